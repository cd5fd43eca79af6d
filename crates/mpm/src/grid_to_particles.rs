//! Stage 7: velocities and affine matrices of the particles from the faces.

use crate::grid::LiquidGrid;
use crate::particles::Particles;
use crate::settings::TransferDamping;
use particle_grid::gather;
use rayon::prelude::*;

/// Interpolates the face velocities at the particles.
///
/// With no damping, affine fields are reproduced and linear and angular momentum are kept.
pub fn grid_to_particles<const D: usize>(
    particles: &mut Particles<D>,
    grid: &LiquidGrid<D>,
    damping: &TransferDamping,
) {
    compiled::grid_to_particles(particles, grid, damping)
}

fn grid_to_particles_any<const D: usize>(
    particles: &mut Particles<D>,
    grid: &LiquidGrid<D>,
    damping: &TransferDamping,
) {
    gather(
        &grid.blocks,
        &grid.order,
        &particles.position,
        grid.velocities(),
        LiquidGrid::<D>::offsets(),
        &mut particles.velocity,
        &mut particles.affine,
    );
    if *damping != TransferDamping::default() {
        let (own, turned) = (
            0.5 * ((1.0 - damping.stretch) + (1.0 - damping.rotation)),
            0.5 * ((1.0 - damping.stretch) - (1.0 - damping.rotation)),
        );
        particles.affine.par_iter_mut().with_min_len(4096).for_each(|c| *c = *c * own + c.transpose() * turned);
        particles.velocity.par_iter_mut().with_min_len(4096).for_each(|v| *v *= 1.0 - damping.velocity);
    }
}

numerics::compile_here! {
    mod compiled {
        fn grid_to_particles(particles: &mut Particles<D>, grid: &LiquidGrid<D>, damping: &TransferDamping)  = grid_to_particles_any;
    }
}
