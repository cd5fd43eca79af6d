//! One step: particles to grid, nodes, grid to particles, motion, return map.

use constitutive::yarn::{YarnForm, YieldMode};
use nalgebra::{SMatrix, SVector};
use particle_grid::{Contribution, Lattice};
use rayon::prelude::*;

use crate::YarnError;
use crate::boundary::Boundary;
use crate::forces::{CHUNK, Forces};
use crate::grid::{Transfer, lanes};
use crate::implicit::{ImplicitScratch, SolveOutcome};
use crate::kinematics::{Gathered, damp};
use crate::model::YarnModel;
use crate::nodes::{self, Impulses, Loads, Totals};
use crate::settings::{Integrator, YarnSettings};
use crate::state::YarnState;

/// Nodes with less than this share of the mean vertex mass have no velocity of their own.
const LEAST_MASS: f64 = 1e-14;

/// Working memory of the steps.
#[derive(Clone, Debug)]
pub(crate) struct Scratch<const D: usize> {
    pub forces: Forces<D>,
    pub transfer: Transfer<D>,
    pub gathered: Gathered<D>,
    pub blocks: Vec<Impulses<D>>,
    pub implicit: ImplicitScratch<D>,
}

impl<const D: usize> Scratch<D> {
    pub fn new(lattice: Lattice<D>) -> Self {
        Self {
            forces: Forces::default(),
            transfer: Transfer::new(lattice),
            gathered: Gathered::default(),
            blocks: Vec::new(),
            implicit: ImplicitScratch::default(),
        }
    }
}

/// The unchanging things a step needs.
pub(crate) struct Setting<'a, const D: usize> {
    pub settings: &'a YarnSettings,
    pub model: &'a YarnModel<D>,
    pub boundary: &'a Boundary<D>,
    pub gravity: SVector<f64, D>,
}

/// What one step did.
pub(crate) struct Outcome<const D: usize> {
    pub impulses: Totals<D>,
    pub drives: Vec<SVector<f64, D>>,
    pub clamped: usize,
    pub depth: f64,
    pub solve: SolveOutcome,
}

/// Puts mass, momentum and (for explicit steps) the impulses of the internal forces on the grid.
///
/// The force on a driven vertex goes to its drive: on the grid it would move the neighbours, whatever the drive does.
pub(crate) fn particles_to_grid<const D: usize>(
    model: &YarnModel<D>,
    state: &YarnState<D>,
    forces: Option<(&Forces<D>, f64)>,
    driven: &[bool],
    transfer: &mut Transfer<D>,
) {
    let n = model.len();
    let moment = -4.0 / (model.cell * model.cell);
    transfer.scatter(|point| {
        if point < n {
            let mass = model.vertex_mass[point];
            let mut momentum = state.velocity[point] * mass;
            if let Some((forces, dt)) = forces
                && !driven.get(point).is_some_and(|driven| *driven)
            {
                momentum += forces.on_vertex(point) * dt;
            }
            affine_contribution(&momentum, mass, &(state.affine[point] * mass))
        } else {
            let s = point - n;
            if !model.has_segment(s) {
                return affine_contribution(&SVector::zeros(), 0.0, &SMatrix::zeros());
            }
            let mass = model.quadrature_mass[s];
            let momentum = (state.velocity[s] + state.velocity[s + 1]) * (0.5 * mass);
            let mut affine = state.quadrature_affine[s] * mass;
            if let Some((forces, dt)) = forces {
                affine += forces.section[s] * (moment * dt);
            }
            affine_contribution(&momentum, mass, &affine)
        }
    });
}

/// A contribution of momentum, mass and affine momentum.
#[inline(always)]
pub(crate) fn affine_contribution<const D: usize>(
    momentum: &SVector<f64, D>,
    mass: f64,
    affine: &SMatrix<f64, D, D>,
) -> Contribution<D> {
    Contribution {
        value: lanes(momentum, mass),
        gradient: std::array::from_fn(|a| lanes(&affine.column(a).into_owned(), 0.0)),
    }
}

