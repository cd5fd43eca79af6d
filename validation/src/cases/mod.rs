//! All cases, grouped as in `viscose validate --list`.

use crate::case::Case;

/// Every case there is, in order of group and name.
#[must_use]
pub fn all() -> Vec<Case> {
    Vec::new()
}
