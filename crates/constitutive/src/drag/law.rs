//! Coefficient and force of drag.

use serde::{Deserialize, Serialize};

use super::DragGeometry;
use crate::error::{RheologyError, require};
use crate::flow_curve::FlowCurve;

/// Choices of the drag law.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DragSettings {
    /// Use the superficial velocity `ε_f U` of Di Felice's original form: the force is multiplied by `ε_f²`. Matters only in
    /// dense bundles. Default off.
    pub superficial: bool,
    /// A constant coefficient instead of the shear-dependent one (0.44 is the inertial limit). Default none.
    pub constant_coefficient: Option<f64>,
}

/// Drag law of one liquid, constants prepared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DragLaw {
    /// Density of the liquid where the strand is [kg/m³]: its rest density over the volume ratio.
    pub density: f64,
    yield_stress: f64,
    consistency: f64,
    index: f64,
    creeping: f64,
    blend: f64,
    wake: f64,
    exponent: f64,
    settings: DragSettings,
}

/// A drag force with what is needed to solve for the speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DragForce {
    /// Force that remains at vanishing speed [N]: below it the body sticks.
    pub yield_force: f64,
    /// Force above the yield force [N].
    pub viscous_force: f64,
    /// Derivative of the force by `ln U` [N].
    pub by_ln_speed: f64,
}

impl DragForce {
    /// The whole force [N].
    #[inline]
    #[must_use]
    pub fn total(&self) -> f64 {
        self.yield_force + self.viscous_force
    }
}

/// Inertial limit of the coefficient.
const INERTIAL: f64 = 0.44;

/// Exponent of the voidage function `ε_f^{−χ}`, between 3.05 (Re ≈ 32) and 3.7 (creeping and inertial flow).
///
/// Source: Di Felice 1994; main-paper (20).
#[inline]
#[must_use]
pub fn voidage_exponent(reynolds: f64) -> f64 {
    let distance = 1.5 - reynolds.log10();
    if distance.is_finite() { 3.7 - 0.65 * (-0.5 * distance * distance).exp() } else { 3.7 }
}

impl DragLaw {
    /// Prepares the law of a liquid of the given density [kg/m³] and flow curve, in the curve's own reading
    /// ([`FlowCurve::boundary`]).
    ///
    /// # Errors
    /// [`RheologyError::Parameter`] if a number lies outside its range.
    pub fn new(density: f64, curve: &FlowCurve, settings: DragSettings) -> Result<Self, RheologyError> {
        curve.check()?;
        require("density", density, density > 0.0, "finite, above 0 kg/m³")?;
        if let Some(coefficient) = settings.constant_coefficient {
            require("constant drag coefficient", coefficient, coefficient >= 0.0, "finite, at least 0")?;
        }
        let (yield_stress, consistency, index) = curve.boundary();
        let n = index;
        let alpha = 3.0 / (n * n + n + 1.0);
        let creeping = 6f64.powf(0.5 * (n - 1.0)) * alpha.powf(n + 1.0);
        let half = (3.0 - alpha) / (2.0 * alpha);
        let root = 6f64.sqrt();
        Ok(DragLaw {
            density,
            yield_stress,
            consistency,
            index,
            creeping,
            blend: 6.0 * creeping * (3.0 * (alpha - 6f64.ln())).exp(),
            wake: (3.0 - alpha) / (6.0 * alpha) * (half * 3f64.ln()).exp(),
            exponent: 11.0 / 48.0 * root * -(half * half * ((root - 1.0) / root).ln()).exp_m1(),
            settings,
        })
    }

    /// The same law in liquid of another density [kg/m³] (compressed or expanded).
    #[inline]
    #[must_use]
    pub fn at_density(&self, density: f64) -> Self {
        DragLaw { density, ..*self }
    }

    /// Factor `X(n)` of the creeping coefficient `24 X/Re`.
    #[must_use]
    pub fn creeping_factor(&self) -> f64 {
        self.creeping
    }

    /// Reynolds number `ε_f ρ d^n U² / (η U^n + σ_Y d^n)`; infinite for an inviscid liquid.
    ///
    /// - `speed`: relative speed [m/s]
    /// - `porosity`: liquid fraction `ε_f`
    #[must_use]
    pub fn reynolds(&self, speed: f64, diameter: f64, porosity: f64) -> f64 {
        if speed == 0.0 { 0.0 } else { porosity * self.density * speed * speed / self.resistance(speed, diameter).0 }
    }

