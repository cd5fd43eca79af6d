//! Stage 9, advect: everything moves with the velocities of stage 6.

use super::Step;
use super::mixture::rejection;
use crate::system::{Rejection, RejectionReason};
use crate::world::World;
use crate::world::liquid::{Flow, FlowState, finite, in_its_dimension, solids};
use crate::world::solids::SceneSolid;

/// Moves the liquid, accepts the rods' solution and books what acted on them from outside.
pub fn run(world: &mut World, step: Step) -> Result<(), Rejection> {
    in_its_dimension!(world, |flow, state| liquid(flow, state, &world.solids, step))?;
    let Some(strands) = &mut world.strands else { return Ok(()) };
    let rods = &mut world.state.rods;
    let film_mass = world.film.as_ref().map(|film| film.mass.as_slice());
    strands.book(rods, world.contact.as_ref(), film_mass, &world.gravity, step, &mut world.state.ledger);
    strands.stepper.accept(rods).map_err(|error| rejection(&error))
}

/// Moves the particles and keeps them out of the solids, which are where they will be at the end of the step.
fn liquid<const D: usize>(
    flow: &mut Flow<D>,
    state: &mut FlowState<D>,
    scene: &[SceneSolid],
    step: Step,
) -> Result<(), Rejection> {
    if state.particles.is_empty() || !flow.settings.advection {
        return Ok(());
    }
    let posed = solids::at::<D>(scene, &flow.bodies, step.time + step.dt);
    let advected = mpm::advect::advect(&mut state.particles, &flow.grid, &posed, step.dt);
    flow.report.advect = advected;
    let cell = flow.grid.lattice().dx;
    let fastest = state.particles.velocity.iter().fold(0.0, |most: f64, v| most.max(v.norm_squared())).sqrt();
    if advected.deepest > cell && fastest * step.dt > cell {
        let detail = format!(
            "{} particles ended in solids, the deepest {:.2} cells below a surface",
            advected.pushed_out,
            advected.deepest / cell
        );
        return Err(Rejection { stage: "advect", reason: RejectionReason::TooLargeMotion, element: None, detail });
    }
    finite::positions("advect", &state.particles)
}
