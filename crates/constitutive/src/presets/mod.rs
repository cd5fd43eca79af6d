//! Liquids and fibres known by name. Tables are kept as published (CGS) in the source and converted to SI once, here.

mod fibres;
mod liquids;

pub use fibres::{FIBRE_NAMES, Fibre};
pub use liquids::{LIQUID_NAMES, Liquid};
