//! Plastic history of a particle: when it tears, what a torn particle may still do, how it heals.
//!
//! The history is the isochoric plastic right Cauchy–Green tensor `C^P = J^{-2/D} Fᵀ b̄⁻¹ F`, where `F` is the whole
//! deformation gradient since the particle was made and `b̄` its elastic strain. Source: Fei et al. 2019, stages 5 and 12.

use crate::error::RheologyError;
use crate::liquid_law::{ElasticTrial, elastic_trial};
use crate::tensor::{
    Tensor, determinant, deviator, inverse, inverse_root, largest_eigenvalue, polar_rotation, symmetric_eigen,
    symmetric_part,
};
use serde::{Deserialize, Serialize};

/// Plastic history `C^P = J^{-2/D} Fᵀ b̄⁻¹ F`, symmetric, of determinant 1 where `b̄` has it.
///
/// # Errors
/// [`RheologyError::Deformation`] if `det F` is not positive and finite; [`RheologyError::NonFinite`] if `b̄` is singular.
pub fn plastic_history<const D: usize>(
    deformation_gradient: &Tensor<D>,
    strain: &Tensor<D>,
) -> Result<Tensor<D>, RheologyError> {
    let j = determinant(deformation_gradient);
    if !(j > 0.0 && j.is_finite()) {
        return Err(RheologyError::Deformation { determinant: j });
    }
    let isochoric = deformation_gradient * inverse_root::<D>(j);
    let inverse_strain = inverse(strain).ok_or(RheologyError::NonFinite { what: "inverse of the elastic strain" })?;
    let history = isochoric.transpose() * inverse_strain * isochoric;
    Ok(0.5 * (history + history.transpose()))
}

/// Whether a history exceeds the tearing strain: `‖dev C^P‖ ≥ limit`.
#[inline]
#[must_use]
pub fn is_torn<const D: usize>(history: &Tensor<D>, limit: f64) -> bool {
    deviator(history).0.norm() >= limit
}

/// What becomes of the shear stress of a torn particle that is pulled further.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum TornRule {
    /// Its elastic strain is released: a torn thread bears nothing until it is pressed together again. The default.
    #[default]
    Release,
    /// Its elastic strain turns with it but does not grow; what lies below yield stays for good. The published form.
    Hold,
}

/// What a torn particle does with the deformation `f` of a step: strain that would grow only turns, tension is released.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TornStep<const D: usize> {
    /// Trial strain and volume factor; the factor is 1 where the particle would have come under tension.
    pub trial: ElasticTrial<D>,
    /// The part of the deformation that reaches the deformation gradient: `F ← applied F`.
    pub applied: Tensor<D>,
}

/// [`torn_step_with`] under the default rule.
///
/// # Errors
/// Those of [`elastic_trial`].
pub fn torn_step<const D: usize>(
    strain: &Tensor<D>,
    volume_ratio: f64,
    f: &Tensor<D>,
) -> Result<TornStep<D>, RheologyError> {
    torn_step_with(TornRule::default(), strain, volume_ratio, f)
}

/// Carries the strain of a torn particle through the deformation `f`: the largest principal strain may fall, not grow (it is
/// released or held by `rule`), and a volume ratio above 1 may not grow.
///
/// - `rule`: what becomes of the shear stress
/// - `strain`: elastic strain before the step
/// - `volume_ratio`: volume ratio before the step
///
/// # Errors
/// Those of [`elastic_trial`].
pub fn torn_step_with<const D: usize>(
    rule: TornRule,
    strain: &Tensor<D>,
    volume_ratio: f64,
    f: &Tensor<D>,
) -> Result<TornStep<D>, RheologyError> {
    let mut trial = elastic_trial(strain, f)?;
    let mut applied = *f;
    if largest_eigenvalue(&trial.strain) > largest_eigenvalue(strain) {
        let turn = polar_rotation(f);
        trial.strain = match rule {
            TornRule::Hold => symmetric_part(&(turn * strain * turn.transpose())),
            TornRule::Release => Tensor::<D>::identity(),
        };
        applied = turn / inverse_root::<D>(trial.volume_factor);
    }
    if trial.volume_factor > 1.0 && volume_ratio * trial.volume_factor > 1.0 {
        applied *= inverse_root::<D>(trial.volume_factor);
        trial.volume_factor = 1.0;
    }
    Ok(TornStep { trial, applied })
}

