//! Block Gauss–Seidel: each contact in turn is solved exactly with the others held.
//!
//! Sweeps in fixed order ([`super::sweep`]), so the result is the same on any machine and thread count. Converges fast where contacts are
//! few per body, crawls where they are redundant (a capsule lying on its side): then [`super::auto`] hands over.
//! Long chains of contacts are sped up by Anderson acceleration, which is dropped wherever it does not reduce the change.

use super::anderson::Anderson;
use super::group::{Best, Group, GroupOutcome, GroupSolver};
use super::sweep::Sweeps;
use crate::block::Vec3;
use crate::law::project_cone;
use crate::local::LocalMethod;
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
        let mut best = Best::start(group, r);
        let done = |status, best: &Best, sweeps, r: &mut [Vec3]| {
            r.copy_from_slice(&best.r);
            GroupOutcome::of(Method::GaussSeidel, status, best.residual, sweeps)
        };
        if best.residual <= group.tolerance {
            return done(Status::Converged, &best, 0, r);
        }
        let mut swept = Sweeps::new(group, self.local, self.inner);
        let mut sweeps = 0;
        let mut last_check = best.residual;
        // accelerated sweeps rise and fall: their progress is that of the best over this many looks
        let mut mark = (0, best.residual);
        let mut past = Past::new(self.window, group);
        while sweeps < self.max_sweeps {
            let batch = self.check_every.clamp(1, self.max_sweeps - sweeps);
            for i in 0..batch {
                past.combine(group.friction, r);
                let estimate = swept.sweep(r);
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
