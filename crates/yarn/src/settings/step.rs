//! Step size and integrator.

use serde::{Deserialize, Serialize};

use super::{positive, range};
use crate::YarnError;

/// How the grid velocities are advanced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Integrator {
    /// Symplectic Euler: cheap steps, bounded by the fastest wave.
    #[default]
    Explicit,
    /// Backward Euler by Newton–CG on the grid: steps bounded by motion alone; damps waves that the step does not resolve.
    Implicit(ImplicitSettings),
}

/// Knobs of the implicit solve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ImplicitSettings {
    /// Newton and the search for friction stop when what is left has fallen to this share of the momentum change they started from;
    /// 1e-12 to 0.1. Momentum is kept as well as this.
    pub tolerance: f64,
    /// Most Newton iterations for one set of contacts and friction impulses, from 1. One gives the linearly implicit step.
    pub max_newton: usize,
    /// Most conjugate-gradient iterations per Newton iteration, from 1.
    pub max_cg: usize,
    /// Refuse a step that did not converge; otherwise take the last iterate, which never raises the step's potential.
    pub require_convergence: bool,
}

impl Default for ImplicitSettings {
    fn default() -> Self {
        Self { tolerance: 1e-4, max_newton: 20, max_cg: 200, require_convergence: true }
    }
}

/// What to do with a step that is too large for stability.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum OversizedStep {
    /// Divide it; the report says into how many and why.
    #[default]
    Substep,
    /// Refuse it with an error.
    Refuse,
}

/// Step control.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StepSettings {
    /// Integrator.
    pub integrator: Integrator,
    /// Share of the provable stability limit that is used, 0.01 to 1. Larger is faster and less accurate at the grid scale.
    pub safety: f64,
    /// Largest motion per step of vertices and obstacles in cells, 0.01 to 1.
    pub motion: f64,
    /// What to do with a step that is too large.
    pub oversized: OversizedStep,
    /// Most sub-steps of one step.
    pub max_substeps: usize,
}

impl Default for StepSettings {
    fn default() -> Self {
        Self {
            integrator: Integrator::Explicit,
            safety: 0.7,
            motion: 0.3,
            oversized: OversizedStep::Substep,
            max_substeps: 1000,
        }
    }
}

impl StepSettings {
    pub(super) fn check(&self) -> Result<(), YarnError> {
        range("step.safety", self.safety, 0.01, 1.0)?;
        range("step.motion", self.motion, 0.01, 1.0)?;
        positive("step.max_substeps", self.max_substeps as f64)?;
        if let Integrator::Implicit(implicit) = &self.integrator {
            range("step.integrator.tolerance", implicit.tolerance, 1e-12, 0.1)?;
            positive("step.integrator.max_newton", implicit.max_newton as f64)?;
            positive("step.integrator.max_cg", implicit.max_cg as f64)?;
        }
        Ok(())
    }
}
