//! The potential of the step with its first and second derivatives.

use constitutive::yarn::{FlowLimits, StressTangent, YarnForm, bend_differential};
use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

use super::{ImplicitScratch, vector};
use crate::forces::{CHUNK, bending_energy, section_moment};
use crate::grid::{Transfer, lanes, momentum};
use crate::kinematics::{damp, spread_forces};
use crate::model::BendingLaw;
use crate::state::YarnState;
use crate::step::{Setting, affine_contribution};

/// The step's potential: needs the state at the beginning, the grid and the driven vertices' velocities.
pub(super) struct Operator<'a, const D: usize> {
    pub setting: &'a Setting<'a, D>,
    pub state: &'a YarnState<D>,
    pub transfer: &'a mut Transfer<D>,
    pub targets: &'a [(usize, SVector<f64, D>)],
    pub dt: f64,
}

impl<const D: usize> Operator<'_, D> {
    fn hand_back(&self) -> bool {
        self.setting.settings.momentum_hand_back && !self.setting.settings.compat
    }

    /// Gathers node velocities to vertex velocities (`work.moved`) and affine matrices (`work.affine`).
    fn gather(&mut self, nodes: &[SVector<f64, D>], work: &mut Buffers<'_, D>, driven: bool) {
        let model = self.setting.model;
        let n = model.len();
        work.packed.clear();
        work.packed.extend(nodes.iter().map(|v| lanes(v, 0.0)));
        self.transfer.gather_from(work.packed);
        work.affine.resize(n, SMatrix::zeros());
        work.moved.resize(n, SVector::zeros());
        work.gathered.take(self.transfer, model, self.setting.settings.affine_damping, work.affine);
        work.gathered.vertex_velocities(model, self.hand_back(), work.moved);
        for &(vertex, target) in self.targets {
            work.moved[vertex] = if driven { target } else { SVector::zeros() };
        }
    }

    /// Positions and deformations at the end of the step for the node velocities `nodes`.
    fn configure(&mut self, nodes: &[SVector<f64, D>], work: &mut Buffers<'_, D>) {
        self.gather(nodes, work, true);
        let (model, state, dt) = (self.setting.model, self.state, self.dt);
        let n = model.len();
        work.position.resize(n, SVector::zeros());
        work.deformation.resize(n, SMatrix::zeros());
        let (moved, affine) = (&*work.moved, &*work.affine);
        work.position.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, x)| {
            for (k, x) in x.iter_mut().enumerate() {
                let i = chunk * CHUNK + k;
                *x = state.position[i] + moved[i] * dt;
            }
        });
        let position = &*work.position;
        work.deformation.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, f)| {
            for (k, f) in f.iter_mut().enumerate() {
                let i = chunk * CHUNK + k;
                *f = state.deformation[i];
                if model.has_segment(i) {
                    *f += affine[i] * state.deformation[i] * dt;
                    f.set_column(0, &((position[i + 1] - position[i]) / model.rest_length[i]));
                }
            }
        });
    }

    /// Potential at `work.trial` [J].
    pub fn potential_of_trial(&mut self, work: &mut ImplicitScratch<D>) -> f64 {
        let (nodes, mut buffers, _, _) = split(work, true);
        self.configure(nodes, &mut buffers);
        self.potential(work, true)
    }

    /// Potential at `work.velocity`, or at `work.trial`, whichever was configured last [J].
    pub fn potential(&self, work: &mut ImplicitScratch<D>, trial: bool) -> f64 {
        let (nodes, work, mass, star) = split(work, trial);
        let model = self.setting.model;
        let kinetic = vector::total(nodes.len(), |i| 0.5 * mass[i] * (nodes[i] - star[i]).norm_squared());
        let (position, deformation, limits) = (&*work.position, &*work.deformation, &*work.limits);
        let elastic = vector::total(model.len(), |i| {
            let mut energy = bending_energy(model, i, position);
            if model.has_segment(i) {
                let law = &model.materials[model.material[i] as usize].law;
                energy += model.volume[i]
                    * match limits.get(i) {
                        Some(limits) => law.flow_energy(&deformation[i], limits),
                        None => law.energy(&deformation[i]),
                    };
            }
            energy
        });
        kinetic + elastic
    }

    /// Limits of plastic flow at the present configuration.
    fn limit(&self, work: &mut Buffers<'_, D>) {
        let (model, settings) = (self.setting.model, self.setting.settings);
        work.limits.clear();
        if !settings.plastic || settings.compat {
            return;
        }
        work.limits.resize(model.len(), FlowLimits::ELASTIC);
        let deformation = &*work.deformation;
        work.limits.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, limits)| {
            for (k, limits) in limits.iter_mut().enumerate() {
                let i = chunk * CHUNK + k;
                let law = &model.materials[model.material[i] as usize].law;
                if model.has_segment(i) && law.form == YarnForm::Corrected {
                    *limits = law.flow_limits(&deformation[i]);
                }
            }
        });
    }

    /// Gradient at `work.velocity` into `work.residual`: the impulse that nothing but the boundary can balance [N s].
    ///
    /// `flow`: take the limits of plastic flow from this state; otherwise they stay.
    pub fn gradient(&mut self, work: &mut ImplicitScratch<D>, flow: bool) {
        let (nodes, mut buffers, _, _) = split(work, false);
        self.configure(nodes, &mut buffers);
        if flow {
            self.limit(&mut buffers);
        }
        let damping = self.setting.settings.affine_damping;
        let model = self.setting.model;
        buffers.forces.evaluate(
            model,
            buffers.position,
            buffers.deformation,
            &self.state.deformation,
            &*buffers.limits,
        );
        if damping != 1.0 {
            for moment in &mut buffers.forces.section {
                *moment = damp(moment, damping);
            }
        }
        self.spread(&mut buffers);
        for (i, residual) in work.residual.iter_mut().enumerate() {
            *residual = if work.mass[i] > 0.0 {
                (work.velocity[i] - work.star[i]) * work.mass[i] - momentum::<D>(&self.transfer.nodes[i])
            } else {
                SVector::zeros()
            };
        }
    }

    /// Prepares the stress tangents at `work.velocity` (configured by the last gradient); with `secant` those of flowing shear do not overshoot.
    pub fn linearise(&mut self, work: &mut ImplicitScratch<D>, secant: bool) {
        let model = self.setting.model;
        work.tangents.resize(model.len(), None);
        let (deformation, limits) = (&work.deformation, &work.limits);
        work.tangents.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, tangents)| {
            for (k, tangent) in tangents.iter_mut().enumerate() {
                let i = chunk * CHUNK + k;
                *tangent = model.has_segment(i).then(|| {
                    let law = &model.materials[model.material[i] as usize].law;
                    law.flow_tangent(&deformation[i], limits.get(i).unwrap_or(&FlowLimits::ELASTIC), secant)
                });
            }
        });
        // Positions of the linearisation stay in `work.position`: the Hessian does not touch them.
    }

    /// `H` times `work.search` into `work.image`.
    pub fn hessian(&mut self, work: &mut ImplicitScratch<D>) {
        let search = std::mem::take(&mut work.search);
        let tangents = std::mem::take(&mut work.tangents);
        {
            let (_, mut buffers, _, _) = split(work, false);
            self.gather(&search, &mut buffers, false);
            self.differentiate(&mut buffers, &tangents);
            self.spread(&mut buffers);
        }
        for (i, image) in work.image.iter_mut().enumerate() {
            *image = if work.mass[i] > 0.0 {
                search[i] * work.mass[i] - momentum::<D>(&self.transfer.nodes[i])
            } else {
                SVector::zeros()
            };
        }
        work.search = search;
        work.tangents = tangents;
    }

    /// Force changes for the gathered velocities `work.moved`, `work.affine` over one step.
    fn differentiate(&self, work: &mut Buffers<'_, D>, tangents: &[Option<StressTangent<D>>]) {
        let (model, state, dt) = (self.setting.model, self.state, self.dt);
        let damping = self.setting.settings.affine_damping;
        let (moved, affine, position) = (&*work.moved, &*work.affine, &*work.position);
        let forces = &mut *work.forces;
        forces
            .traction
            .par_chunks_mut(CHUNK)
            .zip(forces.section.par_chunks_mut(CHUNK))
            .zip(forces.bending.par_chunks_mut(CHUNK))
            .enumerate()
            .for_each(|(chunk, ((traction, section), bending))| {
                for k in 0..traction.len() {
                    let i = chunk * CHUNK + k;
                    if let Some(tangent) = &tangents[i] {
                        let mut change = affine[i] * state.deformation[i] * dt;
                        change.set_column(0, &((moved[i + 1] - moved[i]) * (dt / model.rest_length[i])));
                        let stress = tangent.apply(&change);
                        traction[k] = stress.column(0) * (model.volume[i] / model.rest_length[i]);
                        section[k] = damp(&section_moment(&stress, &state.deformation[i], model.volume[i]), damping);
                    }
                    if model.is_inner(i) {
                        let changes = [(moved[i] - moved[i - 1]) * dt, (moved[i + 1] - moved[i]) * dt];
                        let edges = [position[i] - position[i - 1], position[i + 1] - position[i]];
                        let lengths = [model.rest_length[i - 1], model.rest_length[i]];
                        bending[k] = match model.materials[model.material[i] as usize].bending {
                            BendingLaw::None => [SVector::zeros(); 2],
                            BendingLaw::Rod(b) => bend_differential(
                                &edges[0],
                                &edges[1],
                                [&changes[0], &changes[1]],
                                b,
                                0.5 * (lengths[0] + lengths[1]),
                            ),
                            BendingLaw::Spring(stiffness) => {
                                let (chord, rate) = (edges[0] + edges[1], changes[0] + changes[1]);
                                let length = chord.norm().max(f64::MIN_POSITIVE);
                                let n = chord / length;
                                let along = n * n.dot(&rate);
                                let slack = 1.0 - (lengths[0] + lengths[1]) / length;
                                let change = (along + (rate - along) * slack) * stiffness;
                                [change, change]
                            }
                        };
                    }
                }
            });
    }

    /// Impulses of `work.forces` on the nodes, into the transfer's nodes.
    fn spread(&mut self, work: &mut Buffers<'_, D>) {
        let model = self.setting.model;
        let n = model.len();
        work.force.resize(n, SVector::zeros());
        work.on_vertex.resize(n, SVector::zeros());
        work.on_quadrature.resize(n, SVector::zeros());
        let forces = &*work.forces;
        work.force.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, force)| {
            for (k, force) in force.iter_mut().enumerate() {
                *force = forces.on_vertex(chunk * CHUNK + k);
            }
        });
        for &(vertex, _) in self.targets {
            work.force[vertex] = SVector::zeros();
        }
        spread_forces(model, self.hand_back(), work.force, work.on_vertex, work.on_quadrature);
        let (on_vertex, on_quadrature, dt) = (&*work.on_vertex, &*work.on_quadrature, self.dt);
        let moment = -4.0 * dt / (model.cell * model.cell);
        self.transfer.scatter(|point| {
            if point < n {
                affine_contribution(&(on_vertex[point] * dt), 0.0, &SMatrix::zeros())
            } else {
                let s = point - n;
                if model.has_segment(s) {
                    affine_contribution(&(on_quadrature[s] * dt), 0.0, &(forces.section[s] * moment))
                } else {
                    affine_contribution(&SVector::zeros(), 0.0, &SMatrix::zeros())
                }
            }
        });
    }
}

