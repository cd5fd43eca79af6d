//! Global Newton method on the smoothed Fischer–Burmeister equations, one sparse factorisation per iteration.
//!
//! The zeros of `f(x_k(r), y_k(r); μ) = 0` over all contacts form a path that ends, at `μ = 0`, in the exact Coulomb
//! solution; De Saxcé's shift is differentiated too, so this is not a convex relaxation. Every iteration factorises
//! the Jacobian once, gets a corrector and a predictor along `μ²` from it, and takes the smallest `μ` at which the full
//! step stays in a neighbourhood of the path. With `μ > 0` the Jacobian stays regular although `W` is singular, which
//! is why redundant contacts do no harm (non-interior continuation: Chen and Harker 1993; Hayashi, Yamashita and
//! Fukushima 2005 for second-order cones).

use super::block_lu::BlockLu;
use super::group::{Best, Group, GroupOutcome, GroupSolver};
use super::ordering::{Elimination, minimum_degree};
use crate::block::Vec3;
use crate::report::Method;
use numerics::Status;

mod path;
mod system;

/// How one attempt follows the path. The attempts differ so that what stops one rarely stops the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attempt {
    /// Power of `ν` shared between impulse and velocity in the self-dual pair (0 … 1).
    pub friction_power: f64,
    /// Size of the neighbourhood of the path, in units of `μ`.
    pub neighbourhood: f64,
    /// Neighbourhood in the largest contact rather than in the mean.
    pub by_largest: bool,
    /// Smoothing of `‖u_T‖` in units of `μ`.
    pub slip_smoothing: f64,
    /// Scale every contact by its own diagonal rather than all by the mean.
    pub equilibrate: bool,
    /// Regularisation of `W` in the Jacobian, relative to its diagonal.
    pub damping: f64,
    /// Start from the impulses given (else from zero).
    pub warm: bool,
    /// Hold De Saxcé's shift at its value of the last iterate instead of differentiating it: every step is then one of
    /// a monotone problem, whose path has no folds, at the price of linear convergence in the shift.
    pub lagged: bool,
}

/// The attempts in order.
pub const ATTEMPTS: [Attempt; 7] = [
    Attempt {
        friction_power: 1.0,
        neighbourhood: 0.5,
        by_largest: true,
        slip_smoothing: 0.03,
        equilibrate: false,
        damping: 1e-13,
        warm: true,
        lagged: false,
    },
    Attempt {
        friction_power: 0.5,
        neighbourhood: 0.5,
        by_largest: true,
        slip_smoothing: 0.03,
        equilibrate: true,
        damping: 1e-13,
        warm: false,
        lagged: false,
    },
    Attempt {
        friction_power: 0.7,
        neighbourhood: 0.35,
        by_largest: true,
        slip_smoothing: 0.05,
        equilibrate: false,
        damping: 1e-12,
        warm: false,
        lagged: false,
    },
    Attempt {
        friction_power: 1.0,
        neighbourhood: 0.25,
        by_largest: true,
        slip_smoothing: 0.01,
        equilibrate: true,
        damping: 1e-12,
        warm: false,
        lagged: false,
    },
    Attempt {
        friction_power: 0.5,
        neighbourhood: 2.0,
        by_largest: false,
        slip_smoothing: 0.1,
        equilibrate: true,
        damping: 1e-13,
        warm: false,
        lagged: true,
    },
    Attempt {
        friction_power: 0.5,
        neighbourhood: 1.0,
        by_largest: true,
        slip_smoothing: 0.1,
        equilibrate: true,
        damping: 1e-13,
        warm: true,
        lagged: false,
    },
    Attempt {
        friction_power: 0.0,
        neighbourhood: 5.0,
        by_largest: false,
        slip_smoothing: 0.3,
        equilibrate: false,
        damping: 1e-11,
        warm: false,
        lagged: false,
    },
];

/// The Newton solver with its limits.
#[derive(Clone, Copy, Debug)]
pub struct Newton<'a> {
    /// Most iterations of one attempt.
    pub max_iterations: usize,
    /// Attempts, tried in order until one converges.
    pub attempts: &'a [Attempt],
    /// Most block multiplications of one factorisation; above it the solver declines at once (`Breakdown`, no iterations).
    pub work_limit: usize,
    /// Most block multiplications of all factorisations together.
    pub most_products: usize,
}

impl Default for Newton<'_> {
    fn default() -> Self {
        Newton { max_iterations: 60, attempts: &ATTEMPTS, work_limit: 2_000_000_000, most_products: usize::MAX }
    }
}

impl GroupSolver for Newton<'_> {
    fn name(&self) -> &'static str {
        "newton"
    }

    fn solve(&self, group: &Group<'_>, r: &mut [Vec3]) -> GroupOutcome {
        let best = Best::start(group, r);
        if best.residual <= group.tolerance {
            return GroupOutcome::of(Method::Newton, Status::Converged, best.residual, 0);
        }
        match minimum_degree(group.w, self.work_limit) {
            Some(elimination) => self.solve_ordered(group, &elimination, r),
            None => GroupOutcome::of(Method::Newton, Status::Breakdown, best.residual, 0),
        }
    }
}

impl Newton<'_> {
    /// Solves with an elimination order that is at hand.
    pub fn solve_ordered(&self, group: &Group<'_>, elimination: &Elimination, r: &mut [Vec3]) -> GroupOutcome {
        let mut best = Best::start(group, r);
        let mut iterations = 0;
        let mut status = Status::Converged;
        if best.residual > group.tolerance {
            let mut lu = BlockLu::new(elimination);
            let affordable = self.most_products / elimination.block_products.max(1);
            for attempt in self.attempts {
                let most = self.max_iterations.min(affordable.saturating_sub(iterations));
                if most == 0 {
                    status = Status::MaxIterations;
                    break;
                }
                let start = best.r.clone();
                let (s, i) = path::follow(group, elimination, &mut lu, attempt, &start, most, &mut best);
                status = s;
                iterations += i;
                if best.residual <= group.tolerance {
                    status = Status::Converged;
                    break;
                }
            }
        }
        r.copy_from_slice(&best.r);
        GroupOutcome::of(Method::Newton, status, best.residual, iterations)
    }
}
