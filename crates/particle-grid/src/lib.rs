//! Sparse blocked grids, B-spline transfers and particle sorting: what every particle-in-cell method of the house stands on.
//!
//! ```text
//! lattice   ── cell size, origin, periodic directions; positions to cells and back
//! order     ── which blocks hold particles, and the stable order that sorts particles by block and cell
//! blocks    ── the active blocks of 4^D cells, their neighbours, node indices
//! scatter   ── particles to grid: affine (APIC) contributions, four quantities a node, summed in a fixed order
//! gather    ── grid to particles: values and gradients of D fields, staggered (MAC) or collocated
//! tile      ── a block with its halo, for matrix-free operators
//! sample    ── the stencil of one point anywhere, for the few points that are not sorted particles
//! ```
//!
//! A step sorts the particles (`order`), lets the grid follow them (`blocks`), scatters, computes on node arrays of
//! `4^D × blocks` entries, and gathers. Scattering goes through one private tile per block whose halo is added to the grid
//! afterwards, block by block, in the order of the neighbour table: threads share out blocks and never change a sum.
//!
//! A field is a plain slice with one entry per node; its *offset* (in cells, 0 or ½ per direction) says where in the cell its
//! nodes sit: [`mac_offset`] for face-normal components, [`CENTRE`] for cell centres, zero for corners.

pub mod blocks;
pub mod dispatch;
pub mod error;
pub mod gather;
mod lanes;
pub mod lattice;
pub mod order;
pub mod sample;
pub mod scatter;
pub mod tile;

pub use blocks::{BlockGrid, NONE};
pub use dispatch::vectorised;
pub use error::GridError;
pub use gather::{gather, sum_over_some};
pub use lanes::Lanes;
pub use lattice::{BLOCK, CENTRE, Lattice, cells_per_block, mac_offset};
pub use order::{ParticleOrder, permute};
pub use sample::{StencilNode, stencil};
pub use scatter::{Contribution, ScatterScratch, scatter};
