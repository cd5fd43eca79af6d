//! The elastic strain of a liquid particle through one step, in 2-D and 3-D.
//!
//! ```text
//! elastic_trial   b̄* = f̄ b̄ f̄ᵀ, determinant 1          (stage 8, after the grid moved)
//! relax           deviator of b̄* through the flow map  (stage 10)
//! ```
//!
//! `b̄` is the isochoric elastic left Cauchy–Green tensor (determinant 1, identity at rest), `f = I + dt ∇u` the deformation
//! of the step. Source: Fei et al. 2019, supplemental S4–S13, S80–S83; the determinant policy is our own.

use serde::{Deserialize, Serialize};

use crate::equation_of_state::EquationOfState;
use crate::error::{RheologyError, require};
use crate::flow_curve::FlowCurve;
use crate::flow_map::FlowMap;
use crate::shear_flow::ShearFlow;
use crate::tearing::TornRule;
use crate::tensor::{Tensor, contract, determinant, deviator, inverse_root, symmetric_eigen};

/// How the mean of `b̄` is chosen after its deviator was relaxed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum DeterminantPolicy {
    /// The mean that makes the determinant 1 exactly: the returned stress stays on the flow curve. The default.
    #[default]
    Exact,
    /// The trace is kept; the next step's normalisation then rescales the stress (a third of a percent low in steady
    /// shear of a foam). The published form.
    Trace,
}

/// Choices of the shear law that are not material constants.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LawSettings {
    /// How the plastic flow of one step is integrated.
    pub flow_map: FlowMap,
    /// How the determinant of the strain is kept.
    pub determinant: DeterminantPolicy,
    /// What becomes of the shear stress of a torn particle.
    pub torn: TornRule,
}

/// The law of one liquid: neo-Hookean volume and shear, Herschel–Bulkley flow.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HerschelBulkley {
    /// Pressure law.
    pub volume: EquationOfState,
    /// Shear modulus μ [Pa]; 0 for a Newtonian liquid, whose viscosity acts in the shear solve instead.
    pub shear_modulus: f64,
    /// Plastic flow.
    pub flow: ShearFlow,
    /// Dynamic viscosity [Pa·s] of the shear solve where `shear_modulus` is 0; 0 otherwise.
    pub newtonian_viscosity: f64,
    /// Choices that are not material constants.
    pub settings: LawSettings,
}

/// Elastic strain after the deformation of a step, before flow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElasticTrial<const D: usize> {
    /// Trial strain `b̄*`, symmetric, determinant 1.
    pub strain: Tensor<D>,
    /// Determinant of the deformation of the step: the volume ratio grows by it.
    pub volume_factor: f64,
    /// Set where the strain was extreme and its principal values were limited.
    pub limited: bool,
}

/// Elastic strain after flow, with what the implicit shear solve needs of the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relaxed<const D: usize> {
    /// Elastic strain `b̄` after flow, symmetric.
    pub strain: Tensor<D>,
    /// Norm of the shear stress after flow [Pa].
    pub stress: f64,
    /// Radial factor `λ̃` of the stress deviator.
    pub radial: f64,
    /// Derivative of the radial factor by the trial stress norm [1/Pa].
    pub radial_by_stress: f64,
    /// Derivative of the radial factor by the effective modulus [1/Pa].
    pub radial_by_modulus: f64,
    /// Whether the particle flowed.
    pub yielded: bool,
}

/// Deformations of one step whose determinant lies outside this range are refused.
pub const DETERMINANT_RANGE: (f64, f64) = (0.05, 20.0);

/// Largest principal value of `b̄`; beyond it (and below its inverse) principal values are limited in log space.
pub const MAX_PRINCIPAL_STRAIN: f64 = 1e6;

/// Frobenius norm from which the principal values are inspected: below it no limit can be reached.
const INSPECTED_NORM: f64 = 1e4;

/// Carries the elastic strain through the deformation `f` of one step: `b̄* = f̄ b̄ f̄ᵀ`, `f̄ = f/(det f)^{1/D}`, determinant 1.
///
/// # Errors
/// [`RheologyError::Deformation`] if `det f` is not within [`DETERMINANT_RANGE`]; [`RheologyError::NonFinite`] if the
/// strain is not finite.
pub fn elastic_trial<const D: usize>(strain: &Tensor<D>, f: &Tensor<D>) -> Result<ElasticTrial<D>, RheologyError> {
    let volume_factor = determinant(f);
    if !(volume_factor >= DETERMINANT_RANGE.0 && volume_factor <= DETERMINANT_RANGE.1) {
        return Err(RheologyError::Deformation { determinant: volume_factor });
    }
    let isochoric = f * inverse_root::<D>(volume_factor);
    let moved = isochoric * strain * isochoric.transpose();
    normalise(&moved).map(|(strain, limited)| ElasticTrial { strain, volume_factor, limited })
}

