//! Stage 6, mixture: velocities of everything that moves.
//!
//! The steps of Algorithm 1 (spec 08), numbered as there. Strands come before the liquid, so that the liquid feels how they
//! move in this step; films are driven last, when the velocities of the strands are final (contacts included). Sub-steps of
//! what a scene does not have return at once.

pub mod contact;
pub mod coupling;
pub mod film;
pub mod liquid;
pub mod rods;

pub use rods::rejection;

use super::Step;
use crate::system::Rejection;
use crate::world::World;

/// Solves for the velocities at the end of the step; nothing moves yet.
pub fn run(world: &mut World, step: Step) -> Result<(), Rejection> {
    film::advect(world, step)?; // 2
    film::add_inertia(world, step)?; // 3
    coupling::meet(world, step)?;
    rods::solve_free(world, step)?; // 4
    coupling::drag(world, step)?; // 4, with the drag of the liquid
    coupling::carry_films(world, step)?; // 8
    coupling::carry_volume(world, step)?; // 10
    liquid::begin(world, step)?; // 8
    liquid::shear(world, step)?; // 9
    liquid::pressure(world, step)?; // 10, 11
    liquid::shear_again(world, step)?; // 12, 14
    coupling::release_films(world)?; // 13
    coupling::press(world, step)?; // 17
    coupling::iterate(world, step)?; // 8 to 17 again, where asked for
    coupling::book(world, step)?;
    liquid::end(world, step)?;
    contact::resolve(world, step)?; // 1, 6, 7, 18, 19
    film::drive(world, step)?; // 5
    coupling::hold_films(world); // 13
    Ok(())
}
