//! Materials by name: fibres and liquids, from presets or own values.

use super::declare::{choice, section};
use super::presets::{self, FibrePreset, LiquidProperties};
use super::quantity::{above, at_least};
use super::yarn::YarnMaterial;
use constitutive::FlowCurve;
use std::f64::consts::FRAC_PI_3;

section! {
    /// What strands are made of. Every value not given comes from the preset; without a preset all but `viscosity` are needed.
    pub struct Fibre {
        /// `"hair"`, `"brush"` or `"noodle"`.
        preset: Option<String> = [None] () "";
        /// Mass density.
        density: Option<f64> = [None] (Density, above(0.0).up_to(1e5)) "Heavier strands sag more and swing slower.";
        /// Young's modulus.
        young_modulus: Option<f64> = [None] (Pressure, above(0.0).up_to(1e14)) "Stiffness of bending and stretching; frequencies grow with its root.";
        /// Poisson ratio; the shear modulus is `E / 2(1+ν)`.
        poisson_ratio: Option<f64> = [None] (Number, above(-1.0).below(0.5)) "Only the stiffness against twist depends on it.";
        /// Internal (Kelvin–Voigt) viscosity.
        viscosity: Option<f64> = [None] (Viscosity, at_least(0.0).up_to(1e13)) "Damps bending, twist and stretch; 0 conserves energy.";
        /// Factor on the stiffness against stretch only.
        stretch_factor: f64 = [1.0] (Number, above(0.0).up_to(1e3)) "Below 1 softens stretch for larger steps, at the price of a wrong length: keep 1 where it matters.";
    }
}

section! {
    /// Shear stress at yield and flow. Every value not given comes from the preset, if that is stated in the same reading.
    pub struct FlowValues {
        /// Yield stress.
        yield_stress: Option<f64> = [None] (Pressure, at_least(0.0).up_to(1e9)) "Below it the material does not flow; 0 for a power law.";
        /// Consistency `K` of `stress = yield stress + K·rateⁿ`.
        consistency: Option<f64> = [None] (Consistency, at_least(0.0).up_to(1e9)) "Thicker with larger values; 0 is perfectly plastic.";
        /// Flow index `n`.
        index: Option<f64> = [None] (Number, above(0.0).up_to(5.0)) "1 is Bingham or Newtonian, below 1 shear-thinning, above 1 shear-thickening.";
    }
}

choice! {
    /// The two readings of flow parameters.
    pub enum Flow {
        /// As the model's J2 flow law takes them: uniaxial (von Mises) yield stress, consistency on Frobenius norms. The shear viscosity at n = 1 is half the consistency.
        J2(FlowValues) ();
        /// As a rheometer measures them in simple shear.
        Rheometer(FlowValues) ();
    }
}

section! {
    /// What flows. Every value not given comes from the preset; without a preset `density`, `bulk_modulus`, `shear_modulus` and a whole `flow` are needed.
    pub struct LiquidMaterial {
        /// `"water"`, `"tetrachloroethylene"`, `"drilling-mud"`, `"drilling-mud-v2"`, `"acrylic-paint"`, `"milk-cream"`, `"shaving-cream"`, `"oyster-sauce"`, `"milk-chocolate"`, `"chocolate-dense"` or `"mayonnaise"`.
        preset: Option<String> = [None] () "";
        /// Rest density.
        density: Option<f64> = [None] (Density, above(0.0).up_to(1e5)) "";
        /// Bulk modulus.
        bulk_modulus: Option<f64> = [None] (Pressure, above(0.0).up_to(1e13)) "Resistance to compression; foams have low values. Implicit: it does not limit the step.";
        /// Shear modulus; 0 for a liquid without elasticity in shear.
        shear_modulus: Option<f64> = [None] (Pressure, at_least(0.0).up_to(1e13)) "Stiffness below yield. Above about a hundred yield stresses the result hardly depends on it.";
        /// Yield stress, consistency and flow index, in one of two readings.
        flow: Option<Flow> = [None] () "";
        /// Surface tension against air.
        surface_tension: Option<f64> = [None] (SurfaceTension, at_least(0.0).up_to(10.0)) "Strength of capillary bridges between strands.";
        /// Contact angle on strands.
        contact_angle: Option<f64> = [None] (Angle, at_least(0.0).up_to(std::f64::consts::PI)) "Above 90° bridges repel and cohesion is off.";
        /// Plastic strain at which threads tear.
        tearing_strain: Option<f64> = [None] (Number, above(0.0)) "1e8 or more: never.";
        /// Time over which broken bonds heal.
        recovery_time: Option<f64> = [None] (Time, above(0.0)) "1e8 s or more: never.";
        /// Height of the film that a strand takes up when it leaves the liquid.
        film_height: Option<f64> = [None] (Length, above(0.0).up_to(0.1)) "";
        /// Damping time of elastic vibration below yield.
        shear_damping: Option<f64> = [None] (Time, at_least(0.0).up_to(1.0)) "0 is the model; 1e-3 s calms foams without changing their flow.";
    }
}

