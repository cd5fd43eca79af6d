//! Which method goes first and when it hands over, decided by measured progress, not by the clock: the same problem
//! always takes the same way.

use super::admm::Admm;
use super::gauss_seidel::GaussSeidel;
use super::group::{Best, Group, GroupOutcome, GroupSolver};
use super::newton::{ATTEMPTS, Attempt, Newton};
use super::ordering::{Elimination, minimum_degree};
use super::part::{Part, places};
use super::patches::mend;
use crate::block::{Vec3, norm_squared};
use crate::local::{LocalContact, LocalMethod};
use crate::problem::Component;
use crate::report::Method;
use numerics::Status;
use rayon::prelude::*;

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

/// Factorisations that a Newton solve takes as a rule: about fifteen where all goes well, up to sixty where states are many.
const NEWTON_FACTORS: usize = 20;

/// What all factorisations of a group may cost, in all the sweeps that are allowed: large groups that cannot be solved would otherwise be
/// factorised a thousand times. At least two ordinary solves are always tried.
const NEWTON_SWEEPS: usize = 4;

/// Cost of a local solve in block-vector products.
const LOCAL_SOLVE: usize = 30;

/// Sweeps below which a second run of them is not worth its start.
const LEAST_SWEEPS: usize = 100;

/// Rounds in which contacts that close join those that are solved for.
const ROUNDS: usize = 12;

/// Sweeps between two looks at what has opened, while a tenth of the contacts leaves each time.
const SHORT_RUN: usize = 100;
const STILL_THINNING_TENTHS: usize = 9;

/// Share of a group that must be closed for the open ones to be carried along, in tenths.
const WORTH_LEAVING_TENTHS: usize = 8;

/// Contacts that one task looks at to see whether they close.
const LOOK: usize = 256;

/// Sweeps after a first Newton attempt that ended short of the tolerance but this much nearer to it.
const FINISHING_SWEEPS: usize = 200;
const MUCH_NEARER: f64 = 0.1;

/// Sweeps that are combined in long runs.
const WINDOW: usize = 8;

/// How often sweeps that are to find who stays closed go over contacts that feel each other most, and what such a sweep costs in
/// plain ones: where neighbours on a strand share a load, it takes less than half as many. In small groups there is nothing to gain.
const INNER: usize = 2;
const INNER_COST: usize = 2;
const WORTH_CLUSTERING: usize = 500;

/// How often long runs of sweeps over so many contacts go over each cluster.
fn inner(contacts: usize) -> usize {
    if contacts >= WORTH_CLUSTERING { INNER } else { 1 }
}

/// Turns of the last resort, and what a turn must gain for another one.
const TURNS: usize = 6;
const MOVES: f64 = 0.95;

/// Iterations of alternating directions that may pass without progress where it is one of many turns.
const SHORT_PATIENCE: usize = 300;

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
            inner: 1,
        };
        let mut outcome = first.solve(group, r);
        if outcome.status.is_converged() {
            return outcome;
        }
        if let Some(reduced) = self.without_open(group, r) {
            outcome = reduced.after(&outcome);
            // where the closed contacts alone could not be solved, open ones beside them will not help
            if outcome.status != Status::Stalled {
                return outcome;
            }
        }
        self.whole(group, r, TURNS).after(&outcome)
    }
}

