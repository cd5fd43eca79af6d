//! The fibres of the published scenes.

use serde::{Deserialize, Serialize};

use crate::error::{RheologyError, require};

/// Everything the simulator knows about the material of a strand, in SI.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fibre {
    /// Radius of the circular cross-section [m], > 0; a strand may say its own.
    pub radius: f64,
    /// Density [kg/m³], > 0.
    pub density: f64,
    /// Young's modulus [Pa], > 0.
    pub young_modulus: f64,
    /// Poisson's ratio, above −1 and below 0.5: torsion stiffness `E/2(1 + ν)`.
    pub poisson_ratio: f64,
    /// Internal viscosity [Pa·s], ≥ 0: damps stretching, bending and twisting.
    pub viscosity: f64,
    /// Slip length of liquid on the surface [m], ≥ 0: lets thin films move.
    pub slip_length: f64,
}

/// Names of all fibres.
pub const FIBRE_NAMES: [&str; 3] = ["hair", "brush", "noodle"];

impl Fibre {
    /// The fibre of the given name (see [`FIBRE_NAMES`]).
    ///
    /// The source gives radius and modulus of the brush bristle; density, Poisson's ratio and viscosity are those of hair.
    ///
    /// # Errors
    /// [`RheologyError::UnknownMaterial`] if there is none.
    pub fn preset(name: &str) -> Result<Fibre, RheologyError> {
        // CGS: radius, density, Young's modulus, Poisson's ratio, viscosity, slip length
        let [radius, density, young, poisson, viscosity, slip] = match name {
            "hair" => [0.005, 1.32, 3.7e10, 0.37, 3.7e8, 2e-4],
            "brush" => [0.0125, 1.32, 2.98e10, 0.37, 3.7e8, 2e-4],
            "noodle" => [0.056, 1.0, 1.0e6, 0.37, 4.0e5, 2e-4],
            _ => return Err(RheologyError::UnknownMaterial(name.to_owned())),
        };
        Ok(Fibre {
            radius: 0.01 * radius,
            density: 1000.0 * density,
            young_modulus: 0.1 * young,
            poisson_ratio: poisson,
            viscosity: 0.1 * viscosity,
            slip_length: 0.01 * slip,
        })
    }

    /// Shear modulus `E/2(1 + ν)` [Pa].
    #[must_use]
    pub fn shear_modulus(&self) -> f64 {
        self.young_modulus / (2.0 * (1.0 + self.poisson_ratio))
    }

    /// Checks all ranges.
    ///
    /// # Errors
    /// [`RheologyError::Parameter`] naming the first number outside its range.
    pub fn check(&self) -> Result<(), RheologyError> {
        require("radius", self.radius, self.radius > 0.0, "finite, above 0 m")?;
        require("density", self.density, self.density > 0.0, "finite, above 0 kg/m³")?;
        require("Young's modulus", self.young_modulus, self.young_modulus > 0.0, "finite, above 0 Pa")?;
        let nu = self.poisson_ratio;
        require("Poisson's ratio", nu, nu > -1.0 && nu < 0.5, "above -1, below 0.5")?;
        require("viscosity", self.viscosity, self.viscosity >= 0.0, "finite, at least 0 Pa·s")?;
        require("slip length", self.slip_length, self.slip_length >= 0.0, "finite, at least 0 m")?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_are_valid_and_si() {
        for name in FIBRE_NAMES {
            Fibre::preset(name).unwrap().check().unwrap();
        }
        let hair = Fibre::preset("hair").unwrap();
        assert_eq!((hair.radius, hair.density), (5e-5, 1320.0));
        approx::assert_relative_eq!(hair.young_modulus, 3.7e9, max_relative = 1e-15);
        assert!(Fibre::preset("rope").is_err());
    }
}
