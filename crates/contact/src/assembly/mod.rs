//! From contacts between strands and solids to a contact problem: the Delassus matrix through the rods' factors.
//!
//! `W = H K⁻¹ Hᵀ`, `q = H v_free + w`. A strand is seen only as a number of freedoms and a way to apply its inverse
//! dynamics `K⁻¹`; each contact touches it at a point whose velocity is a weighted sum of two vertex velocities. Columns
//! are solved strand by strand in parallel; blocks are added in a fixed order.
//!
//! ```text
//! point    ── where a contact touches a strand, and its Jacobian
//! delassus ── who touches whom, free velocity, impulses back to the strands
//! share    ── columns and blocks of one strand
//! rows     ── the matrix put together
//! mobility ── how easily single contacts move, without the matrix
//! operator ── the same product without the blocks
//! warm     ── impulses kept over steps by key, rotated with the contact basis
//! ```

mod delassus;
mod mobility;
mod operator;
mod point;
mod rows;
mod share;
mod warm;

pub use delassus::{AssemblyError, ContactSystem, InverseDynamics, assemble};
pub use mobility::normal_mobilities;
pub use operator::DelassusOperator;
pub use point::{ContactSide, PosedContact};
pub use warm::{ContactKey, SOLID, WarmStarts};