impl Auto {
    /// Solves for the contacts alone that carry an impulse or close, and looks again at the others: what closes by the
    /// answer joins. Exact as soon as nothing closes any more; `None` where too few are open to be worth it.
    ///
    /// In bundles nine contacts of ten are open in the end, and a factorisation or a sweep need not carry them. The first
    /// sweeps press more of them than stay pressed, so what has opened leaves again between short runs of sweeps.
    fn without_open(&self, group: &Group<'_>, r: &mut [Vec3]) -> Option<GroupOutcome> {
        let n = group.len();
        let mut best = Best::start(group, r);
        let weight = |k: usize| group.scaling.weight(group.w, k);
        let free: f64 = (0..n).map(|k| weight(k).powi(2) * norm_squared(&group.q[k])).sum();
        let size_floor = group.size_floor.max(free.sqrt());
        let mut taken = vec![false; n];
        let mut members: Vec<u32> = Vec::new();
        let mut outcome: Option<GroupOutcome> = None;
        let mut thinning = true;
        for round in 0..ROUNDS {
            let before = if round == 0 { n } else { members.len() };
            let seen = &*r;
            taken.par_iter_mut().enumerate().with_min_len(LOOK).for_each(|(k, taken)| {
                let closes = || group.w.row_product_sparse(k, seen)[0] + group.q[k][0] < 0.0;
                // a bilateral contact is never open; one that closes or pulls together is not either
                let now = group.friction[k] < 0.0 || seen[k] != [0.0; 3] || closes();
                *taken = now || *taken && !thinning;
            });
            let last = std::mem::take(&mut members);
            members.extend((0..n as u32).filter(|k| taken[*k as usize]));
            // where nothing is pressed and nothing closes there is nothing to solve apart
            if members.is_empty() || !thinning && members == last || 10 * members.len() > WORTH_LEAVING_TENTHS * n {
                break;
            }
            thinning = thinning && 10 * members.len() < STILL_THINNING_TENTHS * before;
            let taken_out = Component { contacts: members.clone() };
            let position = places(&taken_out, n);
            let mut part = Part::take(&taken_out, &position, group.w, group.q, group.friction, r);
            let answer = part.solve(group.scaling, group.tolerance, size_floor, |small, x| {
                if !thinning {
                    return self.whole(small, x, TURNS);
                }
                let short = GaussSeidel {
                    max_sweeps: SHORT_RUN.min(self.max_sweeps),
                    check_every: 10,
                    local: self.local,
                    patience: None,
                    window: WINDOW,
                    inner: inner(small.len()),
                };
                short.solve(small, x)
            });
            part.put_back(r);
            let residual = group.residual(r);
            best.offer(residual, r);
            let status = if residual <= group.tolerance {
                Status::Converged
            } else if answer.status.is_converged() || thinning || answer.residual <= MUCH_NEARER * residual {
                // solved, or nearly, but others close now; or to be thinned out further
                Status::Stalled
            } else if answer.status == Status::Stalled {
                Status::MaxIterations
            } else {
                answer.status
            };
            let answer = GroupOutcome { status, residual, ..answer };
            let answer = match &outcome {
                Some(earlier) => answer.after(earlier),
                None => answer,
            };
            outcome = Some(answer);
            if status != Status::Stalled {
                break;
            }
        }
        r.copy_from_slice(&best.r);
        outcome.map(|o| GroupOutcome { residual: best.residual, ..o })
    }

    /// Goes over the patches that hold most of what is left.
    fn mended(&self, group: &Group<'_>, r: &mut [Vec3], outcome: GroupOutcome) -> GroupOutcome {
        let Some(mended) = mend(group, r, |patch, x| self.whole(patch, x, 0)) else { return outcome };
        let status = if mended.residual <= group.tolerance { Status::Converged } else { Status::Stalled };
        GroupOutcome { status, ..mended.after(&outcome) }
    }

