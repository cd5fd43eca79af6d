//! Which method goes first and when it hands over, decided by measured progress, not by the clock: the same problem
//! always takes the same way.

use super::admm::Admm;
use super::gauss_seidel::GaussSeidel;
use super::group::{Group, GroupOutcome, GroupSolver};
use super::newton::Newton;
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

/// Sweeps that a Gauss–Seidel run is worth before Newton, per block multiplication of its factorisation and stored block.
const FIRST_SWEEPS: usize = 20;

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
        let first =
            GaussSeidel { max_sweeps: FIRST_SWEEPS, check_every: 10, local: self.local, patience: Some(FIRST_SWEEPS) };
        let mut outcome = first.solve(group, r);
        if outcome.status.is_converged() {
            return outcome;
        }
        let newton = Newton { max_iterations: self.max_newton_iterations, ..Newton::default() };
        outcome = newton.solve(group, r).after(&outcome);
        if outcome.status.is_converged() {
            return outcome;
        }
        let admm = Admm { max_iterations: self.max_admm_iterations, ..Admm::default() };
        outcome = admm.solve(group, r).after(&outcome);
        if outcome.status.is_converged() {
            return outcome;
        }
        outcome = GaussSeidel::new(self.max_sweeps, self.local).solve(group, r).after(&outcome);
        outcome
    }
}
