//! The three numbers of a Herschel–Bulkley liquid, in the reading of the model or of the rheometer.
//!
//! The model measures stress and rate by Frobenius norms, a rheometer by the shear components. Between them, for steady
//! simple shear and small elastic strain: `τ_s = τ_Y/√3`, `K = 2^{-(n+1)/2} η`, same `n`.
//! Mixing the two up makes a Newtonian liquid twice too viscous, so the reading is part of the type.
//!
//! Source: Fei et al. 2019, supplemental S12–S15 (flow rule); the mapping is derived in the theory pages.

use serde::{Deserialize, Serialize};

use crate::error::{RheologyError, require};

/// Which convention the numbers of a [`FlowCurve`] follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum RheologyReading {
    /// The model's own parameters: uniaxial (von Mises) yield stress and consistency of the Frobenius norms.
    J2,
    /// A rheometer's parameters: `σ_xy = τ_s + K γ̇ⁿ` in simple shear.
    Rheometer,
}

/// Yield stress [Pa], consistency [Pa·sⁿ] and flow index of a liquid, with the reading they follow.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum FlowCurve {
    /// The model's reading: flow at the rate `((s − √(2/3) τ_Y)/η)^{1/n}`, all in Frobenius norms.
    J2 {
        /// Uniaxial yield stress τ_Y [Pa], ≥ 0.
        yield_stress: f64,
        /// Consistency η [Pa·sⁿ], ≥ 0.
        consistency: f64,
        /// Flow index n > 0: below 1 thins, above 1 thickens.
        index: f64,
    },
    /// The rheometer's reading: `σ_xy = τ_s + K γ̇ⁿ`.
    Rheometer {
        /// Yield stress in simple shear τ_s [Pa], ≥ 0.
        yield_stress: f64,
        /// Consistency in simple shear K [Pa·sⁿ], ≥ 0.
        consistency: f64,
        /// Flow index n > 0: below 1 thins, above 1 thickens.
        index: f64,
    },
}

/// How a liquid flows, in one word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum FlowClass {
    /// No yield stress, index 1.
    Newtonian,
    /// Index below 0.9: viscosity falls with the rate (with or without a yield stress).
    ShearThinning,
    /// A yield stress and an index within 0.1 of 1: nearly a Bingham plastic.
    NearBingham,
    /// Index above 1.1, or above 1 without a yield stress.
    ShearThickening,
}

impl FlowClass {
    /// The class in words for tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            FlowClass::Newtonian => "Newtonian",
            FlowClass::ShearThinning => "shear-thinning",
            FlowClass::NearBingham => "near-Bingham",
            FlowClass::ShearThickening => "shear-thickening",
        }
    }
}

/// `√3`, the ratio of uniaxial to shear yield stress of the von Mises criterion.
const SQRT_3: f64 = 1.732_050_807_568_877_2;
/// `√(2/3)`, from the uniaxial yield stress to the Frobenius norm of the stress deviator at yield.
pub(crate) const SQRT_TWO_THIRDS: f64 = 0.816_496_580_927_726;

impl FlowCurve {
    /// A Newtonian liquid of the given dynamic viscosity [Pa·s].
    #[must_use]
    pub fn newtonian(viscosity: f64) -> Self {
        FlowCurve::Rheometer { yield_stress: 0.0, consistency: viscosity, index: 1.0 }
    }

    /// The convention the numbers follow.
    #[must_use]
    pub fn reading(&self) -> RheologyReading {
        match self {
            FlowCurve::J2 { .. } => RheologyReading::J2,
            FlowCurve::Rheometer { .. } => RheologyReading::Rheometer,
        }
    }

    /// Yield stress [Pa], consistency [Pa·sⁿ] and index as written, in the curve's own reading.
    #[must_use]
    pub fn raw(&self) -> (f64, f64, f64) {
        match *self {
            FlowCurve::J2 { yield_stress, consistency, index }
            | FlowCurve::Rheometer { yield_stress, consistency, index } => (yield_stress, consistency, index),
        }
    }

    /// Flow index n.
    #[must_use]
    pub fn index(&self) -> f64 {
        self.raw().2
    }

    /// The same liquid as `(τ_Y [Pa], η [Pa·sⁿ], n)` of the model.
    #[must_use]
    pub fn j2(&self) -> (f64, f64, f64) {
        let (yield_stress, consistency, n) = self.raw();
        match self.reading() {
            RheologyReading::J2 => (yield_stress, consistency, n),
            RheologyReading::Rheometer => (SQRT_3 * yield_stress, ((n + 1.0) / 2.0).exp2() * consistency, n),
        }
    }

    /// The same liquid as `(τ_s [Pa], K [Pa·sⁿ], n)` of a rheometer.
    #[must_use]
    pub fn rheometer(&self) -> (f64, f64, f64) {
        let (yield_stress, consistency, n) = self.raw();
        match self.reading() {
            RheologyReading::J2 => (yield_stress / SQRT_3, (-(n + 1.0) / 2.0).exp2() * consistency, n),
            RheologyReading::Rheometer => (yield_stress, consistency, n),
        }
    }

    /// The same liquid written in the other (or the same) reading.
    #[must_use]
    pub fn read_as(&self, reading: RheologyReading) -> FlowCurve {
        match reading {
            RheologyReading::J2 => {
                let (yield_stress, consistency, index) = self.j2();
                FlowCurve::J2 { yield_stress, consistency, index }
            }
            RheologyReading::Rheometer => {
                let (yield_stress, consistency, index) = self.rheometer();
                FlowCurve::Rheometer { yield_stress, consistency, index }
            }
        }
    }

