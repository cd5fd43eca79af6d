//! Isotropic bending of two consecutive edges in any dimension: the curvature energy of a discrete elastic rod without twist.
//!
//! For a section of equal stiffness in all directions the four curvatures of the discrete rod add up to the squared
//! curvature binormal, `|κb|² = 4 tan²(θ/2)`, and directors drop out; this is that special case, and also serves in 2-D.

use nalgebra::SVector;

/// Least `1 + cos θ` at which the energy is followed exactly; beyond (a fold within 1.6° of flat) it goes on linearly in `cos θ`.
const LEAST_CHI: f64 = 4e-4;

/// Energy and gradient of the bending energy `B/(2 l) · 4 tan²(θ/2)` of two edges.
#[derive(Clone, Copy, Debug)]
pub struct Bend<const D: usize> {
    /// Energy [J].
    pub energy: f64,
    /// Gradient by the first edge vector [N].
    pub first: SVector<f64, D>,
    /// Gradient by the second edge vector [N].
    pub second: SVector<f64, D>,
    /// `(1 + cos θ)/2`, one when straight: the stiffness grows with its inverse square.
    pub openness: f64,
}

/// Directions and derivatives of the energy by `c = cos θ`.
struct Angle<const D: usize> {
    t: [SVector<f64, D>; 2],
    length: [f64; 2],
    /// `1 − c` without cancellation.
    gap: f64,
    slope: f64,
    curvature: f64,
    energy: f64,
    chi: f64,
}

impl<const D: usize> Angle<D> {
    #[inline]
    fn new(first: &SVector<f64, D>, second: &SVector<f64, D>, weight: f64) -> Option<Self> {
        let length = [first.norm(), second.norm()];
        if length[0] < f64::MIN_POSITIVE || length[1] < f64::MIN_POSITIVE {
            return None;
        }
        let t = [first / length[0], second / length[1]];
        let gap = 0.5 * (t[1] - t[0]).norm_squared();
        let chi = 2.0 - gap;
        // E = weight (1 − c)/(1 + c); dE/dc = −2 weight/χ²; d²E/dc² = 4 weight/χ³.
        let at = chi.max(LEAST_CHI);
        let slope = -2.0 * weight / (at * at);
        let (energy, curvature) = if chi >= LEAST_CHI {
            (weight * gap / chi, 4.0 * weight / (at * at * at))
        } else {
            (weight * (2.0 - at) / at + slope * (chi - at), 0.0)
        };
        Some(Self { t, length, gap, slope, curvature, energy, chi })
    }

    /// `∂c/∂t` directions made normal to the edges, over the edge lengths.
    #[inline]
    fn arms(&self) -> [SVector<f64, D>; 2] {
        let difference = self.t[1] - self.t[0];
        [(difference + self.t[0] * self.gap) / self.length[0], (-difference + self.t[1] * self.gap) / self.length[1]]
    }
}

/// Bending of the edges `first`, `second` with stiffness `stiffness` [N m²] over the rest length `length` [m] of the vertex between them.
///
/// An edge of no length has no direction and bends nothing.
#[inline]
#[must_use]
pub fn bend<const D: usize>(first: &SVector<f64, D>, second: &SVector<f64, D>, stiffness: f64, length: f64) -> Bend<D> {
    let Some(angle) = Angle::new(first, second, 2.0 * stiffness / length) else {
        return Bend { energy: 0.0, first: SVector::zeros(), second: SVector::zeros(), openness: 1.0 };
    };
    let [a, b] = angle.arms();
    Bend { energy: angle.energy, first: a * angle.slope, second: b * angle.slope, openness: 0.5 * angle.chi }
}

