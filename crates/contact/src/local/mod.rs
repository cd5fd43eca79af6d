//! One contact at a time: given its block `W`, the velocity `b` that everything else gives it, and `ν`, find `r`.
//!
//! ```text
//! enumerative ── take-off, stick, then the sliding root of a scalar equation (quartic when squared): exact, no start needed
//! newton      ── damped Newton on the Fischer–Burmeister function from a warm start
//! wide        ── the same cases with twice the digits, where the block is singular to nearly all of them
//! solver      ── the order in which they are tried, and the residual that decides
//! ```

pub mod enumerative;
pub mod newton;
pub mod quartic;
pub mod solver;
mod wide;

pub use solver::{LocalContact, LocalMethod, LocalSolution};
