//! Why a stage of the liquid stops.

use constitutive::RheologyError;
use particle_grid::GridError;
use thiserror::Error;

/// What can stop a stage. The caller restores its snapshot and tries a smaller step, or reports.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum LiquidError {
    /// Positions that no grid can hold.
    #[error(transparent)]
    Grid(#[from] GridError),
    /// A particle deforms too much in one step, or inverts: the step must be made smaller.
    #[error("particle {id} deforms too much in one step: {source}")]
    Deformation {
        /// Stable identity of the particle.
        id: u64,
        /// What its law says.
        source: RheologyError,
    },
    /// A linear solve produced numbers that are not finite.
    #[error("the {solve} solve produced numbers that are not finite")]
    NonFinite {
        /// Which solve.
        solve: &'static str,
    },
    /// A particle refers to a material that does not exist.
    #[error("particle {id} refers to material {material} of {count}")]
    Material {
        /// Stable identity of the particle.
        id: u64,
        /// Index it holds.
        material: usize,
        /// Number of materials there are.
        count: usize,
    },
    /// The state is inconsistent.
    #[error("particle state: {0}")]
    State(String),
    /// A setting lies outside its range.
    #[error("{name} = {value} is outside its range: {allowed}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// Value given.
        value: f64,
        /// The range in words.
        allowed: &'static str,
    },
}

impl LiquidError {
    /// Whether a smaller step may help.
    #[must_use]
    pub fn is_retryable(&self) -> bool {
        matches!(self, LiquidError::Deformation { .. } | LiquidError::NonFinite { .. } | LiquidError::Grid(_))
    }
}
