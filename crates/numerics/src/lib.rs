//! The tools every other room uses: how a solve ends, small tensors, splines, banded and iterative solvers.
//!
//! ```text
//! report     ── Status, SolveReport: how every solver in the house says how it went
//! tensor     ── deviator, double contraction, determinants and roots of small matrices (2-D and 3-D)
//! eigen      ── symmetric eigen-decomposition and singular values of small matrices, robust for repeated values
//! lanes      ── four problems side by side: lane arithmetic, sine, cosine and angle with the same bits everywhere
//! transport  ── parallel transport and rotations of vectors
//! bspline    ── quadratic B-spline weights on staggered grids
//! reduce     ── sums in an order that no thread count changes
//! banded     ── banded LDLᵀ with the half-bandwidth known at compile time, batched over strands
//! multigrid  ── conjugate gradients with geometric multigrid for a scalar on sparse grid cells
//! dimension  ── generic kernels compiled once, in their own crate, for two and three dimensions
//! pcg        ── preconditioned conjugate gradients with breakdown detection
//! ```
//!
//! Nothing here knows what a strand or a liquid is.

pub mod banded;
pub mod bspline;
pub mod dimension;
pub mod eigen;
pub mod lane_math;
pub mod lanes;
pub mod multigrid;
mod multigrid_coarsen;
mod multigrid_level;
pub mod multigrid_system;
pub mod pcg;
pub mod reduce;
pub mod report;
pub mod tensor;
pub mod transport;

pub use report::{SolveReport, Status};
