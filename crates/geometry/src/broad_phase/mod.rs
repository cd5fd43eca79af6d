//! Which boxes overlap, which points are near: hashed grids with a counting sort.
//!
//! [`BoxGrid`] takes boxes of mixed sizes (a few nested grids, each with cells as large as its members, per axis, so that bundles of
//! aligned slender segments stay sorted apart) and lists overlapping pairs; [`SegmentGrid`] lists pairs of segments nearer than their
//! reaches, at rest or moving, in axes turned along the prevailing direction; [`PointGrid`] answers radius queries. Work and memory grow
//! linearly with members and answers. Nothing depends on the number of threads: pairs come out in ascending order.

mod boxes;
mod points;
mod rows;
mod segments;

pub use boxes::BoxGrid;
pub use points::PointGrid;
pub use segments::{Nearness, SegmentGrid, SegmentMotion, Segments, largest_relative_motion};

use thiserror::Error;

/// Why a grid cannot be built.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum BroadPhaseError {
    /// A member is not finite or its bounds are out of order.
    #[error("member {index} has no finite bounds")]
    NotFinite {
        /// Which one.
        index: usize,
    },
    /// Members are numbered with 32 bits.
    #[error("{count} members are more than 2³¹ - 1")]
    TooMany {
        /// How many.
        count: usize,
    },
    /// The cell size must be positive and finite.
    #[error("cell size must be positive and finite [m]")]
    Cell,
}
