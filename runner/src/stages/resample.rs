//! Stage 2, resample: particles that are too large are split, too small ones given away, crowded ones moved apart.

use super::Step;
use crate::system::Rejection;
use crate::world::World;
use crate::world::liquid::{Flow, FlowState, in_its_dimension, rejection, solids};
use crate::world::solids::SceneSolid;

/// Maintains the particles every so many steps.
pub fn run(world: &mut World, step: Step) -> Result<(), Rejection> {
    in_its_dimension!(world, |flow, state| maintain(flow, state, &world.solids, step))
}

fn maintain<const D: usize>(
    flow: &mut Flow<D>,
    state: &mut FlowState<D>,
    scene: &[SceneSolid],
    step: Step,
) -> Result<(), Rejection> {
    flow.report.resample = mpm::ResampleReport::default();
    flow.shear.lend(&mut flow.grid);
    let every = flow.settings.resample.every as u64;
    if state.particles.is_empty() || every == 0 || !state.steps.is_multiple_of(every) {
        return Ok(());
    }
    let posed = solids::at::<D>(scene, &flow.bodies, step.time);
    let since = step.dt * every as f64;
    let result = mpm::resample(
        &mut state.particles,
        &flow.materials,
        &mut flow.grid,
        &posed,
        since,
        state.steps,
        &flow.settings,
        &mut flow.maintenance,
    );
    flow.report.resample = result.map_err(|error| rejection("resample", &error, &state.particles.id))?;
    state.ledger.resampled(&flow.report.resample);
    Ok(())
}
