//! Backward Euler on the grid.

use nalgebra::SVector;

use crate::YarnError;
use crate::boundary::BoundarySample;
use crate::nodes::{Loads, Totals};
use crate::settings::ImplicitSettings;
use crate::state::YarnState;
use crate::step::{Scratch, Setting};

/// Effort and success of a solve.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SolveOutcome {
    pub newton: usize,
    pub cg: usize,
    pub residual: f64,
}

/// Working memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct ImplicitScratch<const D: usize> {
    _p: Vec<SVector<f64, D>>,
}

#[expect(clippy::too_many_arguments)]
pub(crate) fn solve<const D: usize>(
    _setting: &Setting<'_, D>,
    _implicit: &ImplicitSettings,
    _state: &YarnState<D>,
    _scratch: &mut Scratch<D>,
    _posed: &BoundarySample<'_, D>,
    _loads: &Loads<D>,
    _targets: &[(usize, SVector<f64, D>)],
    _dt: f64,
    _least_mass: f64,
    _totals: &mut Totals<D>,
) -> Result<SolveOutcome, YarnError> {
    unimplemented!()
}
