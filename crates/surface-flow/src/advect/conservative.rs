//! Finite volumes: volume at vertices, momentum at edges, both moved by the same fluxes.

use super::{minmod, reset_dry};
use crate::block::Strand;
use crate::report::FilmReport;
use crate::settings::FilmSettings;
use crate::state::End;

/// Sub-steps beyond which the speeds are not credible.
const MAX_SUBSTEPS: usize = 100_000;

/// Carries one film along for `dt`, in sub-steps that keep the Courant number.
pub(super) fn advect(strand: &mut Strand<'_>, settings: &FilmSettings, density: f64, dt: f64) -> FilmReport {
    let mut report = FilmReport::default();
    let mut left = dt;
    while left > 0.0 {
        reset_dry(strand, settings.dry_fraction);
        let edges = strand.velocity.len();
        // the vertex length is the shorter one next to an end or a short edge
        let rate = (0..edges)
            .map(|j| {
                let shortest = strand.vertex_length(j).min(strand.vertex_length(j + 1)).min(strand.edge_length[j]);
                strand.velocity[j].abs() / shortest
            })
            .fold(0.0, f64::max);
        let wanted = (left * rate / settings.courant).ceil();
        if wanted.is_nan() || wanted >= MAX_SUBSTEPS as f64 || report.substeps >= MAX_SUBSTEPS {
            // not credible: left to the check of the solver
            strand.velocity[0] = f64::NAN;
            return report;
        }
        let step = left / wanted.max(1.0);
        substep(strand, settings, density, step, &mut report);
        report.substeps += 1;
        left = if wanted <= 1.0 { 0.0 } else { left - step };
    }
    reset_dry(strand, settings.dry_fraction);
    report
}

/// One step within the Courant number.
fn substep(strand: &mut Strand<'_>, settings: &FilmSettings, density: f64, dt: f64, report: &mut FilmReport) {
    let vertices = strand.area.len();
    let edges = vertices - 1;
    let work = std::mem::take(&mut strand.work);
    let (slope, rest) = work.split_at_mut(vertices);
    let (flux, rest) = rest.split_at_mut(vertices);
    let (outgoing, rest) = rest.split_at_mut(vertices);
    let (strain, rest) = rest.split_at_mut(vertices);
    let (momentum, moved) = rest.split_at_mut(vertices);
    let (area, velocity, length) = (&mut *strand.area, &mut *strand.velocity, strand.edge_length);
    let dry = |i: usize, a: f64| {
        a < settings.dry_fraction * std::f64::consts::PI * strand.semi_axes[i][0] * strand.semi_axes[i][1]
    };
    let vertex_length =
        |i: usize| 0.5 * (if i > 0 { length[i - 1] } else { 0.0 } + if i < edges { length[i] } else { 0.0 });

    // limited slopes of the cross-section; none at ends and next to dry vertices
    slope.fill(0.0);
    for i in 1..edges {
        if !(dry(i - 1, area[i - 1]) || dry(i, area[i]) || dry(i + 1, area[i + 1])) {
            slope[i] = minmod((area[i] - area[i - 1]) / length[i - 1], (area[i + 1] - area[i]) / length[i]);
        }
    }
    // volume fluxes at edges and open ends
    outgoing.fill(0.0);
    for j in 0..edges {
        let u = velocity[j];
        let (from, side) = if u > 0.0 { (j, 0.5) } else { (j + 1, -0.5) };
        let value = (area[from] + side * length[j] * slope[from]).max(0.0);
        flux[j] = u * value;
        outgoing[from] += flux[j].abs();
    }
    let mut end_flux = [0.0; 2];
    if strand.ends[0] == End::Open {
        end_flux[0] = (-velocity[0]).max(0.0) * area[0];
        outgoing[0] += end_flux[0];
    }
    if strand.ends[1] == End::Open {
        end_flux[1] = velocity[edges - 1].max(0.0) * area[edges];
        outgoing[edges] += end_flux[1];
    }
    // no vertex gives more than it has
    for i in 0..vertices {
        let (need, have) = (dt * outgoing[i], area[i] * vertex_length(i));
        outgoing[i] = if need > have { have / need } else { 1.0 };
    }
    for j in 0..edges {
        flux[j] *= if flux[j] > 0.0 { outgoing[j] } else { outgoing[j + 1] };
    }
    end_flux[0] *= outgoing[0];
    end_flux[1] *= outgoing[edges];

    // momentum of edges before and its flux through vertices; the fluxes there are those that move the mass of the edges
    for j in 0..edges {
        momentum[j] = density * 0.5 * (area[j] + area[j + 1]) * length[j] * velocity[j];
    }
    for i in 0..vertices {
        let through = if i == 0 {
            -end_flux[0]
        } else if i == edges {
            end_flux[1]
        } else {
            (length[i] * flux[i - 1] + length[i - 1] * flux[i]) / (length[i - 1] + length[i])
        };
        let carried = if through > 0.0 { velocity[i.saturating_sub(1)] } else { velocity[i.min(edges - 1)] };
        moved[i] = dt * density * through * carried;
    }
    report.outflow_momentum += moved[edges] - moved[0];

    // strain goes with the volume
    for i in 0..vertices {
        strain[i] = area[i] * vertex_length(i) * strand.log_strain[i];
    }
    for j in 0..edges {
        let from = if flux[j] > 0.0 { j } else { j + 1 };
        let amount = dt * flux[j] * strand.log_strain[from];
        strain[j] -= amount;
        strain[j + 1] += amount;
        strand.crossed[j] += dt * flux[j];
    }
    strain[0] -= dt * end_flux[0] * strand.log_strain[0];
    strain[edges] -= dt * end_flux[1] * strand.log_strain[edges];

    for i in 0..vertices {
        let before = if i > 0 { flux[i - 1] } else { -end_flux[0] };
        let after = if i < edges { flux[i] } else { end_flux[1] };
        area[i] = (area[i] - dt / vertex_length(i) * (after - before)).max(0.0);
        let volume = area[i] * vertex_length(i);
        strand.log_strain[i] = if volume > 0.0 && !dry(i, area[i]) { strain[i] / volume } else { 0.0 };
    }
    for end in 0..2 {
        let volume = dt * end_flux[end];
        strand.reservoir[end] += volume;
        report.outflow += volume;
    }
    let mut behind = velocity[0];
    for j in 0..edges {
        let mass = density * 0.5 * (area[j] + area[j + 1]) * length[j];
        let ahead = velocity[(j + 1).min(edges - 1)];
        // speeds mix, they do not grow: the bound only stops round-off where the mass is all but gone
        let bound = behind.abs().max(velocity[j].abs()).max(ahead.abs());
        behind = velocity[j];
        let carried = momentum[j] - (moved[j + 1] - moved[j]);
        velocity[j] = if mass > 0.0 { (carried / mass).clamp(-bound, bound) } else { 0.0 };
    }
    strand.work = work;
}