/// The strain divided by the root of its determinant, principal values limited where they are extreme.
///
/// # Errors
/// [`RheologyError::NonFinite`] if the strain is not finite.
pub fn normalise<const D: usize>(strain: &Tensor<D>) -> Result<(Tensor<D>, bool), RheologyError> {
    let symmetric = 0.5 * (strain + strain.transpose());
    let det = determinant(&symmetric);
    let size = symmetric.norm();
    if det > 1e-4 && size < INSPECTED_NORM {
        return Ok((symmetric * inverse_root::<D>(det), false));
    }
    if !size.is_finite() {
        return Err(RheologyError::NonFinite { what: "elastic strain" });
    }
    // a determinant taken from the entries has no digits left here: normalise the principal values in log space
    let eigen = symmetric_eigen(&symmetric);
    let floor = size.max(1.0) * 1e-15;
    let mut logs = eigen.values.map(|v| v.max(floor).ln());
    let bound = MAX_PRINCIPAL_STRAIN.ln();
    let mut limited = false;
    for _ in 0..4 {
        let mean = logs.sum() / D as f64;
        for k in 0..D {
            logs[k] -= mean;
            if logs[k].abs() > bound {
                logs[k] = logs[k].clamp(-bound, bound);
                limited = true;
            }
        }
    }
    let mean = logs.sum() / D as f64;
    let mut scaled = eigen.vectors;
    for i in 0..D {
        let factor = (logs[i] - mean).exp();
        for k in 0..D {
            scaled[(k, i)] *= factor;
        }
    }
    let axes = eigen.vectors;
    let out = scaled * axes.transpose();
    Ok((0.5 * (out + out.transpose()), limited))
}

/// Mean `β` that makes `det(D + β I) = 1` for a symmetric deviator, on the branch where `D + β I` is positive definite.
///
/// `start`: a mean at or above the root (the mean of the strain the deviator was shrunk from).
#[must_use]
pub fn unit_determinant_mean<const D: usize>(dev: &Tensor<D>, start: f64) -> f64 {
    let half_square = 0.5 * contract(dev, dev);
    if D == 2 {
        return (1.0 + half_square).sqrt();
    }
    let det = determinant(dev);
    // β³ − ½‖D‖²β + det D − 1, increasing and convex above its largest root: Newton descends from any point above
    let mut beta = start.max((half_square / 3.0).sqrt()).max(1.0);
    let cubic = |b: f64| (b * b - half_square) * b + (det - 1.0);
    if cubic(beta) < 0.0 {
        beta = 1.0 + half_square.sqrt(); // the cubic is positive there: |det D| ≤ (half_square)^{3/2}·2/(3√3)
    }
    for _ in 0..60 {
        let slope = 3.0 * beta * beta - half_square;
        if slope <= 0.0 {
            break;
        }
        let next = beta - cubic(beta) / slope;
        let step = beta - next;
        if step > 0.0 {
            beta = next;
        }
        if step <= 1e-15 * beta || step.is_nan() {
            break;
        }
    }
    beta
}

impl HerschelBulkley {
    /// A law from bulk modulus [Pa], shear modulus [Pa], flow curve and settings.
    ///
    /// # Errors
    /// [`RheologyError::Parameter`] if a number lies outside its range.
    pub fn new(
        bulk_modulus: f64,
        shear_modulus: f64,
        curve: &FlowCurve,
        settings: LawSettings,
    ) -> Result<Self, RheologyError> {
        require("shear modulus", shear_modulus, shear_modulus >= 0.0, "finite, at least 0 Pa")?;
        Ok(HerschelBulkley {
            volume: EquationOfState::new(bulk_modulus)?,
            shear_modulus,
            flow: ShearFlow::new(curve)?,
            newtonian_viscosity: if shear_modulus == 0.0 { curve.newtonian_viscosity() } else { 0.0 },
            settings,
        })
    }

    /// Whether the liquid carries elastic shear at all; if not, only its volume ratio needs to be stored.
    #[inline]
    #[must_use]
    pub fn is_shear_elastic(&self) -> bool {
        self.shear_modulus > 0.0
    }

