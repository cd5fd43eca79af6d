//! Block Gauss–Seidel: each contact in turn is solved exactly with the others held.
//!
//! Sweeps in fixed order, so the result is the same on any machine and thread count. Converges fast where contacts are
//! few per body, crawls where they are redundant (a capsule lying on its side): then [`super::auto`] hands over.
//! Long chains of contacts are sped up by Anderson acceleration, which is dropped wherever it does not reduce the change.

use super::anderson::Anderson;
use super::clusters::Clusters;
use super::group::{Best, Group, GroupOutcome, GroupSolver};
use crate::block::Vec3;
use crate::law::{natural_map, project_cone};
use crate::local::{LocalContact, LocalMethod};
use crate::problem::residual::ResidualParts;
use crate::report::Method;
use numerics::Status;

/// Block Gauss–Seidel with its limits.
#[derive(Clone, Copy, Debug)]
pub struct GaussSeidel {
    /// Most sweeps.
    pub max_sweeps: usize,
    /// Sweeps between two looks at the residual.
    pub check_every: usize,
    /// Local solver.
    pub local: LocalMethod,
    /// Give up when the residual at the present rate would need more than this many further sweeps; `None`: never.
    pub patience: Option<usize>,
    /// Sweeps whose outcome is combined (Anderson acceleration); 0: none.
    pub window: usize,
    /// How often a sweep goes over contacts that feel each other most before it goes on; 1: once.
    pub inner: usize,
}

/// Looks at the residual between two judgements of the progress of accelerated sweeps.
const LOOKS: usize = 10;

/// Growth of the change of a sweep, relative to the smallest since the last restart, that ends an acceleration.
const GROWTH: f64 = 2.0;

/// Residual of a local solve from which on its answer is taken whole.
const LOCAL: f64 = 1e-9;

/// Residual asked of local solves, as a share of the tolerance of the group, and the least of it: digits that the sweeps around
/// it do not have are not worth a fall-back.
const LOCAL_SHARE: f64 = 1e-4;
const LEAST_LOCAL: f64 = 1e-12;

/// Coupling from which on contacts are taken together, in parts of what each feels of itself, and the most of them.
const FELT: f64 = 0.1;
const MOST: usize = 32;

impl GaussSeidel {
    /// A run of at most `max_sweeps` sweeps that never gives up before.
    #[must_use]
    pub fn new(max_sweeps: usize, local: LocalMethod) -> Self {
        GaussSeidel { max_sweeps, check_every: 10, local, patience: None, window: 0, inner: 1 }
    }
}

impl GroupSolver for GaussSeidel {
    fn name(&self) -> &'static str {
        "gauss_seidel"
    }

    fn solve(&self, group: &Group<'_>, r: &mut [Vec3]) -> GroupOutcome {
        let n = group.len();
        let mut best = Best::start(group, r);
        let done = |status, best: &Best, sweeps, r: &mut [Vec3]| {
            r.copy_from_slice(&best.r);
            GroupOutcome::of(Method::GaussSeidel, status, best.residual, sweeps)
        };
        if best.residual <= group.tolerance {
            return done(Status::Converged, &best, 0, r);
        }
        let locals: Vec<LocalContact> =
            (0..n).map(|k| LocalContact::new(group.w.diagonal(k), group.friction[k])).collect();
        let weights: Vec<f64> = (0..n).map(|k| group.scaling.weight(group.w, k)).collect();
        let clusters = (self.inner > 1).then(|| Clusters::new(group.w, FELT, MOST));
        let mut sweeps = 0;
        let mut last_check = best.residual;
        // accelerated sweeps rise and fall: their progress is that of the best over this many looks
        let mut mark = (0, best.residual);
        let mut past = Past::new(self.window, group);
        while sweeps < self.max_sweeps {
            let batch = self.check_every.clamp(1, self.max_sweeps - sweeps);
            for i in 0..batch {
                past.combine(group.friction, r);
                let estimate = match &clusters {
                    Some(clusters) => sweep_clusters(group, clusters, &locals, &weights, self.local, self.inner, r),
                    None => sweep(group, &locals, &weights, self.local, r),
                };
                sweeps += 1;
                // the residual gathered while sweeping lags by one update a contact: a cheap reason to look early
                if group.relative(&estimate) <= 0.7 * group.tolerance && i + 1 < batch {
                    break;
                }
            }
            let residual = group.residual(r);
            if !residual.is_finite() {
                return done(Status::NonFinite, &best, sweeps, r);
            }
            best.offer(residual, r);
            if residual <= group.tolerance {
                return done(Status::Converged, &best, sweeps, r);
            }
            if let Some(patience) = self.patience {
                let (since, before, now) = if self.window > 0 {
                    (sweeps - mark.0, mark.1, best.residual)
                } else {
                    (batch, last_check, residual)
                };
                if since >= batch * if self.window > 0 { LOOKS } else { 1 } {
                    let rate = (now / before).powf(1.0 / since as f64);
                    let needed = (group.tolerance / now).ln() / rate.ln();
                    if !(rate < 1.0 && needed <= patience as f64) {
                        return done(Status::Stalled, &best, sweeps, r);
                    }
                    mark = (sweeps, best.residual);
                }
            }
            last_check = residual;
        }
        done(Status::MaxIterations, &best, sweeps, r)
    }
}

