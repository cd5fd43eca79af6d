//! What can be wrong with positions handed to the grid.

use thiserror::Error;

/// A set of particles that no grid can hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum GridError {
    /// A position is NaN or infinite.
    #[error("particle {particle} has a non-finite position")]
    NonFinite {
        /// Index of the particle.
        particle: usize,
    },
    /// A position lies outside the period of a periodic direction; wrap positions first.
    #[error("particle {particle} lies outside the periodic domain in direction {axis}")]
    OutsidePeriod {
        /// Index of the particle.
        particle: usize,
        /// Direction, 0 to `D − 1`.
        axis: usize,
    },
    /// A position is more than a million blocks away from the origin of the grid.
    #[error("particle {particle} is too far from the origin of the grid")]
    TooFar {
        /// Index of the particle.
        particle: usize,
    },
    /// More than four thousand million particles or nodes.
    #[error("too many particles or nodes for 32-bit indices")]
    TooMany,
}
