//! Stage 3, particles_to_grid: the grid follows the particles; mass, momentum, volume and shear force go to its faces.

use super::Step;
use crate::system::Rejection;
use crate::world::World;
use crate::world::liquid::{Flow, FlowState, in_its_dimension, rejection};

/// Transfers the particles to the grid.
pub fn run(world: &mut World, step: Step) -> Result<(), Rejection> {
    in_its_dimension!(world, |flow, state| transfer(flow, state, step))
}

fn transfer<const D: usize>(flow: &mut Flow<D>, state: &mut FlowState<D>, step: Step) -> Result<(), Rejection> {
    let particles = &mut state.particles;
    if particles.is_empty() {
        return Ok(());
    }
    mpm::particles_to_grid::activate(particles, &flow.materials, &flow.coupling.points, &mut flow.grid)
        .map_err(|error| rejection("particles_to_grid", &error, &particles.id))?;
    flow.shear.reclaim(&mut flow.grid);
    flow.resists = flow
        .shear
        .prepare(particles, &flow.materials, step.dt, &flow.settings.shear)
        .map_err(|error| rejection("particles_to_grid", &error, &particles.id))?;
    let stress = flow.resists.then_some(&flow.shear.state);
    flow.report.transfer =
        mpm::particles_to_grid::particles_to_grid(particles, &flow.materials, stress, &mut flow.grid);
    Ok(())
}
