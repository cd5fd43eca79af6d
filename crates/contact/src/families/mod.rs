//! Families of contact problems built from rigid bodies: what tests, benches and validation cases solve.
//!
//! The public collections may not be copied into the project, so it makes hyperstatic problems of its own: walls and
//! towers of boxes, capsule piles, a masonry arch, chains, sphere piles, single bodies on many supports, and random
//! systems with rank-deficient matrices. Every problem follows from a seed.

pub mod bodies;
pub mod bundle;
pub mod random;
pub mod shapes;

pub use bodies::{Bodies, Touch};
pub use bundle::{Beams, Bundle, Chains, bundle, squeezed_bundle};
pub use random::{Random, random_system};
pub use shapes::{Family, arch, boxes, capsules, chain, one_object, spheres, tower, vehicle};
