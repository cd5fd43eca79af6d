//! Frictional contact: detection, Delassus operator, complementarity solvers, cohesion, cross-check.
pub mod block;
pub mod families;
pub mod law;
pub mod local;
pub mod problem;
pub mod report;
pub mod settings;
pub mod solvers;

pub use problem::{BlockMatrix, ContactProblem, ProblemError, Scaling};
pub use report::{ContactReport, Method, StageReport};
pub use settings::{ContactSettings, SolverChoice};
pub use solvers::{Solution, solve};
