//! Preconditioned conjugate gradients with breakdown detection.
//!
//! The caller supplies the operator and the preconditioner as closures and keeps the scratch vectors, so a solve allocates
//! nothing once they have grown. All sums run in a fixed order ([`crate::reduce`]): the result does not depend on the thread count.

use crate::reduce::{add_scaled, dot, norm, norm_max, scale_add};
use crate::report::{SolveReport, Status};
use serde::{Deserialize, Serialize};

/// Norm in which residual and right-hand side are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ResidualNorm {
    /// Euclidean norm.
    #[default]
    Euclidean,
    /// Largest magnitude.
    Maximum,
}

impl ResidualNorm {
    fn of(self, v: &[f64]) -> f64 {
        match self {
            ResidualNorm::Euclidean => norm(v),
            ResidualNorm::Maximum => norm_max(v),
        }
    }
}

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PcgSettings {
    /// Residual over right-hand side at which the solve counts as converged [1]; smaller is costlier and closer.
    pub tolerance: f64,
    /// Largest number of iterations [1].
    pub max_iterations: usize,
    /// Norm of the stopping test.
    pub norm: ResidualNorm,
    /// The residual is computed afresh after this many iterations [1]; rounding of the recurrence is removed at the cost of
    /// one more product.
    pub refresh: usize,
}

impl Default for PcgSettings {
    fn default() -> Self {
        Self { tolerance: 1e-6, max_iterations: 1000, norm: ResidualNorm::Euclidean, refresh: 50 }
    }
}

/// Vectors of a solve, kept by the caller between solves.
#[derive(Clone, Debug, Default)]
pub struct PcgScratch {
    residual: Vec<f64>,
    preconditioned: Vec<f64>,
    direction: Vec<f64>,
    product: Vec<f64>,
    best: Vec<f64>,
}

impl PcgScratch {
    /// Residual `b − A x` where the last solve stopped (by its recurrence; of the last iterate, not the best).
    #[must_use]
    pub fn residual(&self) -> &[f64] {
        &self.residual
    }

    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let vectors = [&self.residual, &self.preconditioned, &self.direction, &self.product, &self.best];
        8 * vectors.iter().map(|v| v.capacity()).sum::<usize>()
    }

    fn resize(&mut self, n: usize) {
        for v in [&mut self.residual, &mut self.preconditioned, &mut self.direction, &mut self.product, &mut self.best]
        {
            v.clear();
            v.resize(n, 0.0);
        }
    }
}

/// Solves `A x = b` for a symmetric positive definite `A`; `x` holds the first guess and receives the best iterate.
///
/// - `apply(v, out)`: `out = A v`
/// - `precondition(v, out)`: `out ≈ A⁻¹ v`, symmetric positive definite
///
/// The report's residual is relative to the norm of `b`. A direction of non-positive curvature ends the solve with
/// [`Status::Breakdown`] and the best iterate so far: a step from it is never accepted.
pub fn solve(
    apply: impl FnMut(&[f64], &mut [f64]),
    precondition: impl FnMut(&[f64], &mut [f64]),
    b: &[f64],
    x: &mut [f64],
    scratch: &mut PcgScratch,
    settings: &PcgSettings,
) -> SolveReport {
    solve_system(&mut Closures { apply, precondition }, b, x, scratch, settings)
}

/// A symmetric positive definite operator with its preconditioner, for solvers whose two halves share state.
pub trait PreconditionedSystem {
    /// `out = A v`.
    fn apply(&mut self, v: &[f64], out: &mut [f64]);
    /// `z ≈ A⁻¹ r`, symmetric positive definite.
    fn precondition(&mut self, r: &[f64], z: &mut [f64]);
}

struct Closures<A, P> {
    apply: A,
    precondition: P,
}

impl<A: FnMut(&[f64], &mut [f64]), P: FnMut(&[f64], &mut [f64])> PreconditionedSystem for Closures<A, P> {
    fn apply(&mut self, v: &[f64], out: &mut [f64]) {
        (self.apply)(v, out);
    }

    fn precondition(&mut self, r: &[f64], z: &mut [f64]) {
        (self.precondition)(r, z);
    }
}

