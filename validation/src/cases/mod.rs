//! All cases, grouped as in `viscose validate --list`.

pub mod liquid;

use crate::case::Case;

/// Every case there is, in order of group and name.
#[must_use]
pub fn all() -> Vec<Case> {
    let groups = [liquid::cases()];
    groups.into_iter().flatten().collect()
}
