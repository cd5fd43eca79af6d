//! The published program's rules, visit by visit: directed contacts, index-ordered updates, plates by position.
//!
//! This room exists to reproduce reference data; its known faults (F1–F21 of the notes) are kept on purpose and named where
//! they happen. Only the search for contacts differs: candidates come from a list with a skin, in the same order.

mod forces;
mod state;
mod step;
mod stresses;

pub use state::{DirectedContact, DirectedSample};