    /// All methods in turn on the whole group.
    fn whole(&self, group: &Group<'_>, r: &mut [Vec3], turns: usize) -> GroupOutcome {
        let mut outcome = GroupOutcome::of(Method::GaussSeidel, Status::Stalled, group.residual(r), 0);
        // what one Newton solve costs, counted in sweeps, decides how long sweeps are worth trying
        let elimination = minimum_degree(group.w, NEWTON_PRODUCTS);
        let products = elimination.as_ref().map_or(NEWTON_PRODUCTS, |e| e.block_products);
        let sweep = group.w.block_count() + LOCAL_SOLVE * group.len();
        let inner = inner(group.len());
        let worth = NEWTON_FACTORS * products * 3 / (sweep * if inner > 1 { INNER_COST } else { 1 });
        let mut budget =
            NEWTON_SWEEPS.saturating_mul(self.max_sweeps).saturating_mul(sweep).max(2 * NEWTON_FACTORS * products);
        let mut by_newton = |attempts: &[Attempt], elimination: &Elimination, r: &mut [Vec3]| {
            let max_iterations = self.max_newton_iterations;
            let newton = Newton { max_iterations, attempts, most_products: budget, ..Newton::default() };
            let outcome = newton.solve_ordered(group, elimination, r);
            let taken = outcome.iterations[Method::Newton as usize].unwrap_or(0);
            budget = budget.saturating_sub(taken.saturating_mul(products));
            outcome
        };
        let admm = Admm { max_iterations: self.max_admm_iterations, ..Admm::default() };
        if worth >= LEAST_SWEEPS {
            let long = GaussSeidel {
                max_sweeps: worth.min(self.max_sweeps),
                check_every: 10,
                local: self.local,
                patience: Some(worth.min(self.max_sweeps)),
                window: WINDOW,
                inner,
            };
            outcome = long.solve(group, r).after(&outcome);
            if outcome.status.is_converged() {
                return outcome;
            }
        }
        if let Some(elimination) = &elimination {
            let before = outcome.residual;
            let (first, others) = ATTEMPTS.split_at(1);
            let (second, others) = others.split_at(1);
            outcome = by_newton(first, elimination, r).after(&outcome);
            // where contacts ask for what no motion gives, impulses grow without end, and so does the search
            if outcome.status.is_converged() || group.runs_away(r) {
                return outcome;
            }
            // where contacts are redundant Newton finds who sticks and slides, and then may creep towards the tolerance;
            // sweeps that crawled before are quick from there
            if outcome.residual <= MUCH_NEARER * before {
                let finish = GaussSeidel {
                    max_sweeps: FINISHING_SWEEPS.min(self.max_sweeps),
                    check_every: 10,
                    local: self.local,
                    patience: Some(FINISHING_SWEEPS),
                    window: WINDOW,
                    inner: 1,
                };
                outcome = finish.solve(group, r).after(&outcome);
                if outcome.status.is_converged() {
                    return outcome;
                }
            }
            outcome = by_newton(second, elimination, r).after(&outcome);
            if outcome.status.is_converged() || group.runs_away(r) {
                return outcome;
            }
            outcome = admm.solve_ordered(group, elimination, r).after(&outcome);
            if outcome.status.is_converged() || group.runs_away(r) {
                return outcome;
            }
            if turns > 0 {
                outcome = self.mended(group, r, outcome);
                if outcome.status.is_converged() {
                    return outcome;
                }
            }
            outcome = by_newton(others, elimination, r).after(&outcome);
            if outcome.status.is_converged() || group.runs_away(r) {
                return outcome;
            }
        }
        // from nothing, without combining: another way altogether
        let mut cold = vec![[0.0; 3]; group.len()];
        let plain = Admm { window: 0, ..admm };
        let other = match &elimination {
            Some(elimination) => plain.solve_ordered(group, elimination, &mut cold),
            None => plain.solve(group, &mut cold),
        };
        let residual = other.residual.min(outcome.residual);
        if other.residual < outcome.residual {
            r.copy_from_slice(&cold);
        }
        outcome = GroupOutcome { residual, ..other }.after(&outcome);
        if outcome.status.is_converged() || group.runs_away(r) {
            return outcome;
        }
        // turns of sweeps and Newton from where they lead: each moves on where the other is stuck
        let turn = GaussSeidel {
            max_sweeps: self.max_sweeps / TURNS,
            check_every: 25,
            local: self.local,
            patience: None,
            window: WINDOW,
            inner: 1,
        };
        for _ in 0..turns {
            let at_first = outcome.residual;
            outcome = turn.solve(group, r).after(&outcome);
            if outcome.status.is_converged() {
                return outcome;
            }
            outcome = self.mended(group, r, outcome);
            if outcome.status.is_converged() {
                return outcome;
            }
            if let Some(elimination) = &elimination {
                outcome =
                    Admm { patience: SHORT_PATIENCE, ..admm }.solve_ordered(group, elimination, r).after(&outcome);
                if outcome.status.is_converged() {
                    return outcome;
                }
                outcome = by_newton(&WARM, elimination, r).after(&outcome);
                if outcome.status.is_converged() {
                    return outcome;
                }
            }
            if outcome.residual > MOVES * at_first {
                break;
            }
        }
        outcome
    }
}
