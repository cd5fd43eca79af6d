//! Alternating directions with one reused factorisation of `W + ρ`, De Saxcé's shift updated on the way.
//!
//! Splits `r = z`, `z` in the cone: `(W' + ρ) r = ρ (z − w) − q' − s e_N`, `z = P_K(r + w)`, `w += r − z`, with De Saxcé's shift
//! `s = ν‖u_T‖`. All state is in `v = r + w`: `z = P_K(v)`, `w = v − z`, and `u_T = −ρ w_T` where it rests. One iteration is therefore
//! a map of `v`, over-relaxed, and its last iterates are combined (Anderson): where states no longer change the map is nearly
//! affine, and plain iterations would crawl. `ρ` follows the balance of primal and dual residuals, each change costing one factorisation.
//! Indifferent to redundancy of contacts.

use super::anderson::Anderson;
use super::block_lu::BlockLu;
use super::group::{BEYOND, Best, Group, GroupOutcome, GroupSolver};
use super::ordering::{Elimination, minimum_degree};
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
    /// How many of the last iterates are combined; 0: none.
    pub window: usize,
    /// Iterations that may pass without a tenth of the residual going.
    pub patience: usize,
    /// Most block multiplications of one factorisation; above it the solver declines at once.
    pub work_limit: usize,
}

impl Default for Admm {
    fn default() -> Self {
        Admm { max_iterations: 3000, relaxation: 1.6, window: 12, patience: 1000, work_limit: 2_000_000_000 }
    }
}

const CHECK_EVERY: usize = 10;
/// Iterations between a combination that moved more than what it was made from, and the next one that is tried.
const REST: usize = 10;

impl GroupSolver for Admm {
    fn name(&self) -> &'static str {
        "admm"
    }

    fn solve(&self, group: &Group<'_>, r: &mut [Vec3]) -> GroupOutcome {
        let best = Best::start(group, r);
        if best.residual <= group.tolerance {
            return GroupOutcome::of(Method::Admm, Status::Converged, best.residual, 0);
        }
        match minimum_degree(group.w, self.work_limit) {
            Some(elimination) => self.solve_ordered(group, &elimination, r),
            None => GroupOutcome::of(Method::Admm, Status::Breakdown, best.residual, 0),
        }
    }
}

impl Admm {
    /// Solves with an elimination order that is at hand.
    pub fn solve_ordered(&self, group: &Group<'_>, elimination: &Elimination, r: &mut [Vec3]) -> GroupOutcome {
        let n = group.len();
        let mut best = Best::start(group, r);
        let finish = |status, best: &Best, i, r: &mut [Vec3]| {
            r.copy_from_slice(&best.r);
            GroupOutcome::of(Method::Admm, status, best.residual, i)
        };
        if best.residual <= group.tolerance {
            return finish(Status::Converged, &best, 0, r);
        }
        let mut lu = BlockLu::new(elimination);
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
        // v = z + w, with the dual started at the velocity of the first guess
        let mut v: Vec<Vec3> = order.iter().zip(&d).map(|(k, d)| scale(1.0 / d, &r[*k as usize])).collect();
        let mut u = vec![[0.0; 3]; n];
        w.apply(&v, &q, &mut u);
        for k in 0..n {
            let shift = nu[k].max(0.0) * u[k][1].hypot(u[k][2]);
            v[k] = [v[k][0] - (u[k][0] + shift) / rho, v[k][1] - u[k][1] / rho, v[k][2] - u[k][2] / rho];
        }
        let free: f64 = q.iter().map(norm_squared).sum();
        let mut past = Anderson::new(self.window, vec![1.0; n]);
        // the plain image and its change that the last combination was made from; and how many plain iterations are still due
        let (mut plain, mut plain_change, mut rest) = (vec![[0.0; 3]; n], f64::INFINITY, 0);
        let mut image = vec![[0.0; 3]; n];
        let mut next = vec![[0.0; 3]; n];
        let mut exported = vec![[0.0; 3]; n];
        let mut mark = (best.residual, 0usize);
        let mut next_balance = 30usize;
        for i in 1..=self.max_iterations {
            let z = |k: usize| project_cone(&v[k], nu[k]);
            for k in 0..n {
                let z = z(k);
                for c in 0..3 {
                    image[k][c] = rho * (2.0 * z[c] - v[k][c]) - q[k][c];
                }
                image[k][0] -= nu[k].max(0.0) * rho * (v[k][1] - z[1]).hypot(v[k][2] - z[2]);
            }
            lu.solve(&mut image);
            let (mut primal, mut dual_change, mut size_z, mut size_w) = (0.0, 0.0, 0.0, 0.0);
            for k in 0..n {
                let before = z(k);
                let x = image[k];
                image[k] = [0, 1, 2]
                    .map(|c| self.relaxation * x[c] + (1.0 - self.relaxation) * before[c] + v[k][c] - before[c]);
                let after = project_cone(&image[k], nu[k]);
                for c in 0..3 {
                    primal += (x[c] - after[c]).powi(2);
                    dual_change += (rho * (after[c] - before[c])).powi(2);
                    size_w += (rho * (image[k][c] - after[c])).powi(2);
                }
                size_z += norm_squared(&after);
            }
            // where no motion gives what contacts ask for, combined iterates run away so fast that rounding would hide it
            if size_z > BEYOND * BEYOND * free {
                return finish(Status::Stalled, &best, i, r);
            }
            if i % CHECK_EVERY == 0 || i == self.max_iterations {
                for (p, k) in order.iter().enumerate() {
                    exported[*k as usize] = scale(d[p], &project_cone(&image[p], nu[p]));
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
                } else if i > mark.1 + self.patience {
                    return finish(Status::Stalled, &best, i, r);
                }
            }
            if i == next_balance {
                next_balance = i + (i / 2).max(30);
                let ratio =
                    ((primal / size_z.max(1e-300)) / (dual_change / size_w.max(1e-300)).max(1e-300)).sqrt().sqrt();
                if !(0.4..=2.5).contains(&ratio) && ratio.is_finite() {
                    let new = (rho * ratio.clamp(0.1, 10.0)).clamp(1e-6, 1e4);
                    for (v, nu) in image.iter_mut().zip(&nu) {
                        let z = project_cone(v, *nu);
                        *v = [0, 1, 2].map(|c| z[c] + (v[c] - z[c]) * rho / new);
                    }
                    rho = new;
                    if !factor(rho, &mut lu) {
                        return finish(Status::Breakdown, &best, i, r);
                    }
                    std::mem::swap(&mut v, &mut image);
                    past.restart();
                    (plain_change, rest) = (f64::INFINITY, REST);
                    continue;
                }
            }
            let change = past.change(&v, &image);
            if change > plain_change {
                // worse than what it was made from: back to that
                past.restart();
                (plain_change, rest) = (f64::INFINITY, REST);
                std::mem::swap(&mut v, &mut plain);
                continue;
            }
            if self.window > 0 {
                past.advance(&v, &image, &mut next);
            }
            if self.window > 0 && rest == 0 {
                plain_change = change;
                std::mem::swap(&mut plain, &mut image);
                std::mem::swap(&mut v, &mut next);
            } else {
                rest = rest.saturating_sub(1);
                std::mem::swap(&mut v, &mut image);
            }
        }
        finish(Status::MaxIterations, &best, self.max_iterations, r)
    }
}
