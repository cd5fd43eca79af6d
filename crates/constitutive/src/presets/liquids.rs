//! The liquids of Fei et al. 2019, table S14, and the variants found in the authors' scenes.
//!
//! Deviations from the printed table: the consistency of drilling mud is 6.49 Ba·sⁿ (the print lost the exponent; ten times
//! less would be far too thin for a bentonite mud). Water and tetrachloroethylene have no shear modulus and are Newtonian in
//! the rheometer's reading. The printed milk chocolate is aerated (density 0.95, soft in compression); `chocolate-dense` is
//! solid chocolate.

use serde::{Deserialize, Serialize};

use crate::error::{RheologyError, require};
use crate::flow_curve::FlowCurve;
use crate::liquid_law::{HerschelBulkley, LawSettings};

/// Everything the simulator knows about a liquid, in SI.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Liquid {
    /// Rest density [kg/m³], > 0.
    pub density: f64,
    /// Bulk modulus κ [Pa], > 0: resistance to compression; from 1e8 Pa on treated as incompressible in reports.
    pub bulk_modulus: f64,
    /// Shear modulus μ [Pa], ≥ 0: stiffness before yield; 0 makes the liquid Newtonian in the bulk.
    pub shear_modulus: f64,
    /// Yield stress, consistency and index.
    pub flow: FlowCurve,
    /// Surface tension [N/m], ≥ 0: pulls wet strands together.
    pub surface_tension: f64,
    /// Contact angle on strands [rad], 0 to π.
    pub contact_angle: f64,
    /// Plastic strain `‖dev C^P‖` at which the liquid tears; `None`: never.
    pub tearing_strain: Option<f64>,
    /// Time in which the plastic history heals [s]; `None`: never.
    pub recovery_time: Option<f64>,
    /// Film height a strand takes up when it leaves the liquid [m], > 0.
    pub film_height: f64,
    /// Rayleigh damping of the shear solve [s], ≥ 0: damps elastic vibration of unyielded liquid.
    pub shear_damping: f64,
}

/// Names of all liquids, the eight published ones first.
pub const LIQUID_NAMES: [&str; 11] = [
    "water",
    "tetrachloroethylene",
    "drilling-mud",
    "acrylic-paint",
    "milk-cream",
    "shaving-cream",
    "oyster-sauce",
    "milk-chocolate",
    "drilling-mud-v2",
    "chocolate-dense",
    "mayonnaise",
];

/// A row in CGS: density, bulk modulus, shear modulus, yield stress, consistency, index, surface tension.
struct Row([f64; 7]);

impl Row {
    fn liquid(&self) -> Liquid {
        let [density, bulk, shear, yield_stress, consistency, index, tension] = self.0;
        let newtonian = shear == 0.0;
        let flow = if newtonian {
            FlowCurve::Rheometer { yield_stress: 0.1 * yield_stress, consistency: 0.1 * consistency, index }
        } else {
            FlowCurve::J2 { yield_stress: 0.1 * yield_stress, consistency: 0.1 * consistency, index }
        };
        Liquid {
            density: 1000.0 * density,
            bulk_modulus: 0.1 * bulk,
            shear_modulus: 0.1 * shear,
            flow,
            surface_tension: 1e-3 * tension,
            contact_angle: std::f64::consts::FRAC_PI_3,
            tearing_strain: if newtonian { None } else { Some(217.5) },
            recovery_time: if newtonian { None } else { Some(0.35) },
            film_height: 5e-4,
            shear_damping: if newtonian { 0.0 } else { 1e-3 },
        }
    }
}