    /// Relaxes the trial strain by the flow of one step.
    ///
    /// - `trial`: strain after the deformation of the step, determinant 1
    /// - `previous`: strain before it (only the `Forced` map reads it)
    /// - `dt`: step [s]
    ///
    /// # Errors
    /// [`RheologyError::NonFinite`] if the trial strain is not finite.
    #[inline]
    pub fn relax<const D: usize>(
        &self,
        trial: &Tensor<D>,
        previous: &Tensor<D>,
        dt: f64,
    ) -> Result<Relaxed<D>, RheologyError> {
        if self.shear_modulus == 0.0 {
            return Ok(Relaxed {
                strain: Tensor::<D>::identity(),
                stress: 0.0,
                radial: 0.0,
                radial_by_stress: 0.0,
                radial_by_modulus: 0.0,
                yielded: true,
            });
        }
        let (dev, mean) = deviator(trial);
        let size = dev.norm();
        if !(size.is_finite() && mean.is_finite()) {
            return Err(RheologyError::NonFinite { what: "elastic strain" });
        }
        let trial_stress = self.shear_modulus * size;
        let before = if self.settings.flow_map == FlowMap::Forced && size > 0.0 {
            self.shear_modulus * contract(&deviator(previous).0, &dev) / size
        } else {
            trial_stress
        };
        let map = self.flow.return_map(self.settings.flow_map, trial_stress, before, self.shear_modulus * mean, dt);
        let (radial, radial_by_stress, radial_by_modulus) = map.radial(trial_stress);
        let yielded = map.stress != trial_stress;
        let mut strain = *trial;
        if yielded {
            strain = dev * radial;
            let beta = match self.settings.determinant {
                DeterminantPolicy::Exact => unit_determinant_mean(&strain, mean),
                DeterminantPolicy::Trace => mean,
            };
            for i in 0..D {
                strain[(i, i)] += beta;
            }
        }
        Ok(Relaxed { strain, stress: map.stress, radial, radial_by_stress, radial_by_modulus, yielded })
    }

    /// Kirchhoff shear stress `μ dev b̄` [Pa].
    #[inline]
    #[must_use]
    pub fn shear_stress<const D: usize>(&self, strain: &Tensor<D>) -> Tensor<D> {
        deviator(strain).0 * self.shear_modulus
    }

    /// Norm `s = μ‖dev b̄‖` of the shear stress [Pa].
    #[inline]
    #[must_use]
    pub fn shear_stress_norm<const D: usize>(&self, strain: &Tensor<D>) -> f64 {
        self.shear_modulus * deviator(strain).0.norm()
    }

    /// Kirchhoff stress `κ/2 (J² − 1) I + μ dev b̄` [Pa], tension positive.
    #[must_use]
    pub fn kirchhoff_stress<const D: usize>(&self, volume_ratio: f64, strain: &Tensor<D>) -> Tensor<D> {
        let mut out = self.shear_stress(strain);
        for i in 0..D {
            out[(i, i)] -= volume_ratio * self.volume.pressure(volume_ratio);
        }
        out
    }

    /// Cauchy stress [Pa]: the Kirchhoff stress over the volume ratio.
    #[must_use]
    pub fn cauchy_stress<const D: usize>(&self, volume_ratio: f64, strain: &Tensor<D>) -> Tensor<D> {
        self.kirchhoff_stress(volume_ratio, strain) / volume_ratio
    }

