//! Yarns by the material point method with anisotropic elastoplasticity, in two and three dimensions.
//!
//! Yarns are polylines of vertices; each segment has one quadrature point whose deformation gradient follows the edge in its
//! first column and the grid in the others. Contact and friction come from the energy and its plastic flow
//! (`constitutive::yarn`); nothing looks for contacts.
//!
//! ```text
//! generate ─► model (what stays) + state (what moves)
//! forces ─► particles to grid ─► nodes: loads, obstacles, pins, walls (or the implicit solve) ─► grid to particles
//!        ─► kinematics: hand-back, driven vertices, motion ─► deformation, return map
//! limits: how large a step may be, and why        diagnostics: energies, momenta, plain arrays for output
//! ```
//!
//! Contact acts over about one cell, so yarns rest about `dx` apart and spacings below that start pre-compressed. The transfer
//! damps what the grid cannot resolve: an axial wave loses 28 % of its amplitude in two periods at 9.5 cells length, 13 % at
//! 19.5, 6.5 % at 39.5.
//!
//! Source: Jiang, Gast, Teran 2017 and the seed note with its errata.

mod boundary;
pub mod diagnostics;
mod error;
mod forces;
pub mod generate;
mod grid;
mod implicit;
mod kinematics;
pub mod limits;
mod model;
mod nodes;
mod report;
pub mod scenes;
pub mod settings;
mod state;
mod step;
mod system;

#[cfg(test)]
mod tests;

pub use error::{YarnError, YarnWarning};
pub use generate::{YarnGroup, YarnShape, parse_polylines};
pub use model::{BendingLaw, Material, YarnModel};
pub use report::{Energy, Ledger, Momentum, StepLimit, StepReport, YarnFrameData};
pub use settings::{YarnMaterial, YarnSettings};
pub use state::YarnState;
pub use system::YarnSystem;
