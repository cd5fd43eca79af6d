//! The strain of the film stretched by the flow, and its plastic flow.

use crate::block::Strand;
use crate::liquid::FilmLiquid;
use crate::settings::FilmSettings;

/// Stretches and relaxes the strain of one film over `dt`: `ϑ + 2 dt ∂x u`, then the return map with `s = √2 μ sinh|ϑ|` and the
/// effective modulus `μ cosh ϑ` frozen.
pub(crate) fn relax(strand: &mut Strand<'_>, settings: &FilmSettings, liquid: &FilmLiquid, dt: f64) {
    let mu = liquid.shear_modulus;
    let edges = strand.velocity.len();
    if mu == 0.0 {
        strand.log_strain.fill(0.0);
        return;
    }
    let scale = 2f64.sqrt() * mu;
    for i in 0..strand.area.len() {
        if strand.area[i] < strand.dry_area(i, settings.dry_fraction) {
            strand.log_strain[i] = 0.0;
            continue;
        }
        let old = strand.log_strain[i];
        let mut theta = old;
        if i > 0 && i < edges {
            let length = 0.5 * (strand.edge_length[i - 1] + strand.edge_length[i]);
            theta += 2.0 * dt * (strand.velocity[i] - strand.velocity[i - 1]) / length;
        }
        if settings.plasticity {
            theta = relaxed_strain(settings, liquid, scale, theta, old, dt);
        }
        strand.log_strain[i] = theta;
    }
}

/// Strain after plastic flow of the trial strain `theta`.
pub(crate) fn relaxed_strain(
    settings: &FilmSettings,
    liquid: &FilmLiquid,
    scale: f64,
    theta: f64,
    old: f64,
    dt: f64,
) -> f64 {
    let trial = scale * theta.abs().sinh();
    let previous = scale * (old * theta.signum()).sinh();
    let map = liquid.flow.return_map(settings.flow_map, trial, previous, liquid.shear_modulus * theta.cosh(), dt);
    if map.stress == trial { theta } else { (map.stress / scale).asinh().copysign(theta) }
}
