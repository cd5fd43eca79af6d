//! Energy and first Piola–Kirchhoff stress.

use nalgebra::SMatrix;
use serde::{Deserialize, Serialize};

use super::frame::{SECTION, YarnFrame};
use super::printed;

/// Which formulas are used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum YarnForm {
    /// Stress as the derivative of the energy, Coulomb cone on the Kirchhoff stress.
    #[default]
    Corrected,
    /// The formulas of the seed note as printed (2-D only): for comparison, not for use. The stress is not the
    /// derivative of the energy and the friction coefficient is not the one asked for.
    Printed,
}

/// Moduli and friction of a yarn material point.
///
/// Energy per reference volume, with stretch `a`, shear `r` and principal section strains `e_i = ln s_i`:
///
/// ```text
/// ψ = k/2 (a − 1)² + γ/2 |r|² + μ Σ dev(e)_i² + N/2 min(Σ e_i, 0)²,   N = 2μ + λ in 2-D, μ + λ in 3-D
/// ```
///
/// The section resists compression only (`N` term); the `μ` term is the cross-section's shape change, which the return
/// map removes wherever there is no pressure. There is no torsion, no bending and no coupling of stretch to the section.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct YarnLaw {
    /// Stretch modulus `k` [Pa], positive.
    pub stretch_modulus: f64,
    /// Fibre shear modulus `γ` [Pa]; zero leaves shear free.
    pub shear_modulus: f64,
    /// First contact modulus `μ` [Pa] (shear modulus of the cross-section).
    pub mu: f64,
    /// Second contact modulus `λ` [Pa].
    pub lambda: f64,
    /// Coulomb coefficient between fibres sliding along the yarn (the note's `c_f`).
    pub friction: f64,
    /// Coulomb coefficient of shape change of the cross-section (yarns sliding past each other sideways), 3-D only.
    pub section_friction: f64,
    /// Smallest principal section stretch: the energy continues linearly below it and the return map lifts states to it.
    pub min_section: f64,
    /// Corrected or printed formulas.
    pub form: YarnForm,
}

impl YarnLaw {
    /// Modulus `N` of the section's area change [Pa].
    #[inline]
    #[must_use]
    pub fn contact_modulus<const D: usize>(&self) -> f64 {
        if D == 2 { 2.0 * self.mu + self.lambda } else { self.mu + self.lambda }
    }

    /// Energy per reference volume [J/m³] at the deformation gradient `deformation`.
    #[must_use]
    pub fn energy<const D: usize>(&self, deformation: &SMatrix<f64, D, D>) -> f64 {
        let frame = YarnFrame::new(deformation);
        let shear2 = frame.shear[0] * frame.shear[0] + frame.shear[1] * frame.shear[1];
        let section = SectionResponse::new::<D>(self, &frame.section, f64::INFINITY);
        0.5 * self.stretch_modulus * (frame.stretch - 1.0).powi(2) + 0.5 * self.shear_modulus * shear2 + section.energy
    }

    /// First Piola–Kirchhoff stress `P = ∂ψ/∂F` [Pa] (for [`YarnForm::Printed`] what the note has in its place).
    #[inline]
    #[must_use]
    pub fn stress<const D: usize>(&self, deformation: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
        let frame = YarnFrame::new(deformation);
        if self.form == YarnForm::Printed && D == 2 {
            return printed::stress(self, &frame);
        }
        self.stress_of_frame(&frame)
    }

    /// [`YarnLaw::stress`] of an already decomposed gradient.
    #[inline]
    #[must_use]
    pub fn stress_of_frame<const D: usize>(&self, frame: &YarnFrame<D>) -> SMatrix<f64, D, D> {
        let section = SectionResponse::new::<D>(self, &frame.section, f64::INFINITY);
        self.stress_of_parts(frame, self.shear_modulus, &section)
    }

