//! The microgel rheometer: soft grains in an oscillatory shear cell.
//!
//! Grains are elastic discs (or spheres) that overlap, slide and may be linked for good into particles of any shape; sheared in a
//! box without walls they show how a suspension of soft, interlocking particles yields. Method: Otsuki & Hayakawa 2017 (contacts,
//! protocol), Nicot et al. 2013 (averaged stress), and the manual of the program that published it, cited by equation (S1-n).
//!
//! ```text
//! MicrogelSettings ─► Rheometer ── preparation: packing ─► relaxation ─► links ─► cuts ─► rest     (preparation)
//!                        │ advance()  one step of the sample                                   (compat | physical | spheres)
//!                        ▼
//!                      Row of 42 columns ─► signals ─► demodulation ─► Summary with gates ─► Ensemble with error bars
//! ```
//!
//! Two modes. `physical` (default) evaluates each contact once, keeps the spring at the Coulomb limit and counts every contact in
//! the bulk stress; its results do not depend on the order of grains or the number of threads. `compat` repeats the published
//! program visit by visit, faults included, to reproduce its data.
//!
//! Units: µm, s, mg per metre of depth (spheres: mg); stress in Pa; see [`model`]. Stress is positive in compression.

pub mod assembly;
pub mod cell;
pub mod compat;
pub mod demodulation;
mod error;
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
