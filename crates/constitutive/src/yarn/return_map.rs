//! Plastic flow: projection onto the friction cones at the end of a step.

use nalgebra::SMatrix;

use super::frame::YarnFrame;
use super::law::{YarnForm, YarnLaw};
use super::printed;

/// What the projection found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum YieldMode {
    /// Inside the cones: nothing was changed.
    Elastic,
    /// Neighbours have come apart: section and shear were reset.
    Separated,
    /// Fibre shear or section shape was scaled back onto its cone.
    Sliding,
}

/// Result of the return map.
#[derive(Clone, Copy, Debug)]
pub struct ReturnMapped<const D: usize> {
    /// Projected deformation gradient (first column as given).
    pub deformation: SMatrix<f64, D, D>,
    /// Decomposition of the projected gradient.
    pub frame: YarnFrame<D>,
    /// What happened.
    pub mode: YieldMode,
    /// Fibre shear taken up by sliding in this projection (0 unless sliding).
    pub slip: f64,
    /// A principal section stretch had fallen below the smallest one and was lifted to it.
    pub clamped: bool,
}

impl YarnLaw {
    /// Projects `deformation` onto the cohesionless friction cones; the yarn tangent and stretch are kept.
    ///
    /// In 2-D `|τ₁₂| ≤ c_f |τ₂₂|`. In 3-D first the shape of the section, `τ₁ − τ₂ ≤ 2 α p`, then the fibre shear,
    /// `|(τ₁₂, τ₁₃)| ≤ c_f p`, with `p` the section's pressure. Expanded sections (`Σ ln s_i ≥ 0`) come apart: no section
    /// strain, no shear. The projection is at fixed area (no dilation), so the energy never rises.
    #[inline]
    #[must_use]
    pub fn return_map<const D: usize>(&self, deformation: &SMatrix<f64, D, D>) -> ReturnMapped<D> {
        let mut frame = YarnFrame::new(deformation);
        let mut clamped = false;
        let mut strain = [0.0; 2];
        let mut trace = 0.0;
        for i in 0..D - 1 {
            if frame.section[i] < self.min_section {
                frame.section[i] = self.min_section;
                clamped = true;
            }
            strain[i] = frame.section[i].ln();
            trace += strain[i];
        }
        if trace > 0.0 {
            frame.section = [1.0; 2];
            frame.shear = [0.0; 2];
            return ReturnMapped {
                deformation: keep_edge(deformation, &frame),
                frame,
                mode: YieldMode::Separated,
                slip: 0.0,
                clamped,
            };
        }
        let pressure = -self.contact_modulus::<D>() * trace;
        let mut mode = YieldMode::Elastic;
        if D == 3 {
            let mean = 0.5 * trace;
            let deviator = 0.5 * (strain[0] - strain[1]);
            // |dev| = √2 |deviator| ≤ α p / (√2 μ)
            let bound = 0.5 * self.section_friction * pressure;
            if self.mu * deviator.abs() > bound {
                let kept = (bound / self.mu).copysign(deviator);
                frame.section = [(mean + kept).exp(), (mean - kept).exp()];
                mode = YieldMode::Sliding;
            }
        }
        let mut slip = 0.0;
        if self.shear_modulus > 0.0 {
            let resolved = frame.principal_shear();
            let mut traction2 = 0.0;
            for i in 0..D - 1 {
                traction2 += (frame.section[i] * resolved[i]).powi(2);
            }
            let traction = self.shear_modulus * traction2.sqrt();
            let bound = match self.form {
                YarnForm::Corrected => self.friction * pressure,
                YarnForm::Printed => {
                    self.shear_modulus * frame.section[0] * printed::shear_bound(self, frame.section[0])
                }
            };
            if traction > bound {
                let keep = bound / traction;
                slip = (1.0 - keep) * (frame.shear[0].powi(2) + frame.shear[1].powi(2)).sqrt();
                frame.shear = [frame.shear[0] * keep, frame.shear[1] * keep];
                mode = YieldMode::Sliding;
            }
        }
        if mode == YieldMode::Elastic && !clamped {
            return ReturnMapped { deformation: *deformation, frame, mode, slip, clamped };
        }
        ReturnMapped { deformation: keep_edge(deformation, &frame), frame, mode, slip, clamped }
    }
}

/// The composed gradient with its first column as it was: the edge vector is not the material point's to change.
#[inline]
fn keep_edge<const D: usize>(before: &SMatrix<f64, D, D>, frame: &YarnFrame<D>) -> SMatrix<f64, D, D> {
    let mut after = frame.compose();
    after.set_column(0, &before.column(0));
    after
}
