//! Rheometer experiments on one material point of the liquid, in simple shear.
//!
//! ```text
//! experiments   steady shear, start-up, relaxation, creep, oscillation: marched with the particle update of the simulator
//! reference     the tensor equation itself, by an implicit high-order integrator and a Newton steady state
//! radau         that integrator
//! ```
//!
//! The experiments use what a simulation uses, step by step; the reference shares nothing with it but the flow rate, so that
//! each can be held against the other.

mod experiments;
mod radau;
mod reference;

pub use experiments::{Creep, Oscillation, Sample, SteadyShear, Viscometer};
pub use reference::TensorReference;
