//! Pressure of a volume ratio and back: the volume part of a compressible neo-Hookean liquid.
//!
//! `W_v(J) = κ/2 (½(J² − 1) − ln J)`. Source: Fei et al. 2019, supplemental S4–S6, S52 (with the missing factor `J`).

use serde::{Deserialize, Serialize};

use crate::error::{RheologyError, require};

/// The pressure law of a liquid with bulk modulus κ.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EquationOfState {
    /// Bulk modulus κ [Pa], > 0.
    pub bulk_modulus: f64,
}

impl EquationOfState {
    /// A law with the given bulk modulus [Pa].
    ///
    /// # Errors
    /// [`RheologyError::Parameter`] unless the modulus is finite and positive.
    pub fn new(bulk_modulus: f64) -> Result<Self, RheologyError> {
        require("bulk modulus", bulk_modulus, bulk_modulus > 0.0, "finite, above 0 Pa")?;
        Ok(EquationOfState { bulk_modulus })
    }

    /// Energy per rest volume [J/m³] at the volume ratio `j`.
    #[must_use]
    pub fn energy(&self, j: f64) -> f64 {
        0.5 * self.bulk_modulus * (0.5 * (j * j - 1.0) - j.ln())
    }

    /// Pressure [Pa], positive in compression: `p = κ/2 (1/J − J)`.
    #[must_use]
    pub fn pressure(&self, j: f64) -> f64 {
        // (1 − J)(1 + J)/J keeps the digits of a nearly incompressible liquid
        0.5 * self.bulk_modulus * (1.0 - j) * (1.0 + j) / j
    }

    /// Second derivative of the energy `W_v'' = κ/2 (1 + 1/J²)` [Pa], minus the slope of the pressure.
    #[must_use]
    pub fn stiffness(&self, j: f64) -> f64 {
        0.5 * self.bulk_modulus * (1.0 + 1.0 / (j * j))
    }

    /// Rate of pressure per rate of volume, `J W_v'' = κ/2 (J + 1/J)` [Pa]: `dp/dt = −(J W_v'') ∇·u`.
    #[must_use]
    pub fn volumetric_stiffness(&self, j: f64) -> f64 {
        0.5 * self.bulk_modulus * (j + 1.0 / j)
    }

    /// Volume ratio at the pressure `p` [Pa]: `J = exp(−asinh(p/κ))`, positive for every pressure.
    #[must_use]
    pub fn volume_ratio(&self, pressure: f64) -> f64 {
        (-(pressure / self.bulk_modulus).asinh()).exp()
    }

    /// Speed of sound [m/s] at rest of a liquid with the given rest density [kg/m³].
    #[must_use]
    pub fn sound_speed(&self, density: f64) -> f64 {
        (self.bulk_modulus / density).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_inverse_undoes_the_pressure(kappa in 1e2f64..1e10, ln_j in -3.0f64..3.0) {
            let law = EquationOfState::new(kappa).unwrap();
            let j = ln_j.exp();
            prop_assert!((law.volume_ratio(law.pressure(j)) / j - 1.0).abs() < 1e-13);
        }

        #[test]
        fn pressure_and_stiffness_are_derivatives_of_the_energy(j in 0.2f64..4.0) {
            let law = EquationOfState { bulk_modulus: 7.0 };
            let h = 1e-4;
            let first = (law.energy(j + h) - law.energy(j - h)) / (2.0 * h);
            let second = (law.energy(j + h) - 2.0 * law.energy(j) + law.energy(j - h)) / (h * h);
            prop_assert!((first + law.pressure(j)).abs() < 1e-5 * law.stiffness(j));
            prop_assert!((second - law.stiffness(j)).abs() < 1e-5 * law.stiffness(j));
            prop_assert!((law.volumetric_stiffness(j) - j * law.stiffness(j)).abs() < 1e-12 * law.stiffness(j));
        }
    }

    /// Hydrostatic column of 50 cm, integrated here with fine midpoint steps: pressures and ratios of the specification.
    #[test]
    fn hydrostatic_column_of_foams() {
        for (density, kappa, p_ref, j_ref) in [(200.0, 1.09e5, 985.441, 0.991000), (275.0, 1.09e5, 1357.29, 0.987625)] {
            let law = EquationOfState { bulk_modulus: kappa };
            let (mut p, steps) = (0.0, 2000);
            for _ in 0..steps {
                let dz = 0.5 / steps as f64;
                let half = p + 0.5 * dz * density * 9.81 / law.volume_ratio(p);
                p += dz * density * 9.81 / law.volume_ratio(half);
            }
            approx::assert_relative_eq!(p, p_ref, max_relative = 1e-5);
            approx::assert_relative_eq!(law.volume_ratio(p), j_ref, max_relative = 1e-6);
        }
    }
}
