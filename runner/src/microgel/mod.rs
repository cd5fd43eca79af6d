//! Soft grains in the rheometer under the common stepper.
//!
//! ```text
//! scene.microgel ─► settings (µm, mg, s) ─► schedule (what happens when; end of the run)
//!                                        └► system: one sample per seed, all in step, in parallel
//!                                             ├► series.csv, frames (picture), checkpoints
//!                                             └► microgel.csv, rheology.json (record)
//! ```
//! The grains take their own steps: the stepper asks for them and never cuts them, so output changes nothing.

mod picture;
mod record;
mod schedule;
mod settings;
mod system;

pub use schedule::Schedule;
pub use settings::settings;
pub use system::MicrogelSystem;

use crate::scene::Scene;

/// The schedule of a scene of grains; `None` for other scenes, or where the settings are out of range.
#[must_use]
pub fn schedule_of(scene: &Scene) -> Option<Schedule> {
    let settings = settings(scene, scene.microgel.as_ref()?).ok()?;
    Some(Schedule::new(&settings))
}

/// Memory per grain with its contacts and neighbours [bytes].
pub const BYTES_PER_GRAIN: f64 = 1200.0;
/// Memory per recorded step and sample [bytes].
pub const BYTES_PER_SIGNAL: f64 = 72.0;
/// Memory per row of the table [bytes].
pub const BYTES_PER_ROW: f64 = 360.0;

/// Memory of a run [bytes]: `grains` in each of `samples`, `measured` steps in each, `rows` of the table.
#[must_use]
pub fn memory(grains: f64, samples: f64, measured: f64, rows: f64) -> f64 {
    samples * (grains * BYTES_PER_GRAIN + measured * BYTES_PER_SIGNAL) + rows * BYTES_PER_ROW
}
