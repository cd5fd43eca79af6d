//! Stage 7, grid_to_particles: velocities and affine matrices of the particles from the faces.

use super::Step;
use crate::system::Rejection;
use crate::world::World;
use crate::world::liquid::{Flow, FlowState, finite, in_its_dimension};

/// Transfers the grid to the particles.
pub fn run(world: &mut World, _: Step) -> Result<(), Rejection> {
    in_its_dimension!(world, |flow, state| transfer(flow, state))
}

fn transfer<const D: usize>(flow: &mut Flow<D>, state: &mut FlowState<D>) -> Result<(), Rejection> {
    let particles = &mut state.particles;
    if particles.is_empty() {
        return Ok(());
    }
    mpm::grid_to_particles::grid_to_particles(particles, &flow.grid, &flow.settings.damping);
    finite::velocities("grid_to_particles", particles)?;
    // what the particles carry now is what the faces carry, less what damping took
    let (held, mut carried, mut scale) = (flow.grid.momentum(), mpm::Vector::<D>::zeros(), 0.0);
    for (m, v) in particles.mass.iter().zip(&particles.velocity) {
        carried += v * *m;
        scale += m * v.norm();
    }
    flow.report.transfer_defect = if scale > 0.0 { (carried - held).norm() / scale } else { 0.0 };
    Ok(())
}
