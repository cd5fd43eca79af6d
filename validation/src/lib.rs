//! Analytic, literature and hard cases: each a small experiment with its reference recomputed for the parameters asked for.
//!
//! ```text
//! registry ── every case by its id ──► case (Params → Outcome) ──► run: seconds, JSON line, verdict
//! cases/<group>/…: one file a case        hard: scenes in scenes/hard run to their stated pass conditions
//! ```

pub mod case;
pub mod cases;
pub mod hard;
pub mod report;
pub mod run;

pub use case::{Case, CaseError, Curve, Outcome, Param, Params, Table};
pub use run::{CaseResult, run_case};
