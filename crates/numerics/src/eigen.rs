//! Eigenvalues and singular values of small matrices by Jacobi rotations.
//!
//! Jacobi's method is used rather than closed forms: it keeps orthogonal vectors and full relative accuracy for repeated and
//! for widely separated values, the two cases that plastic flow produces all the time.

use crate::tensor::{Tensor, Vector, determinant};
use nalgebra::SMatrix;

/// Sweeps after which the iteration stops at the latest; three-by-three matrices need five or six.
const MAX_SWEEPS: usize = 32;

/// Eigenvalues and eigenvectors of a symmetric matrix.
#[derive(Clone, Copy, Debug)]
pub struct SymmetricEigen<const D: usize> {
    /// Eigenvalues in ascending order.
    pub values: Vector<D>,
    /// Column `k` is the unit eigenvector of `values[k]`.
    pub vectors: Tensor<D>,
}

impl<const D: usize> SymmetricEigen<D> {
    /// Rebuilds `V diag(f(values)) Vᵀ`.
    #[must_use]
    pub fn map(&self, f: impl Fn(f64) -> f64) -> Tensor<D> {
        let mut out = Tensor::<D>::zeros();
        for k in 0..D {
            let v = self.vectors.column(k);
            out += v * v.transpose() * f(self.values[k]);
        }
        // The sum of symmetric dyads is symmetric up to rounding; make it so exactly.
        Tensor::<D>::from_fn(|i, j| 0.5 * (out[(i, j)] + out[(j, i)]))
    }
}

/// The rotation `(c, s)` that diagonalises `[[p, r], [r, q]]`, the smaller of the two angles.
#[inline(always)]
fn rotation(p: f64, q: f64, r: f64) -> (f64, f64) {
    if r == 0.0 {
        return (1.0, 0.0);
    }
    let theta = (q - p) / (2.0 * r);
    // `theta` may overflow for a tiny `r`; the tangent is then zero, which is the right answer.
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let t = if theta == 0.0 { 1.0 } else { t };
    let c = 1.0 / (t * t + 1.0).sqrt();
    (c, t * c)
}

/// Eigen-decomposition of the symmetric matrix whose lower triangle is that of `a` (cyclic Jacobi).
///
/// Non-finite input gives non-finite output; the iteration always ends.
#[must_use]
pub fn symmetric_eigen<const D: usize>(a: &Tensor<D>) -> SymmetricEigen<D> {
    let mut m = Tensor::<D>::from_fn(|i, j| if i >= j { a[(i, j)] } else { a[(j, i)] });
    let mut v = Tensor::<D>::identity();
    for _ in 0..MAX_SWEEPS {
        let mut rotated = false;
        for p in 0..D {
            for q in p + 1..D {
                let r = m[(p, q)];
                // An entry below rounding of both its diagonal entries cannot change them any more.
                if r.abs() <= f64::EPSILON * 0.125 * (m[(p, p)] * m[(q, q)]).abs().sqrt() || r.abs() < f64::MIN_POSITIVE
                {
                    m[(p, q)] = 0.0;
                    m[(q, p)] = 0.0;
                    continue;
                }
                rotated = true;
                let (c, s) = rotation(m[(p, p)], m[(q, q)], r);
                for k in 0..D {
                    let (x, y) = (m[(k, p)], m[(k, q)]);
                    m[(k, p)] = c * x - s * y;
                    m[(k, q)] = s * x + c * y;
                }
                for k in 0..D {
                    let (x, y) = (m[(p, k)], m[(q, k)]);
                    m[(p, k)] = c * x - s * y;
                    m[(q, k)] = s * x + c * y;
                }
                m[(p, q)] = 0.0;
                m[(q, p)] = 0.0;
                for k in 0..D {
                    let (x, y) = (v[(k, p)], v[(k, q)]);
                    v[(k, p)] = c * x - s * y;
                    v[(k, q)] = s * x + c * y;
                }
            }
        }
        if !rotated {
            break;
        }
    }
    let mut order: [usize; D] = std::array::from_fn(|i| i);
    order.sort_by(|&i, &j| m[(i, i)].total_cmp(&m[(j, j)]));
    SymmetricEigen {
        values: Vector::<D>::from_fn(|k, _| m[(order[k], order[k])]),
        vectors: Tensor::<D>::from_fn(|i, k| v[(i, order[k])]),
    }
}