    /// Elastic energy per rest volume [J/m³]: `W_v(J) + μ/2 (tr b̄ − D)`.
    #[must_use]
    pub fn energy<const D: usize>(&self, volume_ratio: f64, strain: &Tensor<D>) -> f64 {
        self.volume.energy(volume_ratio) + 0.5 * self.shear_modulus * (strain.trace() - D as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Matrix3, Rotation3, Vector3};
    use proptest::prelude::*;

    fn cream(settings: LawSettings) -> HerschelBulkley {
        let curve = FlowCurve::J2 { yield_stress: 31.9, consistency: 27.2, index: 0.22 };
        HerschelBulkley::new(1.09e5, 290.0, &curve, settings).unwrap()
    }

    fn matrix3(amplitude: f64) -> impl Strategy<Value = Matrix3<f64>> {
        prop::array::uniform9(-amplitude..amplitude).prop_map(|a| Matrix3::from_row_slice(&a))
    }

    proptest! {
        #[test]
        fn stress_is_the_derivative_of_the_energy(step in matrix3(0.25), direction in matrix3(1.0)) {
            let f = Matrix3::identity() + step;
            let j = determinant(&f);
            prop_assume!(j > 0.2);
            let law = HerschelBulkley { volume: EquationOfState { bulk_modulus: 7.0 }, shear_modulus: 3.0, ..cream(LawSettings::default()) };
            let energy = |f: &Matrix3<f64>| {
                let j = determinant(f);
                law.energy(j, &(f * f.transpose() * j.powf(-2.0 / 3.0)))
            };
            // P : dF with P = τ F^{-T}
            let tau = law.kirchhoff_stress(j, &(f * f.transpose() * j.powf(-2.0 / 3.0)));
            let along = contract(&(tau * f.try_inverse().unwrap().transpose()), &direction);
            let h = 1e-5;
            let difference = (energy(&(f + h * direction)) - energy(&(f - h * direction))) / (2.0 * h);
            prop_assert!((along - difference).abs() < 1e-6 * (1.0 + along.abs()));
        }

        #[test]
        fn relaxation_keeps_determinant_direction_and_the_flow_curve(step in matrix3(0.4), ln_dt in -9.0f64..-2.0) {
            let f = Matrix3::identity() + step;
            prop_assume!(determinant(&f) > 0.1);
            let trial = elastic_trial(&Matrix3::identity(), &f).unwrap();
            prop_assert!((determinant(&trial.strain) - 1.0).abs() < 1e-12);
            let law = cream(LawSettings::default());
            let out = law.relax(&trial.strain, &Matrix3::identity(), ln_dt.exp()).unwrap();
            prop_assert!((determinant(&out.strain) - 1.0).abs() < 1e-12);
            prop_assert!((law.shear_stress_norm(&out.strain) - out.stress).abs() <= 1e-12 * out.stress.max(1.0));
            let (a, b) = (deviator(&trial.strain).0, deviator(&out.strain).0);
            prop_assert!((contract(&a, &b) - a.norm() * b.norm()).abs() <= 1e-12 * a.norm() * b.norm());
            prop_assert!(symmetric_eigen(&out.strain).values.iter().all(|&v| v > 0.0));
        }

        #[test]
        fn a_rotation_turns_the_strain_and_changes_nothing_else(step in matrix3(0.3), axis in prop::array::uniform3(-3.0f64..3.0)) {
            let trial = elastic_trial(&Matrix3::identity(), &(Matrix3::identity() + step));
            prop_assume!(trial.is_ok());
            let strain = trial.unwrap().strain;
            let q = Rotation3::from_scaled_axis(Vector3::from(axis)).into_inner();
            let turned = elastic_trial(&strain, &q).unwrap();
            prop_assert!((turned.strain - q * strain * q.transpose()).norm() <= 1e-13 * strain.norm());
            prop_assert!((turned.volume_factor - 1.0).abs() < 1e-13);
        }
    }

    #[test]
    fn two_dimensions_have_their_own_closed_form() {
        let trial = elastic_trial(&Matrix2::identity(), &Matrix2::new(1.0, 0.7, 0.0, 1.0)).unwrap();
        let out = cream(LawSettings::default()).relax(&trial.strain, &Matrix2::identity(), 1e-2).unwrap();
        assert!(out.yielded && (determinant(&out.strain) - 1.0).abs() < 1e-14);
        let kept = cream(LawSettings { determinant: DeterminantPolicy::Trace, ..LawSettings::default() })
            .relax(&trial.strain, &Matrix2::identity(), 1e-2)
            .unwrap();
        assert!((kept.strain.trace() - trial.strain.trace()).abs() < 1e-14);
    }

    #[test]
    fn extreme_stretch_is_limited_and_stays_a_strain() {
        let mut strain = Matrix3::identity();
        for _ in 0..60 {
            let f = Matrix3::from_diagonal(&Vector3::new(2.0, 0.7, 1.0 / 1.4));
            let trial = elastic_trial(&strain, &f).unwrap();
            strain = trial.strain;
            let values = symmetric_eigen(&strain).values;
            assert!(values.iter().all(|v| v.is_finite() && *v > 0.0 && *v <= 1.1 * MAX_PRINCIPAL_STRAIN), "{values:?}");
        }
        assert!(elastic_trial(&strain, &Matrix3::identity()).unwrap().strain.norm() > 1e5);
    }

    #[test]
    fn bad_deformations_are_refused() {
        let id = Matrix3::<f64>::identity();
        for f in [-id, 0.1 * id, 5.0 * id, id * f64::NAN] {
            assert!(matches!(elastic_trial(&id, &f), Err(RheologyError::Deformation { .. })));
        }
        assert!(elastic_trial(&(id * f64::NAN), &id).is_err());
        assert!(cream(LawSettings::default()).relax(&(id * f64::NAN), &id, 1e-3).is_err());
    }

    #[test]
    fn an_inviscid_elastic_liquid_drops_all_shear() {
        let curve = FlowCurve::J2 { yield_stress: 0.0, consistency: 0.0, index: 0.5 };
        let law = HerschelBulkley::new(1e5, 100.0, &curve, LawSettings::default()).unwrap();
        let trial =
            elastic_trial(&Matrix3::identity(), &Matrix3::new(1.0, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)).unwrap();
        let out = law.relax(&trial.strain, &Matrix3::identity(), 1e-3).unwrap();
        assert!((out.strain - Matrix3::identity()).norm() < 1e-15 && out.stress == 0.0);
        let still = law.relax(&Matrix3::identity(), &Matrix3::identity(), 1e-3).unwrap();
        assert_eq!((still.radial, still.stress), (1.0, 0.0));
    }
}
