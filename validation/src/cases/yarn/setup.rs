//! Set-ups shared by the cases.

use std::path::Path;

use rayon::ThreadPoolBuilder;

use yarn::settings::{Bending, ContactModuli, YarnMaterial};
use yarn::{YarnGroup, YarnSettings, YarnShape, YarnSystem};

use crate::case::{CaseError, Curve};

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

/// Observed order: slope of the logarithm of the error over that of the resolution, fitted to all points `(size, error)`.
pub fn observed_order(points: &[[f64; 2]]) -> f64 {
    let logs: Vec<(f64, f64)> = points.iter().map(|[size, error]| (size.ln(), error.ln())).collect();
    let n = logs.len() as f64;
    let (mx, my) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
    let (mut above, mut below) = (0.0, 0.0);
    for (x, y) in logs {
        above += (x - mx) * (y - my);
        below += (x - mx) * (x - mx);
    }
    above / below
}

/// A curve of errors over resolutions, both axes logarithmic, with the line of the wanted order through the finest point.
pub fn order_curve(title: &str, x_label: &str, y_label: &str, points: &[[f64; 2]], order: f64) -> Curve {
    let mut series = vec![("measured".to_owned(), points.to_vec())];
    if let Some(&[size, error]) = points.iter().min_by(|a, b| a[0].total_cmp(&b[0])) {
        let line = points.iter().map(|[s, _]| [*s, error * (s / size).powf(order)]).collect();
        series.push((format!("order {order}"), line));
    }
    Curve {
        title: title.to_owned(),
        x_label: x_label.to_owned(),
        y_label: y_label.to_owned(),
        log_x: true,
        log_y: true,
        series,
    }
}
