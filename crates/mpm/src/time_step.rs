//! How large a step the liquid allows: by what moves, not by stiffness, which is implicit.

use crate::particles::Particles;
use crate::settings::StepSettings;
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
