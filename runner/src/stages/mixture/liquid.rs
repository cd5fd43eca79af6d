//! Steps 8 to 14 of the mixture: momentum and pressure of the liquid on its grid.
//!
//! ```text
//! begin           8       walls take hold of the grid; the shear system is built (with drag and added mass, if any)
//! shear           9       momentum with shear; under the pressure of the free motion where nothing else acts on the momentum
//! pressure        10, 11  pressure, or what is left of it, and its gradient on the faces (strands read it there)
//! shear_again     12, 14  momentum once more with the pressure, where strands act on it
//! end                     impulses are booked, what strands did is forgotten
//! ```
//! Whatever couples strands to the liquid stands between these steps and fills `flow.coupling`.

use std::time::Instant;

use mpm::{LiquidError, LiquidGrid, PressureReport, ShearReport, Vector, pressure_solve, shear_solve};
use numerics::report::{SolveReport, Status};

use crate::stages::Step;
use crate::system::{Rejection, RejectionReason};
use crate::world::World;
use crate::world::liquid::{Flow, FlowState, LiquidWorld, finite, in_its_dimension, rejection};

const STAGE: &str = "mixture";

/// A solve that could not reach its tolerance is still taken when its residual is no more than this many tolerances, at most
/// [`WORST_ACCEPTED`]: rounding sets a floor that grows with the contrast of the materials. The record shows the residual.
const SLACK: f64 = 1e3;
/// No residual above this is ever taken.
const WORST_ACCEPTED: f64 = 1e-3;

/// Walls take hold, the system of the shear solve is built.
pub fn begin(world: &mut World, step: Step) -> Result<(), Rejection> {
    in_its_dimension!(world, |flow, state| {
        flow.seconds = [0.0; 2];
        if state.particles.is_empty() {
            return Ok(());
        }
        let start = Instant::now();
        shear_solve::impose_walls(&mut flow.grid);
        let coupling = flow.coupling.faces();
        flow.shear.begin(&state.particles, &flow.grid, &coupling, step.dt, &flow.settings.shear);
        flow.seconds[0] += start.elapsed().as_secs_f64();
        Ok(())
    })
}

/// Momentum with shear, under the pressure of the free motion where that is predicted.
pub fn shear(world: &mut World, step: Step) -> Result<(), Rejection> {
    in_its_dimension!(world, |flow, state| {
        (flow.report.prediction, flow.report.shear_again, flow.report.projection) = (None, None, None);
        if state.particles.is_empty() {
            return Ok(());
        }
        if flow.settings.pressure.enabled {
            let start = Instant::now();
            flow.pressure.build(&flow.grid, flow.coupling.room(), step.dt, &flow.settings.pressure);
            flow.seconds[1] += start.elapsed().as_secs_f64();
        }
        let predict = predicts(flow);
        if predict {
            let start = Instant::now();
            let Flow { pressure, grid, coupling, settings, body, .. } = flow.as_mut();
            let report = pressure
                .predict(grid, body, coupling.room(), step.dt, &settings.pressure)
                .map_err(|error| refuse(&error, state))?;
            flow.seconds[1] += start.elapsed().as_secs_f64();
            flow.report.prediction = Some(report);
        }
        flow.report.shear = Some(momentum(flow, state, step, predict)?);
        Ok(())
    })
}

/// The same step again after the start was pushed, by the same road: where the pressure was predicted, the one found last is the
/// prediction and what is left of it is solved for; elsewhere momentum, pressure, momentum with the pressure.
pub fn solve_again(world: &mut World, step: Step) -> Result<(), Rejection> {
    let Some(before) = world.liquid.as_ref().map(LiquidWorld::report) else { return Ok(()) };
    in_its_dimension!(world, |flow, state| {
        if !state.particles.is_empty() {
            let known = flow.report.prediction.is_some();
            flow.report.shear = Some(momentum(flow, state, step, known)?);
        }
        Ok(())
    })?;
    super::coupling::carry_volume(world, step)?;
    pressure(world, step)?;
    shear_again(world, step)?;
    in_its_dimension!(world, |flow, _state| {
        flow.report.add(&before);
        Ok(())
    })
}

/// Pressure, or what the prediction left of it, and its gradient on the faces.
pub fn pressure(world: &mut World, step: Step) -> Result<(), Rejection> {
    in_its_dimension!(world, |flow, state| {
        if !state.particles.is_empty() && flow.settings.pressure.enabled {
            let rest = flow.report.prediction.is_some();
            flow.report.pressure = Some(project(flow, state, step, rest)?);
            if rest {
                settle(flow, state, step)?;
            }
        }
        Ok(())
    })
}

/// Momentum once more, with the pressure; without strands and with the default settings the pressure alone acts.
pub fn shear_again(world: &mut World, step: Step) -> Result<(), Rejection> {
    in_its_dimension!(world, |flow, state| {
        if state.particles.is_empty() || !flow.settings.pressure.enabled || flow.report.prediction.is_some() {
            return Ok(());
        }
        let resists_again = flow.resists && flow.settings.shear.after_pressure;
        if !resists_again && !flow.coupling.acts_on_momentum() {
            pressure_solve::correct_velocities(&mut flow.grid, step.dt);
            return Ok(());
        }
        flow.report.shear_again = Some(momentum(flow, state, step, true)?);
        if flow.settings.pressure.project_last {
            flow.report.projection = Some(project(flow, state, step, true)?);
        }
        Ok(())
    })
}

