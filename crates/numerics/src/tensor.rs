//! Algebra of small square matrices in two and three dimensions, generic over the dimension.
//!
//! The stress and strain measures of the house live in `D × D` matrices with `D` known at compile time. Only `D ≤ 3` occurs;
//! the closed forms below are written out for these.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// A `D × D` matrix.
pub type Tensor<const D: usize> = SMatrix<f64, D, D>;
/// A vector of length `D`.
pub type Vector<const D: usize> = SVector<f64, D>;

/// Sum of the diagonal.
#[inline(always)]
#[must_use]
pub fn trace<const D: usize>(a: &Tensor<D>) -> f64 {
    let mut sum = 0.0;
    for i in 0..D {
        sum += a[(i, i)];
    }
    sum
}

/// `a − tr(a)/D I`.
#[inline(always)]
#[must_use]
pub fn deviator<const D: usize>(a: &Tensor<D>) -> Tensor<D> {
    let mean = trace(a) / D as f64;
    let mut out = *a;
    for i in 0..D {
        out[(i, i)] -= mean;
    }
    out
}

/// `(a + aᵀ)/2`.
#[inline(always)]
#[must_use]
pub fn symmetric_part<const D: usize>(a: &Tensor<D>) -> Tensor<D> {
    Tensor::<D>::from_fn(|i, j| 0.5 * (a[(i, j)] + a[(j, i)]))
}

/// `(a − aᵀ)/2`.
#[inline(always)]
#[must_use]
pub fn skew_part<const D: usize>(a: &Tensor<D>) -> Tensor<D> {
    Tensor::<D>::from_fn(|i, j| 0.5 * (a[(i, j)] - a[(j, i)]))
}

/// `Σ_ij a_ij b_ij`.
#[inline(always)]
#[must_use]
pub fn double_contraction<const D: usize>(a: &Tensor<D>, b: &Tensor<D>) -> f64 {
    let mut sum = 0.0;
    for j in 0..D {
        for i in 0..D {
            sum += a[(i, j)] * b[(i, j)];
        }
    }
    sum
}

/// Frobenius norm `sqrt(a : a)`.
#[inline(always)]
#[must_use]
pub fn frobenius_norm<const D: usize>(a: &Tensor<D>) -> f64 {
    double_contraction(a, a).sqrt()
}

/// Determinant in closed form, `D ≤ 3`.
///
/// # Panics
/// Never for `D ≤ 3`; larger dimensions are refused at compile time.
#[inline(always)]
#[must_use]
pub fn determinant<const D: usize>(a: &Tensor<D>) -> f64 {
    const { assert!(D >= 1 && D <= 3, "closed forms exist for one to three dimensions") };
    match D {
        1 => a[(0, 0)],
        2 => a[(0, 0)] * a[(1, 1)] - a[(0, 1)] * a[(1, 0)],
        _ => {
            a[(0, 0)] * (a[(1, 1)] * a[(2, 2)] - a[(1, 2)] * a[(2, 1)])
                - a[(0, 1)] * (a[(1, 0)] * a[(2, 2)] - a[(1, 2)] * a[(2, 0)])
                + a[(0, 2)] * (a[(1, 0)] * a[(2, 1)] - a[(1, 1)] * a[(2, 0)])
        }
    }
}

/// Transposed cofactor matrix: `adjugate(a) a = det(a) I`, also for singular `a`.
#[inline(always)]
#[must_use]
pub fn adjugate<const D: usize>(a: &Tensor<D>) -> Tensor<D> {
    const { assert!(D >= 1 && D <= 3, "closed forms exist for one to three dimensions") };
    match D {
        1 => Tensor::<D>::repeat(1.0),
        2 => {
            let mut out = *a;
            out[(0, 0)] = a[(1, 1)];
            out[(1, 1)] = a[(0, 0)];
            out[(0, 1)] = -a[(0, 1)];
            out[(1, 0)] = -a[(1, 0)];
            out
        }
        _ => Tensor::<D>::from_fn(|i, j| {
            // Entry (i, j) is the cofactor of (j, i); the cyclic index order supplies the sign.
            let (r0, r1) = ((j + 1) % 3, (j + 2) % 3);
            let (c0, c1) = ((i + 1) % 3, (i + 2) % 3);
            a[(r0, c0)] * a[(r1, c1)] - a[(r0, c1)] * a[(r1, c0)]
        }),
    }
}

/// Inverse, or `None` where the determinant is zero or not finite.
#[inline(always)]
#[must_use]
pub fn inverse<const D: usize>(a: &Tensor<D>) -> Option<Tensor<D>> {
    let det = determinant(a);
    if det == 0.0 || !det.is_finite() {
        return None;
    }
    Some(adjugate(a) / det)
}

/// `x^(1/D)` for `x > 0`: the edge of a cube of measure `x`.
#[inline(always)]
#[must_use]
pub fn dimension_root<const D: usize>(x: f64) -> f64 {
    match D {
        1 => x,
        2 => x.sqrt(),
        _ => x.cbrt(),
    }
}

/// Splits a matrix with positive determinant into its determinant and its unimodular part `a / det(a)^(1/D)`.
///
/// Returns `None` where the determinant is not positive and finite.
#[inline(always)]
#[must_use]
pub fn unimodular_part<const D: usize>(a: &Tensor<D>) -> Option<(f64, Tensor<D>)> {
    let det = determinant(a);
    if det > 0.0 && det.is_finite() { Some((det, a / dimension_root::<D>(det))) } else { None }
}

