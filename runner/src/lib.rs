//! From a scene file to records: scene → world → plan → stepper → record.
//!
//! ```text
//! scene     text → Scene in SI, or a message that says what to write instead
//! world     all state of strands and liquid; components are optional
//! microgel  soft grains in the rheometer, another kind of scene
//! yarn      yarns on a grid, the third kind of scene
//! import    scenes of other programs → scene text
//! plan      which stages this scene needs, and why
//! stages    one file per stage of the algorithm
//! system    the trait that strands and liquid, yarns and microgels share
//! stepper   step size, retry with a smaller step
//! record    series, frames, checkpoints, provenance
//! overlap   strands that overlap where a scene puts them
//! prepare   scene → job        run       job → results
//! report, picture   a page with plots and pictures
//! ```

pub mod cost;
pub mod import;
pub mod microgel;
pub mod overlap;
pub mod picture;
pub mod plan;
pub mod prepare;
pub mod record;
pub mod report;
pub mod run;
pub mod scene;
pub mod stages;
pub mod stepper;
pub mod system;
pub mod world;
pub mod yarn;
