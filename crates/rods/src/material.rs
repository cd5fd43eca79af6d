//! What a strand is made of.

use crate::error::RodError;
use serde::{Deserialize, Serialize};

/// Elastic and viscous constants of one strand. SI units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StrandMaterial {
    /// Young's modulus \[Pa\], positive. Stiffness of stretching and bending.
    pub young_modulus: f64,
    /// Poisson's ratio, between −1 and 0.5. Enters through the shear modulus `E / (2(1+ν))` of torsion.
    pub poisson_ratio: f64,
    /// Mass density \[kg/m³\], positive.
    pub density: f64,
    /// Internal (Kelvin–Voigt) viscosity \[Pa s\], not negative. A mode of angular frequency ω gets the damping ratio `3 η ω/(2 E)`.
    pub viscosity: f64,
    /// Artificial multiplier of the stretching stiffness, in (0, 1]; 1 is physical.
    pub stretch_multiplier: f64,
    /// Air drag per length and velocity \[kg/(m s)\], not negative.
    pub air_drag: f64,
    /// Angle \[rad\] from the initial reference director to the axis of the radius `a`.
    pub base_rotation: f64,
}

impl Default for StrandMaterial {
    /// Human hair.
    fn default() -> Self {
        Self {
            young_modulus: 3.7e9,
            poisson_ratio: 0.37,
            density: 1320.0,
            viscosity: 0.0,
            stretch_multiplier: 1.0,
            air_drag: 0.0,
            base_rotation: 0.0,
        }
    }
}

impl StrandMaterial {
    /// Shear modulus \[Pa\].
    #[must_use]
    pub fn shear_modulus(&self) -> f64 {
        self.young_modulus / (2.0 * (1.0 + self.poisson_ratio))
    }

    /// Refuses values outside their range, naming the field and the range.
    pub fn check(&self) -> Result<(), RodError> {
        let positive = |v: f64| v.is_finite() && v > 0.0;
        let not_negative = |v: f64| v.is_finite() && v >= 0.0;
        let bad = |field, range| Err(RodError::Material { field, range });
        if !positive(self.young_modulus) {
            return bad("young_modulus", "positive and finite [Pa]");
        }
        if !(self.poisson_ratio > -1.0 && self.poisson_ratio <= 0.5) {
            return bad("poisson_ratio", "above -1 and at most 0.5");
        }
        if !positive(self.density) {
            return bad("density", "positive and finite [kg/m^3]");
        }
        if !not_negative(self.viscosity) {
            return bad("viscosity", "not negative and finite [Pa s]");
        }
        if !(self.stretch_multiplier > 0.0 && self.stretch_multiplier <= 1.0) {
            return bad("stretch_multiplier", "above 0 and at most 1");
        }
        if !not_negative(self.air_drag) {
            return bad("air_drag", "not negative and finite [kg/(m s)]");
        }
        if !self.base_rotation.is_finite() {
            return bad("base_rotation", "finite [rad]");
        }
        Ok(())
    }
}