/// The by-vertex part of the working memory.
struct Buffers<'a, const D: usize> {
    packed: &'a mut Vec<particle_grid::Lanes>,
    gathered: &'a mut crate::kinematics::Gathered<D>,
    forces: &'a mut crate::forces::Forces<D>,
    affine: &'a mut Vec<SMatrix<f64, D, D>>,
    moved: &'a mut Vec<SVector<f64, D>>,
    position: &'a mut Vec<SVector<f64, D>>,
    deformation: &'a mut Vec<SMatrix<f64, D, D>>,
    limits: &'a mut Vec<FlowLimits>,
    force: &'a mut Vec<SVector<f64, D>>,
    on_vertex: &'a mut Vec<SVector<f64, D>>,
    on_quadrature: &'a mut Vec<SVector<f64, D>>,
}

type Split<'a, const D: usize> = (&'a [SVector<f64, D>], Buffers<'a, D>, &'a [f64], &'a [SVector<f64, D>]);

fn split<const D: usize>(work: &mut ImplicitScratch<D>, trial: bool) -> Split<'_, D> {
    let nodes = if trial { &work.trial } else { &work.velocity };
    (
        nodes,
        Buffers {
            packed: &mut work.packed,
            gathered: &mut work.gathered,
            forces: &mut work.forces,
            affine: &mut work.affine,
            moved: &mut work.moved,
            position: &mut work.position,
            deformation: &mut work.deformation,
            limits: &mut work.limits,
            force: &mut work.force,
            on_vertex: &mut work.on_vertex,
            on_quadrature: &mut work.on_quadrature,
        },
        &work.mass,
        &work.star,
    )
}
