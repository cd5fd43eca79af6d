//! The fixed point on De Saxcé's shift around a convex solve.

use crate::block::Vec3;
use numerics::Status;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Settings of the cross-check.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OracleSettings {
    /// Tolerance of each cone programme [1], 1e-12 … 1e-6. A hundred times less is tried first; below 1e-10 the
    /// interior-point method often ends `AlmostSolved`, which is not accepted.
    pub tolerance: f64,
    /// Change of the shift, relative to its largest entry, at which the fixed point ends [1].
    pub shift_tolerance: f64,
    /// Most outer iterations; 1 gives the convex model.
    pub max_outer: usize,
}

impl Default for OracleSettings {
    fn default() -> Self {
        OracleSettings { tolerance: 1e-10, shift_tolerance: 1e-9, max_outer: 200 }
    }
}

/// What the second opinion says.
#[derive(Clone, Debug, PartialEq)]
pub struct OracleAnswer {
    /// Converged; `Stalled` where the shift changes by no more than the cone solver's inaccuracy; `MaxIterations` where
    /// the fixed point still moves (it may cycle for ν above one); `Breakdown` where the
    /// cone solver did not report `Solved`.
    pub status: Status,
    /// Impulses `r` without the cohesive shift [N s]; not unique where contacts are redundant.
    pub impulses: Vec<Vec3>,
    /// Relative velocities [m/s].
    pub velocities: Vec<Vec3>,
    /// Outer iterations.
    pub outer_iterations: usize,
    /// Last change of the shift relative to its largest entry.
    pub shift_change: f64,
    /// Natural-map residual of the exact law (scaled per contact).
    pub residual: f64,
}

/// Why no second opinion can be given.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum OracleError {
    /// The dual form needs a cost ½ rᵀW r.
    #[error("the Delassus matrix is not symmetric (relative {0:.1e}): the cone programme does not apply")]
    NotSymmetric(f64),
    /// Data the cone solver refuses.
    #[error("the cone solver refuses the problem: {0}")]
    Refused(String),
}

/// Change of the shift that may be the cone solver's own inaccuracy …
const NOISE: f64 = 1e-6;
/// … and the outer iterations without halving it after which it counts as such.
const PATIENCE: usize = 15;

/// One convex solve for a shift: writes impulses and velocities (scaled), says whether it was solved.
pub(super) trait ConvexSolve {
    fn solve(&mut self, shift: &[f64], r: &mut [Vec3], u: &mut [Vec3]) -> bool;
}

/// Iterates `ς ← ν‖u_T‖`; halves the step whenever the change stops shrinking.
pub(super) fn fixed_point(
    convex: &mut dyn ConvexSolve,
    friction: &[f64],
    settings: &OracleSettings,
    r: &mut [Vec3],
    u: &mut [Vec3],
) -> (Status, usize, f64) {
    let n = friction.len();
    // zero velocities on entry start from the convex model
    let mut shift: Vec<f64> = (0..n).map(|k| friction[k].max(0.0) * u[k][1].hypot(u[k][2])).collect();
    let mut damping = 1.0;
    let mut last = f64::INFINITY;
    let mut growth = 0;
    let (mut lowest, mut lowest_at) = (f64::INFINITY, 0);
    for outer in 1..=settings.max_outer {
        if !convex.solve(&shift, r, u) {
            return (Status::Breakdown, outer, last);
        }
        let (mut change, mut largest) = (0.0_f64, 0.0_f64);
        let mut next = vec![0.0; n];
        for k in 0..n {
            next[k] = friction[k].max(0.0) * u[k][1].hypot(u[k][2]);
            change = change.max((next[k] - shift[k]).abs());
            largest = largest.max(next[k]);
        }
        // velocities are of order one after scaling: a shift below the cone solver's own accuracy counts as none
        let relative = change / largest.max(1e-1);
        if relative <= settings.shift_tolerance {
            return (Status::Converged, outer, relative);
        }
        if relative < 0.5 * lowest {
            (lowest, lowest_at) = (relative, outer);
        } else if lowest < NOISE && outer > lowest_at + PATIENCE {
            return (Status::Stalled, outer, relative);
        }
        growth = if relative > 0.95 * last { growth + 1 } else { 0 };
        if growth >= 3 {
            damping = (damping * 0.5_f64).max(1.0 / 64.0);
            growth = 0;
        }
        last = relative;
        for k in 0..n {
            shift[k] += damping * (next[k] - shift[k]);
        }
    }
    (Status::MaxIterations, settings.max_outer, last)
}
