//! Rate of plastic flow of a shear stress: the constants of a Herschel–Bulkley liquid prepared for hot loops.

use serde::{Deserialize, Serialize};

use crate::error::RheologyError;
use crate::flow_curve::{FlowCurve, SQRT_TWO_THIRDS};

/// Plastic flow `γ̇(s) = (max(0, s − σ_Y)/η)^{1/n}` with `σ_Y = √(2/3) τ_Y`, stresses and rates in Frobenius norms.
///
/// Powers are always taken as `exp(ln(·)/n)`: `(Φ/η)^{1/n}` itself overflows for small `n`.
///
/// Source: Fei et al. 2019, supplemental S11–S13.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "FlowCurve", into = "FlowCurve")]
pub struct ShearFlow {
    yield_norm: f64,
    consistency: f64,
    ln_consistency: f64,
    index: f64,
    inverse_index: f64,
}

impl From<FlowCurve> for ShearFlow {
    fn from(curve: FlowCurve) -> Self {
        let (yield_stress, consistency, index) = curve.j2();
        ShearFlow {
            yield_norm: SQRT_TWO_THIRDS * yield_stress,
            consistency,
            ln_consistency: consistency.ln(),
            index,
            inverse_index: 1.0 / index,
        }
    }
}

impl From<ShearFlow> for FlowCurve {
    fn from(flow: ShearFlow) -> Self {
        FlowCurve::J2 {
            yield_stress: flow.yield_norm / SQRT_TWO_THIRDS,
            consistency: flow.consistency,
            index: flow.index,
        }
    }
}

impl ShearFlow {
    /// Prepares the constants of a flow curve.
    ///
    /// # Errors
    /// [`RheologyError::Parameter`] if a number lies outside its range.
    pub fn new(curve: &FlowCurve) -> Result<Self, RheologyError> {
        curve.check()?;
        Ok(ShearFlow::from(*curve))
    }

    /// Norm of the stress deviator at yield, `σ_Y = √(2/3) τ_Y` [Pa].
    #[inline]
    #[must_use]
    pub fn yield_norm(&self) -> f64 {
        self.yield_norm
    }

    /// Consistency η of the model [Pa·sⁿ].
    #[inline]
    #[must_use]
    pub fn consistency(&self) -> f64 {
        self.consistency
    }

    /// Natural logarithm of the consistency (−∞ for a perfectly plastic liquid).
    #[inline]
    #[must_use]
    pub fn ln_consistency(&self) -> f64 {
        self.ln_consistency
    }

    /// Flow index n.
    #[inline]
    #[must_use]
    pub fn index(&self) -> f64 {
        self.index
    }

    /// `1/n`.
    #[inline]
    #[must_use]
    pub fn inverse_index(&self) -> f64 {
        self.inverse_index
    }

    /// Rate of plastic flow [1/s] at the stress norm `stress` [Pa]; infinite above yield where η = 0.
    #[inline]
    #[must_use]
    pub fn rate(&self, stress: f64) -> f64 {
        let excess = stress - self.yield_norm;
        if excess > 0.0 { ((excess.ln() - self.ln_consistency) * self.inverse_index).exp() } else { 0.0 }
    }

    /// Slope of [`Self::rate`] [1/(Pa·s)]: `γ̇/(n Φ)`; zero below yield.
    #[inline]
    #[must_use]
    pub fn rate_slope(&self, stress: f64) -> f64 {
        let excess = stress - self.yield_norm;
        if excess > 0.0 { self.rate(stress) * self.inverse_index / excess } else { 0.0 }
    }

    /// Stress norm [Pa] that flows steadily at the rate `rate` [1/s]: `σ_Y + η rateⁿ`.
    #[inline]
    #[must_use]
    pub fn stress_at(&self, rate: f64) -> f64 {
        self.yield_norm
            + if rate > 0.0 && self.consistency > 0.0 {
                (self.ln_consistency + self.index * rate.ln()).exp()
            } else {
                0.0
            }
    }
}
