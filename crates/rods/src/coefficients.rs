//! Stiffnesses, masses and inertias of vertices and edges.

use crate::state::RodSet;
use std::f64::consts::PI;

/// Stiffness of stretch of edge `j` of a strand: `k_s = π a b E ς` \[N\], radii at the middle of the edge.
pub(crate) fn stretch_stiffness(rods: &RodSet, strand: usize, j: usize) -> f64 {
    let v = rods.first_vertex[strand] + j;
    let (p, q) = (rods.radius[v], rods.radius[v + 1]);
    let m = &rods.material[strand];
    let scale = 0.5 * (rods.stiffness_scale[v] + rods.stiffness_scale[v + 1]);
    PI * 0.25 * (p[0] + q[0]) * (p[1] + q[1]) * m.young_modulus * m.stretch_multiplier * scale
}

/// Rest length that belongs to vertex `i` of a strand \[m\]: half of the adjacent edges.
pub(crate) fn vertex_length(rods: &RodSet, strand: usize, i: usize) -> f64 {
    let e = rods.edges(strand);
    let n = e.len();
    let before = if i > 0 { rods.rest_length[e.start + i - 1] } else { 0.0 };
    let after = if i < n { rods.rest_length[e.start + i] } else { 0.0 };
    0.5 * (before + after)
}

/// Stiffness of the curvatures and of the twist at interior vertex `i`: `(B₁/2L, B₂/2L, k_t/L)` \[N m\].
pub(crate) fn bend_twist_stiffness(rods: &RodSet, strand: usize, i: usize) -> (f64, f64, f64) {
    let v = rods.first_vertex[strand] + i;
    let [a, b] = rods.radius[v];
    let m = &rods.material[strand];
    let l = vertex_length(rods, strand, i);
    let bend = m.young_modulus * rods.stiffness_scale[v] * (PI / 4.0) * a * b / (2.0 * l);
    let twist = PI * a * a * a * b * b * b / (a * a + b * b) * m.shear_modulus() * rods.stiffness_scale[v] / l;
    (bend * a * a, bend * b * b, twist)
}

/// Mass of vertex `i` without film \[kg\].
pub(crate) fn vertex_mass(rods: &RodSet, strand: usize, i: usize) -> f64 {
    let [a, b] = rods.radius[rods.first_vertex[strand] + i];
    rods.material[strand].density * PI * a * b * vertex_length(rods, strand, i)
}

/// Turning inertia of edge `j` about its tangent \[kg m²\], with a film of the given masses and heights at its vertices.
///
/// `I = ¼ [mˢ(a² + b²) + mᵗ(a² + b² + ½ Σ ((a + h)² + (b + h)²))]`, spec 4.6.
pub(crate) fn edge_inertia(
    rods: &RodSet,
    strand: usize,
    j: usize,
    film_mass: Option<&[f64]>,
    film_height: Option<&[f64]>,
) -> f64 {
    let v = rods.first_vertex[strand] + j;
    let (p, q) = (rods.radius[v], rods.radius[v + 1]);
    let (a, b) = (0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1]));
    let length = rods.rest_length[rods.edges(strand).start + j];
    let square = a * a + b * b;
    let mut inertia = rods.material[strand].density * PI * a * b * length * square;
    if let Some(mass) = film_mass {
        let share = |i: usize| mass[v + i] * 0.5 * length / vertex_length(rods, strand, j + i);
        let outer = |i: usize| {
            let h = film_height.map_or(0.0, |h| h[v + i]);
            (a + h) * (a + h) + (b + h) * (b + h)
        };
        inertia += (share(0) + share(1)) * (square + 0.5 * (outer(0) + outer(1)));
    }
    0.25 * inertia
}