/// Change of the two gradients of [`bend`] for changes of the two edges.
#[inline]
#[must_use]
pub fn bend_differential<const D: usize>(
    first: &SVector<f64, D>,
    second: &SVector<f64, D>,
    changes: [&SVector<f64, D>; 2],
    stiffness: f64,
    length: f64,
) -> [SVector<f64, D>; 2] {
    let Some(angle) = Angle::new(first, second, 2.0 * stiffness / length) else {
        return [SVector::zeros(); 2];
    };
    let arms = angle.arms();
    let along = [angle.t[0].dot(changes[0]), angle.t[1].dot(changes[1])];
    let turn = [
        (changes[0] - angle.t[0] * along[0]) / angle.length[0],
        (changes[1] - angle.t[1] * along[1]) / angle.length[1],
    ];
    let rate = turn[0].dot(&angle.t[1]) + turn[1].dot(&angle.t[0]);
    let cosine = 1.0 - angle.gap;
    let mut out = [SVector::zeros(); 2];
    for i in 0..2 {
        let arm_rate = (turn[1 - i] - angle.t[i] * rate - turn[i] * cosine) / angle.length[i]
            - arms[i] * (along[i] / angle.length[i]);
        out[i] = arms[i] * (angle.curvature * rate) + arm_rate * angle.slope;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Vector2, Vector3};
    use proptest::prelude::*;

    #[test]
    fn energy_is_that_of_the_curvature_and_quadratic_for_small_angles() {
        for angle in [1e-6f64, 0.1, 1.0, 2.5] {
            let b = bend(&Vector2::new(0.3, 0.0), &(Vector2::new(angle.cos(), angle.sin()) * 0.2), 2.0, 0.25);
            let exact = 0.5 * 2.0 / 0.25 * (2.0 * (0.5 * angle).tan()).powi(2);
            assert!((b.energy - exact).abs() < 1e-12 * exact, "{angle}: {} {exact}", b.energy);
        }
        let folded = bend(&Vector2::new(1.0, 0.0), &Vector2::new(-1.0, 0.0), 1.0, 1.0);
        assert!(folded.energy.is_finite() && folded.first.iter().all(|x| x.is_finite()));
        assert_eq!(bend(&Vector2::zeros(), &Vector2::new(1.0, 0.0), 1.0, 1.0).energy, 0.0);
    }

    proptest! {
        #[test]
        fn gradient_and_differential(v in prop::array::uniform6(-1.0f64..1.0), w in prop::array::uniform6(-1.0f64..1.0)) {
            let (e, f) = (Vector3::new(v[0] + 1.5, v[1], v[2]), Vector3::new(v[3] + 1.5, v[4], v[5]));
            let (de, df) = (Vector3::new(w[0], w[1], w[2]), Vector3::new(w[3], w[4], w[5]));
            let at = |h: f64| bend(&(e + de * h), &(f + df * h), 1.3, 0.7);
            let h = 1e-3;
            let six = |a: f64, b: f64, c: f64, d: f64, x: f64, y: f64| (45.0 * (a - b) - 9.0 * (c - d) + (x - y)) / (60.0 * h);
            let p = [at(h), at(-h), at(2.0 * h), at(-2.0 * h), at(3.0 * h), at(-3.0 * h)];
            let slope = six(p[0].energy, p[1].energy, p[2].energy, p[3].energy, p[4].energy, p[5].energy);
            let b = at(0.0);
            let scale = b.first.norm() + b.second.norm() + 1.0;
            prop_assert!((slope - b.first.dot(&de) - b.second.dot(&df)).abs() < 1e-9 * scale);
            let [d0, d1] = bend_differential(&e, &f, [&de, &df], 1.3, 0.7);
            for k in 0..3 {
                let n0 = six(p[0].first[k], p[1].first[k], p[2].first[k], p[3].first[k], p[4].first[k], p[5].first[k]);
                let n1 = six(p[0].second[k], p[1].second[k], p[2].second[k], p[3].second[k], p[4].second[k], p[5].second[k]);
                prop_assert!((n0 - d0[k]).abs() < 1e-8 * (scale + d0.norm()) && (n1 - d1[k]).abs() < 1e-8 * (scale + d1.norm()));
            }
        }
    }
}
