//! What can go wrong, by name and place.

use numerics::Status;

/// Why rods could not be built or advanced.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RodError {
    /// A material constant lies outside its range.
    #[error("strand material: `{field}` must be {range}")]
    Material {
        /// Field of [`StrandMaterial`](crate::StrandMaterial).
        field: &'static str,
        /// Allowed values.
        range: &'static str,
    },
    /// The geometry of a strand cannot be used.
    #[error("strand {strand}, vertex {vertex}: {reason}")]
    Geometry {
        /// Strand index.
        strand: usize,
        /// Vertex index within the strand.
        vertex: usize,
        /// What is wrong.
        reason: &'static str,
    },
    /// An argument has the wrong length or an index is out of range.
    #[error("{what}: expected {expected}, got {got}")]
    Argument {
        /// Which argument.
        what: &'static str,
        /// Expected length or bound.
        expected: usize,
        /// What was given.
        got: usize,
    },
    /// A setting lies outside its range.
    #[error("rod setting `{field}` must be {range}")]
    Setting {
        /// Field name.
        field: &'static str,
        /// Allowed values.
        range: &'static str,
    },
    /// Newton's method did not reach the tolerance.
    #[error(
        "strand {strand}, vertex {vertex}: Newton {status} after {iterations} iterations, residual {residual:.3e} N, \
         tolerance {tolerance:.3e} N"
    )]
    NotConverged {
        /// Strand index.
        strand: usize,
        /// Vertex (within the strand) with the largest residual.
        vertex: usize,
        /// How the solve ended.
        status: Status,
        /// Iterations used.
        iterations: usize,
        /// Largest residual force \[N\].
        residual: f64,
        /// Tolerance \[N\].
        tolerance: f64,
    },
    /// A number that is not finite appeared.
    #[error("strand {strand}, vertex {vertex}: not a finite number in {what}")]
    NonFinite {
        /// Strand index.
        strand: usize,
        /// Vertex within the strand.
        vertex: usize,
        /// Where.
        what: &'static str,
    },
    /// No admissible start: an edge is folded back on its neighbour or has no length.
    #[error("strand {strand}, vertex {vertex}: the prescribed motion folds the strand or removes an edge")]
    Folded {
        /// Strand index.
        strand: usize,
        /// Vertex within the strand.
        vertex: usize,
    },
    /// A static equilibrium was not reached.
    #[error("no equilibrium after {steps} pseudo-time steps: residual {residual:.3e} N, tolerance {tolerance:.3e} N")]
    NoEquilibrium {
        /// Pseudo-time steps taken.
        steps: usize,
        /// Largest unbalanced force \[N\].
        residual: f64,
        /// Tolerance \[N\].
        tolerance: f64,
    },
    /// Rest shapes for a given equilibrium exist only for a strand clamped at its root.
    #[error("strand {strand}: a sag-free rest shape needs the first two vertices and the first angle fixed, and no others")]
    NotClampedAtRoot {
        /// Strand index.
        strand: usize,
    },
}
