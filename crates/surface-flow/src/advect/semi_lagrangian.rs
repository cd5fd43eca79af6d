//! Back-traced values, then one rescaling of the volume: the published form.

use super::reset_dry;
use crate::block::Strand;
use crate::report::FilmReport;
use crate::settings::FilmSettings;
use crate::state::End;

/// Value at `x` of data given at increasing `at`, held constant beyond its ends; 0 outside `[0, end]`.
fn sample(at: impl Fn(usize) -> f64, value: impl Fn(usize) -> f64, count: usize, end: f64, x: f64) -> f64 {
    if !(x >= 0.0 && x <= end) {
        return 0.0;
    }
    if x <= at(0) {
        return value(0);
    }
    if x >= at(count - 1) {
        return value(count - 1);
    }
    let (mut low, mut high) = (0, count - 1);
    while high - low > 1 {
        let middle = (low + high) / 2;
        if at(middle) <= x {
            low = middle;
        } else {
            high = middle;
        }
    }
    let t = (x - at(low)) / (at(high) - at(low));
    value(low) + t * (value(high) - value(low))
}

/// Carries one film along for `dt` in one step.
pub(super) fn advect(strand: &mut Strand<'_>, settings: &FilmSettings, density: f64, dt: f64) -> FilmReport {
    reset_dry(strand, settings.dry_fraction);
    let vertices = strand.area.len();
    let edges = vertices - 1;
    let work = std::mem::take(&mut strand.work);
    let (position, rest) = work.split_at_mut(vertices);
    let (speed, rest) = rest.split_at_mut(vertices);
    let (area, rest) = rest.split_at_mut(vertices);
    let (strain, rest) = rest.split_at_mut(vertices);
    let (velocity, _) = rest.split_at_mut(vertices);
    position[0] = 0.0;
    for j in 0..edges {
        position[j + 1] = position[j] + strand.edge_length[j];
    }
    let end = position[edges];
    for i in 0..vertices {
        let (a, b) = (strand.velocity[i.saturating_sub(1)], strand.velocity[i.min(edges - 1)]);
        speed[i] = 0.5 * (a + b);
    }
    let volume =
        |area: &[f64]| -> f64 { (0..edges).map(|j| 0.5 * (area[j] + area[j + 1]) * strand.edge_length[j]).sum() };
    let before = volume(strand.area);
    let foot = |x: f64| {
        let at = |x: f64| sample(|i| position[i], |i| speed[i], vertices, end, x);
        x - dt * at(x - 0.5 * dt * at(x))
    };
    let middle = |j: usize| position[j] + 0.5 * strand.edge_length[j];
    for i in 0..vertices {
        let x = foot(position[i]);
        area[i] = sample(|k| position[k], |k| strand.area[k], vertices, end, x);
        strain[i] = sample(|k| position[k], |k| strand.log_strain[k], vertices, end, x);
        if i > 0 && i < edges {
            let length = 0.5 * (strand.edge_length[i - 1] + strand.edge_length[i]);
            area[i] *= (-dt * (strand.velocity[i] - strand.velocity[i - 1]) / length).exp();
        }
    }
    for j in 0..edges {
        velocity[j] = sample(middle, |k| strand.velocity[k], edges, end, foot(middle(j)));
        strand.crossed[j] = dt * strand.velocity[j] * 0.5 * (strand.area[j] + strand.area[j + 1]);
    }
    let mut report = FilmReport { substeps: 1, ..FilmReport::default() };
    for (side, (vertex, outward)) in
        [(0, -strand.velocity[0]), (edges, strand.velocity[edges - 1])].into_iter().enumerate()
    {
        if strand.ends[side] == End::Open {
            let length = 0.5 * strand.edge_length[if side == 0 { 0 } else { edges - 1 }];
            let lost = (dt * outward.max(0.0)).min(length) * strand.area[vertex];
            strand.reservoir[side] += lost;
            report.outflow += lost;
            report.outflow_momentum += density * lost * if side == 0 { -outward } else { outward };
        }
    }
    let after = volume(area);
    let factor = if after > 0.0 { (before - report.outflow).max(0.0) / after } else { 0.0 };
    if after == 0.0 {
        // everything was traced beyond the ends: kept where it was
        area.copy_from_slice(strand.area);
        let kept = if before > 0.0 { (before - report.outflow).max(0.0) / before } else { 0.0 };
        area.iter_mut().for_each(|a| *a *= kept);
    } else {
        area.iter_mut().for_each(|a| *a *= factor);
    }
    strand.area.copy_from_slice(area);
    strand.log_strain.copy_from_slice(strain);
    strand.velocity.copy_from_slice(&velocity[..edges]);
    strand.work = work;
    reset_dry(strand, settings.dry_fraction);
    report
}