/// Takes one step of length `dt`. On an error the state is undefined.
///
/// `evaluated`: the forces in `scratch` are those of the state (explicit steps).
pub(crate) fn step<const D: usize>(
    setting: &Setting<'_, D>,
    state: &mut YarnState<D>,
    scratch: &mut Scratch<D>,
    dt: f64,
    evaluated: bool,
) -> Result<Outcome<D>, YarnError> {
    let Setting { settings, model, boundary, gravity } = *setting;
    let posed = boundary.at(state.time);
    let loads = Loads { gravity, attractor: settings.attractor.as_ref().map(|a| a.sample(state.time)) };
    let least_mass = LEAST_MASS * model.mean_mass;
    let targets = drive_targets(boundary, state, dt);
    scratch.transfer.rebuild(model, &state.position)?;
    let mut totals = Totals::new(boundary.obstacles.len(), boundary.pins.len());
    let mut solve = SolveOutcome::default();
    match &settings.step.integrator {
        Integrator::Explicit => {
            if !evaluated {
                scratch.forces.evaluate(model, &state.position, &state.deformation, &state.deformation, &[]);
            }
            particles_to_grid(model, state, Some((&scratch.forces, dt)), &boundary.driven, &mut scratch.transfer);
            totals.drives.extend(targets.iter().map(|&(vertex, _)| -scratch.forces.on_vertex(vertex) * dt));
            nodes::update(&mut scratch.transfer, &posed, &loads, dt, least_mass, &mut scratch.blocks);
            totals.add(&scratch.blocks);
        }
        Integrator::Implicit(implicit) => {
            particles_to_grid(model, state, None, &[], &mut scratch.transfer);
            solve = crate::implicit::solve(
                setting,
                implicit,
                state,
                scratch,
                &posed,
                &loads,
                &targets,
                dt,
                least_mass,
                &mut totals,
            )?;
        }
    }
    scratch.transfer.gather();
    take_affine(model, &scratch.transfer, settings.affine_damping, &mut state.affine);
    scratch.gathered.take(&scratch.transfer, model, settings.affine_damping, &mut state.quadrature_affine);
    scratch.gathered.vertex_velocities(model, settings.momentum_hand_back && !settings.compat, &mut state.velocity);
    let drives: Vec<SVector<f64, D>> = targets
        .iter()
        .zip(&totals.drives)
        .map(|(&(vertex, target), held)| {
            let impulse = held + (target - state.velocity[vertex]) * model.lumped_mass(vertex);
            state.velocity[vertex] = target;
            impulse
        })
        .collect();
    move_vertices(model, state, dt)?;
    let depth = boundary_depth(settings, boundary, state, dt);
    check_vertices(setting, state)?;
    let clamped = deform(settings, model, state, dt);
    state.time += dt;
    state.step += 1;
    book(state, &totals, &drives);
    Ok(Outcome { impulses: totals, drives, clamped, depth, solve })
}

/// Velocities that bring driven vertices to their places at the end of the step.
fn drive_targets<const D: usize>(
    boundary: &Boundary<D>,
    state: &YarnState<D>,
    dt: f64,
) -> Vec<(usize, SVector<f64, D>)> {
    boundary
        .drives
        .iter()
        .map(|(vertex, led)| (*vertex, (led.at(state.time + dt).0 - state.position[*vertex]) / dt))
        .collect()
}

fn take_affine<const D: usize>(
    model: &YarnModel<D>,
    transfer: &Transfer<D>,
    damping: f64,
    affine: &mut [SMatrix<f64, D, D>],
) {
    debug_assert_eq!(model.len(), affine.len());
    affine.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, affine)| {
        for (k, affine) in affine.iter_mut().enumerate() {
            *affine = damp(transfer.gradient(chunk * CHUNK + k), damping);
        }
    });
}

fn move_vertices<const D: usize>(model: &YarnModel<D>, state: &mut YarnState<D>, dt: f64) -> Result<(), YarnError> {
    let velocity = &state.velocity;
    state.position.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, position)| {
        for (k, x) in position.iter_mut().enumerate() {
            *x += velocity[chunk * CHUNK + k] * dt;
        }
    });
    let bad = first_index(model.len(), |i| {
        !(state.position[i].iter().all(|x| x.is_finite()) && state.quadrature_affine[i].iter().all(|x| x.is_finite()))
    });
    if let Some(i) = bad {
        let (yarn, vertex) = model.locate(i);
        return Err(YarnError::NonFinite { yarn, vertex, quantity: "velocity", step: state.step });
    }
    Ok(())
}

