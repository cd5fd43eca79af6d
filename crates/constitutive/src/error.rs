//! Why a law refuses its input.

use thiserror::Error;

/// An input that a material law cannot answer for.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RheologyError {
    /// A parameter of a material lies outside the range where the law has a meaning.
    #[error("{name} = {value} is outside its range: {allowed}")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// Value given, in SI.
        value: f64,
        /// The range in words.
        allowed: &'static str,
    },
    /// The deformation of one step is too large, inverted or not finite: the step must be made smaller.
    #[error("deformation increment of determinant {determinant} (allowed: 0.05 to 20, finite)")]
    Deformation {
        /// Determinant of the increment.
        determinant: f64,
    },
    /// A strain or stress is not finite.
    #[error("{what} is not finite")]
    NonFinite {
        /// What was found not finite.
        what: &'static str,
    },
    /// No material of this name is known.
    #[error("no material is called `{0}`")]
    UnknownMaterial(String),
    /// A measured flow curve cannot be fitted.
    #[error("flow curve: {0}")]
    Data(String),
}

/// Returns `value` if it is finite and passes `allowed`, an error naming the range otherwise.
pub(crate) fn require(
    name: &'static str,
    value: f64,
    passes: bool,
    allowed: &'static str,
) -> Result<f64, RheologyError> {
    if value.is_finite() && passes { Ok(value) } else { Err(RheologyError::Parameter { name, value, allowed }) }
}