/// Whether the pressure of the free motion acts in the shear solve: where shear is solved for, once, and strands do not act on the
/// momentum (their drag is no part of the free motion, and with them the momentum is solved for again).
fn predicts<const D: usize>(flow: &Flow<D>) -> bool {
    let settings = &flow.settings;
    settings.pressure.enabled
        && settings.pressure.predict
        && flow.resists
        && !settings.shear.after_pressure
        && !flow.coupling.acts_on_momentum()
}

/// Books what acted on the liquid and forgets what strands did.
pub fn end(world: &mut World, step: Step) -> Result<(), Rejection> {
    in_its_dimension!(world, |flow, state| {
        if state.particles.is_empty() {
            return Ok(());
        }
        finite::grid(STAGE, &flow.grid)?;
        let mass = state.particles.mass.iter().sum();
        state.ledger.fell(mass, &flow.body, step.dt);
        if flow.settings.pressure.enabled {
            state.pressure_impulse += pressure_impulse(&flow.grid, step.dt);
        }
        flow.report.mixture_divergence = flow.pressure.mixture_divergence(&flow.grid, flow.coupling.room(), step.dt);
        state.steps += 1;
        flow.coupling.clear();
        Ok(())
    })
}

/// Momentum that the pressure gives to the faces in a step [N s].
fn pressure_impulse<const D: usize>(grid: &LiquidGrid<D>, dt: f64) -> Vector<D> {
    Vector::<D>::from_fn(|a, _| {
        let face = &grid.face[a];
        let faces = face.mass.iter().zip(&face.volume).zip(&face.pressure_gradient);
        -dt * faces.filter(|((m, _), _)| **m > grid.mass_floor).map(|((_, v), g)| v * g).sum::<f64>()
    })
}

fn momentum<const D: usize>(
    flow: &mut Flow<D>,
    state: &FlowState<D>,
    step: Step,
    with_pressure: bool,
) -> Result<ShearReport, Rejection> {
    let start = Instant::now();
    let Flow { shear, grid, coupling, materials, settings, body, .. } = flow;
    let report = shear
        .solve(&state.particles, materials, grid, &coupling.faces(), body, step.dt, with_pressure, &settings.shear)
        .map_err(|error| refuse(&error, state))?;
    flow.seconds[0] += start.elapsed().as_secs_f64();
    accept("shear", &report.solve)?;
    Ok(report)
}

/// Solves for the pressure (`rest`: for what is left beside the pressure that acts already, and corrects the velocities).
fn project<const D: usize>(
    flow: &mut Flow<D>,
    state: &FlowState<D>,
    step: Step,
    rest: bool,
) -> Result<PressureReport, Rejection> {
    let start = Instant::now();
    let Flow { pressure, grid, coupling, settings, .. } = flow;
    let room = coupling.room();
    let report = if rest {
        pressure.correct(grid, room, step.dt, &settings.pressure)
    } else {
        pressure.solve(grid, room, step.dt, &settings.pressure)
    };
    let report = report.map_err(|error| refuse(&error, state))?;
    flow.seconds[1] += start.elapsed().as_secs_f64();
    accept("pressure", &report.multigrid.solve)?;
    Ok(report)
}

/// Shear and pressure in turn until they agree, where elastic waves cross many cells in a step.
fn settle<const D: usize>(flow: &mut Flow<D>, state: &FlowState<D>, step: Step) -> Result<(), Rejection> {
    let start = Instant::now();
    let Flow { shear, pressure, grid, coupling, materials, settings, body, .. } = flow;
    let room = coupling.room();
    let settled = shear
        .settle(pressure, &state.particles, materials, grid, body, room, step.dt, settings)
        .map_err(|error| refuse(&error, state))?;
    flow.seconds[0] += start.elapsed().as_secs_f64();
    if let Some((shear, pressure, _)) = settled {
        accept("shear", &shear.solve)?;
        accept("pressure", &pressure.multigrid.solve)?;
        (flow.report.shear_again, flow.report.projection) = (Some(shear), Some(pressure));
    }
    Ok(())
}

fn refuse<const D: usize>(error: &LiquidError, state: &FlowState<D>) -> Rejection {
    rejection(STAGE, error, &state.particles.id)
}

/// Refuses a solve that is too far from its tolerance.
fn accept(what: &str, solve: &SolveReport) -> Result<(), Rejection> {
    let near = solve.residual <= (SLACK * solve.tolerance).min(WORST_ACCEPTED);
    match solve.status {
        Status::Converged => return Ok(()),
        Status::Stalled | Status::MaxIterations if near => return Ok(()),
        _ => {}
    }
    let reason =
        if solve.status == Status::NonFinite { RejectionReason::NonFinite } else { RejectionReason::NotConverged };
    let detail = format!(
        "{what} solve: {} after {} iterations, residual {:.2e} instead of {:.0e}",
        solve.status, solve.iterations, solve.residual, solve.tolerance
    );
    Err(Rejection { stage: STAGE, reason, element: None, detail })
}
