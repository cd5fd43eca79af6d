//! All cases, grouped as in `viscose validate --list`.
//!
//! Each group is a module with `cases()`; a new group adds its line here.

pub mod granular;
pub mod liquid;
pub mod yarn;

use crate::case::Case;

/// Every case there is, in order of group and name.
#[must_use]
pub fn all() -> Vec<Case> {
    let groups: Vec<Vec<Case>> = vec![granular::cases(), liquid::cases(), yarn::cases()];
    let mut cases: Vec<Case> = groups.into_iter().flatten().collect();
    cases.sort_by_key(|case| case.id);
    cases
}