    /// `η (U/d)^n + σ_Y` [Pa] and its viscous part.
    #[inline]
    fn resistance(&self, speed: f64, diameter: f64) -> (f64, f64) {
        let viscous = if self.consistency > 0.0 && speed > 0.0 {
            self.consistency * (self.index * (speed / diameter).ln()).exp()
        } else {
            0.0
        };
        (viscous + self.yield_stress, viscous)
    }

    /// Drag coefficient at a Reynolds number for a body of the given ratio of surface to projected area.
    ///
    /// Source: supplemental S64–S66.
    #[must_use]
    pub fn coefficient(&self, reynolds: f64, area_ratio: f64) -> f64 {
        if let Some(constant) = self.settings.constant_coefficient {
            return constant;
        }
        if reynolds <= 0.0 {
            return f64::INFINITY;
        }
        let creeping = 24.0 * self.creeping / reynolds;
        if creeping == 0.0 {
            return INERTIAL;
        }
        let (wake, inertia) = self.terms(creeping.ln(), area_ratio);
        creeping + wake + inertia
    }

    /// Second and third term of the coefficient at `ln C₀`.
    #[inline]
    fn terms(&self, ln_creeping: f64, area_ratio: f64) -> (f64, f64) {
        let ln_sum = |scale: f64| {
            // ln(1 + scale C₀/q)
            let x = (scale / self.blend).ln() + ln_creeping;
            if x > 0.0 { x + (-x).exp().ln_1p() } else { x.exp().ln_1p() }
        };
        let wake = INERTIAL * area_ratio * self.wake * (self.exponent * (2.0 * ln_creeping - ln_sum(1.0))).exp();
        (wake, INERTIAL * (-ln_sum(128.0)).exp())
    }

    /// Factor `½ ρ A_⊥ ε_f^{−χ}` (`× ε_f²` with the superficial velocity) [kg/m].
    #[inline]
    fn scale(&self, geometry: &DragGeometry, porosity: f64, exponent: f64) -> f64 {
        let power = if self.settings.superficial { 2.0 - exponent } else { -exponent };
        0.5 * self.density * geometry.projected_area * (power * porosity.ln()).exp()
    }

    /// Drag force at a relative speed, split into its yield and viscous part, with its derivative by `ln U`.
    ///
    /// - `speed`: relative speed [m/s], ≥ 0
    /// - `porosity`: liquid fraction `ε_f` in (0, 1]
    /// - `exponent`: exponent of the voidage function ([`voidage_exponent`]), frozen because the force would not be monotone
    ///   with it varying
    #[must_use]
    pub fn force(&self, speed: f64, geometry: &DragGeometry, porosity: f64, exponent: f64) -> DragForce {
        let scale = self.scale(geometry, porosity, exponent);
        let square = speed * speed;
        if let Some(constant) = self.settings.constant_coefficient {
            let force = scale * constant * square;
            return DragForce { yield_force: 0.0, viscous_force: force, by_ln_speed: 2.0 * force };
        }
        // C₀ U² has a finite limit: the part with the yield stress does not depend on the speed
        let unit = scale * 24.0 * self.creeping / (porosity * self.density);
        let (resistance, viscous) = self.resistance(speed, geometry.diameter);
        let yield_force = unit * self.yield_stress;
        if speed < 1e-150 {
            return DragForce { yield_force, viscous_force: unit * viscous, by_ln_speed: self.index * unit * viscous };
        }
        let creeping = 24.0 * self.creeping * resistance / (porosity * self.density * square);
        if creeping == 0.0 {
            let force = scale * INERTIAL * square;
            return DragForce { yield_force, viscous_force: force, by_ln_speed: 2.0 * force };
        }
        let by_ln_creeping = self.index * viscous / resistance - 2.0;
        let (wake, inertia) = self.terms(creeping.ln(), geometry.area_ratio());
        let wake_slope = self.exponent * (2.0 - creeping / (self.blend + creeping));
        let inertia_slope = -128.0 * creeping / (self.blend + 128.0 * creeping);
        DragForce {
            yield_force,
            viscous_force: unit * viscous + scale * square * (wake + inertia),
            by_ln_speed: self.index * unit * viscous
                + scale
                    * square
                    * (wake * (2.0 + wake_slope * by_ln_creeping) + inertia * (2.0 + inertia_slope * by_ln_creeping)),
        }
    }

