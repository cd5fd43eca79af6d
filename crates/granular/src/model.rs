//! From a modulus, a density and a packing to springs, masses and a time scale.
//!
//! Units of this room: length µm, time s, mass mg per metre of depth, hence force µm mg s⁻² per m (times 1e-12 gives N/m),
//! spring mg s⁻² per m, torque µm² mg s⁻² per m; stress in Pa. They keep every number of a soft-grain cell near one and
//! are the units of the reference data.

use crate::error::{GranularError, require};
use crate::law::{CentralLaw, Tension};
use serde::{Deserialize, Serialize};

/// Which rules the simulation follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Mode {
    /// Each contact evaluated once, spring kept at the Coulomb limit, order- and thread-independent.
    #[default]
    Physical,
    /// The visiting order and rules of the published program, with its faults, to reproduce its data.
    Compat,
}

/// How the two sizes are distributed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Radii {
    /// Each grain large or small with probability one half.
    Random,
    /// Exactly half of the grains large; the realised packing equals the nominal one for even counts.
    #[default]
    ExactHalf,
}

/// Discs or spheres.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Dimension {
    /// Discs in the plane, quantities per metre of depth (default).
    #[default]
    Two,
    /// Spheres; masses in mg, springs in mg s⁻². Physical mode only.
    Three,
}

/// The material and the box: everything that fixes masses, springs and the time scale.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ModelSettings {
    /// Discs or spheres.
    pub dimension: Dimension,
    /// Number of grains [-], at least 2. More grains: smaller finite-size error, cost linear.
    pub grains: usize,
    /// Width of the box along the flow [µm].
    pub width: f64,
    /// Height of the box along the gradient [µm].
    pub height: f64,
    /// Depth of the box along the vorticity [µm], spheres only; 0 takes the width.
    pub depth: f64,
    /// Nominal packing: summed disc area over box area, or sphere volume over box volume [-], 0.01 … 4. Above about 0.84 (discs) or
    /// 0.64 (spheres) the grains press on each other.
    pub packing: f64,
    /// Young modulus of a grain [Pa]. Stress scales with it, time with its inverse root.
    pub young_modulus: f64,
    /// Density of the grains [kg/m³].
    pub density: f64,
    /// Ratio of the two radii [-], 1 … 4; 1 gives equal grains, which crystallise.
    pub size_ratio: f64,
    /// How the two sizes are distributed.
    pub radii: Radii,
    /// Coulomb coefficient of transient contacts [-], 0 … 1000.
    pub friction: f64,
    /// Viscosity of a contact relative to `sqrt(m k)` [-]; larger damps more and may need a smaller step.
    pub relative_viscosity: f64,
    /// Tangential over central spring constant [-]; applies to the viscosity as well.
    pub tangential_ratio: f64,
    /// Compression law.
    pub law: CentralLaw,
    /// Tension law of permanent links.
    pub tension: Tension,
    /// Factor by which transient contacts are stiffer than permanent links, centrally [-].
    pub reinforcement_central: f64,
    /// The same tangentially [-].
    pub reinforcement_tangential: f64,
    /// Leaves the viscosities out of the reinforcement.
    pub keep_viscosity: bool,
}

impl Default for ModelSettings {
    fn default() -> Self {
        Self {
            dimension: Dimension::Two,
            grains: 150,
            width: 500.0,
            height: 500.0,
            depth: 0.0,
            packing: 1.5,
            young_modulus: 8000.0,
            density: 50.0,
            size_ratio: 1.4,
            radii: Radii::ExactHalf,
            friction: 0.01,
            relative_viscosity: 0.1,
            tangential_ratio: 1.0,
            law: CentralLaw::default(),
            tension: Tension::Linear,
            reinforcement_central: 1.0,
            reinforcement_tangential: 1.0,
            keep_viscosity: false,
        }
    }
}

/// Constants derived from [`ModelSettings`], in the units of this room.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ModelConstants {
    /// Mass of the model grain [mg/m].
    pub mass: f64,
    /// Spring constant without reinforcement [mg s⁻²/m].
    pub spring: f64,
    /// Characteristic time `sqrt(m/k)` [s].
    pub time: f64,
    /// Mean radius of the bimodal packing [µm].
    pub mean_radius: f64,
    /// Large radius [µm].
    pub large: f64,
    /// Small radius [µm].
    pub small: f64,
}

