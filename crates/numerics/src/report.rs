//! How a solve ended. Every solver returns a [`SolveReport`]; nobody ignores it.

use serde::{Deserialize, Serialize};

/// The way a solve ended, by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Status {
    /// The residual fell below the tolerance.
    Converged,
    /// No further progress was possible although the tolerance was not reached; the best iterate is returned.
    Stalled,
    /// The iteration limit was reached; the best iterate is returned.
    MaxIterations,
    /// The method broke down (loss of definiteness, zero pivot); the best iterate is returned.
    Breakdown,
    /// A non-finite number appeared; the result must not be used.
    NonFinite,
}

impl Status {
    /// Whether the tolerance was reached.
    #[must_use]
    pub fn is_converged(self) -> bool {
        self == Status::Converged
    }

    /// The name written into records: `converged`, `stalled`, `max_iterations`, `breakdown`, `non_finite`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Status::Converged => "converged",
            Status::Stalled => "stalled",
            Status::MaxIterations => "max_iterations",
            Status::Breakdown => "breakdown",
            Status::NonFinite => "non_finite",
        }
    }

    /// Severity order used when many solves are summed up: converged < stalled < iterations < breakdown < non-finite.
    #[must_use]
    pub fn severity(self) -> u8 {
        match self {
            Status::Converged => 0,
            Status::Stalled => 1,
            Status::MaxIterations => 2,
            Status::Breakdown => 3,
            Status::NonFinite => 4,
        }
    }
}

impl std::fmt::Display for Status {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// What a solver says of one solve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SolveReport {
    /// How it ended.
    pub status: Status,
    /// Iterations used.
    pub iterations: usize,
    /// Residual reached, in the norm and units the solver documents.
    pub residual: f64,
    /// Tolerance asked for, in the same norm and units.
    pub tolerance: f64,
}

impl SolveReport {
    /// A solve that had nothing to do.
    pub const TRIVIAL: SolveReport =
        SolveReport { status: Status::Converged, iterations: 0, residual: 0.0, tolerance: 0.0 };

    /// The worse of two reports in status, the larger in residual, iterations added: the sum of two solves.
    #[must_use]
    pub fn combined(self, other: SolveReport) -> SolveReport {
        let worse = if other.status.severity() > self.status.severity() { other.status } else { self.status };
        SolveReport {
            status: worse,
            iterations: self.iterations + other.iterations,
            residual: self.residual.max(other.residual),
            tolerance: self.tolerance.max(other.tolerance),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn combining_keeps_the_worse_status_and_adds_iterations() {
        let good = SolveReport { status: Status::Converged, iterations: 3, residual: 1e-9, tolerance: 1e-8 };
        let bad = SolveReport { status: Status::Breakdown, iterations: 2, residual: 0.5, tolerance: 1e-8 };
        for sum in [good.combined(bad), bad.combined(good)] {
            assert_eq!(sum.status, Status::Breakdown);
            assert_eq!(sum.iterations, 5);
            assert_eq!(sum.residual, 0.5);
        }
    }
}
