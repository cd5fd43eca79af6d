//! The film carried along its strand.

mod conservative;
mod semi_lagrangian;

use crate::block::Strand;
use crate::report::FilmReport;
use crate::settings::{Advection, FilmSettings};

/// Carries volume, momentum and strain of one film along for `dt`.
pub(crate) fn advect(strand: &mut Strand<'_>, settings: &FilmSettings, density: f64, dt: f64) -> FilmReport {
    strand.crossed.fill(0.0);
    if strand.edge_length.is_empty() {
        return FilmReport::default();
    }
    match settings.advection {
        Advection::Conservative => conservative::advect(strand, settings, density, dt),
        Advection::SemiLagrangian => semi_lagrangian::advect(strand, settings, density, dt),
    }
}

/// Stops edges between two dry vertices and clears the strain of dry vertices.
pub(crate) fn reset_dry(strand: &mut Strand<'_>, dry_fraction: f64) {
    let vertices = strand.area.len();
    for i in 0..vertices {
        if strand.area[i] < strand.dry_area(i, dry_fraction) {
            strand.log_strain[i] = 0.0;
            let neighbour_dry = i + 1 < vertices && strand.area[i + 1] < strand.dry_area(i + 1, dry_fraction);
            if neighbour_dry {
                strand.velocity[i] = 0.0;
            }
        }
    }
}

/// The smaller of two slopes of the same sign, 0 otherwise.
pub(crate) fn minmod(a: f64, b: f64) -> f64 {
    if a * b <= 0.0 {
        0.0
    } else if a.abs() < b.abs() {
        a
    } else {
        b
    }
}
