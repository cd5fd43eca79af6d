//! Yarns: exact motion, conservation, waves, hanging and swinging chains, friction, the reference trajectories.

mod axial_mode;
mod bending;
mod capstan;
mod catenary;
mod cone;
mod crossed_pull;
mod free_fall;
mod incline;
mod momentum;
mod pendulum_chain;
mod reference;
mod rotation;
mod setup;
mod work_precision;

use crate::case::Case;

/// All cases of the group.
#[must_use]
pub fn cases() -> Vec<Case> {
    vec![
        axial_mode::CASE,
        bending::CASE,
        capstan::CASE,
        catenary::CASE,
        cone::CASE,
        crossed_pull::CASE,
        free_fall::CASE,
        incline::CASE,
        momentum::CASE,
        pendulum_chain::CASE,
        reference::CASE,
        rotation::CASE,
        work_precision::CASE,
    ]
}
