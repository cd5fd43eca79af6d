//! Forces of the present configuration: traction of segments on their ends, section stress of quadrature points, bending.
//!
//! The edge column of `F` moves with the two vertices, the section columns with the affine velocity of the quadrature point;
//! so the derivative of the energy splits into a pair of forces on the vertices' stencils and a first-moment force on the
//! quadrature point's.

use constitutive::yarn::{FlowLimits, YarnForm, YarnFrame, bend};
use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

use crate::model::{BendingLaw, YarnModel};

/// Entries per parallel task; results do not depend on it.
pub(crate) const CHUNK: usize = 1024;

/// Forces of one configuration, one entry per vertex.
#[derive(Clone, Debug, Default)]
pub(crate) struct Forces<const D: usize> {
    /// Force of each segment on its first vertex; the second feels the opposite [N].
    pub traction: Vec<SVector<f64, D>>,
    /// `V Σ_a P_a ⊗ F_a` over the section columns [J]: first-moment force of each quadrature point.
    pub section: Vec<SMatrix<f64, D, D>>,
    /// Gradients of the bending energy at each inner vertex by the edges before and after it [N].
    pub bending: Vec<[SVector<f64, D>; 2]>,
}

impl<const D: usize> Forces<D> {
    /// Makes room for `n` entries.
    pub fn resize(&mut self, n: usize) {
        self.traction.resize(n, SVector::zeros());
        self.section.resize(n, SMatrix::zeros());
        self.bending.resize(n, [SVector::zeros(); 2]);
    }

    /// Evaluates all forces at `position` and `deformation`; section columns are advanced by the grid from `carried`.
    ///
    /// For explicit steps `carried` is `deformation` itself, for implicit ones the deformation at the beginning of the step; those
    /// also give `limits` of plastic flow, one per vertex, or none where nothing flows.
    pub fn evaluate(
        &mut self,
        model: &YarnModel<D>,
        position: &[SVector<f64, D>],
        deformation: &[SMatrix<f64, D, D>],
        carried: &[SMatrix<f64, D, D>],
        limits: &[FlowLimits],
    ) {
        self.resize(model.len());
        self.traction
            .par_chunks_mut(CHUNK)
            .zip(self.section.par_chunks_mut(CHUNK))
            .zip(self.bending.par_chunks_mut(CHUNK))
            .enumerate()
            .for_each(|(chunk, ((traction, section), bending))| {
                for k in 0..traction.len() {
                    let i = chunk * CHUNK + k;
                    if model.has_segment(i) {
                        let stress = match limits.get(i) {
                            Some(limits) => {
                                model.materials[model.material[i] as usize].law.flow_stress(&deformation[i], limits)
                            }
                            None => stress(model, i, &deformation[i]),
                        };
                        traction[k] = stress.column(0) * (model.volume[i] / model.rest_length[i]);
                        section[k] = section_moment(&stress, &carried[i], model.volume[i]);
                    }
                    bending[k] = bending_force(model, i, position).gradients;
                }
            });
    }

    /// Force on vertex `i` [N].
    #[inline(always)]
    pub fn on_vertex(&self, i: usize) -> SVector<f64, D> {
        let mut force = self.traction[i] + self.bending[i][1] - self.bending[i][0];
        if i > 0 {
            force -= self.traction[i - 1] + self.bending[i - 1][1];
        }
        if i + 1 < self.bending.len() {
            force += self.bending[i + 1][0];
        }
        force
    }
}

/// Stress of segment `i`, in the frame that the model asks for.
#[inline]
pub(crate) fn stress<const D: usize>(
    model: &YarnModel<D>,
    i: usize,
    deformation: &SMatrix<f64, D, D>,
) -> SMatrix<f64, D, D> {
    stress_of_frame(model, i, deformation, &YarnFrame::new(deformation))
}

/// [`stress`] of a gradient that is already decomposed.
#[inline]
pub(crate) fn stress_of_frame<const D: usize>(
    model: &YarnModel<D>,
    i: usize,
    deformation: &SMatrix<f64, D, D>,
    frame: &YarnFrame<D>,
) -> SMatrix<f64, D, D> {
    let law = &model.materials[model.material[i] as usize].law;
    if law.form == YarnForm::Printed
        && let Some(frames) = &model.world_frame
    {
        return law.stress(&(deformation * frames[i].transpose())) * frames[i];
    }
    law.stress_of_frame(frame)
}

/// `V Σ_a P_a ⊗ F_a` over the section columns.
#[inline]
pub(crate) fn section_moment<const D: usize>(
    stress: &SMatrix<f64, D, D>,
    deformation: &SMatrix<f64, D, D>,
    volume: f64,
) -> SMatrix<f64, D, D> {
    let mut moment = SMatrix::<f64, D, D>::zeros();
    for a in 1..D {
        for c in 0..D {
            let f = volume * deformation[(c, a)];
            for r in 0..D {
                moment[(r, c)] += stress[(r, a)] * f;
            }
        }
    }
    moment
}

/// Bending at a vertex.
pub(crate) struct BendingForce<const D: usize> {
    /// Gradients of the energy by the edges before and after [N].
    pub gradients: [SVector<f64, D>; 2],
    /// `(1 + cos θ)/2` of a rod, one otherwise.
    pub openness: f64,
}

#[inline]
pub(crate) fn bending_force<const D: usize>(
    model: &YarnModel<D>,
    i: usize,
    position: &[SVector<f64, D>],
) -> BendingForce<D> {
    let zero = BendingForce { gradients: [SVector::zeros(); 2], openness: 1.0 };
    if !model.is_inner(i) {
        return zero;
    }
    match model.materials[model.material[i] as usize].bending {
        BendingLaw::None => zero,
        BendingLaw::Rod(stiffness) => {
            let length = 0.5 * (model.rest_length[i - 1] + model.rest_length[i]);
            let b = bend(&(position[i] - position[i - 1]), &(position[i + 1] - position[i]), stiffness, length);
            BendingForce { gradients: [b.first, b.second], openness: b.openness }
        }
        BendingLaw::Spring(stiffness) => {
            let chord = position[i + 1] - position[i - 1];
            let length = chord.norm();
            if length <= 1e-9 {
                return zero;
            }
            let gradient = chord * (stiffness * (length - model.rest_length[i - 1] - model.rest_length[i]) / length);
            BendingForce { gradients: [gradient, gradient], ..zero }
        }
    }
}

/// Bending energy at vertex `i` [J].
pub(crate) fn bending_energy<const D: usize>(model: &YarnModel<D>, i: usize, position: &[SVector<f64, D>]) -> f64 {
    if !model.is_inner(i) {
        return 0.0;
    }
    match model.materials[model.material[i] as usize].bending {
        BendingLaw::None => 0.0,
        BendingLaw::Rod(stiffness) => {
            let length = 0.5 * (model.rest_length[i - 1] + model.rest_length[i]);
            bend(&(position[i] - position[i - 1]), &(position[i + 1] - position[i]), stiffness, length).energy
        }
        BendingLaw::Spring(stiffness) => {
            let length = (position[i + 1] - position[i - 1]).norm();
            0.5 * stiffness * (length - model.rest_length[i - 1] - model.rest_length[i]).powi(2)
        }
    }
}