    /// `(yield stress [Pa], consistency [Pa·sⁿ], n)` as drag, film friction and wet contacts use them: `(τ_s, K, n)` of a
    /// rheometer reading, `(√(2/3) τ_Y, η, n)` of a J2 reading, where the published formulas take the model's numbers
    /// literally.
    #[must_use]
    pub fn boundary(&self) -> (f64, f64, f64) {
        let (yield_stress, consistency, n) = self.raw();
        match self.reading() {
            RheologyReading::J2 => (SQRT_TWO_THIRDS * yield_stress, consistency, n),
            RheologyReading::Rheometer => (yield_stress, consistency, n),
        }
    }

    /// Shear stress [Pa] at the shear rate `rate` [1/s] in steady simple shear, `τ_s + K γ̇ⁿ` (the limit of a stiff shear
    /// modulus). At zero rate: the yield stress.
    #[must_use]
    pub fn shear_stress(&self, rate: f64) -> f64 {
        let (yield_stress, consistency, n) = self.rheometer();
        let rate = rate.abs();
        yield_stress + if rate > 0.0 && consistency > 0.0 { (consistency.ln() + n * rate.ln()).exp() } else { 0.0 }
    }

    /// Apparent viscosity [Pa·s] at the shear rate `rate` [1/s]: stress over rate.
    #[must_use]
    pub fn viscosity(&self, rate: f64) -> f64 {
        self.shear_stress(rate) / rate.abs()
    }

    /// Dynamic viscosity [Pa·s] a liquid without shear modulus gets in the shear solve: `η/2` of a J2 reading, `K` of a
    /// rheometer reading.
    #[must_use]
    pub fn newtonian_viscosity(&self) -> f64 {
        match *self {
            FlowCurve::J2 { consistency, .. } => 0.5 * consistency,
            FlowCurve::Rheometer { consistency, .. } => consistency,
        }
    }

    /// How the liquid flows, in one word.
    #[must_use]
    pub fn class(&self) -> FlowClass {
        let (yield_stress, _, n) = self.raw();
        if n == 1.0 && yield_stress == 0.0 {
            FlowClass::Newtonian
        } else if yield_stress > 0.0 && (n - 1.0).abs() <= 0.1 {
            FlowClass::NearBingham
        } else if n < 1.0 {
            FlowClass::ShearThinning
        } else {
            FlowClass::ShearThickening
        }
    }

    /// Checks the ranges: yield stress and consistency finite and ≥ 0, index in `[0.01, 10]`.
    ///
    /// # Errors
    /// [`RheologyError::Parameter`] naming the number and its range.
    pub fn check(&self) -> Result<(), RheologyError> {
        let (yield_stress, consistency, n) = self.raw();
        require("yield stress", yield_stress, yield_stress >= 0.0, "finite, at least 0 Pa")?;
        require("consistency", consistency, consistency >= 0.0, "finite, at least 0 Pa·sⁿ")?;
        require("flow index", n, (0.01..=10.0).contains(&n), "0.01 to 10")?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table of the mapping for all eight materials, CGS numbers as published.
    #[test]
    fn the_rheometer_reading_of_the_published_materials() {
        for (yield_stress, consistency, index, tau_s, k) in [
            (16.813, 6.49, 0.5173, 9.7070, 3.83591),
            (9.6, 173.56, 0.3162, 5.5426, 109.987),
            (1.2e3, 50.0, 0.27, 692.820, 32.1970),
            (319.0, 272.0, 0.22, 184.175, 178.214),
            (26.5, 16.1, 0.62, 15.2998, 9.18315),
            (300.0, 28.0, 0.98, 173.205, 14.0974),
        ] {
            let (t, c, n) = FlowCurve::J2 { yield_stress, consistency, index }.rheometer();
            approx::assert_relative_eq!(t, tau_s, max_relative = 1e-5);
            approx::assert_relative_eq!(c, k, max_relative = 1e-5);
            assert_eq!(n, index);
        }
    }

    #[test]
    fn readings_convert_back_and_forth() {
        let curve = FlowCurve::Rheometer { yield_stress: 18.4, consistency: 17.8, index: 0.22 };
        let back = curve.read_as(RheologyReading::J2).read_as(RheologyReading::Rheometer);
        let ((a, b, n), (c, d, m)) = (curve.raw(), back.raw());
        approx::assert_relative_eq!(a, c, max_relative = 1e-15);
        approx::assert_relative_eq!(b, d, max_relative = 1e-15);
        assert_eq!(n, m);
    }

    #[test]
    fn a_newtonian_j2_liquid_has_half_its_consistency_as_viscosity() {
        let curve = FlowCurve::J2 { yield_stress: 0.0, consistency: 10.0, index: 1.0 };
        approx::assert_relative_eq!(curve.viscosity(3.0), 5.0, max_relative = 1e-14);
        approx::assert_relative_eq!(curve.newtonian_viscosity(), 5.0, max_relative = 1e-14);
        assert_eq!(curve.class(), FlowClass::Newtonian);
    }

    #[test]
    fn ranges_are_refused_by_name() {
        for (curve, name) in [
            (FlowCurve::J2 { yield_stress: -1.0, consistency: 1.0, index: 1.0 }, "yield stress"),
            (FlowCurve::J2 { yield_stress: 1.0, consistency: f64::NAN, index: 1.0 }, "consistency"),
            (FlowCurve::J2 { yield_stress: 1.0, consistency: 1.0, index: 0.0 }, "flow index"),
        ] {
            assert!(curve.check().unwrap_err().to_string().contains(name));
        }
    }
}
