//! Set-ups shared by the cases.

use std::path::Path;

use rayon::ThreadPoolBuilder;

use yarn::settings::{Bending, ContactModuli, YarnMaterial};
use yarn::{YarnGroup, YarnSettings, YarnShape, YarnSystem};

use crate::case::CaseError;

/// Cell of the reference set-up [m].
pub const CELL: f64 = 1.0 / 64.0;
/// Segment of the reference set-up [m].
pub const SEGMENT: f64 = 0.5 * CELL;

/// The reference material without bending: k = 1000, γ = 500, μ = 400, λ = 600 Pa.
pub fn material(friction: f64) -> YarnMaterial {
    YarnMaterial {
        contact: ContactModuli::Lame { mu: 400.0, lambda: 600.0 },
        friction,
        bending: Bending::None,
        ..YarnMaterial::default()
    }
}

/// Plane yarns of one material, no loads, open space.
pub fn plane(material: YarnMaterial, yarns: Vec<YarnGroup>) -> YarnSettings {
    YarnSettings {
        dimension: 2,
        cell: CELL,
        materials: [("yarn".to_owned(), material)].into(),
        yarns,
        ..YarnSettings::default()
    }
}

/// One yarn through given points with given rest lengths (empty: as built) and velocities (empty: at rest).
pub fn polyline(points: Vec<Vec<f64>>, rest_lengths: Vec<f64>, velocities: Vec<Vec<f64>>) -> YarnGroup {
    YarnGroup::new(YarnShape::Polyline { points, rest_lengths, velocities })
}

/// Builds a plane system.
pub fn build(settings: &YarnSettings) -> Result<YarnSystem<2>, CaseError> {
    YarnSystem::build(settings, Path::new(".")).map_err(CaseError::failed)
}

/// Processor time of the calling thread [s], which other programs do not lengthen; wall clock where the system does not say.
pub fn processor_seconds() -> f64 {
    static START: std::sync::LazyLock<std::time::Instant> = std::sync::LazyLock::new(std::time::Instant::now);
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let spent: Option<f64> = text.split(' ').next().and_then(|word| word.parse().ok());
    spent.map_or_else(|| START.elapsed().as_secs_f64(), |nanoseconds| 1e-9 * nanoseconds)
}

/// Runs a case on one thread of its own: its systems are too small to be shared out.
pub fn alone<R: Send>(work: impl FnOnce() -> Result<R, CaseError> + Send) -> Result<R, CaseError> {
    ThreadPoolBuilder::new().num_threads(1).build().map_err(CaseError::failed)?.install(work)
}
