//! Cases of the liquid on its grid: transfers, operators, and flows with a known answer.

mod acoustic;
mod apic_invariants;
mod channel;
mod dam_break;
mod film_on_plane;
mod hydrostatic;
mod pipe;
mod profile;
mod resample;
mod rotation_grid;
mod setup;
mod shear_operator;
mod slump;
mod thin_spread;
mod work_precision;

use crate::case::Case;

/// The cases of this group.
#[must_use]
pub fn cases() -> Vec<Case> {
    vec![
        acoustic::CASE,
        apic_invariants::CASE,
        channel::CASE,
        dam_break::CASE,
        film_on_plane::CASE,
        hydrostatic::CASE,
        pipe::CASE,
        resample::CASE,
        rotation_grid::CASE,
        shear_operator::CASE,
        slump::CASE,
        thin_spread::CASE,
        work_precision::CASE,
        work_precision::VOLUME_DRIFT,
    ]
}