/// The matrix `[v]` with `[v] w = v × w`.
#[inline(always)]
#[must_use]
pub fn cross_matrix(v: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -v.z, v.y, v.z, 0.0, -v.x, -v.y, v.x, 0.0)
}

/// The axial vector of the skew part of `a`: `w` with `skew(a) x = w × x`.
#[inline(always)]
#[must_use]
pub fn axial_vector(a: &Matrix3<f64>) -> Vector3<f64> {
    0.5 * Vector3::new(a[(2, 1)] - a[(1, 2)], a[(0, 2)] - a[(2, 0)], a[(1, 0)] - a[(0, 1)])
}

/// Number of independent entries of a symmetric `D × D` matrix.
#[must_use]
pub const fn symmetric_len<const D: usize>() -> usize {
    D * (D + 1) / 2
}

/// Number of independent components of angular momentum in `D` dimensions: 0, 1, 3.
#[must_use]
pub const fn rotation_len<const D: usize>() -> usize {
    D * (D - 1) / 2
}

/// Angular momentum per unit mass, `x ∧ v`, in the first [`rotation_len`] entries: `(z)` in 2-D, `(x, y, z)` in 3-D.
#[inline(always)]
#[must_use]
pub fn wedge<const D: usize>(x: &Vector<D>, v: &Vector<D>) -> [f64; 3] {
    match D {
        2 => [x[0] * v[1] - x[1] * v[0], 0.0, 0.0],
        3 => [x[1] * v[2] - x[2] * v[1], x[2] * v[0] - x[0] * v[2], x[0] * v[1] - x[1] * v[0]],
        _ => [0.0; 3],
    }
}

/// Moment of a matrix `b = Σ m v ⊗ x` (velocity first): the angular momentum that it carries, in the order of [`wedge`].
#[inline(always)]
#[must_use]
pub fn moment<const D: usize>(b: &Tensor<D>) -> [f64; 3] {
    match D {
        2 => [b[(1, 0)] - b[(0, 1)], 0.0, 0.0],
        3 => [b[(2, 1)] - b[(1, 2)], b[(0, 2)] - b[(2, 0)], b[(1, 0)] - b[(0, 1)]],
        _ => [0.0; 3],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Vector2};
    use proptest::prelude::*;

    fn matrix3() -> impl Strategy<Value = Matrix3<f64>> {
        prop::array::uniform9(-2.0..2.0f64).prop_map(|a| Matrix3::from_row_slice(&a))
    }

    proptest! {
        #[test]
        fn determinant_and_adjugate_agree_with_their_definition(a in matrix3(), b in matrix3()) {
            let product = adjugate(&a) * a;
            let det = determinant(&a);
            prop_assert!((product - Matrix3::identity() * det).norm() < 1e-13);
            prop_assert!((determinant(&(a * b)) - det * determinant(&b)).abs() < 1e-11);
            prop_assert!((det - a.determinant()).abs() < 1e-13);
        }

        #[test]
        fn deviator_is_traceless_and_orthogonal_to_the_identity(a in matrix3()) {
            let d = deviator(&a);
            prop_assert!(trace(&d).abs() < 1e-14);
            prop_assert!((a - d - Matrix3::identity() * trace(&a) / 3.0).norm() < 1e-15);
            prop_assert!((frobenius_norm(&a) - a.norm()).abs() < 1e-14);
        }

        #[test]
        fn cross_matrix_and_axial_vector_are_inverse(a in prop::array::uniform3(-2.0..2.0f64), b in prop::array::uniform3(-2.0..2.0f64)) {
            let (v, w) = (Vector3::from(a), Vector3::from(b));
            prop_assert!((cross_matrix(&v) * w - v.cross(&w)).norm() < 1e-15);
            prop_assert_eq!(axial_vector(&cross_matrix(&v)), v);
            let l = wedge(&v, &w);
            prop_assert!((Vector3::from(l) - v.cross(&w)).norm() < 1e-15);
            prop_assert!((Vector3::from(moment(&(w * v.transpose()))) - v.cross(&w)).norm() < 1e-15);
        }
    }

    #[test]
    fn two_dimensional_closed_forms() {
        let a = Matrix2::new(2.0, 1.0, -3.0, 4.0);
        assert_eq!(determinant(&a), 11.0);
        assert!((inverse(&a).unwrap() * a - Matrix2::identity()).norm() < 1e-15);
        assert!(inverse(&Matrix2::new(1.0, 2.0, 2.0, 4.0)).is_none());
        let (det, unit) = unimodular_part(&a).unwrap();
        assert_eq!(det, 11.0);
        assert!((determinant(&unit) - 1.0).abs() < 1e-15);
        assert!(unimodular_part(&Matrix2::new(-1.0, 0.0, 0.0, 1.0)).is_none());
        assert_eq!(wedge(&Vector2::new(1.0, 2.0), &Vector2::new(3.0, 4.0))[0], -2.0);
        assert_eq!(
            (symmetric_len::<2>(), symmetric_len::<3>(), rotation_len::<2>(), rotation_len::<3>()),
            (3, 6, 1, 3)
        );
    }
}
