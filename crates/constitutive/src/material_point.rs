//! One liquid particle by itself: the state the laws act on, and its step.

use nalgebra::SMatrix;

use crate::error::RheologyError;
use crate::liquid_law::{HerschelBulkley, Relaxed, elastic_trial};
use crate::tearing::{is_torn, plastic_history, recover, torn_step_with};

/// State of one liquid particle in `D` dimensions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaterialPoint<const D: usize> {
    /// Isochoric elastic left Cauchy–Green tensor `b̄`, symmetric, determinant 1.
    pub elastic_strain: SMatrix<f64, D, D>,
    /// Deformation gradient since the particle was made; carries the plastic history.
    pub deformation_gradient: SMatrix<f64, D, D>,
    /// Volume over rest volume.
    pub volume_ratio: f64,
    /// Whether the particle is torn (as found by [`Self::detect_tearing`]).
    pub torn: bool,
}

impl<const D: usize> Default for MaterialPoint<D> {
    fn default() -> Self {
        let identity = SMatrix::<f64, D, D>::identity();
        MaterialPoint { elastic_strain: identity, deformation_gradient: identity, volume_ratio: 1.0, torn: false }
    }
}

impl<const D: usize> MaterialPoint<D> {
    /// Deforms the particle by `f` over `dt` and lets it flow.
    ///
    /// # Errors
    /// As [`elastic_trial`] and [`HerschelBulkley::relax`]; the particle is then unchanged.
    pub fn advance(
        &mut self,
        law: &HerschelBulkley,
        f: &SMatrix<f64, D, D>,
        dt: f64,
    ) -> Result<Relaxed<D>, RheologyError> {
        let (trial, applied) = if self.torn {
            let step = torn_step_with(law.settings.torn, &self.elastic_strain, self.volume_ratio, f)?;
            (step.trial, step.applied)
        } else {
            (elastic_trial(&self.elastic_strain, f)?, *f)
        };
        let relaxed = law.relax(&trial.strain, &self.elastic_strain, dt)?;
        self.elastic_strain = relaxed.strain;
        self.deformation_gradient = applied * self.deformation_gradient;
        self.volume_ratio *= trial.volume_factor;
        Ok(relaxed)
    }

    /// Sets the torn flag from the plastic history; returns it.
    ///
    /// # Errors
    /// As [`plastic_history`].
    pub fn detect_tearing(&mut self, limit: f64) -> Result<bool, RheologyError> {
        self.torn = is_torn(&plastic_history(&self.deformation_gradient, &self.elastic_strain)?, limit);
        Ok(self.torn)
    }

    /// Heals the plastic history over `dt` [s].
    ///
    /// # Errors
    /// As [`recover`].
    pub fn recover(&mut self, dt: f64, recovery_time: f64) -> Result<(), RheologyError> {
        self.deformation_gradient = recover(&self.deformation_gradient, &self.elastic_strain, dt, recovery_time)?;
        Ok(())
    }
}
