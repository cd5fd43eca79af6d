//! All cases, grouped as in `viscose validate --list`.
//!
//! Each group is a module with `cases()`; a new group adds its line here.

pub mod contact;
pub mod coupled;
pub mod film;
pub mod granular;
pub mod liquid;
pub mod reference_code;
pub mod rods;
pub mod yarn;

use crate::case::Case;

/// Every case there is, in order of group and name.
#[must_use]
pub fn all() -> Vec<Case> {
    let groups: Vec<Vec<Case>> = vec![
        contact::cases(),
        coupled::cases(),
        film::cases(),
        granular::cases(),
        liquid::cases(),
        reference_code::cases(),
        rods::cases(),
        yarn::cases(),
        crate::hard::cases(),
    ];
    let mut cases: Vec<Case> = groups.into_iter().flatten().collect();
    cases.sort_by_key(|case| case.id);
    cases
}
