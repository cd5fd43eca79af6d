//! Materials by name: fibres and liquids, from presets or own values.

use super::declare::{choice, section};
use super::presets;
use super::quantity::{above, at_least};

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
        poisson_ratio: Option<f64> = [None] (Number, above(-1.0).up_to(0.5)) "Only the stiffness against twist depends on it.";
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
        recovery_time: Option<f64> = [None] (Time, above(0.0)) "";
    }
}

choice! {
    /// A material.
    pub enum Material {
        /// For strands.
        Fibre(Fibre) ();
        /// For bulk liquid and films.
        Liquid(LiquidMaterial) ();
    }
}

/// A fibre with every value known [SI].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FibreProperties {
    /// Density [kg/m³].
    pub density: f64,
    /// Young's modulus [Pa].
    pub young_modulus: f64,
    /// Poisson ratio.
    pub poisson_ratio: f64,
    /// Internal viscosity [Pa·s].
    pub viscosity: f64,
    /// Factor on the stretch stiffness.
    pub stretch_factor: f64,
}

/// The reading of flow parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlowReading {
    /// The model's J2 law.
    J2,
    /// Simple shear in a rheometer.
    Rheometer,
}

/// Flow parameters with every value known [SI].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowProperties {
    /// How to read the numbers.
    pub reading: FlowReading,
    /// Yield stress [Pa].
    pub yield_stress: f64,
    /// Consistency [Pa·sⁿ].
    pub consistency: f64,
    /// Flow index.
    pub index: f64,
}

/// A liquid with every value known [SI].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LiquidProperties {
    /// Density [kg/m³].
    pub density: f64,
    /// Bulk modulus [Pa].
    pub bulk_modulus: f64,
    /// Shear modulus [Pa].
    pub shear_modulus: f64,
    /// Flow law.
    pub flow: FlowProperties,
    /// Surface tension [N/m].
    pub surface_tension: f64,
    /// Contact angle [rad].
    pub contact_angle: f64,
    /// Plastic strain at tearing.
    pub tearing_strain: f64,
    /// Healing time [s].
    pub recovery_time: f64,
}

impl Fibre {
    /// The values with the preset's where none are given, or the name of the first value that is missing.
    ///
    /// # Errors
    /// The missing field (`preset` if that preset does not exist).
    pub fn properties(&self) -> Result<FibreProperties, &'static str> {
        let preset = match &self.preset {
            Some(name) => Some(presets::fibre(name).ok_or("preset")?.properties),
            None => None,
        };
        let value =
            |own: Option<f64>, of: fn(&FibreProperties) -> f64, name| own.or(preset.as_ref().map(of)).ok_or(name);
        Ok(FibreProperties {
            density: value(self.density, |p| p.density, "density")?,
            young_modulus: value(self.young_modulus, |p| p.young_modulus, "young_modulus")?,
            poisson_ratio: value(self.poisson_ratio, |p| p.poisson_ratio, "poisson_ratio")?,
            viscosity: value(self.viscosity, |p| p.viscosity, "viscosity").unwrap_or(0.0),
            stretch_factor: self.stretch_factor,
        })
    }
}

impl LiquidMaterial {
    /// The values with the preset's where none are given, or the name of the first value that is missing.
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
        let flow = match &self.flow {
            None => preset.map(|p| p.flow).ok_or("flow")?,
            Some(flow) => {
                let (reading, own) = match flow {
                    Flow::J2(values) => (FlowReading::J2, values),
                    Flow::Rheometer(values) => (FlowReading::Rheometer, values),
                };
                let base = preset.map(|p| p.flow).filter(|base| base.reading == reading);
                FlowProperties {
                    reading,
                    yield_stress: own.yield_stress.or(base.map(|b| b.yield_stress)).ok_or("flow.yield_stress")?,
                    consistency: own.consistency.or(base.map(|b| b.consistency)).ok_or("flow.consistency")?,
                    index: own.index.or(base.map(|b| b.index)).ok_or("flow.index")?,
                }
            }
        };
        Ok(LiquidProperties {
            density: value(self.density, |p| p.density, "density")?,
            bulk_modulus: value(self.bulk_modulus, |p| p.bulk_modulus, "bulk_modulus")?,
            shear_modulus: value(self.shear_modulus, |p| p.shear_modulus, "shear_modulus")?,
            flow,
            surface_tension: self.surface_tension.or(preset.map(|p| p.surface_tension)).unwrap_or(0.0),
            contact_angle: self.contact_angle.or(preset.map(|p| p.contact_angle)).unwrap_or(60f64.to_radians()),
            tearing_strain: self.tearing_strain.or(preset.map(|p| p.tearing_strain)).unwrap_or(1e8),
            recovery_time: self.recovery_time.or(preset.map(|p| p.recovery_time)).unwrap_or(0.35),
        })
    }
}
