//! Discrete elastic rods: state, kinematics, energies, implicit step.
//!
//! ```text
//! spec, material ── what a strand is → RodSet::add_strand
//! state          ── RodSet: positions, angles, directors, rest shape of many strands
//! loads, boundary── what acts and what is held during one step
//! stepper        ── RodStepper: gather → Newton (kernel, band solver) → accept
//! stiffness      ── exact stiffness matrix, stability, modes
//! equilibrium    ── static equilibrium; rest shapes for a given shape
//! measure        ── energies, momenta, curvature, tension for records
//! ```
//!
//! Strands of equal vertex count are worked four at a time in vector lanes ([`numerics::lanes`]); results are the same
//! bits for any grouping and any number of threads.

mod boundary;
mod coefficients;
mod equilibrium;
mod error;
mod group;
mod kernel;
mod loads;
mod material;
mod measure;
mod newton;
mod report;
mod retraction;
mod settings;
mod spec;
mod state;
mod stepper;
mod stiffness;

pub use boundary::{Boundary, End, FixedAngle, FixedEdge, FixedVertex, Goal};
pub use equilibrium::{EquilibriumReport, EquilibriumSettings, equilibrium, make_sag_free};
pub use error::RodError;
pub use loads::Loads;
pub use material::StrandMaterial;
pub use measure::{RodEnergy, RodMomentum};
pub use report::{RodReport, StepLimit, StepReason};
pub use settings::{HessianMode, Integrator, RodSettings};
pub use spec::{RestShape, StrandSpec};
pub use state::{History, RodSet};
pub use stepper::{RodStepper, StrandInverse};
