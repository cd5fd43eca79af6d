//! Small-matrix helpers of the liquid law, for dimension 2 and 3.

use nalgebra::SMatrix;

/// Square matrix of the space dimension.
pub(crate) type Tensor<const D: usize> = SMatrix<f64, D, D>;

/// Determinant for `D` = 1, 2 or 3.
#[inline]
pub(crate) fn determinant<const D: usize>(m: &Tensor<D>) -> f64 {
    match D {
        1 => m[(0, 0)],
        2 => m[(0, 0)] * m[(1, 1)] - m[(0, 1)] * m[(1, 0)],
        _ => {
            m[(0, 0)] * (m[(1, 1)] * m[(2, 2)] - m[(1, 2)] * m[(2, 1)])
                - m[(0, 1)] * (m[(1, 0)] * m[(2, 2)] - m[(1, 2)] * m[(2, 0)])
                + m[(0, 2)] * (m[(1, 0)] * m[(2, 1)] - m[(1, 1)] * m[(2, 0)])
        }
    }
}

/// Deviator `m − tr(m)/D I` and mean `tr(m)/D`.
#[inline]
pub(crate) fn deviator<const D: usize>(m: &Tensor<D>) -> (Tensor<D>, f64) {
    let mean = m.trace() / D as f64;
    let mut dev = *m;
    for i in 0..D {
        dev[(i, i)] -= mean;
    }
    (dev, mean)
}

/// Double contraction `a : b`.
#[inline]
pub(crate) fn contract<const D: usize>(a: &Tensor<D>, b: &Tensor<D>) -> f64 {
    a.component_mul(b).sum()
}

/// `x^{-1/D}` for `D` = 2 or 3.
#[inline]
pub(crate) fn inverse_root<const D: usize>(x: f64) -> f64 {
    match D {
        1 => 1.0 / x,
        2 => 1.0 / x.sqrt(),
        _ => 1.0 / x.cbrt(),
    }
}

/// Inverse of a matrix by its adjugate; the caller knows the determinant is not zero.
#[inline]
pub(crate) fn inverse<const D: usize>(m: &Tensor<D>) -> Tensor<D> {
    let mut out = Tensor::<D>::zeros();
    let det = determinant(m);
    if D == 2 {
        out[(0, 0)] = m[(1, 1)] / det;
        out[(1, 1)] = m[(0, 0)] / det;
        out[(0, 1)] = -m[(0, 1)] / det;
        out[(1, 0)] = -m[(1, 0)] / det;
    } else {
        for i in 0..D {
            for j in 0..D {
                let (r, s) = ((j + 1) % 3, (j + 2) % 3);
                let (p, q) = ((i + 1) % 3, (i + 2) % 3);
                out[(i, j)] = (m[(r, p)] * m[(s, q)] - m[(r, q)] * m[(s, p)]) / det;
            }
        }
    }
    out
}

/// Eigenvalues and eigenvectors (columns) of a symmetric matrix by cyclic Jacobi rotations; robust for repeated values.
pub(crate) fn symmetric_eigen<const D: usize>(m: &Tensor<D>) -> ([f64; D], Tensor<D>) {
    let mut a = 0.5 * (m + m.transpose());
    let mut v = Tensor::<D>::identity();
    let scale = a.norm();
    for _ in 0..30 {
        let mut off = 0.0;
        for i in 0..D {
            for j in i + 1..D {
                off += a[(i, j)] * a[(i, j)];
            }
        }
        if off.sqrt() <= 1e-16 * scale {
            break;
        }
        for p in 0..D {
            for q in p + 1..D {
                if a[(p, q)] == 0.0 {
                    continue;
                }
                let theta = (a[(q, q)] - a[(p, p)]) / (2.0 * a[(p, q)]);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                for k in 0..D {
                    let (x, y) = (a[(k, p)], a[(k, q)]);
                    a[(k, p)] = c * x - s * y;
                    a[(k, q)] = s * x + c * y;
                }
                for k in 0..D {
                    let (x, y) = (a[(p, k)], a[(q, k)]);
                    a[(p, k)] = c * x - s * y;
                    a[(q, k)] = s * x + c * y;
                }
                for k in 0..D {
                    let (x, y) = (v[(k, p)], v[(k, q)]);
                    v[(k, p)] = c * x - s * y;
                    v[(k, q)] = s * x + c * y;
                }
            }
        }
    }
    let mut values = [0.0; D];
    for i in 0..D {
        values[i] = a[(i, i)];
    }
    (values, v)
}

/// Rotation factor of the polar decomposition of an invertible matrix of positive determinant.
///
/// Newton's iteration `R ← (ζR + R^{-T}/ζ)/2` with determinant scaling: quadratic, and it never squares the condition
/// number as an eigen-decomposition of `mᵀm` would.
pub(crate) fn rotation<const D: usize>(m: &Tensor<D>) -> Tensor<D> {
    if D == 2 {
        let (c, s) = (m[(0, 0)] + m[(1, 1)], m[(1, 0)] - m[(0, 1)]);
        let r = c.hypot(s);
        let mut out = Tensor::<D>::identity();
        if r > 0.0 {
            out[(0, 0)] = c / r;
            out[(1, 1)] = c / r;
            out[(1, 0)] = s / r;
            out[(0, 1)] = -s / r;
        }
        return out;
    }
    let mut r = *m;
    for _ in 0..60 {
        let scaled = r * inverse_root::<D>(determinant(&r).abs());
        let next = 0.5 * (scaled + inverse(&scaled).transpose());
        let change = (next - r).norm();
        r = next;
        if change <= 1e-15 * D as f64 {
            break;
        }
    }
    r
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Matrix3, Rotation3, Vector3};

    #[test]
    fn inverse_determinant_and_rotation() {
        let m = Matrix3::new(1.2, 0.3, -0.4, 0.1, 0.7, 0.5, -0.3, 0.2, 1.9);
        assert!((m * inverse(&m) - Matrix3::identity()).norm() < 1e-14);
        assert!((determinant(&m) - m.determinant()).abs() < 1e-14);
        let q = Rotation3::from_scaled_axis(Vector3::new(0.4, -1.1, 0.7)).into_inner();
        let stretch = Matrix3::new(1e3, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1e-3);
        assert!((rotation(&(q * stretch)) - q).norm() < 1e-12);
        let m = Matrix2::new(1.2, 0.3, -0.4, 0.9);
        assert!((m * inverse(&m) - Matrix2::identity()).norm() < 1e-14);
        let r = rotation(&m);
        assert!((r.transpose() * m - (r.transpose() * m).transpose()).norm() < 1e-15);
    }

    #[test]
    fn eigen_decomposition_of_repeated_and_wide_values() {
        for m in [
            Matrix3::identity() * 4.0,
            Matrix3::new(2.0, 1.0, 0.0, 1.0, 2.0, 0.0, 0.0, 0.0, 3.0),
            Matrix3::new(1e6, 3e2, 1.0, 3e2, 1.0, 0.2, 1.0, 0.2, 1e-6),
        ] {
            let (values, v) = symmetric_eigen(&m);
            let d = Matrix3::from_diagonal(&Vector3::from(values));
            assert!((v * d * v.transpose() - m).norm() <= 1e-14 * m.norm());
            assert!((v.transpose() * v - Matrix3::identity()).norm() < 1e-14);
        }
    }
}
