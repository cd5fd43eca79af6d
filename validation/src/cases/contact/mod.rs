//! Frictional contact: exact cases, the public problems, the cross-check, the families made by the project.

mod bridge_force;
mod capstan;
mod capstan_strand;
mod cross_check;
mod families;
mod incline;
mod painleve;
mod public_problems;
mod pull_off;
mod sliding_block;
mod stick_slip;
mod tolerance;

use crate::case::Case;

/// All cases of the group.
#[must_use]
pub fn cases() -> Vec<Case> {
    vec![
        bridge_force::CASE,
        capstan::CASE,
        capstan_strand::CASE,
        cross_check::CASE,
        families::CASE,
        incline::CASE,
        painleve::CASE,
        public_problems::CASE,
        pull_off::CASE,
        sliding_block::CASE,
        stick_slip::CASE,
        tolerance::CASE,
    ]
}
