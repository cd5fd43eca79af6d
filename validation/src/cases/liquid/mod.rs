//! Cases of the bulk liquid.

pub mod material_point;

use crate::case::Case;

/// The cases of this group.
#[must_use]
pub fn cases() -> Vec<Case> {
    material_point::cases()
}
