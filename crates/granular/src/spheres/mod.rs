//! Spheres in a sheared box: the laws and the step of the default mode in three dimensions.
//!
//! The tangential spring is a vector that turns with the contact plane; spins are vectors, for which isotropic inertia needs no
//! orientation. Flow along x, gradient along y, vorticity along z. Of the stress tensors the x–y block goes into the common
//! record; the full bulk tensor stays available.

mod search;
mod state;
mod step;

pub(crate) use state::random_balls;
pub use state::{Ball, SpherePair, SphereSample};
