//! The bulk liquid: particles, MAC fields, shear and pressure solves, resampling.
//!
//! ```text
//! particles          the state: contiguous arrays, one entry per particle
//! material           what a particle is made of
//! solid              what the liquid meets: distance, normal, velocity, stickiness
//! grid               faces and cells of one step; nothing of it survives the step
//! resample           stage 2   split, merge, spread
//! particles_to_grid  stage 3   mass, momentum, volume, shear force, volume ratio
//! weights            stage 4   open shares, wall ties, free surface
//! inlet              stage 4   faces in the mouths of sources
//! tearing            stage 5   which particles are torn
//! shear_solve        stage 6   momentum with implicit shear (shear_state, shear_operator, shear_quadrature, shear_stencil)
//! pressure_solve     stage 6   volume
//! grid_to_particles  stage 7   velocities and affine matrices
//! deformation        stage 8   volume ratio and trial strain
//! tension            stage 8   volume ratios that no pressure watches
//! advect             stage 9   positions
//! liquid_plasticity  stage 10  plastic flow
//! recovery           stage 12  healing
//! step               the stages in their order, for a liquid by itself
//! time_step          how large a step may be
//! fill               regular samples of a region
//! source             sources and terminators (fill: tanks)
//! ledger             what entered, left and is there
//! ```
//!
//! All stages are deterministic for any number of threads. Everything is SI; in 2-D all quantities are per metre of depth.

pub mod advect;
mod arrays;
pub mod deformation;
pub mod error;
pub mod fill;
pub mod grid;
pub mod grid_to_particles;
pub mod inlet;
pub mod ledger;
pub mod liquid_plasticity;
pub mod material;
pub mod neighbours;
pub mod open_fraction;
pub mod particles;
pub mod particles_to_grid;
pub mod pressure_solve;
pub mod random;
pub mod recovery;
pub mod resample;
pub mod settings;
pub mod shear_operator;
pub mod shear_quadrature;
pub mod shear_solve;
pub mod shear_state;
pub mod shear_stencil;
pub mod solid;
pub mod source;
pub mod step;
pub mod tearing;
pub mod tension;
pub mod time_step;
pub mod weights;

pub use advect::AdvectReport;
pub use deformation::DeformationReport;
pub use error::LiquidError;
pub use grid::{LiquidGrid, WallTie};
pub use inlet::Inlet;
pub use ledger::{Ledger, LedgerReport};
pub use liquid_plasticity::PlasticityReport;
pub use material::LiquidMaterial;
pub use particles::{Particle, Particles, TORN, Totals, YIELDED};
pub use pressure_solve::{PressureReport, PressureSolver, Room};
pub use resample::{ResampleReport, ResampleScratch, resample};
pub use settings::LiquidSettings;
pub use shear_solve::{FaceCoupling, ShearReport, ShearSolver};
pub use solid::{HalfSpace, NoSolid, PlanarSolid, Solid};
pub use source::{Emission, SourceSettings, SourceShape, SourceState, emit, terminate};
pub use step::{LiquidStepper, StepReport};
pub use time_step::{StepLimit, elastic_wave_step, step_limit};
pub use weights::WeightsReport;

/// What the rest of the house also calls the numbers in two dimensions and three.
pub use numerics::tensor::{Tensor, Vector};