impl Liquid {
    /// The liquid of the given name (see [`LIQUID_NAMES`]; underscores count as hyphens).
    ///
    /// # Errors
    /// [`RheologyError::UnknownMaterial`] if there is none.
    pub fn preset(name: &str) -> Result<Liquid, RheologyError> {
        let row = match name.replace('_', "-").as_str() {
            "water" => Row([1.0, 2.0e10, 0.0, 0.0, 8.9e-3, 1.0, 72.0]),
            "tetrachloroethylene" => Row([1.622, 3.1e10, 0.0, 0.0, 8.9e-3, 1.0, 72.8]),
            "drilling-mud" => Row([1.22, 2.0e10, 1.0e3, 16.813, 6.49, 0.5173, 72.8]),
            "acrylic-paint" => Row([0.95, 1.35e9, 4.0e3, 9.6, 173.56, 0.3162, 72.8]),
            "milk-cream" => Row([0.275, 1.09e6, 1.6e4, 1.2e3, 50.0, 0.27, 72.8]),
            "shaving-cream" => Row([0.2, 1.09e6, 2.9e3, 3.19e2, 2.72e2, 0.22, 72.8]),
            "oyster-sauce" => Row([1.207, 2.0e10, 4.0e3, 26.5, 16.1, 0.62, 72.8]),
            "milk-chocolate" => Row([0.95, 4.28e6, 4.0e3, 3.0e2, 28.0, 0.98, 72.8]),
            "drilling-mud-v2" => Row([1.22, 2.0e10, 1.0e3, 30.6, 1.259, 0.8175, 72.8]),
            "chocolate-dense" => Row([1.27, 1.35e9, 5.0e3, 3.0e2, 28.0, 0.98, 72.8]),
            "mayonnaise" => Row([1.2, 2.0e10, 1.0e4, 75.4, 447.2, 0.316, 72.8]),
            _ => return Err(RheologyError::UnknownMaterial(name.to_owned())),
        };
        let mut liquid = row.liquid();
        if name.replace('_', "-").starts_with("drilling-mud") {
            liquid.tearing_strain = Some(10.0);
        }
        Ok(liquid)
    }

    /// Whether reports call the liquid compressible: a bulk modulus below 1e8 Pa.
    #[must_use]
    pub fn is_compressible(&self) -> bool {
        self.bulk_modulus < 1e8
    }

    /// Its law of one material point.
    ///
    /// # Errors
    /// [`RheologyError::Parameter`] if a number lies outside its range.
    pub fn law(&self, settings: LawSettings) -> Result<HerschelBulkley, RheologyError> {
        HerschelBulkley::new(self.bulk_modulus, self.shear_modulus, &self.flow, settings)
    }

    /// Checks all ranges.
    ///
    /// # Errors
    /// [`RheologyError::Parameter`] naming the first number outside its range.
    pub fn check(&self) -> Result<(), RheologyError> {
        self.law(LawSettings::default())?;
        require("density", self.density, self.density > 0.0, "finite, above 0 kg/m³")?;
        require("surface tension", self.surface_tension, self.surface_tension >= 0.0, "finite, at least 0 N/m")?;
        let angle = self.contact_angle;
        require("contact angle", angle, (0.0..=std::f64::consts::PI).contains(&angle), "0 to π rad")?;
        if let Some(strain) = self.tearing_strain {
            require("tearing strain", strain, strain > 0.0, "finite, above 0, or none")?;
        }
        if let Some(time) = self.recovery_time {
            require("recovery time", time, time > 0.0, "finite, above 0 s, or none")?;
        }
        require("film height", self.film_height, self.film_height > 0.0, "finite, above 0 m")?;
        require("shear damping", self.shear_damping, self.shear_damping >= 0.0, "finite, at least 0 s")?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow_curve::{FlowClass, RheologyReading};

    #[test]
    fn every_name_gives_a_valid_liquid_of_the_published_class() {
        for name in LIQUID_NAMES {
            let liquid = Liquid::preset(name).unwrap();
            liquid.check().unwrap();
            assert_eq!(liquid.shear_modulus == 0.0, liquid.flow.class() == FlowClass::Newtonian, "{name}");
        }
        let compressible: Vec<_> =
            LIQUID_NAMES.iter().filter(|n| Liquid::preset(n).unwrap().is_compressible()).copied().collect();
        assert_eq!(compressible, ["milk-cream", "shaving-cream", "milk-chocolate"]);
        assert_eq!(Liquid::preset("milk-chocolate").unwrap().flow.class(), FlowClass::NearBingham);
        assert_eq!(Liquid::preset("drilling_mud").unwrap().flow.class(), FlowClass::ShearThinning);
        assert!(Liquid::preset("honey").is_err());
    }

    #[test]
    fn numbers_are_si() {
        let cream = Liquid::preset("shaving-cream").unwrap();
        assert_eq!((cream.density, cream.shear_modulus), (200.0, 290.0));
        approx::assert_relative_eq!(cream.flow.rheometer().0, 18.4175, max_relative = 1e-5);
        approx::assert_relative_eq!(cream.flow.rheometer().1, 17.8214, max_relative = 1e-5);
        let water = Liquid::preset("water").unwrap();
        assert_eq!(water.flow.reading(), RheologyReading::Rheometer);
        approx::assert_relative_eq!(water.flow.viscosity(1.0), 8.9e-4, max_relative = 1e-14);
        approx::assert_relative_eq!(
            water.law(LawSettings::default()).unwrap().newtonian_viscosity,
            8.9e-4,
            max_relative = 1e-14
        );
    }
}
