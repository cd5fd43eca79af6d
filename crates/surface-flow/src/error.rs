//! Why a film is refused or a step given up.

use thiserror::Error;

/// An error of the film solver. The state is then to be restored by the caller.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FilmError {
    /// A slice has another length than the film.
    #[error("{what} has {found} entries, the film needs {expected}")]
    Shape {
        /// Which slice.
        what: &'static str,
        /// Entries needed.
        expected: usize,
        /// Entries found.
        found: usize,
    },
    /// A setting or material number is out of range.
    #[error("{name} = {value}: {allowed}")]
    Parameter {
        /// Which number.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Its range in words.
        allowed: &'static str,
    },
    /// The liquid was refused.
    #[error(transparent)]
    Liquid(#[from] constitutive::RheologyError),
    /// Numbers that are not finite, or a negative cross-section, appeared on this many strands.
    #[error("the film of {strands} strands, first of them strand {first}, is not finite")]
    NonFinite {
        /// Number of strands.
        strands: usize,
        /// The first of them.
        first: usize,
    },
}
