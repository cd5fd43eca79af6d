//! The tensor equation of the liquid in simple shear, solved without the particle update.
//!
//! `db̄/dt = L b̄ + b̄ Lᵀ − 2β γ̇(s) ŝ + χ`, where `χ` keeps `det b̄ = 1`: along the identity for [`DeterminantPolicy::Exact`],
//! along `b̄` for [`DeterminantPolicy::Trace`], because each policy converges to its own equation.

use nalgebra::SVector;

use super::radau;
use crate::error::RheologyError;
use crate::liquid_law::{DeterminantPolicy, HerschelBulkley};

type State = SVector<f64, 4>;

/// Reference solutions of start-up and steady shear.
#[derive(Clone, Copy, Debug)]
pub struct TensorReference<'a> {
    law: &'a HerschelBulkley,
}

impl<'a> TensorReference<'a> {
    /// A reference for the given law, with its determinant policy.
    #[must_use]
    pub fn new(law: &'a HerschelBulkley) -> Self {
        TensorReference { law }
    }

    /// Rate of `(b_xx, b_yy, b_zz, b_xy)`.
    fn rhs(&self, b: &State, rate: f64) -> State {
        let (xx, yy, zz, xy) = (b[0], b[1], b[2], b[3]);
        let mean = (xx + yy + zz) / 3.0;
        let dev = [xx - mean, yy - mean, zz - mean, xy];
        let size = (dev[0] * dev[0] + dev[1] * dev[1] + dev[2] * dev[2] + 2.0 * xy * xy).sqrt();
        let mut out = State::new(2.0 * rate * xy, 0.0, 0.0, rate * yy);
        let flow = self.law.flow.rate(self.law.shear_modulus * size);
        if flow > 0.0 {
            let k = 2.0 * mean * flow / size;
            let plane = xx * yy - xy * xy;
            let inverse = [yy / plane, xx / plane, 1.0 / zz, -xy / plane];
            let along = dev[0] * inverse[0] + dev[1] * inverse[1] + dev[2] * inverse[2] + 2.0 * dev[3] * inverse[3];
            let keep = match self.law.settings.determinant {
                DeterminantPolicy::Exact => {
                    let chi = k * along / (inverse[0] + inverse[1] + inverse[2]);
                    [chi, chi, chi, 0.0]
                }
                DeterminantPolicy::Trace => {
                    let chi = k * along / 3.0;
                    [chi * xx, chi * yy, chi * zz, chi * xy]
                }
            };
            for i in 0..4 {
                out[i] += keep[i] - k * dev[i];
            }
        }
        out
    }

    fn stresses(&self, b: &State) -> (f64, f64) {
        let mean = (b[0] + b[1] + b[2]) / 3.0;
        let square = (b[0] - mean).powi(2) + (b[1] - mean).powi(2) + (b[2] - mean).powi(2) + 2.0 * b[3] * b[3];
        (self.law.shear_modulus * b[3], self.law.shear_modulus * (0.5 * square).sqrt())
    }

    /// Shear stress and stress norm over √2 [Pa] after shearing from rest at `rate` [1/s] for `time` [s].
    ///
    /// # Errors
    /// [`RheologyError::NonFinite`] if the integration fails.
    pub fn start_up(&self, rate: f64, time: f64) -> Result<(f64, f64), RheologyError> {
        if !self.law.is_shear_elastic() {
            let stress = self.law.newtonian_viscosity * rate;
            return Ok((stress, stress.abs()));
        }
        let rhs = |b: &State| self.rhs(b, rate);
        radau::integrate(&rhs, State::new(1.0, 1.0, 1.0, 0.0), time, 1e-11)
            .map(|b| self.stresses(&b))
            .ok_or(RheologyError::NonFinite { what: "reference of start-up" })
    }

