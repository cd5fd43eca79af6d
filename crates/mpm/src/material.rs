//! What a particle is made of: the law of one point and what the grid needs to know of it.

use crate::LiquidError;
use constitutive::{HerschelBulkley, LawSettings, Liquid};
use serde::{Deserialize, Serialize};

/// One liquid of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LiquidMaterial {
    /// Rest density [kg/m³].
    pub density: f64,
    /// Volume, shear and flow of one material point.
    pub law: HerschelBulkley,
    /// Norm of the deviator of the plastic history at which a particle tears [1]; `None`: never.
    pub tearing_strain: Option<f64>,
    /// Time in which the plastic history heals [s]; `None`: never.
    pub recovery_time: Option<f64>,
    /// Rayleigh damping of elastic shear [s]; zero for none.
    pub shear_damping: f64,
    /// Whether the volume cannot change at all: the pressure equation loses its compliance and volume ratios stay as they are.
    pub rigid_volume: bool,
}

impl LiquidMaterial {
    /// The material of a liquid; those called incompressible keep their volume exactly.
    ///
    /// # Errors
    /// Where a number of the liquid lies outside its range.
    pub fn new(liquid: &Liquid, settings: LawSettings) -> Result<Self, constitutive::RheologyError> {
        liquid.check()?;
        Ok(Self {
            density: liquid.density,
            law: liquid.law(settings)?,
            tearing_strain: liquid.tearing_strain,
            recovery_time: liquid.recovery_time,
            shear_damping: if liquid.shear_modulus > 0.0 { liquid.shear_damping } else { 0.0 },
            rigid_volume: !liquid.is_compressible(),
        })
    }

    /// Whether plastic history has to be carried.
    #[must_use]
    pub fn has_history(&self) -> bool {
        self.law.is_shear_elastic() && self.tearing_strain.is_some()
    }

    /// Whether the shear solve has anything to do for this liquid.
    #[must_use]
    pub fn resists_shear(&self) -> bool {
        self.law.is_shear_elastic() || self.law.newtonian_viscosity > 0.0
    }
}

/// Which arrays the particles of a scene need.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Carried {
    /// Elastic strain: some liquid is shear-elastic.
    pub strain: bool,
    /// Deformation gradient: some liquid can tear.
    pub history: bool,
}

impl Carried {
    /// What the given materials need together.
    #[must_use]
    pub fn by(materials: &[LiquidMaterial]) -> Self {
        Self {
            strain: materials.iter().any(|m| m.law.is_shear_elastic()),
            history: materials.iter().any(LiquidMaterial::has_history),
        }
    }
}

/// Checks that every particle refers to a material of the list.
pub(crate) fn check_materials(used: &[u16], ids: &[u64], count: usize) -> Result<(), LiquidError> {
    match used.iter().position(|&m| m as usize >= count) {
        Some(p) => Err(LiquidError::Material { id: ids[p], material: used[p] as usize, count }),
        None => Ok(()),
    }
}