/// [`solve`] for an operator and a preconditioner that share state.
pub fn solve_system(
    system: &mut impl PreconditionedSystem,
    b: &[f64],
    x: &mut [f64],
    scratch: &mut PcgScratch,
    settings: &PcgSettings,
) -> SolveReport {
    let n = b.len();
    debug_assert_eq!(x.len(), n);
    let size = settings.norm.of(b);
    let report =
        |status, iterations, residual| SolveReport { status, iterations, residual, tolerance: settings.tolerance };
    if !size.is_finite() {
        return report(Status::NonFinite, 0, f64::NAN);
    }
    if size == 0.0 {
        x.fill(0.0);
        return report(Status::Converged, 0, 0.0);
    }
    scratch.resize(n);
    let PcgScratch { residual: r, preconditioned: z, direction: p, product: q, best } = scratch;
    residual_of(system, b, x, r);
    let mut error = settings.norm.of(r) / size;
    if !error.is_finite() {
        // A poor first guess must not poison the solve.
        x.fill(0.0);
        r.copy_from_slice(b);
        error = 1.0;
    }
    best.copy_from_slice(x);
    let mut best_error = error;
    if error <= settings.tolerance {
        return report(Status::Converged, 0, error);
    }
    system.precondition(r, z);
    p.copy_from_slice(z);
    let mut rho = dot(r, z);
    let mut status = Status::MaxIterations;
    let mut iterations = 0;
    if rho.is_nan() || rho <= 0.0 {
        return report(if rho.is_finite() { Status::Breakdown } else { Status::NonFinite }, 0, error);
    }
    for iteration in 1..=settings.max_iterations {
        system.apply(p, q);
        let pq = dot(p, q);
        if !pq.is_finite() {
            status = Status::NonFinite;
            break;
        }
        if pq <= 1e-14 * norm(p) * norm(q) {
            status = Status::Breakdown;
            break;
        }
        let alpha = rho / pq;
        add_scaled(x, alpha, p);
        iterations = iteration;
        if settings.refresh > 0 && iteration % settings.refresh == 0 {
            residual_of(system, b, x, r);
        } else {
            add_scaled(r, -alpha, q);
        }
        error = settings.norm.of(r) / size;
        if !error.is_finite() {
            status = Status::NonFinite;
            break;
        }
        if error < best_error {
            best_error = error;
            best.copy_from_slice(x);
        }
        if error <= settings.tolerance {
            status = Status::Converged;
            break;
        }
        system.precondition(r, z);
        let next = dot(r, z);
        if next.is_nan() || next <= 0.0 {
            status = if next.is_finite() { Status::Breakdown } else { Status::NonFinite };
            break;
        }
        scale_add(p, next / rho, z);
        rho = next;
    }
    if status != Status::Converged {
        x.copy_from_slice(best);
    }
    report(status, iterations, best_error)
}

fn residual_of(system: &mut impl PreconditionedSystem, b: &[f64], x: &[f64], r: &mut [f64]) {
    system.apply(x, r);
    for (r, b) in r.iter_mut().zip(b) {
        *r = b - *r;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `−u'' + c u` on `n` points with Dirichlet ends.
    fn laplacian(c: f64) -> impl Fn(&[f64], &mut [f64]) {
        move |v, out| {
            let n = v.len();
            for i in 0..n {
                let left = if i > 0 { v[i - 1] } else { 0.0 };
                let right = if i + 1 < n { v[i + 1] } else { 0.0 };
                out[i] = (2.0 + c) * v[i] - left - right;
            }
        }
    }

    #[test]
    fn reaches_the_exact_solution_in_at_most_n_iterations() {
        let n = 60;
        let b: Vec<f64> = (0..n).map(|i| f64::from(i).sin()).collect();
        let mut x = vec![0.0; n as usize];
        let settings = PcgSettings { tolerance: 1e-13, ..Default::default() };
        let report =
            solve(laplacian(0.0), |r, z| z.copy_from_slice(r), &b, &mut x, &mut PcgScratch::default(), &settings);
        assert_eq!(report.status, Status::Converged);
        assert!(report.iterations <= n as usize);
        let mut product = vec![0.0; n as usize];
        laplacian(0.0)(&x, &mut product);
        assert!(product.iter().zip(&b).all(|(p, b)| (p - b).abs() < 1e-10));
    }

    #[test]
    fn an_indefinite_operator_is_named() {
        let b = [1.0, 1.0, 1.0];
        let mut x = [0.0; 3];
        let apply = |v: &[f64], out: &mut [f64]| {
            out.copy_from_slice(v);
            out[1] = -5.0 * v[1];
        };
        let report =
            solve(apply, |r, z| z.copy_from_slice(r), &b, &mut x, &mut PcgScratch::default(), &PcgSettings::default());
        assert_eq!(report.status, Status::Breakdown);
        assert_eq!(x, [0.0; 3], "no step from a broken direction");
    }

    #[test]
    fn trivial_and_non_finite_right_hand_sides() {
        let mut scratch = PcgScratch::default();
        let mut x = [3.0, 4.0];
        let identity = |v: &[f64], out: &mut [f64]| out.copy_from_slice(v);
        let report = solve(identity, identity, &[0.0, 0.0], &mut x, &mut scratch, &PcgSettings::default());
        assert_eq!((report.status, x), (Status::Converged, [0.0, 0.0]));
        let report = solve(identity, identity, &[f64::NAN, 0.0], &mut x, &mut scratch, &PcgSettings::default());
        assert_eq!(report.status, Status::NonFinite);
        assert_eq!(x, [0.0, 0.0]);
        let empty: [f64; 0] = [];
        let report = solve(identity, identity, &empty, &mut [], &mut scratch, &PcgSettings::default());
        assert_eq!(report.status, Status::Converged);
    }
}
