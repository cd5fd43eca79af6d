//! Stage 6, mixture: velocities of everything that moves.
//!
//! The steps of Algorithm 1 (spec 08) that exist so far, in its order; the rest joins here as it is built.

pub mod contact;
pub mod liquid;
pub mod film;
pub mod rods;

pub use rods::rejection;

use super::Step;
use crate::system::Rejection;
use crate::world::World;

/// Solves for the velocities at the end of the step; nothing moves yet.
pub fn run(world: &mut World, step: Step) -> Result<(), Rejection> {
    film::advect(world, step)?; // 2
    film::add_inertia(world, step)?; // 3
    rods::solve_free(world, step)?; // 4, 17
    liquid::begin(world, step)?; // 8
    liquid::shear(world, step)?; // 9
    liquid::pressure(world, step)?; // 10, 11
    liquid::shear_again(world, step)?; // 12, 14
    liquid::end(world, step)?;
    contact::resolve(world, step)?; // 1, 6, 7, 18, 19
    film::drive(world, step) // 5
}
