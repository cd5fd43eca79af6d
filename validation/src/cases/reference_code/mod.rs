//! Imported scenes of the C++ reference code beside what was recorded while it ran. The recordings are read where they
//! are (`VISCOSE_REFERENCE`); without them the cases are skipped.
//!
//! Equality is not expected: the code has known errors, and the motion of a thin strand is sensitive. Every case shows
//! three runs: theirs, ours with the same step, ours with smaller steps, so that it can be seen which one converges.

mod cost;
mod follow;
mod liquid;
mod recorded;
mod strands;

use crate::case::Case;

/// The cases.
#[must_use]
pub fn cases() -> Vec<Case> {
    vec![
        strands::CRAZY_ROTATION,
        strands::STRAND_PULLING,
        strands::BEND_RELEASE,
        strands::INCLINE,
        liquid::LIQUID_CREAM,
        cost::COST,
    ]
}