    /// Stress from the traction `shear_modulus` times shear and from the slopes of the section's energy.
    #[inline]
    pub(super) fn stress_of_parts<const D: usize>(
        &self,
        frame: &YarnFrame<D>,
        shear_modulus: f64,
        section: &SectionResponse,
    ) -> SMatrix<f64, D, D> {
        let resolved = frame.principal_shear();
        let mut first = frame.tangent * (self.stretch_modulus * (frame.stretch - 1.0));
        for i in 0..D - 1 {
            // Turning the tangent at fixed section columns changes shear and section together.
            let turning = (shear_modulus * frame.section[i] - section.slope[i]) * resolved[i] / frame.stretch;
            first += frame.directions[i] * turning;
        }
        let mut stress = SMatrix::<f64, D, D>::zeros();
        stress.set_column(0, &first);
        for a in 1..D {
            let mut column = frame.tangent * (shear_modulus * frame.shear[a - 1]);
            for i in 0..D - 1 {
                column += frame.directions[i] * (section.slope[i] * frame.material[i][a - 1]);
            }
            stress.set_column(a, &column);
        }
        stress
    }

    /// Kirchhoff pressure of the cross-section [Pa], positive in compression: `-N min(Σ ln s_i, 0)`.
    #[inline]
    #[must_use]
    pub fn pressure<const D: usize>(&self, frame: &YarnFrame<D>) -> f64 {
        let mut trace = 0.0;
        for i in 0..D - 1 {
            trace += frame.section[i].max(self.min_section).ln();
        }
        -self.contact_modulus::<D>() * trace.min(0.0)
    }

    /// Largest modulus seen by section waves at the given principal stretches [Pa]: `(N + μ-part)(1 − ln s)/s²` of the most compressed direction.
    #[inline]
    #[must_use]
    pub fn section_stiffness<const D: usize>(&self, frame: &YarnFrame<D>) -> f64 {
        let mut least = 1.0f64;
        for i in 0..D - 1 {
            least = least.min(frame.section[i].max(self.min_section));
        }
        (2.0 * self.mu + self.lambda) * (1.0 - least.ln()) / (least * least)
    }
}

/// Energy of the cross-section with its first and second derivatives by the principal stretches.
pub(super) struct SectionResponse {
    /// `h(s)` [J/m³].
    pub energy: f64,
    /// `∂h/∂s_i`.
    pub slope: [f64; SECTION],
    /// `∂²h/∂s_i∂s_j`.
    pub curvature: [[f64; SECTION]; SECTION],
}

impl SectionResponse {
    /// Evaluates at the signed principal stretches `section`; beyond half a strain difference of `shape` the shape flows.
    #[inline]
    pub fn new<const D: usize>(law: &YarnLaw, section: &[f64; SECTION], shape: f64) -> Self {
        let count = D - 1;
        let modulus = law.contact_modulus::<D>();
        let mut at = [1.0; SECTION];
        let mut strain = [0.0; SECTION];
        let mut trace = 0.0;
        for i in 0..count {
            at[i] = section[i].max(law.min_section);
            strain[i] = at[i].ln();
            trace += strain[i];
        }
        let mean = trace / count as f64;
        let compressed = if trace < 0.0 { 1.0 } else { 0.0 };
        let mut energy = 0.5 * modulus * compressed * trace * trace;
        let mut slope = [0.0; SECTION];
        let mut shape_modulus = 2.0 * law.mu;
        for i in 0..count {
            let mut deviator = strain[i] - mean;
            let held = if deviator.abs() > shape { shape.copysign(deviator) } else { deviator };
            energy += law.mu * held * (2.0 * deviator - held);
            if held != deviator {
                deviator = held;
                shape_modulus = 0.0;
            }
            slope[i] = (2.0 * law.mu * deviator + modulus * compressed * trace) / at[i];
        }
        let mut curvature = [[0.0; SECTION]; SECTION];
        for i in 0..count {
            for j in 0..count {
                let unit = if i == j { 1.0 } else { 0.0 };
                let tangent = shape_modulus * (unit - 1.0 / count as f64) + modulus * compressed;
                curvature[i][j] = (tangent / at[j] - unit * slope[i]) / at[i];
            }
        }
        // Below the smallest stretch: first-order continuation, with the derivatives of exactly that continuation.
        if (0..count).any(|i| section[i] < law.min_section) {
            let below = [section[0].min(at[0]) - at[0], if count > 1 { section[1].min(at[1]) - at[1] } else { 0.0 }];
            let base = slope;
            for i in 0..count {
                energy += base[i] * below[i];
            }
            for j in 0..count {
                if section[j] >= law.min_section {
                    for i in 0..count {
                        slope[j] += curvature[i][j] * below[i];
                    }
                }
            }
            for i in 0..count {
                if section[i] < law.min_section {
                    curvature[i][i] = 0.0;
                }
            }
        }
        Self { energy, slope, curvature }
    }
}
