//! Plastic flow inside a step: an incremental potential whose stress is that of the projected state.
//!
//! The pressure bounds the fibre shear and the change of shape of the cross-section. At given bounds the flow has a potential:
//! the quadratic energies of shear and shape become linear where the bound is reached,
//!
//! ```text
//! ψ(r) = γ/2 r²           for r ≤ r̄,      γ r̄ (r − r̄/2)     beyond
//! ```
//!
//! and so its derivative, `γ min(r, r̄)`, is what is left after the return map. An implicit step minimises it at the bounds of its
//! last iterate; where bounds and iterate agree, the grid feels the friction that the return map then grants.

use nalgebra::SMatrix;

use super::frame::{SECTION, YarnFrame};
use super::law::{SectionResponse, YarnLaw};

/// Largest shear and largest change of shape of the cross-section that the stress may follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowLimits {
    /// Largest magnitude of the fibre shear.
    pub shear: f64,
    /// Largest magnitude of half the difference of the principal section strains (3-D).
    pub shape: f64,
}

impl FlowLimits {
    /// No flow: the elastic law.
    pub const ELASTIC: FlowLimits = FlowLimits { shear: f64::INFINITY, shape: f64::INFINITY };
}

impl YarnLaw {
    /// The limits that the return map grants at `deformation` (corrected law).
    #[inline]
    #[must_use]
    pub fn flow_limits<const D: usize>(&self, deformation: &SMatrix<f64, D, D>) -> FlowLimits {
        let frame = YarnFrame::new(deformation);
        let mut section = [1.0; SECTION];
        let (mut strain, mut trace) = ([0.0; SECTION], 0.0);
        for i in 0..D - 1 {
            section[i] = frame.section[i].max(self.min_section);
            strain[i] = section[i].ln();
            trace += strain[i];
        }
        if trace > 0.0 {
            return FlowLimits { shear: 0.0, shape: 0.0 };
        }
        let pressure = -self.contact_modulus::<D>() * trace;
        let mut shape = f64::INFINITY;
        if D == 3 {
            shape = 0.5 * self.section_friction * pressure / self.mu;
            let (mean, half) = (0.5 * trace, 0.5 * (strain[0] - strain[1]));
            let kept = if half.abs() > shape { shape.copysign(half) } else { half };
            section = [(mean + kept).exp(), (mean - kept).exp()];
        }
        if self.shear_modulus == 0.0 {
            return FlowLimits { shear: f64::INFINITY, shape };
        }
        // The cone bounds the traction γ |s r|; the same direction of shear gives the bound of |r|.
        let resolved = frame.principal_shear();
        let (mut weighted, mut plain) = (0.0, 0.0);
        for i in 0..D - 1 {
            weighted += (section[i] * resolved[i]).powi(2);
            plain += resolved[i] * resolved[i];
        }
        let stretch = if plain > f64::MIN_POSITIVE { (weighted / plain).sqrt() } else { section[D - 2] };
        FlowLimits { shear: self.friction * pressure / (self.shear_modulus * stretch), shape }
    }

    /// Energy per reference volume [J/m³] with flow at the given limits.
    #[must_use]
    pub fn flow_energy<const D: usize>(&self, deformation: &SMatrix<f64, D, D>, limits: &FlowLimits) -> f64 {
        let frame = YarnFrame::new(deformation);
        let section = SectionResponse::new::<D>(self, &frame.section, limits.shape);
        let shear = (frame.shear[0] * frame.shear[0] + frame.shear[1] * frame.shear[1]).sqrt();
        let held = shear.min(limits.shear);
        0.5 * self.stretch_modulus * (frame.stretch - 1.0).powi(2)
            + self.shear_modulus * held * (shear - 0.5 * held)
            + section.energy
    }

    /// Derivative of [`YarnLaw::flow_energy`] by the deformation gradient [Pa].
    #[inline]
    #[must_use]
    pub fn flow_stress<const D: usize>(
        &self,
        deformation: &SMatrix<f64, D, D>,
        limits: &FlowLimits,
    ) -> SMatrix<f64, D, D> {
        let frame = YarnFrame::new(deformation);
        let shear = (frame.shear[0] * frame.shear[0] + frame.shear[1] * frame.shear[1]).sqrt();
        let keep = if shear > limits.shear { limits.shear / shear } else { 1.0 };
        let section = SectionResponse::new::<D>(self, &frame.section, limits.shape);
        self.stress_of_parts(&frame, self.shear_modulus * keep, &section)
    }
}