    /// Shear stress and stress norm over √2 [Pa] of steady shear at `rate` [1/s], with the residual left over the rate.
    ///
    /// # Errors
    /// [`RheologyError::NonFinite`] if no steady state is found.
    pub fn steady(&self, rate: f64) -> Result<(f64, f64, f64), RheologyError> {
        if !self.law.is_shear_elastic() {
            let stress = self.law.newtonian_viscosity * rate;
            return Ok((stress, stress.abs(), 0.0));
        }
        let rhs = |b: &State| self.rhs(b, rate);
        // near the steady state by marching over the memory of the liquid, then Newton with det b̄ = 1 kept exactly
        let flow = &self.law.flow;
        let stress = flow.stress_at(rate / 2f64.sqrt());
        let strain = (stress + flow.index() * (stress - flow.yield_norm())) / self.law.shear_modulus;
        let none = RheologyError::NonFinite { what: "reference of steady shear" };
        let mut b = radau::integrate(&rhs, State::new(1.0, 1.0, 1.0, 0.0), 12.0 * strain / rate, 1e-8).ok_or(none)?;
        for _ in 0..30 {
            let residual = rhs(&b);
            // the four rates are dependent (det is kept): add the determinant in their place along the identity
            let mut matrix = radau::jacobian(&rhs, &b);
            let plane = b[0] * b[1] - b[3] * b[3];
            let miss = plane * b[2] - 1.0;
            let gradient = [b[1] * b[2], b[0] * b[2], plane, -2.0 * b[3] * b[2]];
            let mut right = -residual;
            for row in 0..3 {
                right[row] -= rate * miss;
                for k in 0..4 {
                    matrix[(row, k)] += rate * gradient[k];
                }
            }
            let Some(delta) = matrix.lu().solve(&right) else { break };
            if !delta.iter().all(|x| x.is_finite()) {
                break;
            }
            b += delta;
            if delta.norm() <= 1e-14 * b.norm() {
                break;
            }
        }
        let (shear, norm) = self.stresses(&b);
        Ok((shear, norm, rhs(&b).norm() / (rate * b.norm())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow_curve::FlowCurve;
    use crate::liquid_law::LawSettings;
    use crate::presets::Liquid;
    use crate::viscometer::Viscometer;

    /// The figures known for the materials' own moduli: the shear component; the norm stays within a thousandth of the flow
    /// curve.
    #[test]
    fn steady_shear_of_the_published_materials() {
        for (material, rate, expected) in [("shaving-cream", 10.0, 47.16), ("drilling-mud", 50.0, 3.87)] {
            let liquid = Liquid::preset(material).unwrap();
            let law = liquid.law(LawSettings::default()).unwrap();
            let (shear, norm, residual) = TensorReference::new(&law).steady(rate).unwrap();
            assert!(residual < 1e-9, "{residual}");
            approx::assert_relative_eq!(shear, expected, max_relative = 5e-4);
            approx::assert_relative_eq!(norm, liquid.flow.shear_stress(rate), max_relative = 1e-3);
        }
    }

    #[test]
    fn the_particle_update_converges_to_the_reference_under_both_policies() {
        for determinant in [DeterminantPolicy::Exact, DeterminantPolicy::Trace] {
            let law = Liquid::preset("shaving-cream")
                .unwrap()
                .law(LawSettings { determinant, ..LawSettings::default() })
                .unwrap();
            let (_, reference) = TensorReference::new(&law).start_up(10.0, 0.05).unwrap();
            let at = |steps| Viscometer::new(&law).start_up_end(10.0, 0.05, steps).unwrap().stress_norm;
            let (coarse, fine) = (at(1000), at(2000));
            assert!((fine - reference).abs() < 0.6 * (coarse - reference).abs());
            approx::assert_relative_eq!(2.0 * fine - coarse, reference, max_relative = 1e-5);
        }
    }

    #[test]
    fn a_maxwell_liquid_starts_up_as_its_closed_form() {
        let curve = FlowCurve::Rheometer { yield_stress: 0.0, consistency: 0.5, index: 1.0 };
        let law = HerschelBulkley::new(1e6, 1e4, &curve, LawSettings::default()).unwrap();
        let (shear, _) = TensorReference::new(&law).start_up(1e-2, 5e-5).unwrap();
        let expected = 0.5e-2 * (1.0 - (-1e4 * 5e-5 / 0.5f64).exp());
        approx::assert_relative_eq!(shear, expected, max_relative = 1e-6);
    }
}
