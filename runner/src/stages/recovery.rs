//! Stage 12, recovery: torn liquid heals.

use super::Step;
use crate::system::Rejection;
use crate::world::World;
use crate::world::liquid::{Flow, FlowState, finite, in_its_dimension, rejection};

/// Heals the plastic history of the particles.
pub fn run(world: &mut World, step: Step) -> Result<(), Rejection> {
    in_its_dimension!(world, |flow, state| heal(flow, state, step))
}

fn heal<const D: usize>(flow: &mut Flow<D>, state: &mut FlowState<D>, step: Step) -> Result<(), Rejection> {
    let particles = &mut state.particles;
    if particles.is_empty() {
        return Ok(());
    }
    mpm::recovery::recovery(particles, &flow.materials, step.dt)
        .map_err(|error| rejection("recovery", &error, &particles.id))?;
    finite::strains("recovery", particles)
}
