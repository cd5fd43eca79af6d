//! Settings of the contact solvers: the same struct that a scene file fills.

use crate::local::LocalMethod;
use crate::problem::Scaling;
use serde::{Deserialize, Serialize};

/// Which solver answers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum SolverChoice {
    /// Chooses per group of contacts and hands over by measured progress.
    #[default]
    Auto,
    /// Block Gauss–Seidel over the contacts.
    GaussSeidel,
    /// Smoothed Fischer–Burmeister Newton method with a sparse factorisation.
    Newton,
    /// Alternating directions with one reused factorisation.
    Admm,
}

impl SolverChoice {
    /// The name used on the command line and in records: `auto`, `gauss_seidel`, `newton`, `admm`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            SolverChoice::Auto => "auto",
            SolverChoice::GaussSeidel => "gauss_seidel",
            SolverChoice::Newton => "newton",
            SolverChoice::Admm => "admm",
        }
    }

    /// The choice of that name; `-` and `_` count the same.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        let name = name.replace('-', "_").to_ascii_lowercase();
        Self::ALL.into_iter().find(|s| s.name() == name)
    }

    /// Every choice.
    pub const ALL: [SolverChoice; 4] =
        [SolverChoice::Auto, SolverChoice::GaussSeidel, SolverChoice::Newton, SolverChoice::Admm];
}

/// Settings of a contact solve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ContactSettings {
    /// Which solver answers.
    pub solver: SolverChoice,
    /// Relative natural-map residual at which a solve ends [1], 1e-14 … 1. Smaller: more sweeps and Newton steps; the
    /// default is where the end state of scenes stops changing (case `contact/tolerance`).
    pub tolerance: f64,
    /// How velocity and impulse are brought to one unit in the residual; public problem files use `UnitStep`.
    pub scaling: Scaling,
    /// Most Gauss–Seidel sweeps when that solver is asked for by name [sweeps].
    pub max_sweeps: usize,
    /// Most Newton iterations of one attempt [iterations]; a group whose attempts all fail goes to the next solver.
    pub max_newton_iterations: usize,
    /// Most alternating-direction iterations [iterations].
    pub max_admm_iterations: usize,
    /// Local solver inside Gauss–Seidel; the other one is its fall-back.
    pub local: LocalMethod,
    /// Groups are solved in parallel when the problem has at least this many contacts; the result does not depend on it.
    pub parallel_above: usize,
}

impl Default for ContactSettings {
    fn default() -> Self {
        ContactSettings {
            solver: SolverChoice::Auto,
            tolerance: 1e-8,
            scaling: Scaling::PerContact,
            max_sweeps: 20_000,
            max_newton_iterations: 60,
            max_admm_iterations: 3_000,
            local: LocalMethod::default(),
            parallel_above: 256,
        }
    }
}