    /// Force below which a body does not move through the liquid [N]: `12 X A_⊥ σ_Y ε_f^{−χ−1}`.
    #[must_use]
    pub fn yield_force(&self, geometry: &DragGeometry, porosity: f64, exponent: f64) -> f64 {
        self.force(0.0, geometry, porosity, exponent).yield_force
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn law(yield_stress: f64, consistency: f64, index: f64) -> DragLaw {
        let curve = FlowCurve::Rheometer { yield_stress, consistency, index };
        DragLaw::new(1000.0, &curve, DragSettings::default()).unwrap()
    }

    /// Sphere curve against the tables of the specification.
    #[test]
    fn coefficients_of_a_sphere() {
        for (n, table) in [
            (1.0, vec![(0.1, 245.4), (1.0, 27.17), (10.0, 4.195), (100.0, 1.0909), (1000.0, 0.4071)]),
            (0.22, vec![(0.01, 3410.829), (1.0, 34.2065), (100.0, 0.660_854)]),
            (1.5, vec![(0.01, 1270.016), (1.0, 20.8689), (100.0, 0.900_816)]),
        ] {
            for (re, expected) in table {
                let tolerance = if n == 1.0 { 2e-4 } else { 1e-6 };
                approx::assert_relative_eq!(law(0.0, 1.0, n).coefficient(re, 4.0), expected, max_relative = tolerance);
            }
        }
        assert!((voidage_exponent(10f64.powf(1.5)) - 3.05).abs() < 1e-14);
        assert!((voidage_exponent(1.0) - 3.4890).abs() < 1e-4);
        assert_eq!(voidage_exponent(0.0), 3.7);
        assert_eq!(law(0.0, 0.0, 0.5).coefficient(f64::INFINITY, 4.0), 0.44);
    }

    proptest! {
        #[test]
        fn the_force_grows_with_speed_and_its_slope_is_right(n in 0.1f64..2.0, tau in prop_oneof![Just(0.0), 0.0f64..30.0],
                                                             ln_eta in -7.0f64..4.0, ln_u in -12.0f64..5.0, porosity in 0.1f64..1.0, ratio in 3.0f64..8.0) {
            let law = law(tau, ln_eta.exp(), n);
            let body = DragGeometry { projected_area: 3e-8, surface_area: 3e-8 * ratio, diameter: 2e-4 };
            let f = |l: f64| law.force(l.exp(), &body, porosity, 3.4);
            let (here, up, down) = (f(ln_u), f(ln_u + 1e-5), f(ln_u - 1e-5));
            prop_assert!(here.by_ln_speed >= 0.0 && here.viscous_force >= 0.0);
            let slope = (up.viscous_force - down.viscous_force) / 2e-5;
            prop_assert!((slope - here.by_ln_speed).abs() <= 1e-5 * here.by_ln_speed + 1e-9 * here.total());
            // the same force by way of the Reynolds number and the coefficient
            let speed = ln_u.exp();
            let direct = 0.5 * 1000.0 * body.projected_area * speed * speed * porosity.powf(-3.4)
                * law.coefficient(law.reynolds(speed, body.diameter, porosity), ratio);
            prop_assert!((direct / here.total() - 1.0).abs() < 1e-10);
        }

        #[test]
        fn units_of_mass_length_and_time_do_not_matter(n in 0.1f64..2.0, m in 0.01f64..100.0, l in 0.01f64..100.0, t in 0.01f64..100.0, speed in 0.001f64..10.0) {
            let at = |m: f64, l: f64, t: f64| {
                let curve = FlowCurve::J2 { yield_stress: 31.9 * m / (l * t * t), consistency: 27.2 * m / (l * t * t) * t.powf(n), index: n };
                let law = DragLaw::new(200.0 * m / l.powi(3), &curve, DragSettings::default()).unwrap();
                let body = DragGeometry::capsule(5e-5 * l, 2e-3 * l, 0.7);
                let re = law.reynolds(speed * l / t, body.diameter, 0.8);
                (law.coefficient(re, body.area_ratio()), law.force(speed * l / t, &body, 0.8, 3.5).total() / (m * l / (t * t)))
            };
            let ((c0, f0), (c1, f1)) = (at(1.0, 1.0, 1.0), at(m, l, t));
            prop_assert!((c1 / c0 - 1.0).abs() < 1e-11 && (f1 / f0 - 1.0).abs() < 1e-11);
        }
    }

    #[test]
    fn the_yield_force_is_the_limit_of_the_force() {
        let law = law(18.4, 17.8, 0.22);
        let body = DragGeometry::sphere(1e-3);
        let expected = 12.0 * law.creeping_factor() * body.projected_area * 18.4 * 0.6f64.powf(-4.7);
        approx::assert_relative_eq!(law.yield_force(&body, 0.6, 3.7), expected, max_relative = 1e-13);
        let tiny = law.force(1e-80, &body, 0.6, 3.7);
        assert!(tiny.viscous_force < 1e-8 * tiny.yield_force);
    }
}