/// First index for which `test` holds, the same for any thread count.
fn first_index(n: usize, test: impl Fn(usize) -> bool + Sync) -> Option<usize> {
    (0..n.div_ceil(CHUNK))
        .into_par_iter()
        .filter_map(|chunk| (chunk * CHUNK..((chunk + 1) * CHUNK).min(n)).find(|&i| test(i)))
        .min()
}

fn check_vertices<const D: usize>(setting: &Setting<'_, D>, state: &YarnState<D>) -> Result<(), YarnError> {
    let Some(walls) = &setting.boundary.walls else { return Ok(()) };
    if let Some(i) = first_index(setting.model.len(), |i| !walls.contains(&state.position[i])) {
        let (yarn, vertex) = setting.model.locate(i);
        let position = state.position[i].iter().copied().collect();
        return Err(YarnError::LeftDomain { yarn, vertex, step: state.step, position });
    }
    Ok(())
}

/// Largest depth of a vertex inside an obstacle at the end of the step; vertices are pushed out where that is asked for.
fn boundary_depth<const D: usize>(
    settings: &YarnSettings,
    boundary: &Boundary<D>,
    state: &mut YarnState<D>,
    dt: f64,
) -> f64 {
    if boundary.obstacles.is_empty() {
        return 0.0;
    }
    let posed = boundary.at(state.time + dt).obstacles;
    let push_out = settings.push_out;
    state
        .position
        .par_chunks_mut(CHUNK)
        .map(|position| {
            let mut deepest = 0.0f64;
            for x in position {
                for obstacle in &posed {
                    let (distance, normal) = obstacle.sample(x);
                    if distance < 0.0 {
                        deepest = deepest.max(-distance);
                        if push_out {
                            *x -= normal * distance;
                        }
                    }
                }
            }
            deepest
        })
        .reduce(|| 0.0, f64::max)
}

/// New deformation gradients and their return map; gives the number of points lifted to the smallest section.
fn deform<const D: usize>(settings: &YarnSettings, model: &YarnModel<D>, state: &mut YarnState<D>, dt: f64) -> usize {
    let (position, affine) = (&state.position, &state.quadrature_affine);
    state
        .deformation
        .par_chunks_mut(CHUNK)
        .zip(state.slip.par_chunks_mut(CHUNK))
        .enumerate()
        .map(|(chunk, (deformation, slip))| {
            let mut clamped = 0;
            for k in 0..deformation.len() {
                let i = chunk * CHUNK + k;
                if !model.has_segment(i) {
                    continue;
                }
                let material = &model.materials[model.material[i] as usize];
                let mut f = deformation[k] + affine[i] * deformation[k] * dt;
                f.set_column(0, &((position[i + 1] - position[i]) / model.rest_length[i]));
                if settings.plastic {
                    let frames = model.world_frame.as_ref().filter(|_| material.law.form == YarnForm::Printed);
                    let mapped = match frames {
                        Some(frames) => {
                            let mut mapped = material.law.return_map(&(f * frames[i].transpose()));
                            mapped.deformation *= frames[i];
                            mapped
                        }
                        None => material.law.return_map(&f),
                    };
                    f = mapped.deformation;
                    if mapped.mode == YieldMode::Sliding {
                        slip[k] += mapped.slip * material.width;
                    }
                    clamped += usize::from(mapped.clamped);
                }
                deformation[k] = f;
            }
            clamped
        })
        .sum()
}

/// Enters the impulses of the step into the ledger.
fn book<const D: usize>(state: &mut YarnState<D>, totals: &Totals<D>, drives: &[SVector<f64, D>]) {
    let ledger = &mut state.ledger;
    ledger.body += totals.body;
    ledger.boundary += totals.boundary();
    ledger.lost += totals.lost;
    for impulse in drives {
        ledger.driven += impulse;
    }
}
