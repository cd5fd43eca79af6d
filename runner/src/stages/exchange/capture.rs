//! A vertex that leaves the liquid takes a film with it.

use nalgebra::Vector3;

use super::Hands;
use crate::world::submersion::near::Near;

/// Fills the films of vertices that were deeper than half a cell below the surface and no longer are.
pub(super) fn run(hands: &mut Hands<'_>) {
    let depth = -0.5 * hands.flow.grid.lattice().dx;
    for strand in 0..hands.rods.strand_count() {
        let Some(material) = hands.material(strand) else { continue };
        let vertices = hands.rods.vertices(strand);
        for (i, v) in vertices.enumerate() {
            let inside = hands.submersion.level[v] < depth;
            let was = std::mem::replace(&mut hands.memory.inside[v], inside);
            if was && !inside && hands.submersion.captures {
                take(hands, strand, i, v, material);
            }
        }
    }
}

/// Takes liquid from the particles around a vertex, the nearest first, until the film is as high as films of this liquid are.
fn take(hands: &mut Hands<'_>, strand: usize, i: usize, v: usize, material: u16) {
    let length = hands.vertex_length(strand, i);
    let wanted = (hands.typical_area(strand, v) - hands.films.state.area[v]) * length;
    if wanted <= 0.0 {
        return;
    }
    let x = hands.rods.position[v];
    let lattice = hands.flow.grid.lattice();
    let particles = &mut hands.fluid.particles;
    let mut near: Vec<Near> = Vec::new();
    hands.submersion.particles.around(lattice, &x, &particles.position, |n| {
        if particles.material[n.index] == material {
            near.push(n);
        }
    });
    near.sort_by(|a, b| a.distance.total_cmp(&b.distance).then(a.index.cmp(&b.index)));
    let (mut volume, mut mass, mut momentum) = (0.0, 0.0, Vector3::zeros());
    let mut left = wanted;
    for n in near {
        let has = particles.rest_volume[n.index];
        let gives = (n.weight * has).min(left);
        if gives <= 0.0 {
            break;
        }
        let weighs = particles.mass[n.index] * (gives / has);
        particles.rest_volume[n.index] -= gives;
        particles.mass[n.index] -= weighs;
        volume += gives;
        mass += weighs;
        momentum += particles.velocity[n.index] * weighs;
        left -= gives;
    }
    if volume == 0.0 {
        return;
    }
    hands.fluid.ledger.exchanged(-mass, -volume, &-momentum);
    hands.films.ledger.captured += mass;
    hands.film.exchanged.captured += mass;

    // the film takes the momentum along the strand, the strand the rest
    let relative = momentum - hands.rods.velocity[v] * mass;
    let density = hands.film.density[strand];
    let state = &mut hands.films.state;
    let edges = state.edges(strand);
    let first = state.vertices(strand).start;
    let (before, after) = (i.checked_sub(1), Some(i).filter(|i| *i < edges.len()));
    let share = if before.is_some() && after.is_some() { 0.5 } else { 1.0 };
    let mut rest = relative;
    for j in [before, after].into_iter().flatten() {
        let e = edges.start + j;
        let tangent = hands.film.tangent[e];
        let has = 0.5 * (state.area[first + j] + state.area[first + j + 1]) * hands.film.edge_length[e];
        let given = share * relative.dot(&tangent);
        state.velocity[e] = (has * state.velocity[e] + given / density) / (has + share * volume);
        rest -= tangent * given;
    }
    let area = state.area[v];
    state.area[v] += volume / length;
    state.log_strain[v] *= area / state.area[v];
    if !hands.submersion.lose_transverse {
        hands.submersion.capture_impulse[v] += rest;
        hands.ledger.impulse += rest;
        hands.ledger.impulse_scale += rest.norm();
        hands.memory.exchanged.transfer += rest;
    }
    hands.joined(v, mass);
}
