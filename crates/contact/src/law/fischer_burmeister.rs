//! The modified Fischer–Burmeister function `f(x, y) = x + y − (x∘x + y∘y + 2μ²e)^{1/2}` of the second-order cone.
//!
//! With `μ = 0` it is zero exactly where `x` and `y` lie in the cone and are orthogonal (Fukushima, Luo and Tseng 2001);
//! with `μ > 0` it is smooth everywhere and its zeros form the central path that the global Newton solver follows.
//! The supplement of Fei et al. 2019 prints `x∘y − …` in (S71); with it a complementary pair is not a zero.

use super::jordan::sum_of_squares_spectrum;
use crate::block::{Block, Vec3, dot};

/// Value and generalised Jacobians of the function.
#[derive(Clone, Copy, Debug)]
pub struct Linearisation {
    /// `f(x, y)`.
    pub value: Vec3,
    /// `∂f/∂x`.
    pub by_x: Block,
    /// `∂f/∂y`.
    pub by_y: Block,
    /// `∂f/∂(μ²)`; zero at a singular point.
    pub by_smoothing: Vec3,
}

/// Below this ratio of the spectral values of `x∘x + y∘y` the pair counts as lying on one boundary ray.
///
/// The smaller value is computed without cancellation, so round-off only reaches about 1e-32 of the larger one; a
/// looser test (1e-13 in the original program) would take slipping pairs of very different size for singular ones.
const SINGULAR_RATIO: f64 = 1e-28;

/// `f(x, y)` with smoothing `mu_squared ≥ 0`.
#[inline]
#[must_use]
pub fn value(x: &Vec3, y: &Vec3, mu_squared: f64) -> Vec3 {
    let (l1, l2, d) = sum_of_squares_spectrum(x, y);
    let a = (l1 + 2.0 * mu_squared).sqrt();
    let b = (l2 + 2.0 * mu_squared).sqrt();
    let s = 0.5 * (b - a);
    [x[0] + y[0] - 0.5 * (a + b), x[1] + y[1] - s * d[0], x[2] + y[2] - s * d[1]]
}