/// Heals the plastic history over a step: `ln C^P` decays by `e^{−dt/recovery_time}` while the elastic strain and the volume
/// stay. Returns the new deformation gradient.
///
/// Principal values of the history below 1e-12 are treated as 1e-12 (a round-off guard).
///
/// # Errors
/// [`RheologyError::Deformation`] if `det F` is not positive and finite.
pub fn recover<const D: usize>(
    deformation_gradient: &Tensor<D>,
    strain: &Tensor<D>,
    dt: f64,
    recovery_time: f64,
) -> Result<Tensor<D>, RheologyError> {
    let history = plastic_history(deformation_gradient, strain)?;
    let j = determinant(deformation_gradient);
    let eigen = symmetric_eigen(&history);
    let exponent = 0.5 * (-dt / recovery_time).exp_m1();
    let factor = eigen.map(|p| (exponent * p.max(1e-12).ln()).exp());
    let healed = deformation_gradient * factor;
    Ok(healed * inverse_root::<D>(determinant(&healed) / j))
}

/// Norm of the logarithm of a history (0 for an unstrained particle).
#[must_use]
pub fn log_norm<const D: usize>(history: &Tensor<D>) -> f64 {
    symmetric_eigen(history).values.iter().map(|v| v.max(1e-300).ln().powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, Matrix3};

    const GRADIENT: Matrix3<f64> = Matrix3::new(2.0, 0.6, 0.0, -0.3, 0.9, 0.2, 0.1, 0.0, 0.8);

    fn strain() -> Matrix3<f64> {
        elastic_trial(&Matrix3::identity(), &Matrix3::new(1.1, 0.2, 0.0, 0.0, 0.95, 0.1, 0.0, 0.0, 1.0)).unwrap().strain
    }

    #[test]
    fn recovery_decays_the_logarithm_and_leaves_elastic_strain_and_volume() {
        let b = strain();
        let begin = plastic_history(&GRADIENT, &b).unwrap();
        let mut f = GRADIENT;
        for _ in 0..50 {
            f = recover(&f, &b, 0.01, 0.35).unwrap();
        }
        let end = plastic_history(&f, &b).unwrap();
        let expected = log_norm(&begin) * (-0.5f64 / 0.35).exp();
        assert!((log_norm(&end) / expected - 1.0).abs() < 1e-10);
        assert!((determinant(&f) / determinant(&GRADIENT) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_history_of_a_purely_elastic_deformation_is_the_identity() {
        let f = Matrix2::new(1.2, 0.4, -0.1, 1.1);
        let b = elastic_trial(&Matrix2::identity(), &f).unwrap().strain;
        assert!((plastic_history(&f, &b).unwrap() - Matrix2::identity()).norm() < 1e-14);
        assert!(!is_torn(&plastic_history(&f, &b).unwrap(), 1e-6));
    }

    #[test]
    fn a_torn_particle_turns_but_does_not_stretch() {
        let b = strain();
        let stretch = Matrix3::new(1.3, 0.3, 0.0, -0.3, 1.1, 0.0, 0.0, 0.0, 1.0);
        let torn = torn_step_with(TornRule::Hold, &b, 1.0, &stretch).unwrap();
        let (before, after) = (symmetric_eigen(&b).values, symmetric_eigen(&torn.trial.strain).values);
        for v in before.iter() {
            assert!(after.iter().any(|w| (v - w).abs() < 1e-12));
        }
        assert_eq!(torn.trial.volume_factor, 1.0);
        assert!((determinant(&torn.applied) - 1.0).abs() < 1e-12);
        let released = torn_step_with(TornRule::Release, &b, 1.0, &stretch).unwrap();
        assert_eq!(released.trial.strain, Matrix3::identity());
        // compression and shortening pass unchanged
        let shrink = Matrix3::identity() * 0.99;
        let torn = torn_step_with(TornRule::Release, &b, 1.0, &shrink).unwrap();
        assert_eq!(torn.applied, shrink);
        assert!((torn.trial.volume_factor - 0.99f64.powi(3)).abs() < 1e-15);
    }
}
