//! Following the path: corrector, predictor, choice of the next `μ`, recovery.

use super::system::System;
use super::{Attempt, Best, BlockLu, Group};
use crate::block::{Vec3, norm_squared};
use crate::solvers::ordering::Elimination;
use numerics::Status;

/// Factors by which `μ` may change in one step, smallest first; those above one step back to where the path is smoother.
const FACTORS: [f64; 13] = [1e-3, 1e-2, 0.05, 0.15, 0.35, 0.6, 0.8, 0.92, 0.98, 1.0, 2.0, 5.0, 20.0];
/// Short damped steps in a row after which `μ` is raised by [`RAISE`]: the path bends too much here to be followed closely.
const SHORT: usize = 2;
/// Factor of that raise.
const RAISE: f64 = 3.0;
/// Iterations without a tenth of progress after which an attempt is given up.
const PATIENCE: usize = 18;

/// Runs one attempt; every iterate is offered to `best`.
pub(super) fn follow(
    group: &Group<'_>,
    elimination: &Elimination,
    lu: &mut BlockLu,
    attempt: &Attempt,
    start: &[Vec3],
    max_iterations: usize,
    best: &mut Best,
) -> (Status, usize) {
    let n = group.len();
    let mut system = System::new(group, elimination, lu, attempt);
    let zero = vec![[0.0; 3]; n];
    let mut r = if attempt.warm { system.import(start) } else { zero.clone() };
    let mut u = zero.clone();
    let mut f = zero.clone();
    let mut by_mu = zero.clone();
    let mut corrector = zero.clone();
    let mut predictor = zero.clone();
    let mut w_corrector = zero.clone();
    let mut w_predictor = zero.clone();
    let mut check = zero.clone();
    let mut exported = zero.clone();
    system.w.apply(&r, &system.q, &mut u);
    let cold = r.iter().all(|v| norm_squared(v) == 0.0);
    let mut mu = if cold {
        1.0
    } else {
        let largest =
            (0..n).map(|p| norm_squared(&system.equation(p, &r[p], &u[p], 0.0))).fold(0.0_f64, f64::max).sqrt();
        largest.clamp(1e-9, 1.0)
    };
    let mut factor = 4usize;
    let mut short_steps = 0;
    let mut mark = (f64::INFINITY, 0usize);
    for iteration in 0..=max_iterations {
        system.w.apply(&r, &system.q, &mut u);
        let residual = system.residual(&r, &u);
        if !residual.is_finite() {
            return (Status::NonFinite, iteration);
        }
        if residual < best.residual {
            system.export(&r, &mut exported);
            // judged again in the problem's own numbers before it counts
            let own = if residual <= 2.0 * group.tolerance { group.residual(&exported) } else { residual };
            best.offer(own, &exported);
            if own <= group.tolerance {
                return (Status::Converged, iteration);
            }
        }
        if residual < 0.9 * mark.0 {
            mark = (residual, iteration);
        } else if iteration > mark.1 + PATIENCE {
            return (Status::Stalled, iteration);
        }
        if iteration == max_iterations {
            break;
        }
        system.hold(&u);
        system.linearise(&r, &u, mu, &mut f, &mut by_mu);
        system.assemble(lu);
        if !lu.factor() {
            return (Status::Breakdown, iteration);
        }
        for p in 0..n {
            corrector[p] = f[p].map(|v| -v);
            predictor[p] = by_mu[p].map(|v| -v);
        }
        lu.solve(&mut corrector);
        lu.solve(&mut predictor);
        system.w.apply(&corrector, &zero, &mut w_corrector);
        // what the factorisation missed (pivots are only chosen inside blocks) is solved for again once
        let norm = total(&f);
        for p in 0..n {
            let jd = system.jacobian_times(p, &corrector[p], &w_corrector[p]);
            check[p] = [0, 1, 2].map(|i| -f[p][i] - jd[i]);
        }
        let missed = total(&check);
        if missed > 1e-6 * norm {
            lu.solve(&mut check);
            for p in 0..n {
                for i in 0..3 {
                    corrector[p][i] += check[p][i];
                }
            }
            system.w.apply(&corrector, &zero, &mut w_corrector);
        }
        system.w.apply(&predictor, &zero, &mut w_predictor);
        let trial = |alpha: f64, beta: f64, mu: f64| -> (f64, f64) {
            let (mut sum, mut largest) = (0.0, 0.0_f64);
            for p in 0..n {
                let rt = [0, 1, 2].map(|i| r[p][i] + alpha * corrector[p][i] + beta * predictor[p][i]);
                let ut = [0, 1, 2].map(|i| u[p][i] + alpha * w_corrector[p][i] + beta * w_predictor[p][i]);
                let e = norm_squared(&system.equation(p, &rt, &ut, mu));
                sum += e;
                largest = largest.max(e);
            }
            if sum.is_finite() { (sum.sqrt(), largest.sqrt()) } else { (f64::INFINITY, f64::INFINITY) }
        };
        let inside = |index: usize| -> bool {
            let next = mu * FACTORS[index];
            let (sum, largest) = trial(1.0, next * next - mu * mu, next);
            if attempt.by_largest {
                largest <= attempt.neighbourhood * next
            } else {
                sum <= attempt.neighbourhood * next * (n as f64).sqrt()
            }
        };
        // the smallest factor whose full step stays near the path, searched from the last one taken
        let mut chosen = None;
        if inside(factor) {
            let mut i = factor;
            while i > 0 && inside(i - 1) {
                i -= 1;
            }
            chosen = Some(i);
        } else {
            for i in factor + 1..FACTORS.len() {
                if inside(i) {
                    chosen = Some(i);
                    break;
                }
            }
        }
        if let Some(i) = chosen {
            let next = mu * FACTORS[i];
            let beta = next * next - mu * mu;
            for p in 0..n {
                for c in 0..3 {
                    r[p][c] += corrector[p][c] + beta * predictor[p][c];
                }
            }
            mu = next;
            factor = i.min(8);
            short_steps = 0;
            continue;
        }
        // nothing stays near the path: damped corrector at the present μ
        let mut alpha = 1.0;
        for _ in 0..14 {
            if trial(alpha, 0.0, mu).0 <= (1.0 - 1e-4 * alpha) * norm {
                break;
            }
            alpha *= 0.5;
        }
        for p in 0..n {
            for c in 0..3 {
                r[p][c] += alpha * corrector[p][c];
            }
        }
        short_steps = if alpha < 0.3 { short_steps + 1 } else { 0 };
        if alpha < 1e-3 || short_steps >= SHORT {
            mu *= RAISE;
            short_steps = 0;
        }
    }
    (Status::MaxIterations, max_iterations)
}

fn total(v: &[Vec3]) -> f64 {
    v.iter().map(norm_squared).sum::<f64>().sqrt()
}
