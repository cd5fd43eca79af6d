//! Solvers of the whole problem, all behind [`GroupSolver`] with one report and one residual.
//!
//! ```text
//! group        ── what a solver is given: one group of coupled contacts, in shifted impulses
//! gauss_seidel ── one contact after the other; cheap sweeps, slow where contacts are redundant
//! sweep        ── one sweep, over every other slab of contacts at once
//! slabs        ── contacts in layers that feel only the next ones
//! clusters     ── contacts that feel each other most, which a sweep goes over several times
//! anderson     ── combines the last sweeps, where chains of contacts make them crawl
//! ordering     ── minimum-degree elimination order of the contact graph
//! block_lu     ── sparse block LU over that order
//! newton       ── smoothed Fischer–Burmeister Newton: few iterations, one factorisation each, redundancy welcome
//! admm         ── alternating directions: one factorisation, many cheap iterations
//! auto         ── which one goes first and when it hands over
//! drive        ── splits a problem into groups, solves them (in parallel), puts the answer together
//! ```

pub mod admm;
pub mod anderson;
pub mod auto;
pub mod block_lu;
pub mod clusters;
pub mod drive;
pub mod gauss_seidel;
pub mod group;
pub mod newton;
pub mod ordering;
mod part;
pub mod patches;
mod slabs;
mod sweep;

pub use drive::{Solution, solve, solve_with};
pub use group::{Group, GroupOutcome, GroupSolver};
