//! From gathered grid velocities to the motion of vertices and segments, and the adjoint of that map for the implicit step.

use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

use crate::forces::CHUNK;
use crate::grid::Transfer;
use crate::model::YarnModel;

/// Keeps the skew part of an affine velocity and the given share of the symmetric part.
#[inline(always)]
pub(crate) fn damp<const D: usize>(affine: &SMatrix<f64, D, D>, share: f64) -> SMatrix<f64, D, D> {
    if share == 1.0 {
        return *affine;
    }
    SMatrix::from_fn(|r, c| {
        let (a, b) = (affine[(r, c)], affine[(c, r)]);
        0.5 * (a - b) + share * 0.5 * (a + b)
    })
}

/// Velocities gathered at vertices and quadrature points.
#[derive(Clone, Debug, Default)]
pub(crate) struct Gathered<const D: usize> {
    /// At vertices [m/s].
    pub vertex: Vec<SVector<f64, D>>,
    /// At quadrature points [m/s].
    pub quadrature: Vec<SVector<f64, D>>,
}

impl<const D: usize> Gathered<D> {
    /// Copies gathered velocities and the (damped) affine matrices of quadrature points out of the sorted order.
    pub fn take(
        &mut self,
        transfer: &Transfer<D>,
        model: &YarnModel<D>,
        damping: f64,
        quadrature_affine: &mut [SMatrix<f64, D, D>],
    ) {
        let n = model.len();
        self.vertex.resize(n, SVector::zeros());
        self.quadrature.resize(n, SVector::zeros());
        self.vertex
            .par_chunks_mut(CHUNK)
            .zip(self.quadrature.par_chunks_mut(CHUNK))
            .zip(quadrature_affine.par_chunks_mut(CHUNK))
            .enumerate()
            .for_each(|(chunk, ((vertex, quadrature), affine))| {
                for k in 0..vertex.len() {
                    let i = chunk * CHUNK + k;
                    vertex[k] = *transfer.value(i);
                    if model.has_segment(i) {
                        quadrature[k] = *transfer.value(n + i);
                        affine[k] = damp(transfer.gradient(n + i), damping);
                    }
                }
            });
    }

    /// Velocities of vertices: as gathered, plus the momentum of quadrature points that their mean does not account for.
    pub fn vertex_velocities(&self, model: &YarnModel<D>, hand_back: bool, out: &mut [SVector<f64, D>]) {
        out.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, out)| {
            for (k, velocity) in out.iter_mut().enumerate() {
                let i = chunk * CHUNK + k;
                *velocity = self.vertex[i];
                if hand_back {
                    let mut momentum = self.excess(model, i);
                    if i > 0 {
                        momentum += self.excess(model, i - 1);
                    }
                    *velocity += momentum * (0.5 / model.lumped_mass(i));
                }
            }
        });
    }

    /// Momentum of quadrature point `s` less what the mean of its vertices carries [N s].
    #[inline(always)]
    fn excess(&self, model: &YarnModel<D>, s: usize) -> SVector<f64, D> {
        if !model.has_segment(s) {
            return SVector::zeros();
        }
        (self.quadrature[s] - (self.vertex[s] + self.vertex[s + 1]) * 0.5) * model.quadrature_mass[s]
    }
}

/// Adjoint of [`Gathered::vertex_velocities`]: forces on vertices to forces on the stencils of vertices (in place) and of quadrature points.
pub(crate) fn spread_forces<const D: usize>(
    model: &YarnModel<D>,
    hand_back: bool,
    force: &[SVector<f64, D>],
    on_vertex: &mut [SVector<f64, D>],
    on_quadrature: &mut [SVector<f64, D>],
) {
    let through = |s: usize| {
        if !hand_back || !model.has_segment(s) {
            return SVector::zeros();
        }
        (force[s] / model.lumped_mass(s) + force[s + 1] / model.lumped_mass(s + 1)) * (0.5 * model.quadrature_mass[s])
    };
    on_vertex.par_chunks_mut(CHUNK).zip(on_quadrature.par_chunks_mut(CHUNK)).enumerate().for_each(
        |(chunk, (vertex, quadrature))| {
            for k in 0..vertex.len() {
                let i = chunk * CHUNK + k;
                quadrature[k] = through(i);
                let mut f = force[i] - quadrature[k] * 0.5;
                if i > 0 {
                    f -= through(i - 1) * 0.5;
                }
                vertex[k] = f;
            }
        },
    );
}
