//! What a run leaves behind: time series, timings, frames, checkpoints, provenance, summary.
//!
//! ```text
//! DIR/ scene.ron         the scene as run          provenance.json   who made it, of what
//!      series.csv        one row a step            timings.csv       what the clock says
//!      frames/           VTK and PLY               checkpoints/      to go on from
//!      summary.json      how it ended
//! ```

pub mod checkpoint;
pub mod clock;
pub mod folder;
pub mod frame;
pub mod frame_files;
pub mod ply;
pub mod provenance;
pub mod recorder;
pub mod series;
mod vti;
pub mod vtk;
