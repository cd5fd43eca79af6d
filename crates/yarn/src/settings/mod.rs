//! What a scene may say about yarns. Vectors are lists of two or three numbers, as the dimension asks.

mod boundary;
mod loads;
mod material;
mod step;

pub use boundary::{DomainSettings, Drive, ObstacleSettings, Pin, PinPlace, WallKind, WallSettings};
pub(crate) use loads::{AttractorSample, gravity};
pub use loads::{AttractorSettings, Interpolation, PathSettings};
pub use material::{Bending, ContactModuli, YarnMaterial};
pub use step::{ImplicitSettings, Integrator, OversizedStep, StepSettings};

use std::collections::BTreeMap;

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use crate::YarnError;
use crate::generate::YarnGroup;

/// A whole yarn scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct YarnSettings {
    /// Two or three dimensions. In 2-D masses, volumes and moduli are per metre of depth.
    pub dimension: usize,
    /// Edge of a grid cell [m], positive. Contact acts over about one cell, so this is the resolution of everything.
    pub cell: f64,
    /// Box with walls; without one space is open.
    pub domain: Option<DomainSettings>,
    /// Materials by name.
    pub materials: BTreeMap<String, YarnMaterial>,
    /// Yarns, group by group, in the order in which they are numbered.
    pub yarns: Vec<YarnGroup>,
    /// Gravity [m/s²]; empty for none.
    pub gravity: Vec<f64>,
    /// Attractor: an acceleration towards a moving point.
    pub attractor: Option<AttractorSettings>,
    /// Solid bodies, fixed or moving.
    pub obstacles: Vec<ObstacleSettings>,
    /// Places where the grid is held or led.
    pub pins: Vec<Pin>,
    /// Vertices that follow a script.
    pub drives: Vec<Drive>,
    /// Step size and integrator.
    pub step: StepSettings,
    /// Friction and separation (the return map). Off: purely elastic, cross-sections still resist compression only.
    pub plastic: bool,
    /// Share of a segment's mass carried by its quadrature point, 0 to 0.9. Zero gives exact angular momentum but loses
    /// forces on nodes that only quadrature points touch.
    pub quadrature_mass_share: f64,
    /// Give the momentum that quadrature points gathered back to their vertices: conserves momentum to round-off. Off: as in the note.
    pub momentum_hand_back: bool,
    /// Share of the symmetric part of the affine velocity kept per step, 0 (strong damping) to 1 (none).
    pub affine_damping: f64,
    /// Smallest principal stretch of the cross-section, 1e-3 to 0.9: smaller needs smaller steps in hard compression.
    pub min_section: f64,
    /// Push vertices found inside an obstacle out to its surface after each step (the depth is reported either way).
    pub push_out: bool,
    /// Follow the printed note (2-D only): world-axis frames, printed stress and yield, spring bending, no hand-back. To compare, not to use.
    pub compat: bool,
}

impl Default for YarnSettings {
    fn default() -> Self {
        Self {
            dimension: 3,
            cell: 1.0 / 64.0,
            domain: None,
            materials: BTreeMap::from([("yarn".to_owned(), YarnMaterial::default())]),
            yarns: Vec::new(),
            gravity: Vec::new(),
            attractor: None,
            obstacles: Vec::new(),
            pins: Vec::new(),
            drives: Vec::new(),
            step: StepSettings::default(),
            plastic: true,
            quadrature_mass_share: 0.5,
            momentum_hand_back: true,
            affine_damping: 1.0,
            min_section: 0.05,
            push_out: false,
            compat: false,
        }
    }
}

impl YarnSettings {
    /// Checks every number that does not need the generated yarns.
    ///
    /// # Errors
    /// The first setting out of range, by its path.
    pub fn check(&self) -> Result<(), YarnError> {
        if self.dimension != 2 && self.dimension != 3 {
            return Err(YarnError::setting("dimension", format!("must be 2 or 3, is {}", self.dimension)));
        }
        positive("cell", self.cell)?;
        range("quadrature_mass_share", self.quadrature_mass_share, 0.0, 0.9)?;
        range("affine_damping", self.affine_damping, 0.0, 1.0)?;
        range("min_section", self.min_section, 1e-3, 0.9)?;
        if self.compat && self.dimension != 2 {
            return Err(YarnError::setting("compat", "the printed note is two-dimensional"));
        }
        if !self.gravity.is_empty() {
            self.vector("gravity", &self.gravity)?;
        }
        for (name, material) in &self.materials {
            material.check(&format!("materials.{name}"))?;
        }
        if let Some(domain) = &self.domain {
            domain.check(self)?;
        }
        if let Some(attractor) = &self.attractor {
            attractor.check(self)?;
        }
        for (i, obstacle) in self.obstacles.iter().enumerate() {
            obstacle.check(&format!("obstacles[{i}]"))?;
        }
        self.step.check()
    }

    fn vector(&self, setting: &str, value: &[f64]) -> Result<(), YarnError> {
        if value.len() != self.dimension || value.iter().any(|x| !x.is_finite()) {
            return Err(YarnError::setting(setting, format!("needs {} finite numbers, has {value:?}", self.dimension)));
        }
        Ok(())
    }
}

/// A vector from a list of exactly `D` finite numbers.
pub(crate) fn vector<const D: usize>(setting: &str, value: &[f64]) -> Result<SVector<f64, D>, YarnError> {
    if value.len() != D || value.iter().any(|x| !x.is_finite()) {
        return Err(YarnError::setting(setting, format!("needs {D} finite numbers, has {value:?}")));
    }
    Ok(SVector::from_column_slice(value))
}

/// Refuses what is not a positive finite number.
pub(crate) fn positive(setting: &str, value: f64) -> Result<(), YarnError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(YarnError::setting(setting, format!("must be positive and finite, is {value}")))
}

/// Refuses what is not in `[low, high]`.
pub(crate) fn range(setting: &str, value: f64, low: f64, high: f64) -> Result<(), YarnError> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(YarnError::setting(setting, format!("must lie in {low}..{high}, is {value}")))
}
