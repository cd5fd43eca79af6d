//! What is done to the sample, and the rheometer that does it one step at a time.
//!
//! ```text
//! settings   the experiments a scene can name; the whole `microgel` section
//! drive      segments: prescribed strain, rate or stress as functions of time
//! program    the order of all steps, from the packing to the last segment
//! rheometer  prepares and drives a sample by a program that can be saved and resumed at any step
//! result     moduli, steady values and quality gates of a finished run
//! figure     the numbers of experiments that do not oscillate
//! ensemble   many seeds in parallel
//! ```

mod drive;
pub mod ensemble;
mod figure;
mod program;
mod result;
mod rheometer;
mod settings;

pub use drive::{Drive, Segment, Wave};
pub use ensemble::{Ensemble, FigureEstimate, figures, run_ensemble};
pub use figure::Figure;
pub use program::program;
pub use result::{Gate, GateLevel, Measure, Moduli, SegmentResult, Summary};
pub use rheometer::{Progress, Rheometer, Signal};
pub use settings::{Experiment, MicrogelSettings, Oscillation, Tone};
