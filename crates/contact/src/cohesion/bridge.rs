//! Liquid bridge between two equal parallel cylinders, per unit length, in a parametrisation without singular points.
//!
//! With the wetting half-angle `α`: chord of a meniscus `w = g − 2 r cos α`, half-angle of its arc `δ = π/2 − θ − α`,
//! curvature `1/R = 2 sin δ / w`, area `A = 2 r sin α w − r²(2α − sin 2α) − ½ w² ψ(δ)` with
//! `ψ = (δ − sin δ cos δ)/sin² δ`. Equal to the supplement of Fei et al. 2019 (S77), but regular where the meniscus is flat
//! (`δ = 0`, `R → ∞`). Force: `F = 2 sin(θ + α) + 2 r sin α / R`, the exact derivative of the energy at fixed area; the
//! supplement's energy (S75) lacks a factor 2.

use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI};

/// `ψ(δ) = (δ − sin δ cos δ)/sin² δ`, by its series near zero.
#[must_use]
pub fn segment_shape(delta: f64) -> f64 {
    if delta.abs() < 1e-2 {
        // 2/3 δ + 4/45 δ³ + 4/315 δ⁵ + …
        let d2 = delta * delta;
        delta * (2.0 / 3.0 + d2 * (4.0 / 45.0 + d2 * (4.0 / 315.0 + d2 * (8.0 / 4725.0))))
    } else {
        let s = delta.sin();
        (delta - s * delta.cos()) / (s * s)
    }
}

/// `δ/sin δ`, length of an arc over its chord.
#[must_use]
pub fn arc_over_chord(delta: f64) -> f64 {
    if delta.abs() < 1e-3 { 1.0 + delta * delta / 6.0 + 7.0 / 360.0 * delta.powi(4) } else { delta / delta.sin() }
}

/// A bridge between two equal cylinders whose axes are `gap` apart.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bridge {
    /// Radius of the cylinders [m].
    pub radius: f64,
    /// Contact angle [rad], 0 … π.
    pub contact_angle: f64,
    /// Separation of the axes [m], at least twice the radius (less is taken as touching).
    pub gap: f64,
}

/// Meniscus of a bridge that holds a given area of liquid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meniscus {
    /// Wetting half-angle `α` [rad].
    pub wetting_angle: f64,
    /// Curvature `1/R` of the meniscus [1/m]; positive bulges inward (suction).
    pub curvature: f64,
    /// Attraction per length over surface tension `F` [1]; negative repels.
    pub force: f64,
    /// Surface energy per length over surface tension, up to a constant [m].
    pub energy: f64,
    /// Area actually held [m²]: the one asked for, clamped to what the gap can hold.
    pub area: f64,
}

impl Bridge {
    fn gap(&self) -> f64 {
        self.gap.max(2.0 * self.radius)
    }

    /// Cross-section of liquid at a wetting half-angle [m²].
    #[must_use]
    pub fn area(&self, alpha: f64) -> f64 {
        let r = self.radius;
        let w = self.gap() - 2.0 * r * alpha.cos();
        let delta = FRAC_PI_2 - self.contact_angle - alpha;
        2.0 * r * alpha.sin() * w - r * r * (2.0 * alpha - (2.0 * alpha).sin()) - 0.5 * w * w * segment_shape(delta)
    }

    /// Largest wetting half-angle considered [rad].
    #[must_use]
    pub fn largest_angle(&self) -> f64 {
        PI - self.contact_angle
    }

    /// Everything at a wetting half-angle.
    #[must_use]
    pub fn at(&self, alpha: f64) -> Meniscus {
        let (r, theta) = (self.radius, self.contact_angle);
        let w = self.gap() - 2.0 * r * alpha.cos();
        let delta = FRAC_PI_2 - theta - alpha;
        let curvature = if w > 0.0 { 2.0 * delta.sin() / w } else { 0.0 };
        Meniscus {
            wetting_angle: alpha,
            curvature,
            force: 2.0 * (theta + alpha).sin() + 2.0 * r * alpha.sin() * curvature,
            // two menisci and the dry arcs of both cylinders
            energy: 2.0 * w * arc_over_chord(delta) + theta.cos() * 4.0 * r * (PI - alpha),
            area: self.area(alpha),
        }
    }

    /// The meniscus that holds `area` [m²] of liquid; an area out of range is clamped to the nearest that can be held.
    ///
    /// Safeguarded Newton on `α`, at which the area increases; it never leaves its bracket, so it cannot fail.
    #[must_use]
    pub fn meniscus(&self, area: f64) -> Meniscus {
        let top = self.largest_angle();
        // near α = π − θ the arc closes on itself: stop where ψ is still finite
        let (mut lo, mut hi) = (0.0, (top * (1.0 - 1e-9)).max(0.0));
        if !(area > self.area(lo)) {
            return self.at(lo);
        }
        if area >= self.area(hi) {
            return self.at(hi);
        }
        let mut alpha = 0.5 * (lo + hi);
        for _ in 0..200 {
            let f = self.area(alpha) - area;
            if f == 0.0 {
                break;
            }
            if f < 0.0 {
                lo = alpha
            } else {
                hi = alpha
            }
            let h = 1e-7 * (1.0 + alpha);
            let slope = (self.area(alpha + h) - self.area(alpha - h)) / (2.0 * h);
            let newton = alpha - f / slope;
            let next = if newton > lo && newton < hi { newton } else { 0.5 * (lo + hi) };
            if (next - alpha).abs() <= 1e-16 * (1.0 + alpha) || hi - lo <= 4e-16 {
                alpha = next;
                break;
            }
            alpha = next;
        }
        self.at(alpha)
    }

