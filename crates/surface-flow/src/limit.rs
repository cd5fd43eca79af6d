//! Limits that keep a film from folding over itself.

use crate::block::Strand;
use crate::report::FilmReport;
use crate::settings::FilmSettings;

/// Limits speeds of one film and evens out the inflow into steep bulges.
pub(crate) fn limit(strand: &mut Strand<'_>, settings: &FilmSettings, dt: f64) -> FilmReport {
    let mut report = FilmReport::default();
    let edges = strand.velocity.len();
    for j in 0..edges {
        let bound = settings.speed_limit * strand.edge_length[j] / dt;
        if strand.velocity[j].abs() > bound {
            strand.velocity[j] = bound.copysign(strand.velocity[j]);
            report.limited += 1;
        }
    }
    if let Some(steepness) = settings.steepness {
        for _ in 0..settings.steepness_sweeps {
            let mut joined = 0;
            for i in 1..edges {
                let whole =
                    |k: usize| strand.area[k] + std::f64::consts::PI * strand.semi_axes[k][0] * strand.semi_axes[k][1];
                let (before, after) = (strand.velocity[i - 1], strand.velocity[i]);
                if before > after && 2.0 * whole(i) >= steepness * (whole(i - 1) + whole(i + 1)) {
                    // joined like two bodies that stick: their momentum stays
                    let mass = |j: usize| (strand.area[j] + strand.area[j + 1]) * strand.edge_length[j];
                    let (a, b) = (mass(i - 1), mass(i));
                    let common = if a + b > 0.0 { (a * before + b * after) / (a + b) } else { 0.0 };
                    strand.velocity[i - 1] = common;
                    strand.velocity[i] = common;
                    joined += 1;
                }
            }
            report.limited += joined;
            if joined == 0 {
                break;
            }
        }
    }
    report
}