/// Largest eigenvalue of a symmetric matrix.
#[must_use]
pub fn largest_eigenvalue<const D: usize>(a: &Tensor<D>) -> f64 {
    if D == 2 {
        let (p, q, r) = (a[(0, 0)], a[(1, 1)], a[(1, 0)]);
        return 0.5 * (p + q) + (0.25 * (p - q) * (p - q) + r * r).sqrt();
    }
    symmetric_eigen(a).values[D - 1]
}

/// Singular value decomposition `a = U diag(σ) Vᵀ` with proper rotations `U` and `V`.
#[derive(Clone, Copy, Debug)]
pub struct RotationSvd<const D: usize> {
    /// Left rotation, `det = +1`.
    pub u: Tensor<D>,
    /// Singular values, descending in magnitude; the last one carries the sign of `det a`.
    pub values: Vector<D>,
    /// Right rotation, `det = +1`.
    pub v: Tensor<D>,
}

/// One-sided Jacobi SVD with proper rotations: the smallest singular value is negative where `det a < 0`.
#[must_use]
pub fn rotation_svd<const D: usize>(a: &Tensor<D>) -> RotationSvd<D> {
    let mut w = *a;
    let mut v = Tensor::<D>::identity();
    for _ in 0..MAX_SWEEPS {
        let mut rotated = false;
        for p in 0..D {
            for q in p + 1..D {
                let pp = w.column(p).norm_squared();
                let qq = w.column(q).norm_squared();
                let pq = w.column(p).dot(&w.column(q));
                if pq.abs() <= f64::EPSILON * (pp * qq).sqrt() || pq == 0.0 || !pq.is_finite() {
                    continue;
                }
                rotated = true;
                let (c, s) = rotation(pp, qq, pq);
                for k in 0..D {
                    let (x, y) = (w[(k, p)], w[(k, q)]);
                    w[(k, p)] = c * x - s * y;
                    w[(k, q)] = s * x + c * y;
                    let (x, y) = (v[(k, p)], v[(k, q)]);
                    v[(k, p)] = c * x - s * y;
                    v[(k, q)] = s * x + c * y;
                }
            }
        }
        if !rotated {
            break;
        }
    }
    let norms: [f64; D] = std::array::from_fn(|k| w.column(k).norm());
    let mut order: [usize; D] = std::array::from_fn(|i| i);
    order.sort_by(|&i, &j| norms[j].total_cmp(&norms[i]));
    let mut values = Vector::<D>::from_fn(|k, _| norms[order[k]]);
    let mut right = Tensor::<D>::from_fn(|i, k| v[(i, order[k])]);
    let mut left = Tensor::<D>::zeros();
    let largest = values[0];
    for k in 0..D {
        let column = w.column(order[k]);
        if values[k] > largest * f64::EPSILON * 4.0 && values[k] > 0.0 {
            left.set_column(k, &(column / values[k]));
        } else {
            left.set_column(k, &complement(&left, k));
        }
    }
    if determinant(&right) < 0.0 {
        let last = D - 1;
        right.set_column(last, &(-right.column(last)));
        values[last] = -values[last];
    }
    if determinant(&left) < 0.0 {
        let last = D - 1;
        left.set_column(last, &(-left.column(last)));
        values[last] = -values[last];
    }
    RotationSvd { u: left, values, v: right }
}

/// A unit vector orthogonal to the first `count` columns of `basis`.
fn complement<const D: usize>(basis: &Tensor<D>, count: usize) -> SMatrix<f64, D, 1> {
    let mut best = Vector::<D>::zeros();
    let mut best_norm = -1.0;
    for axis in 0..D {
        let mut candidate = Vector::<D>::zeros();
        candidate[axis] = 1.0;
        for k in 0..count {
            let b = basis.column(k);
            candidate -= b * b.dot(&candidate);
        }
        let norm = candidate.norm();
        if norm > best_norm {
            best_norm = norm;
            best = candidate / norm.max(f64::MIN_POSITIVE);
        }
    }
    best
}

