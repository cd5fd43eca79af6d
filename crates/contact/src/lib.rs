//! Frictional contact with exact Coulomb friction: detection, Delassus operator, complementarity solvers, cohesion, cross-check.
//!
//! ```text
//! detection  ── strands and solids, start and end of a step → contacts (points, normals, gaps)
//! cohesion   ── wet contacts → cohesive impulse bounds
//! assembly   ── contacts + inverse dynamics of the strands → W, q
//! problem    ── u = W r + q with Coulomb's law: data, files, the one residual
//! law, local ── cone, Fischer–Burmeister function; one contact alone
//! solvers    ── groups of contacts → impulses, velocities, states, report
//! cross_check── the same problem by cone programmes: a second opinion
//! families   ── hyperstatic problems for tests and benches
//! job        ── read a file, solve, report: what the command line calls
//! ```
//!
//! Nothing here knows a strand: `W` comes from any [`assembly::InverseDynamics`], heights and radii are plain slices.
//! Conventions: component 0 is the normal (from B to A), impulses act with plus sign on A, `u_N > 0` separates.

pub mod assembly;
pub mod block;
pub mod cohesion;
pub mod cross_check;
pub mod detection;
pub mod families;
pub mod job;
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
