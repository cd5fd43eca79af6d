//! Steps 8 to 14 of the mixture: momentum and pressure of the liquid on its grid.
//!
//! ```text
//! begin           8       walls take hold of the grid; the shear system is built (with drag and added mass, if any)
//! shear           9       momentum with shear, without pressure
//! pressure        10, 11  pressure, and its gradient on the faces (strands read it there)
//! shear_again     12, 14  momentum once more, with the pressure
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

/// Momentum with shear, without the pressure of this step.
pub fn shear(world: &mut World, step: Step) -> Result<(), Rejection> {
    in_its_dimension!(world, |flow, state| {
        if !state.particles.is_empty() {
            flow.report.shear = Some(momentum(flow, state, step, false)?);
        }
        Ok(())
    })
}

/// The same step again after the start was pushed: momentum, pressure, momentum with the pressure.
pub fn solve_again(world: &mut World, step: Step) -> Result<(), Rejection> {
    let Some(before) = world.liquid.as_ref().map(LiquidWorld::report) else { return Ok(()) };
    shear(world, step)?;
    super::coupling::crowding_rate(world)?;
    in_its_dimension!(world, |flow, state| {
        if flow.settings.pressure.enabled {
            flow.report.pressure = Some(project(flow, state, step, true)?);
        }
        Ok(())
    })?;
    shear_again(world, step)?;
    in_its_dimension!(world, |flow, _state| {
        flow.report.add(&before);
        Ok(())
    })
}

/// Pressure and its gradient on the faces.
pub fn pressure(world: &mut World, step: Step) -> Result<(), Rejection> {
    in_its_dimension!(world, |flow, state| {
        if !state.particles.is_empty() && flow.settings.pressure.enabled {
            flow.pressure.build(&flow.grid, step.dt, &flow.settings.pressure);
            flow.report.pressure = Some(project(flow, state, step, true)?);
        }
        Ok(())
    })
}

/// Momentum once more, with the pressure.
pub fn shear_again(world: &mut World, step: Step) -> Result<(), Rejection> {
    in_its_dimension!(world, |flow, state| {
        if state.particles.is_empty() || !flow.settings.pressure.enabled {
            return Ok(());
        }
        flow.pressure_impulse = pressure_impulse(&flow.grid, step.dt);
        let resists_again = flow.resists && flow.settings.shear.after_pressure;
        if !resists_again && !flow.coupling.acts_on_momentum() {
            pressure_solve::correct_velocities(&mut flow.grid, step.dt);
            return Ok(());
        }
        flow.report.shear_again = Some(momentum(flow, state, step, true)?);
        if flow.settings.pressure.project_last {
            let first = flow.grid.cell.pressure.clone();
            flow.report.projection = Some(project(flow, state, step, false)?);
            flow.pressure_impulse += pressure_impulse(&flow.grid, step.dt);
            pressure_solve::correct_velocities(&mut flow.grid, step.dt);
            for (p, q) in flow.grid.cell.pressure.iter_mut().zip(first) {
                *p += q;
            }
        }
        Ok(())
    })
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
        state.pressure_impulse += flow.pressure_impulse;
        flow.pressure_impulse.fill(0.0);
        let rate = flow.coupling.fraction_rate();
        flow.report.mixture_divergence = flow.pressure.mixture_divergence(&flow.grid, rate);
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

fn project<const D: usize>(
    flow: &mut Flow<D>,
    state: &FlowState<D>,
    step: Step,
    elastic: bool,
) -> Result<PressureReport, Rejection> {
    let start = Instant::now();
    let Flow { pressure, grid, coupling, settings, .. } = flow;
    let rate = if elastic { coupling.fraction_rate() } else { None };
    let report =
        pressure.solve(grid, rate, step.dt, elastic, &settings.pressure).map_err(|error| refuse(&error, state))?;
    flow.seconds[1] += start.elapsed().as_secs_f64();
    accept("pressure", &report.multigrid.solve)?;
    Ok(report)
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
