//! How a rod step went.

use crate::settings::HessianMode;
use numerics::{SolveReport, Status};
use serde::{Deserialize, Serialize};

/// How one solve of all strands ended.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RodReport {
    /// Worst status, most iterations of any strand, largest residual over tolerance (so that the tolerance is 1).
    pub solve: SolveReport,
    /// Newton iterations of all strands together.
    pub total_iterations: usize,
    /// Strand with the largest residual over tolerance.
    pub worst_strand: usize,
    /// Vertex of that strand with the largest residual.
    pub worst_vertex: usize,
    /// Weakest matrix that any strand needed.
    pub hessian: HessianMode,
    /// Iterations in which a strand's exact matrix was not positive definite.
    pub indefinite: usize,
    /// Line-search halvings of all strands together.
    pub halvings: usize,
}

impl RodReport {
    /// A solve without strands.
    pub const EMPTY: RodReport = RodReport {
        solve: SolveReport { status: Status::Converged, iterations: 0, residual: 0.0, tolerance: 1.0 },
        total_iterations: 0,
        worst_strand: 0,
        worst_vertex: 0,
        hessian: HessianMode::Exact,
        indefinite: 0,
        halvings: 0,
    };
}

/// A step size that the rods ask for, and why.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepLimit {
    /// Seconds; infinite when nothing limits.
    pub seconds: f64,
    /// The reason.
    pub reason: StepReason,
}

/// Why a step size is limited.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum StepReason {
    /// Nothing moves.
    Unlimited,
    /// An edge of this strand would turn by more than `max_turn`.
    Turn {
        /// Strand index.
        strand: usize,
    },
}
