//! What a run leaves behind: time series, frames, checkpoints, provenance.

pub mod frame;
