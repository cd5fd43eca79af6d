//! Stage 0, drive: everything scripted moves to the end of the step.

use super::Step;
use crate::system::Rejection;
use crate::world::World;
use crate::world::liquid::in_its_dimension;

/// Prescribes where held vertices and edges are at the end of the step. Solids need no state: they are functions of time.
pub fn run(world: &mut World, step: Step) -> Result<(), Rejection> {
    liquid(world, step)?;
    let Some(strands) = &mut world.strands else { return Ok(()) };
    let boundary = &mut strands.boundary;
    boundary.vertices.clear();
    boundary.edges.clear();
    for part in &strands.held {
        part.prescribe(step.time + step.dt, boundary, &world.state.rods);
    }
    Ok(())
}

/// Lets liquid in and out as it is at the start of the step.
fn liquid(world: &mut World, step: Step) -> Result<(), Rejection> {
    in_its_dimension!(world, |flow, state| {
        flow.drive(state, step.time);
        Ok(())
    })
}
