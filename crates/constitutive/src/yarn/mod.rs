//! The law of one yarn quadrature point: stretch, fibre shear and no-tension contact, with Coulomb friction as plastic flow.
//!
//! A point carries the deformation gradient `F` whose **first column follows the yarn** and whose other columns follow its
//! cross-section; the reference frame is the yarn's own (column one along the undeformed yarn), never the world's.
//!
//! ```text
//! F ──► YarnFrame (stretch, shear, principal section stretches) ──► energy · stress · stress differential
//!                                                              └──► return map on the friction cones ──► F, slip, pressure
//! ```
//!
//! Source: Jiang, Gast, Teran 2017, in the 2-D form of the seed note, with its errata corrected (docs/errata.md, yarn E1–E17).

mod bending;
mod differential;
mod flow;
mod frame;
mod law;
mod printed;
mod return_map;

#[cfg(test)]
mod tests;

pub use bending::{Bend, bend, bend_differential};
pub use differential::StressTangent;
pub use flow::FlowLimits;
pub use frame::{YarnFrame, triangular_factor};
pub use law::{YarnForm, YarnLaw};
pub use return_map::{ReturnMapped, YieldMode};
