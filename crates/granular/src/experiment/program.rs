//! The whole course of a run as a list of operations, known before the first grain is placed.

use super::drive::{Segment, segments};
use super::settings::MicrogelSettings;
use crate::preparation::schedule::{Operation, preparation, step_sizes};

/// Operations from the random packing to the last step, and the segments that their `Drive` entries name.
///
/// It depends on the settings alone, not on the seed: all samples of an ensemble take the same steps.
pub fn program(settings: &MicrogelSettings) -> (Vec<Operation>, Vec<Segment>) {
    let segments = segments(settings);
    let amplitude = settings.experiment.smallest_amplitude();
    // The steps of the preparation are the published ones; only the measurement feels the step factor.
    let sizes = step_sizes(&settings.model, amplitude);
    let cycle = segments.first().map_or(1.0, |s| s.damping.powf(sizes.dt / s.dt));
    let mut program = preparation(&settings.model, &settings.preparation, amplitude, cycle, settings.plates());
    program.extend((0..segments.len()).map(Operation::Drive));
    (program, segments)
}
