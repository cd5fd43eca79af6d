//! Robust Levenberg–Marquardt on the logarithm of the stress.

use nalgebra::{Matrix3, Vector3};

/// Result of a minimisation. Parameters are `(τ_s, ln K, n)`.
pub(super) struct Minimum {
    pub parameters: [f64; 3],
    pub standard_error: [f64; 3],
    /// Root mean square of the unweighted residuals.
    pub rms: f64,
    /// Sum of the robust losses (twice Huber's; squares without it).
    pub cost: f64,
    pub weights: Vec<f64>,
    pub iterations: usize,
    pub converged: bool,
}

/// Huber's constant: 95 % efficient on normal errors.
const HUBER: f64 = 1.345;
/// Bounds of the index.
const INDEX: (f64, f64) = (0.02, 6.0);

struct Problem<'a> {
    ln_rates: Vec<f64>,
    ln_stresses: Vec<f64>,
    stresses: &'a [f64],
    free: [bool; 3],
    max_yield: f64,
}

impl Problem<'_> {
    fn residual(&self, p: &Vector3<f64>, i: usize) -> f64 {
        self.ln_stresses[i] - (p[0] + (p[1] + p[2] * self.ln_rates[i]).exp()).ln()
    }

    /// Gradient of `ln σ_model` by the parameters, zero for fixed ones.
    fn gradient(&self, p: &Vector3<f64>, i: usize) -> Vector3<f64> {
        let flow = (p[1] + p[2] * self.ln_rates[i]).exp();
        let model = p[0] + flow;
        let all = Vector3::new(1.0 / model, flow / model, flow * self.ln_rates[i] / model);
        Vector3::from_fn(|k, _| if self.free[k] { all[k] } else { 0.0 })
    }

    fn weighted(&self, p: &Vector3<f64>, weights: &[f64]) -> f64 {
        (0..weights.len()).map(|i| weights[i] * self.residual(p, i).powi(2)).sum()
    }

    /// Best of a scan over the index; for each, `τ_s` and `K` by linear least squares of relative errors, not negative.
    fn start(&self) -> Vector3<f64> {
        let mut best = (f64::INFINITY, Vector3::new(0.0, 0.0, 1.0));
        let ones = vec![1.0; self.stresses.len()];
        for step in 0..120 {
            let n = if self.free[2] { 0.05 * (3.0f64 / 0.05).powf(f64::from(step) / 119.0) } else { 1.0 };
            // scaled power so that wide ranges of rate do not overflow
            let shift = self.ln_rates.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let (mut aa, mut ab, mut bb, mut ay, mut by) = (0.0, 0.0, 0.0, 0.0, 0.0);
            for i in 0..self.stresses.len() {
                let (a, b) = (1.0 / self.stresses[i], (n * (self.ln_rates[i] - shift)).exp() / self.stresses[i]);
                aa += a * a;
                ab += a * b;
                bb += b * b;
                ay += a;
                by += b;
            }
            let det = aa * bb - ab * ab;
            let mut tau = if self.free[0] && det > 1e-14 * aa * bb { (ay * bb - by * ab) / det } else { 0.0 };
            tau = tau.clamp(0.0, self.max_yield);
            let k = ((by - ab * tau) / bb).max(1e-12 * self.stresses[0]);
            let p = Vector3::new(tau, k.ln() - n * shift, n);
            let cost = self.weighted(&p, &ones);
            if cost < best.0 {
                best = (cost, p);
            }
            if !self.free[2] {
                break;
            }
        }
        best.1
    }

    fn bounded(&self, p: Vector3<f64>) -> Vector3<f64> {
        Vector3::new(p[0].clamp(0.0, self.max_yield), p[1], p[2].clamp(INDEX.0, INDEX.1))
    }

    /// Normal matrix and right side.
    fn normal(&self, p: &Vector3<f64>, weights: &[f64]) -> (Matrix3<f64>, Vector3<f64>) {
        let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for i in 0..weights.len() {
            let g = self.gradient(p, i);
            matrix += weights[i] * g * g.transpose();
            right += weights[i] * self.residual(p, i) * g;
        }
        (matrix, right)
    }

    /// Levenberg–Marquardt for fixed weights; returns the parameters, iterations and whether it converged.
    fn descend(&self, start: Vector3<f64>, weights: &[f64]) -> (Vector3<f64>, usize, bool) {
        let mut p = start;
        let mut cost = self.weighted(&p, weights);
        let mut damping = 1e-3;
        for iteration in 1..=200 {
            let (matrix, right) = self.normal(&p, weights);
            // parameters at a bound and pushed outward stay there
            let held = |k: usize| !self.free[k] || (k == 0 && p[0] == 0.0 && right[0] <= 0.0);
            let mut improved = false;
            while damping < 1e14 {
                let mut a = matrix;
                let mut b = right;
                for k in 0..3 {
                    if held(k) {
                        a.fill_row(k, 0.0);
                        a.fill_column(k, 0.0);
                        a[(k, k)] = 1.0;
                        b[k] = 0.0;
                    } else {
                        a[(k, k)] *= 1.0 + damping;
                        a[(k, k)] = a[(k, k)].max(f64::MIN_POSITIVE);
                    }
                }
                let next = a.lu().solve(&b).map(|d| self.bounded(p + d));
                if let Some(next) = next.filter(|q| q.iter().all(|x| x.is_finite())) {
                    let next_cost = self.weighted(&next, weights);
                    if next_cost <= cost {
                        let scale = Vector3::new(self.max_yield, 1.0, 1.0);
                        let moved = (next - p).component_div(&scale).norm();
                        let gained = cost - next_cost;
                        p = next;
                        cost = next_cost;
                        damping = (damping * 0.2).max(1e-15);
                        improved = true;
                        if moved < 1e-13 || gained <= 1e-15 * cost && moved < 1e-8 {
                            return (p, iteration, true);
                        }
                        break;
                    }
                }
                damping *= 5.0;
            }
            if !improved {
                return (p, iteration, true); // no descent left at working precision
            }
        }
        (p, 200, false)
    }
}

