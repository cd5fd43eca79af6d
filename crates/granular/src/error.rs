//! What can go wrong, with the place and time it went wrong at.

use thiserror::Error;

/// Failure of a granular computation.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum GranularError {
    /// A setting lies outside the range it is defined for.
    #[error("{name} = {value} is out of range: {allowed}")]
    Setting {
        /// Name of the setting as it appears in a scene.
        name: &'static str,
        /// Value that was given.
        value: f64,
        /// Allowed range in words.
        allowed: &'static str,
    },
    /// Arrays of a state disagree in length or hold an inadmissible value.
    #[error("inconsistent state: {0}")]
    State(String),
    /// A grain left the range of finite numbers.
    #[error("grain {grain} has a non-finite state at t = {time} s")]
    NonFinite {
        /// Index of the grain.
        grain: usize,
        /// Time [s].
        time: f64,
    },
    /// The step is too large for the stiffest contact and sub-stepping is off or exhausted.
    #[error("step {step} s at t = {time} s exceeds the stable step {stable} s of the stiffest contact")]
    StepTooLarge {
        /// Requested step [s].
        step: f64,
        /// Largest step admitted by the guard [s].
        stable: f64,
        /// Time [s].
        time: f64,
    },
    /// No grain is free to move.
    #[error("no movable grain is left at t = {time} s")]
    NothingMovable {
        /// Time [s].
        time: f64,
    },
    /// The oscillation is sampled too coarsely to be demodulated.
    #[error("{steps_per_period} steps per period are fewer than 100")]
    CoarseSampling {
        /// Steps per period of the slowest tone.
        steps_per_period: f64,
    },
    /// The random cutting produced no admissible particles within the allowed number of attempts.
    #[error("no admissible particles after {attempts} attempts at cutting")]
    Cutting {
        /// Number of attempts made.
        attempts: usize,
    },
    /// A signal is too short or degenerate for the requested evaluation.
    #[error("signal: {0}")]
    Signal(&'static str),
}

/// Returns an error naming `name` unless `value` is finite and satisfies `holds`.
pub(crate) fn require(
    name: &'static str,
    value: f64,
    holds: impl Fn(f64) -> bool,
    allowed: &'static str,
) -> Result<(), GranularError> {
    if value.is_finite() && holds(value) { Ok(()) } else { Err(GranularError::Setting { name, value, allowed }) }
}
