//! Choices of the contact model that the published program decides otherwise; each can be switched to study its effect.

use serde::{Deserialize, Serialize};

/// What becomes of the tangential spring at the Coulomb limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum SlipRule {
    /// It stays stretched so that spring and dashpot together give the limit.
    #[default]
    KeepAtLimit,
    /// It is reset to zero (Otsuki & Hayakawa 2017).
    Reset,
}

/// Lever of the contact speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Lever {
    /// The lever of the torque, `d r_i/(r_i + r_j)`: rigid rotation slides nothing and power equals force times speed.
    #[default]
    Consistent,
    /// The radius, as published; an overlapping pair in rigid rotation then seems to slide.
    Radius,
}

/// What happens when the step is too large for the stiffest contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum StepGuard {
    /// Nothing is checked.
    Off,
    /// The step is cut into equal parts, at most this many at once.
    SubStep(u32),
    /// The step is refused with an error.
    Refuse,
}

impl Default for StepGuard {
    fn default() -> Self {
        Self::SubStep(4096)
    }
}

/// Rules of the physical mode.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Rules {
    /// Tangential spring at the Coulomb limit.
    pub slip: SlipRule,
    /// Lever of the contact speed.
    pub lever: Lever,
    /// Lets the dashpot of a separating transient contact pull.
    pub viscous_attraction: bool,
    /// Damps spins towards `-rate/2`, the spin of the homogeneous flow, instead of zero.
    pub damp_to_flow_spin: bool,
    /// What happens when the step is too large.
    pub guard: StepGuard,
    /// Largest step in units of `1/sqrt(stiffness (1/m_i + 1/m_j))` of the stiffest contact [-], 0.02 … 0.5; smaller is more accurate.
    pub guard_fraction: f64,
    /// Skin of the pair list in mean radii [-], 0.02 … 2: larger rebuilds less often and visits more idle pairs.
    pub skin: f64,
}

impl Default for Rules {
    fn default() -> Self {
        Self {
            slip: SlipRule::KeepAtLimit,
            lever: Lever::Consistent,
            viscous_attraction: false,
            damp_to_flow_spin: true,
            guard: StepGuard::default(),
            guard_fraction: 0.25,
            skin: 0.2,
        }
    }
}
