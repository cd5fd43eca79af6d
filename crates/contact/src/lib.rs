//! Frictional contact: detection, Delassus operator, complementarity solvers, cohesion, cross-check.
pub mod block;
pub mod law;
pub mod local;
pub mod problem;
