//! What the stepper drives: one system of physics behind one trait.
//!
//! Strands with liquid (the twelve stages), yarns and microgels each implement [`System`]; stepping, retrying, recording,
//! checkpointing and reporting are written once, against this trait.
//!
//! ```text
//! step_limits ──► stepper picks dt ──► snapshot ──► advance ──► accepted: row, frame, checkpoint
//!                                          ▲            └─ rejected: restore, halve ─┘
//! ```

use std::fmt;

use serde::Serialize;

use crate::record::frame::Frame;

/// One system of physics under the common stepper.
pub trait System: Send {
    /// Short name of the system: `strands`, `liquid`, `yarn`, `microgel`.
    fn kind(&self) -> &'static str;

    /// The columns this system adds to `series.csv`, the same for the whole run.
    fn columns(&self) -> Vec<Column>;

    /// The values of those columns after an accepted step, appended to `out` in the same order.
    fn row(&self, out: &mut Vec<f64>);

    /// The stable step of every active component and why. An empty list means: nothing limits the step.
    fn step_limits(&self) -> Vec<StepLimit>;

    /// Keeps the present state so that a rejected step can be taken back.
    fn snapshot(&mut self);

    /// Takes the state back to the last snapshot.
    fn restore(&mut self);

    /// Advances the state from `time` by `dt` [s].
    ///
    /// # Errors
    /// A rejection names the stage and the element; the state is then undefined until [`System::restore`].
    fn advance(&mut self, time: f64, dt: f64) -> Result<(), Rejection>;

    /// Solver effort of the last step, for the progress line: iterations of all solvers together.
    fn iterations(&self) -> usize;

    /// Seconds spent in each stage during the last step (clock figures go to `timings.csv` alone).
    fn stage_seconds(&self) -> Vec<(&'static str, f64)>;

    /// What the present state looks like.
    fn frame(&self, step: u64, time: f64) -> Frame;

    /// The whole mutable state, for a checkpoint.
    ///
    /// # Errors
    /// When the state cannot be written as bytes.
    fn save(&self) -> Result<Vec<u8>, StateError>;

    /// Replaces the mutable state by one that [`System::save`] made for the same scene.
    ///
    /// # Errors
    /// When the bytes are not such a state.
    fn load(&mut self, bytes: &[u8]) -> Result<(), StateError>;

    /// Figures for `summary.json` at the end of the run (or where it stopped).
    fn summary(&self) -> serde_json::Map<String, serde_json::Value>;

    /// True when the experiment has come to its own end before the scene's end time.
    fn finished(&self) -> bool {
        false
    }

    /// True when a step is so short that it is best taken on one thread; the results are the same.
    fn is_small(&self) -> bool {
        false
    }

    /// Further files a system leaves beside the common record at the end of a run (name, content).
    fn final_files(&self) -> Vec<(String, Vec<u8>)> {
        Vec::new()
    }

    /// The state of the failing part alone, for `viscose replay`; `None` where the whole checkpoint is what is saved.
    fn failing_problem(&self) -> Option<(String, Vec<u8>)> {
        None
    }
}

/// A column of `series.csv`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Column {
    /// Name in the header.
    pub name: String,
    /// SI unit, `1` for pure numbers.
    pub unit: &'static str,
    /// Meaning in a few words.
    pub meaning: &'static str,
}

impl Column {
    /// A column.
    pub fn new(name: impl Into<String>, unit: &'static str, meaning: &'static str) -> Column {
        Column { name: name.into(), unit, meaning }
    }
}

/// The largest step a component can take, and why.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StepLimit {
    /// Largest step [s].
    pub seconds: f64,
    /// Who says so: `rods: motion`, `liquid: advection`.
    pub reason: &'static str,
}

/// A step that was not accepted.
#[derive(Clone, Debug, PartialEq)]
pub struct Rejection {
    /// Stage that refused, by its name in the plan.
    pub stage: &'static str,
    /// What went wrong.
    pub reason: RejectionReason,
    /// Strand, yarn or grain concerned.
    pub element: Option<Element>,
    /// One sentence of detail with figures.
    pub detail: String,
}

/// Why a step was rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RejectionReason {
    /// A solver did not reach its tolerance.
    NotConverged,
    /// A number stopped being finite.
    NonFinite,
    /// Something moved or deformed too far in one step.
    TooLargeMotion,
    /// The problem has no solution the method can find.
    Infeasible,
}

/// The element a rejection points at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Element {
    /// A vertex of a strand.
    StrandVertex {
        /// Strand, in scene order.
        strand: usize,
        /// Vertex along the strand.
        vertex: usize,
    },
    /// A liquid particle by its stable identity.
    Particle(u64),
    /// A contact by its place in the list of the step.
    Contact(usize),
    /// A grain.
    Grain(usize),
    /// A vertex of a yarn.
    YarnVertex {
        /// Yarn, in scene order.
        yarn: usize,
        /// Vertex along the yarn.
        vertex: usize,
    },
}

impl fmt::Display for RejectionReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            RejectionReason::NotConverged => "the solve did not converge",
            RejectionReason::NonFinite => "a number stopped being finite",
            RejectionReason::TooLargeMotion => "the motion in one step was too large",
            RejectionReason::Infeasible => "the problem has no solution that could be found",
        })
    }
}

impl fmt::Display for Element {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Element::StrandVertex { strand, vertex } => write!(f, "strand {strand}, vertex {vertex}"),
            Element::Particle(id) => write!(f, "particle {id}"),
            Element::Contact(index) => write!(f, "contact {index}"),
            Element::Grain(index) => write!(f, "grain {index}"),
            Element::YarnVertex { yarn, vertex } => write!(f, "yarn {yarn}, vertex {vertex}"),
        }
    }
}

impl fmt::Display for Rejection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "stage `{}`: {}", self.stage, self.reason)?;
        if let Some(element) = &self.element {
            write!(f, " at {element}")?;
        }
        if !self.detail.is_empty() {
            write!(f, " ({})", self.detail)?;
        }
        Ok(())
    }
}

impl std::error::Error for Rejection {}

/// A state that could not be turned into bytes or back.
#[derive(Debug, thiserror::Error)]
#[error("the saved state does not fit this scene: {0}")]
pub struct StateError(pub String);

impl StateError {
    /// Wraps the error of a serialiser.
    pub fn from_display(error: impl fmt::Display) -> StateError {
        StateError(error.to_string())
    }
}
