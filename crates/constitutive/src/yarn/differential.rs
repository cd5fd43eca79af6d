//! Directional derivative of the stress, for the implicit step.

use nalgebra::{SMatrix, SVector};

use super::flow::FlowLimits;
use super::frame::{SECTION, YarnFrame};
use super::law::{SectionResponse, YarnLaw};

/// The parts of the stress differential that do not depend on the direction, computed once per state.
#[derive(Clone, Copy, Debug)]
pub struct StressTangent<const D: usize> {
    frame: YarnFrame<D>,
    stretch_modulus: f64,
    /// Traction over shear.
    shear_modulus: f64,
    /// Direction of the shear where it flows: the traction then only turns.
    flow: Option<[f64; SECTION]>,
    slope: [f64; SECTION],
    curvature: [[f64; SECTION]; SECTION],
    /// `(h₁' − h₂')/(s₁ − s₂)` and `(h₁' + h₂')/(s₁ + s₂)`.
    difference: f64,
    sum: f64,
}

impl YarnLaw {
    /// Prepares `δF ↦ δP` at `deformation` (corrected law).
    #[must_use]
    pub fn tangent<const D: usize>(&self, deformation: &SMatrix<f64, D, D>) -> StressTangent<D> {
        self.flow_tangent(deformation, &FlowLimits::ELASTIC, false)
    }

    /// Prepares the differential of [`YarnLaw::flow_stress`] at `deformation`.
    ///
    /// `secant`: for flowing shear take stress over shear in place of its derivative, which is zero along the flow. The quadratic
    /// potential with this curvature lies above the true one, so that a Newton step with it does not overshoot.
    #[must_use]
    pub fn flow_tangent<const D: usize>(
        &self,
        deformation: &SMatrix<f64, D, D>,
        limits: &FlowLimits,
        secant: bool,
    ) -> StressTangent<D> {
        let frame = YarnFrame::new(deformation);
        let response = SectionResponse::new::<D>(self, &frame.section, limits.shape);
        let shear = (frame.shear[0] * frame.shear[0] + frame.shear[1] * frame.shear[1]).sqrt();
        let flows = shear > limits.shear;
        let keep = if flows { limits.shear / shear } else { 1.0 };
        let (mut difference, mut sum) = (0.0, 0.0);
        if D == 3 {
            let [s1, s2] = frame.section;
            let gap = s1 - s2;
            difference = if gap.abs() > 1e-7 * s1.abs().max(f64::MIN_POSITIVE) {
                (response.slope[0] - response.slope[1]) / gap
            } else {
                0.5 * (response.curvature[0][0] + response.curvature[1][1]) - response.curvature[0][1]
            };
            // s₁ ≥ |s₂|; the sum vanishes only for a mirror state, where the energy itself has a kink.
            let total = (s1 + s2).max(1e-3 * s1).max(f64::MIN_POSITIVE);
            sum = (response.slope[0] + response.slope[1]) / total;
        }
        StressTangent {
            frame,
            stretch_modulus: self.stretch_modulus,
            shear_modulus: self.shear_modulus * keep,
            flow: (flows && !secant).then(|| frame.shear.map(|r| r / shear)),
            slope: response.slope,
            curvature: response.curvature,
            difference,
            sum,
        }
    }
}

impl<const D: usize> StressTangent<D> {
    /// `δP` [Pa] for the change `change` of the deformation gradient: the second derivative of the energy, hence symmetric.
    #[inline]
    #[must_use]
    pub fn apply(&self, change: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
        let f = &self.frame;
        let k = self.stretch_modulus;
        let first: SVector<f64, D> = change.column(0).into_owned();
        let stretch_rate = f.tangent.dot(&first);
        let tangent_rate = (first - f.tangent * stretch_rate) / f.stretch;

        // Section columns without their shear part, and the energy's slope on them: B = Σ s u vᵀ, G = Σ h' u vᵀ.
        let mut normal_part = [SVector::<f64, D>::zeros(); SECTION];
        let mut slope_part = [SVector::<f64, D>::zeros(); SECTION];
        for a in 0..D - 1 {
            for i in 0..D - 1 {
                normal_part[a] += f.directions[i] * (f.section[i] * f.material[i][a]);
                slope_part[a] += f.directions[i] * (self.slope[i] * f.material[i][a]);
            }
        }
        let mut shear_rate = [0.0; SECTION];
        let mut normal_rate = [SVector::<f64, D>::zeros(); SECTION];
        for a in 0..D - 1 {
            let column: SVector<f64, D> = change.column(a + 1).into_owned();
            // q·B = 0, so the turning of q sees only the normal part of the column plus nothing of the shear part.
            shear_rate[a] = normal_part[a].dot(&tangent_rate) + column.dot(&f.tangent);
            normal_rate[a] = column - tangent_rate * f.shear[a] - f.tangent * shear_rate[a];
        }

        let traction = f.shear.map(|r| self.shear_modulus * r);
        let mut traction_rate = shear_rate.map(|r| self.shear_modulus * r);
        if let Some(along) = self.flow {
            let growth = along[0] * traction_rate[0] + along[1] * traction_rate[1];
            traction_rate = [traction_rate[0] - along[0] * growth, traction_rate[1] - along[1] * growth];
        }

        // δG in the principal frame.
        let mut z = [[0.0; SECTION]; SECTION];
        for i in 0..D - 1 {
            for j in 0..D - 1 {
                for a in 0..D - 1 {
                    z[i][j] += f.directions[i].dot(&normal_rate[a]) * f.material[j][a];
                }
            }
        }
        let mut w = [[0.0; SECTION]; SECTION];
        for i in 0..D - 1 {
            for j in 0..D - 1 {
                w[i][i] += self.curvature[i][j] * z[j][j];
            }
        }
        if D == 3 {
            w[0][1] = 0.5 * (self.difference + self.sum) * z[0][1] + 0.5 * (self.difference - self.sum) * z[1][0];
            w[1][0] = 0.5 * (self.difference + self.sum) * z[1][0] + 0.5 * (self.difference - self.sum) * z[0][1];
        }
        let mut slope_rate = [SVector::<f64, D>::zeros(); SECTION];
        for a in 0..D - 1 {
            for i in 0..D - 1 {
                for j in 0..D - 1 {
                    slope_rate[a] += f.directions[i] * (w[i][j] * f.material[j][a]);
                }
                // The plane of the section turns with the tangent.
                let out_of_plane = -self.slope[i] * tangent_rate.dot(&f.directions[i]) * f.material[i][a];
                slope_rate[a] += f.tangent * out_of_plane;
            }
        }

        let mut column = f.tangent * (k * stretch_rate) + tangent_rate * (k * (f.stretch - 1.0));
        for a in 0..D - 1 {
            let turning = normal_part[a] * traction[a] - slope_part[a] * f.shear[a];
            let rate = normal_rate[a] * traction[a] + normal_part[a] * traction_rate[a]
                - slope_rate[a] * f.shear[a]
                - slope_part[a] * shear_rate[a];
            column += rate / f.stretch - turning * (stretch_rate / (f.stretch * f.stretch));
        }
        let mut rate = SMatrix::<f64, D, D>::zeros();
        rate.set_column(0, &column);
        for a in 0..D - 1 {
            let section = tangent_rate * traction[a] + f.tangent * traction_rate[a] + slope_rate[a];
            rate.set_column(a + 1, &section);
        }
        rate
    }
}
