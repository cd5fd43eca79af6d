//! What a contact solve says of itself.

use numerics::{SolveReport, Status};
use serde::{Deserialize, Serialize};

/// What one method did, summed over the groups it worked on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageReport {
    /// Which method: `direct` (one contact), `gauss_seidel`, `newton`, `admm`.
    pub method: Method,
    /// Groups it worked on.
    pub groups: usize,
    /// Iterations (sweeps) over all groups.
    pub iterations: usize,
    /// Groups it brought to the tolerance.
    pub converged: usize,
}

/// A method inside a solve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The local solver, exact for a single contact.
    Direct,
    /// Block Gauss–Seidel.
    GaussSeidel,
    /// Smoothed Newton method.
    Newton,
    /// Alternating directions.
    Admm,
}

impl Method {
    /// Every method in the order of [`ContactReport::stages`].
    pub const ALL: [Method; 4] = [Method::Direct, Method::GaussSeidel, Method::Newton, Method::Admm];

    /// The name written into records.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Method::Direct => "direct",
            Method::GaussSeidel => "gauss_seidel",
            Method::Newton => "newton",
            Method::Admm => "admm",
        }
    }
}

/// What a contact solve says of itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactReport {
    /// Status, iterations of all methods, residual of the whole problem and tolerance.
    pub solve: SolveReport,
    /// Number of groups of contacts that do not feel each other.
    pub groups: usize,
    /// Per method, only those used.
    pub stages: Vec<StageReport>,
}

impl ContactReport {
    /// The report of a problem without contacts.
    #[must_use]
    pub fn empty(tolerance: f64) -> Self {
        ContactReport { solve: SolveReport { tolerance, ..SolveReport::TRIVIAL }, groups: 0, stages: Vec::new() }
    }

    /// Shorthand for the status.
    #[must_use]
    pub fn status(&self) -> Status {
        self.solve.status
    }
}
