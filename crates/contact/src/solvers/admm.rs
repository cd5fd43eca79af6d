//! Alternating directions with one reused factorisation of `W + ρ`, De Saxcé's shift updated on the way.
//!
//! Splits `r = z`, `z` in the cone: `(W' + ρ) r = ρ (z − w) − q' − s e_N`, `z = P_K(r + w)`, `w += r − z`, with the shift
//! `s = ν‖u_T‖` taken from the last velocity. Over-relaxed; `ρ` follows the balance of primal and dual residuals, each
//! change costing one factorisation. Indifferent to redundancy of contacts, slow to the last digits.

use super::block_lu::BlockLu;
use super::group::{Best, Group, GroupOutcome, GroupSolver};
use super::ordering::minimum_degree;
use crate::block::{Vec3, norm_squared, scale, trace};
use crate::law::project_cone;
use crate::problem::BlockMatrix;
use crate::report::Method;
use numerics::Status;

/// The alternating-direction solver with its limits.
#[derive(Clone, Copy, Debug)]
pub struct Admm {
    /// Most iterations.
    pub max_iterations: usize,
    /// Over-relaxation, 1 … 1.9.
    pub relaxation: f64,
    /// Most block multiplications of one factorisation; above it the solver declines at once.
    pub work_limit: usize,
}

impl Default for Admm {
    fn default() -> Self {
        Admm { max_iterations: 3000, relaxation: 1.6, work_limit: 2_000_000_000 }
    }
}

const CHECK_EVERY: usize = 10;
const PATIENCE: usize = 1000;

impl GroupSolver for Admm {
    fn name(&self) -> &'static str {
        "admm"
    }

    fn solve(&self, group: &Group<'_>, r: &mut [Vec3]) -> GroupOutcome {
        let n = group.len();
        let mut best = Best::start(group, r);
        let finish = |status, best: &Best, i, r: &mut [Vec3]| {
            r.copy_from_slice(&best.r);
            GroupOutcome::of(Method::Admm, status, best.residual, i)
        };
        if best.residual <= group.tolerance {
            return finish(Status::Converged, &best, 0, r);
        }
        let Some(elimination) = minimum_degree(group.w, self.work_limit) else {
            return finish(Status::Breakdown, &best, 0, r);
        };
        let mut lu = BlockLu::new(&elimination);
        let order = &elimination.order;
        // scaled per contact: r = d r', u = u'/d, mean diagonal one
        let mean = group.w.mean_diagonal();
        let d: Vec<f64> = order
            .iter()
            .map(|k| {
                let own = trace(group.w.diagonal(*k as usize)) / 3.0;
                1.0 / (if own > 1e-14 * mean { own } else { mean.max(f64::MIN_POSITIVE) }).sqrt()
            })
            .collect();
        let mut triplets = Vec::with_capacity(group.w.block_count());
        for (i, j, b) in group.w.iter() {
            let (pi, pj) = (elimination.place[i] as usize, elimination.place[j] as usize);
            triplets.push((pi as u32, pj as u32, b.map(|v| v * d[pi] * d[pj])));
        }
        let w = BlockMatrix::from_triplets(n, &triplets);
        let q: Vec<Vec3> = order.iter().zip(&d).map(|(k, d)| scale(*d, &group.q[*k as usize])).collect();
        let nu: Vec<f64> = order.iter().map(|k| group.friction[*k as usize]).collect();
        let factor = |rho: f64, lu: &mut BlockLu| {
            lu.clear();
            for (i, j, b) in w.iter() {
                let mut b = *b;
                if i == j {
                    for c in 0..3 {
                        b[4 * c] += rho;
                    }
                }
                if let Some(s) = lu.slot(i, j) {
                    lu.values_mut()[s] = b;
                }
            }
            lu.factor()
        };
        let mut rho = 0.3;
        if !factor(rho, &mut lu) {
            return finish(Status::Breakdown, &best, 0, r);
        }
        let mut z: Vec<Vec3> = order.iter().zip(&d).map(|(k, d)| scale(1.0 / d, &r[*k as usize])).collect();
        // scaled dual, started at the velocity of the first guess
        let mut dual: Vec<Vec3> = vec![[0.0; 3]; n];
        let mut slip = vec![0.0; n];
        let mut u = vec![[0.0; 3]; n];
        w.apply(&z, &q, &mut u);
        for k in 0..n {
            let t = u[k][1].hypot(u[k][2]);
            slip[k] = nu[k].max(0.0) * t;
            dual[k] = scale(-1.0 / rho, &[u[k][0] + slip[k], u[k][1], u[k][2]]);
        }
        let mut x = vec![[0.0; 3]; n];
        let mut exported = vec![[0.0; 3]; n];
        let mut mark = (best.residual, 0usize);
        let mut next_balance = 30usize;
        for i in 1..=self.max_iterations {
            for k in 0..n {
                for c in 0..3 {
                    x[k][c] = rho * (z[k][c] - dual[k][c]) - q[k][c];
                }
                x[k][0] -= slip[k];
            }
            lu.solve(&mut x);
            let (mut primal, mut dual_change, mut size_z, mut size_w) = (0.0, 0.0, 0.0, 0.0);
            for k in 0..n {
                // u_T = −ρ (x − z + w)_T exactly, from the first-order condition
                let before = z[k];
                let v = [0, 1, 2].map(|c| -rho * (x[k][c] - before[c] + dual[k][c]));
                slip[k] = nu[k].max(0.0) * v[1].hypot(v[2]);
                let relaxed = [0, 1, 2].map(|c| self.relaxation * x[k][c] + (1.0 - self.relaxation) * before[c]);
                let target = [0, 1, 2].map(|c| relaxed[c] + dual[k][c]);
                z[k] = project_cone(&target, nu[k]);
                for c in 0..3 {
                    dual[k][c] = target[c] - z[k][c];
                    primal += (x[k][c] - z[k][c]).powi(2);
                    dual_change += (rho * (z[k][c] - before[c])).powi(2);
                }
                size_z += norm_squared(&z[k]);
                size_w += rho * rho * norm_squared(&dual[k]);
            }
            if i % CHECK_EVERY == 0 || i == self.max_iterations {
                for (p, k) in order.iter().enumerate() {
                    exported[*k as usize] = scale(d[p], &z[p]);
                }
                let residual = group.residual(&exported);
                if !residual.is_finite() {
                    return finish(Status::NonFinite, &best, i, r);
                }
                best.offer(residual, &exported);
                if residual <= group.tolerance {
                    return finish(Status::Converged, &best, i, r);
                }
                if residual < 0.9 * mark.0 {
                    mark = (residual, i);
                } else if i > mark.1 + PATIENCE {
                    return finish(Status::Stalled, &best, i, r);
                }
            }
            if i == next_balance {
                next_balance = i + (i / 2).max(30);
                let ratio =
                    ((primal / size_z.max(1e-300)) / (dual_change / size_w.max(1e-300)).max(1e-300)).sqrt().sqrt();
                if !(0.4..=2.5).contains(&ratio) && ratio.is_finite() {
                    let new = (rho * ratio.clamp(0.1, 10.0)).clamp(1e-6, 1e4);
                    for w in &mut dual {
                        *w = scale(rho / new, w);
                    }
                    rho = new;
                    if !factor(rho, &mut lu) {
                        return finish(Status::Breakdown, &best, i, r);
                    }
                }
            }
        }
        finish(Status::MaxIterations, &best, self.max_iterations, r)
    }
}
