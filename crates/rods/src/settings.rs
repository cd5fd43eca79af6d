//! Settings of the implicit step.

use crate::error::RodError;
use serde::{Deserialize, Serialize};

/// Time integrator.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Integrator {
    /// Backward Euler: first order, dissipates, never gains energy. Right with contact and for stiff scenes.
    #[default]
    ImplicitEuler,
    /// Two-step backward differentiation with variable step: second order, strongly damps what the step cannot resolve.
    Bdf2,
    /// Implicit midpoint: second order, keeps linear and angular momentum, hardly dissipates. Not for long runs whose
    /// step leaves the stretching vibration of stiff strands unresolved: nothing damps it, and fast turning feeds it.
    ImplicitMidpoint,
}

/// Which matrix Newton's method uses; the later ones serve as fallbacks of the earlier.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum HessianMode {
    /// The exact Hessian.
    #[default]
    Exact,
    /// Negative eigenvalues of each element clamped to zero.
    ElementProjected,
    /// Second derivatives of the strains dropped.
    GaussNewton,
    /// Gauss–Newton plus a growing multiple of the diagonal.
    Shifted,
}

/// Settings of [`RodStepper`](crate::RodStepper).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RodSettings {
    /// Time integrator. Default implicit Euler.
    pub integrator: Integrator,
    /// First matrix tried in each Newton iteration; weaker ones follow where it is not positive definite.
    pub hessian: HessianMode,
    /// Relative tolerance of the residual force, against the larger of weight, load and inertia of the heaviest
    /// vertex; 1e-12 to 1e-3. Smaller costs iterations; the round-off floor of the stiffest edge is always allowed.
    pub tolerance: f64,
    /// Newton iterations allowed per strand and step, 1 to 10 000.
    pub max_iterations: usize,
    /// Armijo constant: share of the predicted decrease that must be reached, 0 to 0.5.
    pub armijo: f64,
    /// Halvings allowed in one line search, 1 to 60.
    pub max_halvings: usize,
    /// Largest turn of an edge per step \[rad\] that the accuracy limit of [`RodStepper::step_limit`](crate::RodStepper::step_limit)
    /// aims at, 0.01 to 3. Smaller: more steps, smaller error.
    pub max_turn: f64,
}

impl Default for RodSettings {
    fn default() -> Self {
        Self {
            integrator: Integrator::default(),
            hessian: HessianMode::default(),
            tolerance: 1e-8,
            max_iterations: 60,
            armijo: 1e-4,
            max_halvings: 24,
            max_turn: 0.1,
        }
    }
}

impl RodSettings {
    /// Refuses values outside their range.
    pub fn check(&self) -> Result<(), RodError> {
        let bad = |field, range| Err(RodError::Setting { field, range });
        if !(1e-12..=1e-3).contains(&self.tolerance) {
            return bad("tolerance", "between 1e-12 and 1e-3");
        }
        if !(1..=10_000).contains(&self.max_iterations) {
            return bad("max_iterations", "between 1 and 10000");
        }
        if !(0.0..=0.5).contains(&self.armijo) {
            return bad("armijo", "between 0 and 0.5");
        }
        if !(1..=60).contains(&self.max_halvings) {
            return bad("max_halvings", "between 1 and 60");
        }
        if !(0.01..=3.0).contains(&self.max_turn) {
            return bad("max_turn", "between 0.01 and 3 [rad]");
        }
        Ok(())
    }
}
