//! Stage 10, liquid_plasticity: the trial strain of the particles flows.

use super::Step;
use crate::system::Rejection;
use crate::world::World;
use crate::world::liquid::{Flow, FlowState, finite, in_its_dimension, rejection};

/// Lets the strain of the particles flow.
pub fn run(world: &mut World, step: Step) -> Result<(), Rejection> {
    in_its_dimension!(world, |flow, state| flow_plastically(flow, state, step))
}

fn flow_plastically<const D: usize>(flow: &mut Flow<D>, state: &mut FlowState<D>, step: Step) -> Result<(), Rejection> {
    let particles = &mut state.particles;
    if particles.is_empty() {
        return Ok(());
    }
    let result = mpm::liquid_plasticity::liquid_plasticity(particles, &flow.materials, &flow.previous, step.dt);
    flow.report.plasticity = result.map_err(|error| rejection("liquid_plasticity", &error, &particles.id))?;
    finite::strains("liquid_plasticity", particles)
}
