//! Stage 5, tearing: liquid stretched beyond its tearing strain is marked.
//!
//! The mark decides how the strain of this step is carried (stage 8) and which stress the particle bears from the next step on.

use super::Step;
use crate::system::Rejection;
use crate::world::World;
use crate::world::liquid::{Flow, FlowState, in_its_dimension, rejection};

/// Marks torn particles.
pub fn run(world: &mut World, _: Step) -> Result<(), Rejection> {
    in_its_dimension!(world, |flow, state| mark(flow, state))
}

fn mark<const D: usize>(flow: &mut Flow<D>, state: &mut FlowState<D>) -> Result<(), Rejection> {
    if state.particles.is_empty() {
        return Ok(());
    }
    let result = mpm::tearing::tearing(&mut state.particles, &flow.materials);
    flow.report.torn = result.map_err(|error| rejection("tearing", &error, &state.particles.id))?;
    Ok(())
}