/// `f(x, y)` with an element of its generalised Jacobian at every point, singular ones included.
///
/// Singular points (only with `mu_squared == 0`): on one boundary ray `∂f/∂x = (1 − x_N/√(x_N²+y_N²)) I`; at the
/// origin `(1 − 1/√2) I` for both, a member of Clarke's set that keeps Newton matrices regular.
#[inline]
#[must_use]
pub fn linearise(x: &Vec3, y: &Vec3, mu_squared: f64) -> Linearisation {
    let (l1, l2, d) = sum_of_squares_spectrum(x, y);
    let l1 = l1 + 2.0 * mu_squared;
    let l2 = l2 + 2.0 * mu_squared;
    let a = l1.sqrt();
    let b = l2.sqrt();
    let s = 0.5 * (b - a);
    let value = [x[0] + y[0] - 0.5 * (a + b), x[1] + y[1] - s * d[0], x[2] + y[2] - s * d[1]];
    if l1 <= SINGULAR_RATIO * l2 {
        let r = x[0].hypot(y[0]);
        let (cx, cy) =
            if r > 0.0 { (1.0 - x[0] / r, 1.0 - y[0] / r) } else { (1.0 - 0.5_f64.sqrt(), 1.0 - 0.5_f64.sqrt()) };
        let diagonal = |c: f64| [c, 0.0, 0.0, 0.0, c, 0.0, 0.0, 0.0, c];
        return Linearisation { value, by_x: diagonal(cx), by_y: diagonal(cy), by_smoothing: [0.0; 3] };
    }
    // L_z⁻¹ in its spectral form: eigenvalues √λ₁, √λ₂ on (1, ∓d), their mean on the orthogonal tangent.
    let v1 = [1.0, -d[0], -d[1]];
    let v2 = [1.0, d[0], d[1]];
    let v3 = [0.0, -d[1], d[0]];
    let (c1, c2, c3) = (0.5 / a, 0.5 / b, 2.0 / (a + b));
    let jacobian = |x: &Vec3| -> Block {
        // rows (L_x v_i)ᵀ
        let row = |v: &Vec3| [dot(x, v), x[1] * v[0] + x[0] * v[1], x[2] * v[0] + x[0] * v[2]];
        let (r1, r2, r3) = (row(&v1), row(&v2), row(&v3));
        let mut m = [0.0; 9];
        for i in 0..3 {
            for j in 0..3 {
                m[3 * i + j] = -(c1 * v1[i] * r1[j] + c2 * v2[i] * r2[j] + c3 * v3[i] * r3[j]);
            }
            m[4 * i] += 1.0;
        }
        m
    };
    let t = 0.5 * (1.0 / b - 1.0 / a);
    Linearisation {
        value,
        by_x: jacobian(x),
        by_y: jacobian(y),
        by_smoothing: [-0.5 * (1.0 / a + 1.0 / b), -t * d[0], -t * d[1]],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::{mat_vec, norm_squared, scale};
    use proptest::prelude::*;
    use proptest::test_runner::{Config, TestRunner};

    fn norm(a: &Vec3) -> f64 {
        norm_squared(a).sqrt()
    }

    /// A point of a face of the cone: 0 the apex, 1 the boundary along `angle`, 2 the interior.
    fn on_face(face: u8, size: f64, angle: f64, inside: f64) -> Vec3 {
        match face {
            0 => [0.0; 3],
            1 => [size, size * angle.cos(), size * angle.sin()],
            _ => [size, inside * size * angle.cos(), inside * size * angle.sin()],
        }
    }

    /// 1e5 pairs over the nine face combinations and scales 1e-12…1e12: the function vanishes exactly where the pair
    /// is complementary.
    #[test]
    fn zero_exactly_on_complementary_pairs() {
        let mut runner = TestRunner::new(Config { cases: 100_000, failure_persistence: None, ..Config::default() });
        let strategy =
            (0u8..3, 0u8..3, -12.0..12.0f64, -3.0..3.0f64, 0.0..6.3f64, 0.0..6.3f64, 0.0..0.9f64, any::<bool>());
        runner
            .run(&strategy, |(fx, fy, e, de, ax, ay, inside, opposite)| {
                // "opposite" makes boundary pairs orthogonal
                let ay = if opposite { ax + std::f64::consts::PI } else { ay };
                let x = on_face(fx, 10f64.powf(e), ax, inside);
                let y = on_face(fy, 10f64.powf(e + de), ay, inside);
                let f = norm(&value(&x, &y, 0.0));
                let size = norm(&x).max(norm(&y));
                let small = norm(&x).min(norm(&y));
                // gap of complementarity relative to the product of sizes
                let gap = dot(&x, &y);
                let complementary = gap <= 1e-14 * norm(&x) * norm(&y) || small == 0.0;
                if complementary {
                    prop_assert!(f <= 4e-15 * size, "complementary {x:?} {y:?} gives {f}");
                } else if gap >= 1e-3 * norm(&x) * norm(&y) {
                    // f is at least of the order gap / size
                    prop_assert!(f >= 0.1 * gap / size, "not complementary {x:?} {y:?} gives {f}");
                }
                Ok(())
            })
            .unwrap();
    }

    /// Points outside the cone are not zeros.
    #[test]
    fn outside_the_cone_is_not_a_zero() {
        for (x, y) in [([-1.0, 0.0, 0.0], [0.0; 3]), ([1.0, 2.0, 0.0], [0.0; 3]), ([1.0, 1.5, 0.0], [1.0, -1.5, 0.0])] {
            assert!(norm(&value(&x, &y, 0.0)) > 0.1);
            assert!(norm(&value(&y, &x, 0.0)) > 0.1);
        }
    }

    proptest! {
        /// Jacobians against central differences, smoothed and not, 1e-9 of the size.
        #[test]
        fn jacobians_match_differences(
            x in proptest::array::uniform3(-2.0..2.0f64), y in proptest::array::uniform3(-2.0..2.0f64), mu in 0.0..1.0f64,
        ) {
            let m2 = if mu < 0.3 { 0.0 } else { mu * mu };
            let l = linearise(&x, &y, m2);
            let (l1, l2, _) = sum_of_squares_spectrum(&x, &y);
            prop_assume!(l1 + 2.0 * m2 > 1e-3 * l2);
            let h = 3e-5;
            for k in 0..3 {
                // fourth-order differences: the second-order ones cannot reach 1e-9
                let along = |v: &Vec3, s: f64| { let mut w = *v; w[k] += s * h; w };
                let diff = |g: &dyn Fn(f64) -> Vec3| {
                    let (a, b, c, d) = (g(2.0), g(1.0), g(-1.0), g(-2.0));
                    [0, 1, 2].map(|i| (8.0 * (b[i] - c[i]) - (a[i] - d[i])) / (12.0 * h))
                };
                let dx = diff(&|s| value(&along(&x, s), &y, m2));
                let dy = diff(&|s| value(&x, &along(&y, s), m2));
                let d2 = diff(&|s| value(&x, &y, m2 + 0.2 * s * h));
                for i in 0..3 {
                    prop_assert!((dx[i] - l.by_x[3 * i + k]).abs() < 1e-9, "{} {}", dx[i], l.by_x[3 * i + k]);
                    prop_assert!((dy[i] - l.by_y[3 * i + k]).abs() < 1e-9);
                    if m2 > 0.0 { prop_assert!((5.0 * d2[i] - l.by_smoothing[i]).abs() < 2e-9); }
                }
            }
        }

        /// On a common boundary ray the selected Jacobian is the exact derivative along the ray.
        #[test]
        fn boundary_ray_selection_is_exact_along_the_ray(a in 0.0..6.3f64, s in 0.1..10.0f64, t in 0.1..10.0f64) {
            let ray = [1.0, a.cos(), a.sin()];
            let x = scale(s, &ray);
            let y = scale(t, &ray);
            let l = linearise(&x, &y, 0.0);
            // along the ray f(s) = s + t − √(s² + t²)
            let exact = 1.0 - s / s.hypot(t);
            let d = mat_vec(&l.by_x, &ray);
            for i in 0..3 { prop_assert!((d[i] - exact * ray[i]).abs() < 1e-6, "{d:?} {exact}"); }
        }
    }

    #[test]
    fn the_apex_has_a_regular_jacobian() {
        let l = linearise(&[0.0; 3], &[0.0; 3], 0.0);
        let c = 1.0 - 0.5_f64.sqrt();
        assert_eq!(l.by_x, [c, 0.0, 0.0, 0.0, c, 0.0, 0.0, 0.0, c]);
        assert_eq!(l.by_y, l.by_x);
    }

    /// The smaller spectral value keeps its digits at a size ratio of 1e-8 (spec 7.3: 1.4e-8 error by subtraction).
    #[test]
    fn small_spectral_value_does_not_cancel() {
        for e in 0..12 {
            let t = 10f64.powi(-e);
            let (l1, l2, _) = sum_of_squares_spectrum(&[1.0, 0.6, 0.8], &[t, -0.6 * t, -0.8 * t]);
            // exact: w_N = 2 + 2t², ‖w_T‖ = 2 − 2t²
            assert!((l1 / (4.0 * t * t) - 1.0).abs() < 1e-13, "{l1} at {t}");
            assert!((l2 / 4.0 - 1.0).abs() < 1e-15);
        }
    }
}