impl ModelSettings {
    /// Derives mass, spring, time scale and radii (manual S1-7, S1-8, S1-14).
    ///
    /// Spheres take the spring of a cylinder as long as their mean diameter.
    pub fn constants(&self) -> ModelConstants {
        if self.dimension == Dimension::Three {
            return self.sphere_constants();
        }
        let n = self.grains as f64;
        let area = self.width * self.height;
        let model_radius = (area * self.packing / (n * std::f64::consts::PI)).sqrt();
        let mass = std::f64::consts::PI * (model_radius * 1e-6).powi(2) * self.density * 1e6;
        let spring = std::f64::consts::PI / 8.0 * self.young_modulus * 1e6;
        let (u, l) = (self.size_ratio.sqrt(), 1.0 / self.size_ratio.sqrt());
        let mean_radius = (2.0 * area * self.packing / (n * std::f64::consts::PI * (u * u + l * l))).sqrt();
        ModelConstants {
            mass,
            spring,
            time: (mass / spring).sqrt(),
            mean_radius,
            large: mean_radius * u,
            small: mean_radius * l,
        }
    }

    fn sphere_constants(&self) -> ModelConstants {
        let volume = self.width * self.height * self.depth();
        let per_sphere = 4.0 / 3.0 * std::f64::consts::PI * self.grains as f64;
        let model_radius = (volume * self.packing / per_sphere).cbrt();
        // µm³ · kg/m³ = 1e-12 mg.
        let mass = 4.0 / 3.0 * std::f64::consts::PI * model_radius.powi(3) * self.density * 1e-12;
        let (u, l) = (self.size_ratio.sqrt(), 1.0 / self.size_ratio.sqrt());
        let mean_radius = (2.0 * volume * self.packing / (per_sphere * (u.powi(3) + l.powi(3)))).cbrt();
        let spring = std::f64::consts::PI / 8.0 * self.young_modulus * 1e6 * (2.0 * mean_radius * 1e-6);
        ModelConstants {
            mass,
            spring,
            time: (mass / spring).sqrt(),
            mean_radius,
            large: mean_radius * u,
            small: mean_radius * l,
        }
    }

    /// Depth of the box [µm].
    pub fn depth(&self) -> f64 {
        if self.depth > 0.0 { self.depth } else { self.width }
    }

    /// Builds the contact model: springs and viscosities with reinforcement and the ratios of permanent links.
    pub fn contact_model(&self) -> ContactModel {
        let c = self.constants();
        let viscosity = self.relative_viscosity * c.spring * c.time;
        let (kc, kt) = (self.reinforcement_central, self.reinforcement_tangential);
        let (vc, vt) = if self.keep_viscosity { (1.0, 1.0) } else { (kc, kt) };
        ContactModel {
            spring: c.spring * kc,
            viscosity: viscosity * vc,
            tangential_spring: c.spring * self.tangential_ratio * kt,
            tangential_viscosity: viscosity * self.tangential_ratio * vt,
            friction: self.friction,
            law: self.law.clone(),
            tension: self.tension,
            permanent_ratio_central: 1.0 / kc,
            permanent_ratio_tangential: 1.0 / kt,
            keep_viscosity: self.keep_viscosity,
        }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`GranularError::Setting`] naming the first field out of range.
    pub fn check(&self) -> Result<(), GranularError> {
        require("grains", self.grains as f64, |n| n >= 2.0, "at least 2")?;
        require("width", self.width, |v| v > 0.0, "positive [µm]")?;
        require("height", self.height, |v| v > 0.0, "positive [µm]")?;
        require("depth", self.depth, |v| v >= 0.0, "not negative [µm]")?;
        require("packing", self.packing, |v| (0.01..=4.0).contains(&v), "0.01 … 4")?;
        require("young_modulus", self.young_modulus, |v| v > 0.0, "positive [Pa]")?;
        require("density", self.density, |v| v > 0.0, "positive [kg/m³]")?;
        require("size_ratio", self.size_ratio, |v| (1.0..=4.0).contains(&v), "1 … 4")?;
        require("friction", self.friction, |v| (0.0..=1000.0).contains(&v), "0 … 1000")?;
        require("relative_viscosity", self.relative_viscosity, |v| (0.0..=100.0).contains(&v), "0 … 100")?;
        require("tangential_ratio", self.tangential_ratio, |v| (0.0..=100.0).contains(&v), "0 … 100")?;
        require("reinforcement_central", self.reinforcement_central, |v| v > 0.0, "positive")?;
        require("reinforcement_tangential", self.reinforcement_tangential, |v| v > 0.0, "positive")?;
        if let Tension::Saturating { strain } = self.tension {
            require("tension strain", strain, |v| v > 0.0, "positive")?;
        }
        self.law.check()
    }
}