/// Median of a list (0 if empty).
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    match n {
        0 => 0.0,
        _ if n % 2 == 1 => values[n / 2],
        _ => 0.5 * (values[n / 2 - 1] + values[n / 2]),
    }
}

/// Minimises over the free parameters; with `robust`, points far out are weighted down by Huber's rule.
pub(super) fn minimise(rates: &[f64], stresses: &[f64], free: [bool; 3], robust: bool) -> Minimum {
    let problem = Problem {
        ln_rates: rates.iter().map(|r| r.ln()).collect(),
        ln_stresses: stresses.iter().map(|s| s.ln()).collect(),
        stresses,
        free,
        max_yield: stresses.iter().copied().fold(0.0, f64::max),
    };
    let count = rates.len();
    let parameters = free.iter().filter(|f| **f).count();
    let mut weights = vec![1.0; count];
    let (mut p, mut iterations, mut converged) = problem.descend(problem.start(), &weights);
    let mut scale = 0.0;
    // a robust scale needs more points than the curve has parameters by a margin
    if robust && count >= parameters + 4 {
        for _ in 0..30 {
            let sizes: Vec<f64> = (0..count).map(|i| problem.residual(&p, i).abs()).collect();
            // median absolute deviation, corrected for the points that the parameters fit
            scale = 1.4826 * median(sizes.clone()) * (count as f64 / (count - parameters) as f64).sqrt();
            if scale <= 1e-13 {
                break;
            }
            let next: Vec<f64> = sizes.iter().map(|r| (HUBER * scale / r).min(1.0)).collect();
            let change = next.iter().zip(&weights).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            weights = next;
            let (q, more, ok) = problem.descend(p, &weights);
            p = q;
            iterations += more;
            converged = ok;
            if change < 1e-6 {
                break;
            }
        }
    }
    let residuals: Vec<f64> = (0..count).map(|i| problem.residual(&p, i)).collect();
    let loss = |r: f64| {
        let edge = HUBER * scale;
        if scale > 0.0 && r.abs() > edge { 2.0 * edge * r.abs() - edge * edge } else { r * r }
    };
    let freedom = count.saturating_sub(parameters).max(1) as f64;
    // Huber's sandwich for equal scale: s² (Σψ²/(N−p)) / (Σψ'/N)² (JᵀJ)⁻¹
    let psi = residuals.iter().zip(&weights).map(|(r, w)| (r * w).powi(2)).sum::<f64>() / freedom;
    let flat = weights.iter().filter(|w| **w >= 1.0).count() as f64 / count as f64;
    let variance = psi / (flat * flat).max(0.05);
    let (matrix, _) = problem.normal(&p, &vec![1.0; count]);
    Minimum {
        parameters: [p[0], p[1], p[2]],
        standard_error: standard_errors(&matrix, free).map(|e| e * variance.sqrt()),
        rms: (residuals.iter().map(|r| r * r).sum::<f64>() / count as f64).sqrt(),
        cost: residuals.iter().map(|r| loss(*r)).sum(),
        weights,
        iterations,
        converged,
    }
}

/// Square roots of the diagonal of the inverse normal matrix over the free parameters, scaled before inversion.
fn standard_errors(matrix: &Matrix3<f64>, free: [bool; 3]) -> [f64; 3] {
    let mut scaled = Matrix3::identity();
    let scale = Vector3::from_fn(|k, _| if free[k] { matrix[(k, k)].max(f64::MIN_POSITIVE).sqrt() } else { 1.0 });
    for i in 0..3 {
        for j in 0..3 {
            if free[i] && free[j] {
                scaled[(i, j)] = matrix[(i, j)] / (scale[i] * scale[j]);
            }
        }
    }
    match scaled.try_inverse() {
        Some(inverse) => {
            std::array::from_fn(|k| if free[k] { inverse[(k, k)].max(0.0).sqrt() / scale[k] } else { 0.0 })
        }
        None => std::array::from_fn(|k| if free[k] { f64::INFINITY } else { 0.0 }),
    }
}
