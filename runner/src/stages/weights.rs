//! Stage 4, weights: where solids and the free surface are on the grid of the liquid.

use super::Step;
use crate::system::Rejection;
use crate::world::World;
use crate::world::liquid::sources::Mouth;
use crate::world::liquid::{Flow, FlowState, in_its_dimension, rejection, solids};
use crate::world::solids::SceneSolid;

/// Finds open shares, wall ties and distances, and holds the liquid in the mouths of sources.
pub fn run(world: &mut World, step: Step) -> Result<(), Rejection> {
    super::mixture::coupling::crowd(world)?;
    in_its_dimension!(world, |flow, state| weigh(flow, state, &world.solids, step))
}

fn weigh<const D: usize>(
    flow: &mut Flow<D>,
    state: &mut FlowState<D>,
    scene: &[SceneSolid],
    step: Step,
) -> Result<(), Rejection> {
    if state.particles.is_empty() {
        return Ok(());
    }
    let posed = solids::at::<D>(scene, &flow.bodies, step.time);
    let fraction = flow.coupling.solid_fraction();
    flow.report.weights = mpm::weights::weights(&mut flow.grid, &posed, fraction, &flow.settings.pressure)
        .map_err(|error| rejection("weights", &error, &state.particles.id))?;
    let dx = flow.grid.lattice().dx;
    let mouths: Vec<Mouth<'_>> = flow.sources.iter().filter_map(|source| source.mouth(step.time, dx)).collect();
    mpm::inlet::hold_inlets(&mut flow.grid, &mouths);
    Ok(())
}