/// Coefficients of all contact forces.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ContactModel {
    /// Central spring constant of transient contacts [mg s⁻²/m].
    pub spring: f64,
    /// Central viscosity of transient contacts [mg s⁻¹/m].
    pub viscosity: f64,
    /// Tangential spring constant of transient contacts [mg s⁻²/m].
    pub tangential_spring: f64,
    /// Tangential viscosity of transient contacts [mg s⁻¹/m].
    pub tangential_viscosity: f64,
    /// Coulomb coefficient [-].
    pub friction: f64,
    /// Compression law.
    pub law: CentralLaw,
    /// Tension law of permanent links.
    pub tension: Tension,
    /// Permanent over transient central coefficients [-].
    pub permanent_ratio_central: f64,
    /// Permanent over transient tangential coefficients [-].
    pub permanent_ratio_tangential: f64,
    /// Leaves the viscosities of permanent links unscaled.
    pub keep_viscosity: bool,
}

impl ContactModel {
    /// Factors on (central spring, central viscosity, tangential spring, tangential viscosity) of a permanent link.
    #[inline(always)]
    pub fn permanent_factors(&self) -> [f64; 4] {
        let (c, t) = (self.permanent_ratio_central, self.permanent_ratio_tangential);
        if self.keep_viscosity { [c, 1.0, t, 1.0] } else { [c, c, t, t] }
    }

    /// Elastic central force of a permanent link without ratio: tension beyond `rest`, compression law below.
    #[inline(always)]
    pub fn link_force(&self, d: f64, rest: f64) -> f64 {
        if d > rest { self.tension.force(d, rest, self.spring) } else { self.law.force(d, rest, self.spring) }
    }
}

/// Kind of a contact, as drawn: stick red, slip green, link blue.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[repr(u8)]
pub enum ContactKind {
    /// No contact.
    #[default]
    Apart = 0,
    /// Transient, tangential spring active.
    Stick = 1,
    /// Transient, at the Coulomb limit.
    Slip = 2,
    /// Permanent link.
    Permanent = 3,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn default_constants_are_those_of_the_reference_runs() {
        let settings = ModelSettings::default();
        let c = settings.constants();
        // dt = tau/56 and f = 0.025/tau of set U_mu001_A02_p15.
        assert!((c.time / 56.0 / 1.1263984473304288e-07 - 1.0).abs() < 1e-14);
        assert!((0.025 / c.time / 3963.327297606011 - 1.0).abs() < 1e-14);
        assert!((c.mass - 0.125).abs() < 1e-15);
        let twenty = ModelSettings { grains: 20, ..ModelSettings::default() };
        let d = twenty.constants();
        assert!((d.time / 1.7274707473566775e-05 - 1.0).abs() < 1e-14);
        // The table of that run lists diameters halved once more: 59.27 and 88.90 are r_mean b^∓1/2 of this count.
        assert!((d.large / d.small - 1.4).abs() < 1e-14);
    }

    #[test]
    fn realised_area_equals_the_packing_for_half_and_half() {
        let settings = ModelSettings { packing: 1.7, ..ModelSettings::default() };
        let c = settings.constants();
        let area = 75.0 * std::f64::consts::PI * (c.large * c.large + c.small * c.small);
        assert!((area / 250_000.0 / 1.7 - 1.0).abs() < 1e-14);
    }

    #[test]
    fn nonsense_is_refused_by_name() {
        let bad = ModelSettings { packing: f64::NAN, ..ModelSettings::default() };
        assert!(matches!(bad.check(), Err(GranularError::Setting { name: "packing", .. })));
        assert!(ModelSettings::default().check().is_ok());
    }
}
