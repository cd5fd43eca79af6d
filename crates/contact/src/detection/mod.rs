//! What touches what: strands against strands and against solids, also when they move far in one step.
//!
//! ```text
//! strands    ── edges as capsules: positions at both ends of the step, radii; plain slices
//! solids     ── a solid as signed distance, normal and velocity over the step
//! candidates ── pairs of edges that may meet within the step, kept while only its end changes
//! meetings   ── candidates looked at, and what of that stays true while the ends of the step change
//! pair       ── two moving capsules: closest points, first time of contact
//! surface    ── a moving capsule against a solid
//! detect     ── narrow phase in parallel, pruning; the same contacts in the same order for any thread count
//! ```

mod candidates;
mod detect;
mod meetings;
mod pair;
mod solids;
mod strands;
mod surface;

pub use detect::{Contact, DetectionReport, Detector};
pub use pair::{PairContact, pair_contact};
pub use solids::{SolidField, StepSolid};
pub use strands::{DetectionError, DetectionSettings, Sight, Strands, effective_radius};
pub use surface::{SurfaceContact, surface_contacts};
