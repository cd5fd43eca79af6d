//! Stage 8, deformation: volume ratio and elastic strain of the particles, carried through the motion of the step.

use super::Step;
use crate::system::Rejection;
use crate::world::World;
use crate::world::liquid::{Flow, FlowState, finite, in_its_dimension, rejection};

/// Carries the strain of the particles; it is the trial strain until stage 10 lets it flow.
pub fn run(world: &mut World, step: Step) -> Result<(), Rejection> {
    in_its_dimension!(world, |flow, state| deform(flow, state, step))
}

fn deform<const D: usize>(flow: &mut Flow<D>, state: &mut FlowState<D>, step: Step) -> Result<(), Rejection> {
    let particles = &mut state.particles;
    if particles.is_empty() {
        return Ok(());
    }
    let compressible = flow.settings.compressibility;
    let result = mpm::deformation::deformation(particles, &flow.materials, &mut flow.previous, step.dt, compressible);
    flow.report.deformation = result.map_err(|error| rejection("deformation", &error, &particles.id))?;
    finite::strains("deformation", particles)?;
    flow.report.released = mpm::tension::settle_volume(particles, &flow.materials, &flow.grid, &flow.settings);
    mpm::tension::release_loners(particles, &flow.grid);
    Ok(())
}
