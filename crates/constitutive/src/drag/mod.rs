//! Force of a shear-dependent liquid on a piece of strand.
//!
//! ```text
//! geometry   areas and equivalent diameter of a capsule or sphere seen from the flow
//! law        Reynolds number, coefficient, voidage, force, each with its derivative by ln U
//! solve      speed after a step in which drag acts implicitly; sticks below the yield force
//! ```
//!
//! Source: Fei et al. 2019, supplemental S64–S66 (coefficient for Herschel–Bulkley liquids), main-paper (20)–(21)
//! (Di Felice's voidage function); the secant solve is our own.

mod geometry;
mod law;
mod solve;

pub use geometry::DragGeometry;
pub use law::{DragForce, DragLaw, DragSettings, voidage_exponent};
pub use solve::DragStep;
