//! The microgel rheometer: exact moduli, reference trajectories, moduli of the original's parameter sets, demodulation, laws.

mod assembly;
mod contact_laws;
mod demodulation;
mod lattice_modulus;
mod oscillation;
mod reference;
mod spheres;
mod statistics;
mod two_grain;

use crate::case::Case;

/// All cases of the group.
#[must_use]
pub fn cases() -> Vec<Case> {
    vec![
        assembly::CASE,
        contact_laws::CASE,
        demodulation::CASE,
        demodulation::SYNTHETIC,
        lattice_modulus::CASE,
        oscillation::CASE,
        spheres::CASE,
        statistics::CASE,
        two_grain::COLLISION,
        two_grain::SLIDING,
        two_grain::TRAJECTORIES,
    ]
}