choice! {
    /// A material.
    pub enum Material {
        /// For strands.
        Fibre(Fibre) ();
        /// For bulk liquid and films.
        Liquid(LiquidMaterial) ();
        /// For yarns.
        Yarn(YarnMaterial) ();
    }
}

/// A fibre with every value known \[SI\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FibreProperties {
    /// Density [kg/m³].
    pub density: f64,
    /// Young's modulus \[Pa\].
    pub young_modulus: f64,
    /// Poisson ratio.
    pub poisson_ratio: f64,
    /// Internal viscosity [Pa·s].
    pub viscosity: f64,
    /// Factor on the stretch stiffness.
    pub stretch_factor: f64,
}

impl Fibre {
    /// The values with the preset's where none are given, or the name of the first value that is missing.
    ///
    /// # Errors
    /// The missing field (`preset` if that preset does not exist).
    pub fn properties(&self) -> Result<FibreProperties, &'static str> {
        let preset = match &self.preset {
            Some(name) => Some(presets::fibre(name).ok_or("preset")?),
            None => None,
        };
        let value = |own: Option<f64>, of: fn(&FibrePreset) -> f64, name| own.or(preset.as_ref().map(of)).ok_or(name);
        Ok(FibreProperties {
            density: value(self.density, |p| p.density, "density")?,
            young_modulus: value(self.young_modulus, |p| p.young_modulus, "young_modulus")?,
            poisson_ratio: value(self.poisson_ratio, |p| p.poisson_ratio, "poisson_ratio")?,
            viscosity: value(self.viscosity, |p| p.viscosity, "viscosity").unwrap_or(0.0),
            stretch_factor: self.stretch_factor,
        })
    }
}

/// From this value on a tearing strain or a recovery time means never.
const NEVER: f64 = 1e8;

impl LiquidMaterial {
    /// The values with the preset's where none are given, or the name of the first value that is missing.
    ///
    /// Without a preset, what is not given is: no surface tension, a contact angle of 60°, no tearing, films of 0.5 mm,
    /// no damping.
    ///
    /// # Errors
    /// The missing field (`preset` if that preset does not exist).
    pub fn properties(&self) -> Result<LiquidProperties, &'static str> {
        let preset = match &self.preset {
            Some(name) => Some(presets::liquid(name).ok_or("preset")?),
            None => None,
        };
        let preset = preset.as_ref();
        let value = |own: Option<f64>, of: fn(&LiquidProperties) -> f64, name| own.or(preset.map(of)).ok_or(name);
        let or_never = |own: Option<f64>, of: fn(&LiquidProperties) -> Option<f64>| match own {
            Some(value) => (value < NEVER).then_some(value),
            None => preset.and_then(of),
        };
        Ok(LiquidProperties {
            density: value(self.density, |p| p.density, "density")?,
            bulk_modulus: value(self.bulk_modulus, |p| p.bulk_modulus, "bulk_modulus")?,
            shear_modulus: value(self.shear_modulus, |p| p.shear_modulus, "shear_modulus")?,
            flow: match &self.flow {
                None => preset.map(|p| p.flow).ok_or("flow")?,
                Some(flow) => flow.curve(preset.map(|p| p.flow))?,
            },
            surface_tension: self.surface_tension.or(preset.map(|p| p.surface_tension)).unwrap_or(0.0),
            contact_angle: self.contact_angle.or(preset.map(|p| p.contact_angle)).unwrap_or(FRAC_PI_3),
            tearing_strain: or_never(self.tearing_strain, |p| p.tearing_strain),
            recovery_time: or_never(self.recovery_time, |p| p.recovery_time),
            film_height: self.film_height.or(preset.map(|p| p.film_height)).unwrap_or(5e-4),
            shear_damping: self.shear_damping.or(preset.map(|p| p.shear_damping)).unwrap_or(0.0),
        })
    }
}

impl Flow {
    /// The flow curve, with the values of `base` where none are given and `base` is stated in the same reading.
    fn curve(&self, base: Option<FlowCurve>) -> Result<FlowCurve, &'static str> {
        let (own, base) = match (self, base) {
            (Flow::J2(own), Some(FlowCurve::J2 { yield_stress, consistency, index }))
            | (Flow::Rheometer(own), Some(FlowCurve::Rheometer { yield_stress, consistency, index })) => {
                (own, Some((yield_stress, consistency, index)))
            }
            (Flow::J2(own) | Flow::Rheometer(own), _) => (own, None),
        };
        let yield_stress = own.yield_stress.or(base.map(|b| b.0)).ok_or("flow.yield_stress")?;
        let consistency = own.consistency.or(base.map(|b| b.1)).ok_or("flow.consistency")?;
        let index = own.index.or(base.map(|b| b.2)).ok_or("flow.index")?;
        Ok(match self {
            Flow::J2(_) => FlowCurve::J2 { yield_stress, consistency, index },
            Flow::Rheometer(_) => FlowCurve::Rheometer { yield_stress, consistency, index },
        })
    }
}
