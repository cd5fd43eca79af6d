//! What a film step says of itself.

use serde::{Deserialize, Serialize};

/// Figures of one step, over all strands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FilmReport {
    /// Largest number of advection sub-steps of a strand.
    pub substeps: usize,
    /// Volume that flowed out of open ends into reservoirs [m³].
    pub outflow: f64,
    /// Momentum along the strands that left with it [kg·m/s].
    pub outflow_momentum: f64,
    /// Wet edges that stand still under the yield stress.
    pub stuck: usize,
    /// Wet edges.
    pub wet: usize,
    /// Edges whose speed was limited, and pairs that the steepness limiter joined.
    pub limited: usize,
    /// Largest speed relative to the strand [m/s].
    pub max_speed: f64,
    /// Strands whose film is not finite.
    pub bad_strands: usize,
    /// The first of them.
    pub first_bad: Option<usize>,
}

impl FilmReport {
    /// Sum of two reports, the earlier strands first.
    #[must_use]
    pub fn merged(self, other: FilmReport) -> FilmReport {
        FilmReport {
            substeps: self.substeps.max(other.substeps),
            outflow: self.outflow + other.outflow,
            outflow_momentum: self.outflow_momentum + other.outflow_momentum,
            stuck: self.stuck + other.stuck,
            wet: self.wet + other.wet,
            limited: self.limited + other.limited,
            max_speed: self.max_speed.max(other.max_speed),
            bad_strands: self.bad_strands + other.bad_strands,
            first_bad: self.first_bad.or(other.first_bad),
        }
    }
}
