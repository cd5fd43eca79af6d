//! How large a step the liquid allows: by what moves, not by stiffness, which is implicit.

use crate::material::LiquidMaterial;
use crate::particles::Particles;
use crate::settings::StepSettings;
use crate::shear_solve::SAFE_STIFFNESS;
use serde::{Deserialize, Serialize};

/// The limits of the next step and what set them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepLimit {
    /// By advection: cells crossed [s]; infinite where nothing moves.
    pub advection: f64,
    /// By the deformation of particles [s].
    pub deformation: f64,
}

impl StepLimit {
    /// The smaller of the two [s].
    #[must_use]
    pub fn step(&self) -> f64 {
        self.advection.min(self.deformation)
    }

    /// Number of equal sub-steps that a frame step needs, at least one, at most `most`.
    #[must_use]
    pub fn substeps(&self, frame: f64, most: usize) -> usize {
        let wanted = (frame / self.step()).ceil();
        if wanted.is_finite() && wanted > 1.0 { (wanted as usize).min(most) } else { 1 }
    }
}

/// Limits from the state of the particles; `other_speed` is the largest speed of anything else that moves on the grid [m/s].
#[must_use]
pub fn step_limit<const D: usize>(
    particles: &Particles<D>,
    dx: f64,
    other_speed: f64,
    settings: &StepSettings,
) -> StepLimit {
    let speed = particles.velocity.iter().fold(0.0f64, |m, v| m.max(v.norm_squared())).sqrt().max(other_speed);
    let rate = particles.affine.iter().fold(0.0f64, |m, c| m.max(c.norm_squared())).sqrt();
    StepLimit { advection: settings.cfl * dx / speed, deformation: settings.deformation / rate }
}

/// Longest step at which [`crate::settings::ShearOperator::Automatic`] keeps to points in cells while no particle is compressed
/// [s]: the one in which no shear wave of the unyielded liquid outruns them. Infinite where nothing is shear-elastic.
///
/// Longer steps are stable too, with products through the particles, which cost several times more.
#[must_use]
pub fn elastic_wave_step(materials: &[LiquidMaterial], dx: f64) -> f64 {
    let one = |m: &LiquidMaterial| dx * (SAFE_STIFFNESS * m.density / (8.0 * m.law.shear_modulus)).sqrt();
    materials.iter().filter(|m| m.law.is_shear_elastic()).map(one).fold(f64::INFINITY, f64::min)
}