/// The sweeps so far, as acceleration needs them.
struct Past {
    anderson: Option<Anderson>,
    /// Impulses before the last sweep; empty before the first.
    before: Vec<Vec3>,
    /// Smallest change of a sweep since the last restart.
    smallest: f64,
}

impl Past {
    fn new(window: usize, group: &Group<'_>) -> Past {
        let weight = |k| crate::block::trace(group.w.diagonal(k)) / 3.0;
        let anderson = (window > 0).then(|| Anderson::new(window, (0..group.len()).map(weight).collect()));
        Past { anderson, before: Vec::new(), smallest: f64::INFINITY }
    }

    /// Before a sweep: replaces what the last one gave by the combination of the last ones, on the cones.
    fn combine(&mut self, friction: &[f64], r: &mut [Vec3]) {
        let Some(anderson) = &mut self.anderson else { return };
        if self.before.is_empty() {
            self.before.extend_from_slice(r);
            return;
        }
        let change = anderson.change(&self.before, r);
        if change > GROWTH * self.smallest {
            anderson.restart();
            self.smallest = change;
            self.before.copy_from_slice(r);
            return;
        }
        self.smallest = self.smallest.min(change);
        let swept = r.to_vec();
        anderson.advance(&self.before, &swept, r);
        for (r, nu) in r.iter_mut().zip(friction) {
            if *nu >= 0.0 {
                *r = project_cone(r, *nu);
            }
        }
        self.before.copy_from_slice(r);
    }
}

/// One sweep over all contacts; returns the residual each contact had when it was visited.
fn sweep(
    group: &Group<'_>,
    locals: &[LocalContact],
    weights: &[f64],
    method: LocalMethod,
    r: &mut [Vec3],
) -> ResidualParts {
    let mut parts = ResidualParts::default();
    let accept = (LOCAL_SHARE * group.tolerance).clamp(LEAST_LOCAL, LOCAL);
    for k in 0..group.len() {
        let u = visit(group, k, weights[k], r, &mut parts);
        r[k] = solve_one(&locals[k], &u, &r[k], method, accept);
    }
    parts
}

/// Velocity of a contact with the present impulses; what it adds to the residual is gathered.
#[inline]
fn visit(group: &Group<'_>, k: usize, weight: f64, r: &[Vec3], parts: &mut ResidualParts) -> Vec3 {
    let mut u = group.w.row_product_sparse(k, r);
    for i in 0..3 {
        u[i] += group.q[k][i];
    }
    parts.add(&r[k], &u, &group.q[k], group.friction[k], weight);
    u
}

/// The impulse of one contact whose velocity is `u` with its present one `old`.
#[inline]
fn solve_one(local: &LocalContact, u: &Vec3, old: &Vec3, method: LocalMethod, accept: f64) -> Vec3 {
    let own = crate::block::mat_vec(&local.block, old);
    let b = [u[0] - own[0], u[1] - own[1], u[2] - own[2]];
    let answer = local.solve_to(&b, old, method, accept);
    if answer.residual <= LOCAL {
        return answer.impulse;
    }
    if answer.residual.is_finite() {
        // the local solve missed its tolerance (a nearly singular block): half the update, if it helps at all
        let map = natural_map(old, u, local.friction, local.rho);
        if crate::block::norm_squared(&map) > 0.0 {
            return [0, 1, 2].map(|i| 0.5 * (old[i] + answer.impulse[i]));
        }
    }
    *old
}

/// One sweep over all clusters, each gone over several times.
fn sweep_clusters(
    group: &Group<'_>,
    clusters: &Clusters,
    locals: &[LocalContact],
    weights: &[f64],
    method: LocalMethod,
    inner: usize,
    r: &mut [Vec3],
) -> ResidualParts {
    let mut parts = ResidualParts::default();
    let accept = (LOCAL_SHARE * group.tolerance).clamp(LEAST_LOCAL, LOCAL);
    let mut outside: Vec<Vec3> = Vec::new();
    for c in 0..clusters.count() {
        let members = clusters.members(c);
        outside.clear();
        for (place, k) in members.iter().enumerate() {
            let k = *k as usize;
            let u = visit(group, k, weights[k], r, &mut parts);
            if members.len() > 1 {
                let inside = clusters.inner_product(c, place, r);
                outside.push([u[0] - inside[0], u[1] - inside[1], u[2] - inside[2]]);
            }
            r[k] = solve_one(&locals[k], &u, &r[k], method, accept);
        }
        if members.len() == 1 {
            continue;
        }
        for _ in 1..inner {
            for (place, k) in members.iter().enumerate() {
                let k = *k as usize;
                let inside = clusters.inner_product(c, place, r);
                let u = [0, 1, 2].map(|i| outside[place][i] + inside[i]);
                if r[k] == [0.0; 3] && u[0] >= 0.0 {
                    continue;
                }
                r[k] = solve_one(&locals[k], &u, &r[k], method, accept);
            }
        }
    }
    parts
}
