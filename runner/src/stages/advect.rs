//! Stage 9, advect: everything moves with the velocities of stage 6.

use super::Step;
use super::mixture::rejection;
use crate::system::Rejection;
use crate::world::World;

/// Accepts the rods' solution and books what acted on them from outside.
pub fn run(world: &mut World, step: Step) -> Result<(), Rejection> {
    let Some(strands) = &mut world.strands else { return Ok(()) };
    let rods = &mut world.state.rods;
    let film_mass = world.film.as_ref().map(|film| film.mass.as_slice());
    strands.book(rods, world.contact.as_ref(), film_mass, &world.gravity, step, &mut world.state.ledger);
    strands.stepper.accept(rods).map_err(|error| rejection(&error))
}
