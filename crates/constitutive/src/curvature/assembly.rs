//! From the eight unknowns of an element to the eleven of three vertices; projection to semi-definiteness.

use super::energy::{ElementGradient, ElementHessian, SYMMETRIC};
use nalgebra::{SMatrix, SVector, SymmetricEigen};
use numerics::lanes::{Lane, V3};

/// Gradient in the eleven unknowns `(x₋, θᵉ, x₀, θᶠ, x₊)`.
#[must_use]
pub fn vertex_gradient(g: &ElementGradient<f64>) -> SVector<f64, 11> {
    let mut out = SVector::zeros();
    for i in 0..3 {
        out[i] = -g.e.0[i];
        out[4 + i] = g.e.0[i] - g.f.0[i];
        out[8 + i] = g.f.0[i];
    }
    out[3] = g.te;
    out[7] = g.tf;
    out
}

/// Hessian in the unknowns `(e, θᵉ, f, θᶠ)` as a dense matrix.
fn dense(h: &ElementHessian<f64>) -> SMatrix<f64, 8, 8> {
    let mut m = SMatrix::zeros();
    for (n, (i, j)) in SYMMETRIC.into_iter().enumerate() {
        m[(i, j)] = h.ee[n];
        m[(j, i)] = h.ee[n];
        m[(4 + i, 4 + j)] = h.ff[n];
        m[(4 + j, 4 + i)] = h.ff[n];
    }
    for i in 0..3 {
        for j in 0..3 {
            m[(i, 4 + j)] = h.ef[i][j];
            m[(4 + j, i)] = h.ef[i][j];
        }
        for (row, column, v) in
            [(i, 3, h.e_te.0[i]), (i, 7, h.e_tf.0[i]), (4 + i, 3, h.f_te.0[i]), (4 + i, 7, h.f_tf.0[i])]
        {
            m[(row, column)] = v;
            m[(column, row)] = v;
        }
    }
    m[(3, 3)] = h.tt[0];
    m[(3, 7)] = h.tt[1];
    m[(7, 3)] = h.tt[1];
    m[(7, 7)] = h.tt[2];
    m
}

fn sparse(m: &SMatrix<f64, 8, 8>) -> ElementHessian<f64> {
    ElementHessian {
        ee: SYMMETRIC.map(|(i, j)| m[(i, j)]),
        ff: SYMMETRIC.map(|(i, j)| m[(4 + i, 4 + j)]),
        ef: std::array::from_fn(|i| std::array::from_fn(|j| m[(i, 4 + j)])),
        e_te: V3(std::array::from_fn(|i| m[(i, 3)])),
        e_tf: V3(std::array::from_fn(|i| m[(i, 7)])),
        f_te: V3(std::array::from_fn(|i| m[(4 + i, 3)])),
        f_tf: V3(std::array::from_fn(|i| m[(4 + i, 7)])),
        tt: [m[(3, 3)], m[(3, 7)], m[(7, 7)]],
    }
}

/// Hessian in the eleven unknowns `(x₋, θᵉ, x₀, θᶠ, x₊)`.
#[must_use]
pub fn vertex_hessian(h: &ElementHessian<f64>) -> SMatrix<f64, 11, 11> {
    let mut d = SMatrix::<f64, 8, 11>::zeros();
    for i in 0..3 {
        d[(i, i)] = -1.0;
        d[(i, 4 + i)] = 1.0;
        d[(4 + i, 4 + i)] = -1.0;
        d[(4 + i, 8 + i)] = 1.0;
    }
    d[(3, 3)] = 1.0;
    d[(7, 7)] = 1.0;
    d.transpose() * dense(h) * d
}

/// Clamps the negative eigenvalues of an element Hessian to zero.
///
/// Angles are measured in the given `length` \[m\] (the edge length), so that the unit of length does not decide what
/// is clamped. Semi-definiteness in the edges carries over to the vertices. A matrix that is not finite is returned
/// as it is.
#[must_use]
pub fn project_positive(h: &ElementHessian<f64>, length: f64) -> ElementHessian<f64> {
    let mut m = dense(h);
    let s = 1.0 / length;
    for i in [3, 7] {
        m.row_mut(i).scale_mut(s);
        m.column_mut(i).scale_mut(s);
    }
    if !m.iter().all(|v| v.is_finite()) {
        return *h;
    }
    let Some(mut eigen) = SymmetricEigen::try_new(m, f64::EPSILON, 400) else { return *h };
    if eigen.eigenvalues.min() >= 0.0 {
        return *h;
    }
    eigen.eigenvalues.apply(|v| *v = v.max(0.0));
    let mut m = eigen.recompose();
    for i in [3, 7] {
        m.row_mut(i).scale_mut(length);
        m.column_mut(i).scale_mut(length);
    }
    sparse(&(0.5 * (m + m.transpose())))
}

/// [`project_positive`] for every lane of `h`.
#[inline(always)]
pub fn project_positive_lanes<L: Lane>(h: &ElementHessian<L>, inv_length: L) -> ElementHessian<L> {
    let mut out = *h;
    for l in 0..L::WIDTH {
        let single = ElementHessian {
            ee: h.ee.map(|v| v.lane(l)),
            ff: h.ff.map(|v| v.lane(l)),
            ef: h.ef.map(|r| r.map(|v| v.lane(l))),
            e_te: V3(h.e_te.0.map(|v| v.lane(l))),
            e_tf: V3(h.e_tf.0.map(|v| v.lane(l))),
            f_te: V3(h.f_te.0.map(|v| v.lane(l))),
            f_tf: V3(h.f_tf.0.map(|v| v.lane(l))),
            tt: h.tt.map(|v| v.lane(l)),
        };
        let p = project_positive(&single, 1.0 / inv_length.lane(l));
        for i in 0..6 {
            out.ee[i] = out.ee[i].with_lane(l, p.ee[i]);
            out.ff[i] = out.ff[i].with_lane(l, p.ff[i]);
        }
        for i in 0..3 {
            for j in 0..3 {
                out.ef[i][j] = out.ef[i][j].with_lane(l, p.ef[i][j]);
            }
            out.e_te.0[i] = out.e_te.0[i].with_lane(l, p.e_te.0[i]);
            out.e_tf.0[i] = out.e_tf.0[i].with_lane(l, p.e_tf.0[i]);
            out.f_te.0[i] = out.f_te.0[i].with_lane(l, p.f_te.0[i]);
            out.f_tf.0[i] = out.f_tf.0[i].with_lane(l, p.f_tf.0[i]);
            out.tt[i] = out.tt[i].with_lane(l, p.tt[i]);
        }
    }
    out
}
