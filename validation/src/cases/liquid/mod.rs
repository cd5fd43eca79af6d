//! Cases of the bulk liquid.

pub mod grid;
pub mod material_point;

use crate::case::Case;

/// The cases of this group.
#[must_use]
pub fn cases() -> Vec<Case> {
    [grid::cases(), material_point::cases()].concat()
}