/// The proper rotation nearest to `a` (the rotation factor of its polar decomposition where `det a > 0`).
#[must_use]
pub fn polar_rotation<const D: usize>(a: &Tensor<D>) -> Tensor<D> {
    if D == 2 {
        // Closed form: the rotation by the angle of (a + cofactor(a)).
        let (x, y) = (a[(0, 0)] + a[(1, 1)], a[(1, 0)] - a[(0, 1)]);
        let r = x.hypot(y);
        if r == 0.0 {
            return Tensor::<D>::identity();
        }
        let (c, s) = (x / r, y / r);
        let mut out = Tensor::<D>::identity();
        out[(0, 0)] = c;
        out[(1, 1)] = c;
        out[(1, 0)] = s;
        out[(0, 1)] = -s;
        return out;
    }
    let svd = rotation_svd(a);
    svd.u * svd.v.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Matrix3};
    use proptest::prelude::*;

    fn check_eigen<const D: usize>(a: Tensor<D>, tolerance: f64) {
        let e = symmetric_eigen(&a);
        let scale = a.norm().max(f64::MIN_POSITIVE);
        assert!((e.map(|x| x) - a).norm() <= tolerance * scale, "reconstruction of {a}");
        assert!((e.vectors.transpose() * e.vectors - Tensor::<D>::identity()).norm() < 1e-14);
        for k in 1..D {
            assert!(e.values[k - 1] <= e.values[k]);
        }
        assert!((largest_eigenvalue(&a) - e.values[D - 1]).abs() <= 1e-14 * scale);
    }

    fn check_svd<const D: usize>(a: Tensor<D>) {
        let s = rotation_svd(&a);
        let scale = a.norm().max(f64::MIN_POSITIVE);
        let diag = Tensor::<D>::from_diagonal(&s.values);
        assert!((s.u * diag * s.v.transpose() - a).norm() <= 1e-14 * scale, "{a}");
        for r in [s.u, s.v] {
            assert!((r.transpose() * r - Tensor::<D>::identity()).norm() < 1e-13, "{r}");
            assert!((determinant(&r) - 1.0).abs() < 1e-13);
        }
        let r = polar_rotation(&a);
        assert!((r.transpose() * r - Tensor::<D>::identity()).norm() < 1e-13);
        if determinant(&a) > 1e-8 * scale.powi(D as i32) {
            let stretch = r.transpose() * a;
            assert!((stretch - stretch.transpose()).norm() <= 1e-13 * scale, "stretch must be symmetric");
        }
    }

    #[test]
    fn special_matrices() {
        check_eigen(Matrix3::identity(), 1e-15);
        check_eigen(Matrix3::zeros(), 1e-15);
        check_eigen(Matrix3::new(1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0), 1e-14);
        check_eigen(Matrix3::from_diagonal(&[1e12, 1.0, 1e-12].into()), 1e-15);
        check_eigen(Matrix2::new(1.0, 1e-9, 1e-9, 1.0), 1e-15);
        check_svd(Matrix3::identity());
        check_svd(Matrix3::zeros());
        check_svd(Matrix3::new(1.0, 2.0, 3.0, 2.0, 4.0, 6.0, 3.0, 6.0, 9.0));
        check_svd(Matrix3::from_diagonal(&[1.0, -1.0, 1.0].into()));
        check_svd(Matrix2::new(0.0, -3.0, 3.0, 0.0));
    }

    #[test]
    fn widely_separated_values_keep_relative_accuracy() {
        // A graded positive definite matrix D K D with K well conditioned: Jacobi finds each eigenvalue to relative accuracy.
        let scale = Matrix3::from_diagonal(&[1e6, 1.0, 1e-6].into());
        let k = Matrix3::new(1.0, 0.3, 0.2, 0.3, 1.0, 0.1, 0.2, 0.1, 1.0);
        let e = symmetric_eigen(&(scale * k * scale));
        let det_k = determinant(&k);
        let smallest = det_k / (1.0 - 0.09) * 1e-12; // Schur complement of the leading block, exact to first order in 1e-12
        assert!((e.values[0] / smallest - 1.0).abs() < 1e-10, "{}", e.values[0]);
    }

    proptest! {
        #[test]
        fn random_matrices(a in prop::array::uniform9(-2.0..2.0f64), b in prop::array::uniform4(-2.0..2.0f64)) {
            let a = Matrix3::from_row_slice(&a);
            let b = Matrix2::from_row_slice(&b);
            check_eigen(a + a.transpose(), 1e-14);
            check_eigen(b + b.transpose(), 1e-14);
            check_svd(a);
            check_svd(b);
        }
    }
}
