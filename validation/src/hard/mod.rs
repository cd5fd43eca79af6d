//! Hard scenes: each runs whole through the runner and is judged by the pass condition stated in its file.
//!
//! ```text
//! scenes/hard/NAME.ron ─► scene, world, stepper, record (in a folder of its own) ─► series, frames ─► pass condition
//! ```

mod contact;
mod coupled;
mod friction;
mod liquid;
mod scene_run;
mod strands;
mod yarn;

use crate::case::{Case, Param};

pub use scene_run::{SceneRun, Series};

/// Every hard scene takes one override, so that its neighbours can be tried too.
pub(crate) const OVERRIDE: &[Param] =
    &[Param::text("set", "", "an override of the scene, `path=value` (as for `viscose run --set`)")];

/// The hard scenes as cases.
#[must_use]
pub fn cases() -> Vec<Case> {
    let mut cases = strands::cases();
    cases.extend(yarn::cases());
    cases.extend(liquid::cases());
    cases.extend(coupled::cases());
    cases.extend(friction::cases());
    cases.extend(contact::cases());
    cases
}
