//! Soft grains in an oscillatory shear cell: contacts, links, stress tensors, rheometer.
#![allow(clippy::too_many_arguments)]

pub mod assembly;
pub mod cell;
pub mod compat;
pub mod demodulation;
pub mod error;
pub mod experiment;
pub mod frame;
pub mod grains;
pub mod law;
pub mod model;
mod neighbours;
pub mod physical;
pub mod preparation;
pub mod random;
pub mod spheres;
pub mod statistics;
pub mod stress;
pub mod tensor;

pub use error::GranularError;
