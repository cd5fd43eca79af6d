//! Laws of one material point or one element: liquid rheology, drag, curvature energy, yarn energy.
//!
//! What the room holds, and how a number travels through it:
//!
//! ```text
//! curvature          bending and twisting energy of three vertices of a polyline, with gradient and Hessian
//! flow_curve         FlowCurve: yield stress, consistency and index, in the model's or the rheometer's reading
//! presets            the liquids and fibres known by name, in SI
//! equation_of_state  pressure of a volume ratio and back
//! shear_flow         ShearFlow: rate of plastic flow of a stress (constants prepared once)
//! flow_map           stress after one step of flow and its derivatives: Exact, Implicit, Forced
//! liquid_law         HerschelBulkley: the elastic strain of a particle through one step, in 2-D and 3-D
//! tearing            plastic history of a particle: detection of tearing, torn increments, recovery
//! drag               force of the liquid on a piece of strand, with yield sticking
//! viscometer         rheometer experiments on one material point, and an independent reference for them
//! wide               liquid law, tearing and recovery of four points at a time
//! material_point     MaterialPoint: one particle by itself
//! yarn               energy, stress and friction cones of a yarn segment
//! fit                yield stress, consistency and index from a measured flow curve, with confidence intervals
//! summary            a material described: class, readings, flow curve as data, table and plot
//! ```
//!
//! Everything is SI and `f64`; stresses are Kirchhoff stresses, tension positive, pressures positive in compression.
//! No function here loops over a scene, allocates in a hot path or panics on input.

pub mod curvature;
pub mod drag;
pub mod equation_of_state;
pub mod error;
pub mod fit;
pub mod flow_curve;
pub mod flow_map;
pub mod liquid_law;
pub mod material_point;
pub mod presets;
pub mod shear_flow;
pub mod summary;
pub mod tearing;
mod tensor;
pub mod viscometer;
pub mod wide;
pub mod yarn;

pub use equation_of_state::EquationOfState;
pub use error::RheologyError;
pub use flow_curve::{FlowClass, FlowCurve, RheologyReading};
pub use flow_map::{FlowMap, ReturnMap};
pub use liquid_law::{DeterminantPolicy, ElasticTrial, HerschelBulkley, LawSettings, Relaxed};
pub use material_point::MaterialPoint;
pub use presets::{Fibre, Liquid};
pub use shear_flow::ShearFlow;
pub use tearing::TornRule;