    /// Attraction per length over surface tension at a given area; zero for no liquid.
    #[must_use]
    pub fn force(&self, area: f64) -> f64 {
        if area > 0.0 { self.meniscus(area).force } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::FRAC_PI_4;

    /// The four rows of spec 11 line 51, to 1e-6.
    #[test]
    fn table_of_forces() {
        for (theta, area, gap, expected) in [
            (FRAC_PI_4, 3e-5, 0.0095, 0.825567),
            (40f64.to_radians(), 3e-5, 0.0095, 1.005034),
            (PI / 3.0, 3e-5, 0.0095, 0.217134),
            (0.1, 1.5e-5, 0.0082, 2.002502),
        ] {
            let b = Bridge { radius: 0.004, contact_angle: theta, gap };
            let m = b.meniscus(area);
            assert!((m.force - expected).abs() < 1e-6, "{theta} {} {expected}", m.force);
            assert!((m.area / area - 1.0).abs() < 1e-12);
        }
        assert!(
            (Bridge { radius: 0.004, contact_angle: FRAC_PI_4, gap: 0.0095 }.meniscus(3e-5).wetting_angle - 1.2440)
                .abs()
                < 5e-5
        );
    }

    proptest! {
        /// The force is the derivative of the energy at fixed area, also across flat menisci and contact angles above 90°.
        #[test]
        fn force_is_the_energy_derivative(theta in 0.05..2.2f64, gap in 2.02..2.8f64, fill in 0.05..0.9f64) {
            let b = Bridge { radius: 1.0, contact_angle: theta, gap };
            let alpha = fill * b.largest_angle().min(2.5);
            let area = b.area(alpha);
            prop_assume!(area > 1e-3);
            let h = 1e-4;
            let e = |g: f64| Bridge { gap: g, ..b }.meniscus(area).energy;
            let d = (8.0 * (e(gap + h) - e(gap - h)) - (e(gap + 2.0 * h) - e(gap - 2.0 * h))) / (12.0 * h);
            let f = b.meniscus(area).force;
            prop_assert!((d - f).abs() < 1e-6 * (1.0 + f.abs()), "{d} {f}");
        }

        /// Scaling all lengths leaves the force per tension unchanged.
        #[test]
        fn force_does_not_know_the_unit(theta in 0.0..1.5f64, gap in 2.0..2.5f64, area in 0.01..2.0f64, unit in -5.0..5.0f64) {
            let u = 10f64.powf(unit);
            let a = Bridge { radius: 1.0, contact_angle: theta, gap }.force(area);
            let b = Bridge { radius: u, contact_angle: theta, gap: gap * u }.force(area * u * u);
            prop_assert!((a - b).abs() < 1e-8 * (1.0 + a.abs()));
        }
    }

    /// Work done along an opening at fixed area equals the difference of energy to 1e-8 (Gauss–Legendre, 24 panels).
    #[test]
    fn work_identity() {
        let b = |g: f64| Bridge { radius: 0.004, contact_angle: 0.6, gap: g };
        let (g0, g1, area) = (0.0082, 0.0102, 2e-5);
        let panels = 24;
        let x = [
            0.0,
            (1.0f64 / 3.0 * (5.0 - 2.0 * (10.0f64 / 7.0).sqrt()).sqrt()),
            (1.0f64 / 3.0 * (5.0 + 2.0 * (10.0f64 / 7.0).sqrt()).sqrt()),
        ];
        let w = [128.0 / 225.0, (322.0 + 13.0 * 70f64.sqrt()) / 900.0, (322.0 - 13.0 * 70f64.sqrt()) / 900.0];
        let mut work = 0.0;
        for p in 0..panels {
            let h = (g1 - g0) / panels as f64;
            let mid = g0 + (p as f64 + 0.5) * h;
            for (xi, wi) in [(x[0], w[0]), (x[1], w[1]), (-x[1], w[1]), (x[2], w[2]), (-x[2], w[2])] {
                work += 0.5 * h * wi * b(mid + 0.5 * h * xi).force(area);
            }
        }
        let de = b(g1).meniscus(area).energy - b(g0).meniscus(area).energy;
        assert!((work / de - 1.0).abs() < 1e-8, "{work} {de}");
    }

    /// Hard cases 32 and 33: no liquid, too much, flat meniscus, wetting angle zero, contact angle above 90° repels.
    #[test]
    fn ends_of_the_range() {
        let b = Bridge { radius: 1.0, contact_angle: 0.3, gap: 2.2 };
        assert_eq!(b.force(0.0), 0.0);
        for area in [-1.0, 1e-300, 1e6, f64::MAX] {
            let m = b.meniscus(area);
            assert!(m.force.is_finite() && m.energy.is_finite() && m.area.is_finite());
        }
        let flat = FRAC_PI_2 - 0.3;
        let (l, r) = (b.at(flat - 1e-9).force, b.at(flat + 1e-9).force);
        assert!((l - r).abs() < 1e-7);
        let dry = Bridge { contact_angle: 2.0, ..b };
        assert!(dry.force(0.3) < 0.0);
        let closed = Bridge { contact_angle: PI, ..b };
        assert!(closed.meniscus(1.0).force.is_finite());
        // overlapping axes count as touching
        assert!(Bridge { gap: 1.0, ..b }.force(0.2).is_finite());
    }
}
