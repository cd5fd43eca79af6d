//! Stage 2: splitting, merging and spreading of particles.

use crate::grid::LiquidGrid;
use crate::settings::LiquidSettings;
use crate::solid::Solid;
use crate::{LiquidError, LiquidMaterial, Particles};
use serde::{Deserialize, Serialize};

/// What the stage did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ResampleReport {
    /// Particles that were split.
    pub split: usize,
}

/// Scratch of the stage.
#[derive(Clone, Debug, Default)]
pub struct ResampleScratch<const D: usize> {
    _order: Vec<u32>,
}

/// Maintains the particles.
///
/// # Errors
/// None yet.
#[expect(clippy::too_many_arguments, reason = "temporary")]
pub fn resample<const D: usize, S: Solid<D>>(
    _particles: &mut Particles<D>,
    _materials: &[LiquidMaterial],
    _grid: &mut LiquidGrid<D>,
    _solids: &[S],
    _dt: f64,
    _step_index: u64,
    _settings: &LiquidSettings,
    _scratch: &mut ResampleScratch<D>,
) -> Result<ResampleReport, LiquidError> {
    Ok(ResampleReport::default())
}
