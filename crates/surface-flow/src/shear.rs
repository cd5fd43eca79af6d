//! Gravity, the strand's own acceleration and the elastic force of the film.

use nalgebra::Vector3;

use crate::block::Strand;
use crate::liquid::FilmLiquid;
use crate::settings::FilmSettings;

/// Accelerates one film for `dt`.
///
/// The elastic force `∂x(μ A c)` is taken at the strain the new velocity will make (linearised, plastic flow included): a
/// symmetric positive definite tridiagonal system, so film waves do not limit the step.
pub(crate) fn accelerate(
    strand: &mut Strand<'_>,
    settings: &FilmSettings,
    liquid: &FilmLiquid,
    gravity: Vector3<f64>,
    dt: f64,
) {
    let edges = strand.velocity.len();
    for j in 0..edges {
        let frame = 0.5 * (strand.acceleration[j] + strand.acceleration[j + 1]);
        strand.velocity[j] += dt * (gravity - frame).dot(&strand.tangent[j]);
    }
    let mu = liquid.shear_modulus;
    if mu == 0.0 || !settings.elasticity || edges == 0 {
        return;
    }
    let vertices = edges + 1;
    let work = std::mem::take(&mut strand.work);
    let (stress, rest) = work.split_at_mut(vertices);
    let (stiffness, rest) = rest.split_at_mut(vertices);
    let (diagonal, rest) = rest.split_at_mut(vertices);
    let (right, _) = rest.split_at_mut(vertices);
    for i in 0..vertices {
        let theta = strand.log_strain[i];
        // force A μ c with c = 2 sinh ϑ, and its increase by the stretching of the step
        stress[i] = dt * mu * strand.area[i] * 2.0 * theta.sinh();
        stiffness[i] = 0.0;
        if i > 0 && i < edges && strand.area[i] > 0.0 {
            let (norm, mu_hat) = (2f64.sqrt() * mu * theta.sinh().abs(), mu * theta.cosh());
            let kept = if settings.plasticity {
                liquid.flow.return_map(settings.flow_map, norm, norm, mu_hat, dt).by_trial
            } else {
                1.0
            };
            let length = 0.5 * (strand.edge_length[i - 1] + strand.edge_length[i]);
            stiffness[i] = dt * mu * strand.area[i] * 4.0 * dt * theta.cosh() * kept / length;
        }
    }
    for j in 0..edges {
        let mass = liquid.density * 0.5 * (strand.area[j] + strand.area[j + 1]) * strand.edge_length[j];
        diagonal[j] = mass + stiffness[j] + stiffness[j + 1];
        right[j] = mass * strand.velocity[j] + stress[j + 1] - stress[j];
    }
    // Thomas: the matrix is diagonally dominant; edges without mass keep their speed
    for j in 1..edges {
        if diagonal[j - 1] > 0.0 {
            let factor = stiffness[j] / diagonal[j - 1];
            diagonal[j] -= factor * stiffness[j];
            right[j] += factor * right[j - 1];
        }
    }
    for j in (0..edges).rev() {
        if diagonal[j] > 0.0 {
            let beyond = if j + 1 < edges { stiffness[j + 1] * strand.velocity[j + 1] } else { 0.0 };
            strand.velocity[j] = (right[j] + beyond) / diagonal[j];
        }
    }
    strand.work = work;
}
