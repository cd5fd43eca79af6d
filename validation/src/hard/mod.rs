//! Hard scenes: each runs whole through the runner and is judged by the pass condition stated in its file.
//!
//! ```text
//! scenes/hard/NAME.ron ─► scene, world, stepper, record (in a folder of its own) ─► series, frames ─► pass condition
//! ```

mod coupled;
mod scene_run;
mod strands;

use crate::case::{Case, Param};

pub use scene_run::{SceneRun, Series};

/// Every hard scene takes one override, so that its neighbours can be tried too.
pub(crate) const OVERRIDE: &[Param] =
    &[Param::text("set", "", "an override of the scene, `path=value` (as for `viscose run --set`)")];

/// The hard scenes as cases.
#[must_use]
pub fn cases() -> Vec<Case> {
    let mut cases = coupled::cases();
    cases.extend(strands::cases());
    cases
}
