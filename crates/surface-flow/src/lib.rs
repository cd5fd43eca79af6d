//! The liquid film on a strand: height, velocity, reduced strain.
//!
//! A film of cross-section `A(x)` lies around a strand with semi-axes `a`, `b`; it moves along the strand with the speed
//! `u(x)` relative to it and carries the axial elastic strain `ϑ(x)`. One step, strand by strand:
//!
//! ```text
//! advect      volume, momentum and strain carried along, into reservoirs at open ends    (conservative, positive)
//! accelerate  gravity and the strand's own acceleration; elastic force, semi-implicit    (one tridiagonal solve)
//! rub         friction on the strand, solved exactly edge by edge; true stick            (wall)
//! limit       speed limit and steepness limiter
//! relax       strain stretched by the new velocity, then plastic flow                    (stage 11)
//! ```
//!
//! [`inertia`] gives the impulse that film moving along a moving strand exerts on it. Nothing here knows what a strand is:
//! edge lengths, tangents, semi-axes and accelerations come in as slices ([`StrandSlices`]), many strands in one array. Strands
//! are independent, so the result does not depend on the number of threads. All numbers are SI.
//!
//! Source: Fei et al. 2019, main-paper (2), (3), (7), (9), supplemental S16–S43; log-strain form, finite volumes, exact friction
//! and lubrication law are our own (theory pages).

mod advect;
mod block;
pub mod error;
pub mod inertia;
mod limit;
pub mod liquid;
mod relax;
pub mod report;
pub mod settings;
mod shear;
mod solver;
pub mod state;
pub mod wall;

pub use error::FilmError;
pub use liquid::FilmLiquid;
pub use report::FilmReport;
pub use settings::{Advection, FilmSettings, WallLaw};
pub use solver::FilmSolver;
pub use state::{End, FilmState, StrandSlices, film_area, film_height};
