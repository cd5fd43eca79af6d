//! Capillary cohesion between wet strands and walls: the force of a liquid bridge and its life.
//!
//! ```text
//! bridge    ── the meniscus between two cylinders, equal or not, or a cylinder and a wall: area, force, energy
//! lifecycle ── formation, rupture with hysteresis, wet area shared among contacts, the cohesive bound c_a
//! flow      ── optional Herschel–Bulkley tangential law of a wet contact
//! ```
//!
//! Film heights come as plain numbers; without a film they are zero and nothing is wet.

pub mod bridge;
pub mod flow;
pub mod lifecycle;
pub mod unequal;

pub use bridge::Bridge;
pub use flow::TangentialFlow;
pub use lifecycle::{
    CohesionInput, CohesionSettings, WetContact, cohesive_bound, contact_share, is_active, overlap_length,
};
pub use unequal::{Side, UnequalBridge};
