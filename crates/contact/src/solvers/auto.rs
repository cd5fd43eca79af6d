//! Which method goes first and when it hands over, decided by measured progress, not by the clock: the same problem
//! always takes the same way.

use super::admm::Admm;
use super::gauss_seidel::GaussSeidel;
use super::group::{Group, GroupOutcome, GroupSolver};
use super::newton::{Attempt, Newton};
use super::ordering::minimum_degree;
use crate::block::Vec3;
use crate::local::{LocalContact, LocalMethod};
use crate::report::Method;
use numerics::Status;

/// The automatic choice.
#[derive(Clone, Copy, Debug)]
pub struct Auto {
    /// Local solver of the Gauss–Seidel parts.
    pub local: LocalMethod,
    /// Most iterations of one Newton attempt.
    pub max_newton_iterations: usize,
    /// Most sweeps of the last resort.
    pub max_sweeps: usize,
    /// Most alternating-direction iterations.
    pub max_admm_iterations: usize,
}

/// Sweeps before Newton: enough to settle loose groups and to start the others well.
const FIRST_SWEEPS: usize = 20;

/// Most block multiplications of one factorisation for which Newton is tried at all: a few seconds.
const NEWTON_PRODUCTS: usize = 100_000_000;

/// Factorisations that a Newton solve takes as a rule.
const NEWTON_FACTORS: usize = 20;

/// Cost of a local solve in block-vector products.
const LOCAL_SOLVE: usize = 30;

/// Sweeps below which a second run of them is not worth its start.
const LEAST_SWEEPS: usize = 100;

/// Sweeps that are combined in long runs.
const WINDOW: usize = 8;

/// Turns of the last resort.
const TURNS: usize = 6;

/// Newton attempts that start where the sweeps ended.
const WARM: [Attempt; 2] = [
    Attempt {
        friction_power: 1.0,
        neighbourhood: 0.5,
        by_largest: true,
        slip_smoothing: 0.01,
        equilibrate: false,
        damping: 1e-13,
        warm: true,
        lagged: false,
    },
    Attempt {
        friction_power: 0.5,
        neighbourhood: 2.0,
        by_largest: true,
        slip_smoothing: 0.1,
        equilibrate: true,
        damping: 1e-13,
        warm: true,
        lagged: false,
    },
];

impl GroupSolver for Auto {
    fn name(&self) -> &'static str {
        "auto"
    }

    fn solve(&self, group: &Group<'_>, r: &mut [Vec3]) -> GroupOutcome {
        if group.len() == 1 {
            let local = LocalContact::new(group.w.diagonal(0), group.friction[0]);
            let answer = local.solve(&group.q[0], &r[0], self.local);
            let residual = group.residual(&[answer.impulse]);
            if residual <= group.tolerance {
                r[0] = answer.impulse;
                return GroupOutcome::of(Method::Direct, Status::Converged, residual, 1);
            }
        }
        // a short run of sweeps: settles loose groups, and starts the others well
        let first = GaussSeidel {
            max_sweeps: FIRST_SWEEPS,
            check_every: 10,
            local: self.local,
            patience: Some(FIRST_SWEEPS),
            window: 0,
        };
        let mut outcome = first.solve(group, r);
        if outcome.status.is_converged() {
            return outcome;
        }
        // what one Newton solve costs, counted in sweeps, decides how long sweeps are worth trying
        let elimination = minimum_degree(group.w, NEWTON_PRODUCTS);
        let products = elimination.as_ref().map_or(NEWTON_PRODUCTS, |e| e.block_products);
        let sweep = group.w.block_count() + LOCAL_SOLVE * group.len();
        let worth = NEWTON_FACTORS * products * 3 / sweep;
        if worth >= LEAST_SWEEPS {
            let long = GaussSeidel {
                max_sweeps: worth.min(self.max_sweeps),
                check_every: 10,
                local: self.local,
                patience: Some(worth.min(self.max_sweeps)),
                window: WINDOW,
            };
            outcome = long.solve(group, r).after(&outcome);
            if outcome.status.is_converged() {
                return outcome;
            }
        }
        if let Some(elimination) = &elimination {
            let newton = Newton { max_iterations: self.max_newton_iterations, ..Newton::default() };
            outcome = newton.solve_ordered(group, elimination, r).after(&outcome);
            if outcome.status.is_converged() {
                return outcome;
            }
        }
        let admm = Admm { max_iterations: self.max_admm_iterations, ..Admm::default() };
        outcome = admm.solve(group, r).after(&outcome);
        if outcome.status.is_converged() {
            return outcome;
        }
        // turns of sweeps and Newton from where they lead: each moves on where the other is stuck
        let warm = Newton { max_iterations: self.max_newton_iterations, attempts: &WARM, ..Newton::default() };
        let turn =
            GaussSeidel { max_sweeps: self.max_sweeps / TURNS, check_every: 25, local: self.local, patience: None, window: WINDOW };
        for _ in 0..TURNS {
            outcome = turn.solve(group, r).after(&outcome);
            if outcome.status.is_converged() {
                return outcome;
            }
            let Some(elimination) = &elimination else { continue };
            let before = outcome.residual;
            outcome = warm.solve_ordered(group, elimination, r).after(&outcome);
            if outcome.status.is_converged() {
                return outcome;
            }
            if outcome.residual > 0.999 * before && outcome.residual > 0.1 {
                break;
            }
        }
        outcome
    }
}
