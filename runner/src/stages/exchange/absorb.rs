//! A vertex in the liquid gives its film back.

use super::Hands;
use crate::world::submersion::near::Near;

/// Gives all film of vertices deeper than half a cell below the surface to the particles around them, and of those nearer to
/// it what exceeds the height that films of this liquid have.
pub(super) fn run(hands: &mut Hands<'_>) {
    if !hands.submersion.captures {
        return;
    }
    let depth = -0.5 * hands.flow.grid.lattice().dx;
    for strand in 0..hands.rods.strand_count() {
        let Some(material) = hands.material(strand) else { continue };
        let vertices = hands.rods.vertices(strand);
        let (first, last) = (vertices.start, vertices.end - 1);
        for (i, v) in vertices.enumerate() {
            let level = hands.submersion.level[v];
            if level > 0.0 {
                continue;
            }
            let length = hands.vertex_length(strand, i);
            let keeps = if level < depth { 0.0 } else { hands.typical_area(strand, v) };
            let area = hands.films.state.area[v];
            let surplus = (area - keeps).max(0.0) * length;
            let placed = give(hands, strand, i, v, material, surplus);
            if placed > 0.0 {
                hands.films.state.area[v] =
                    if placed == area * length { 0.0 } else { (area - placed / length).max(0.0) };
                if hands.films.state.area[v] == 0.0 {
                    hands.films.state.log_strain[v] = 0.0;
                }
            }
            for (end, tip) in [first, last].into_iter().enumerate().filter(|(_, tip)| *tip == v) {
                let waiting = hands.films.state.reservoir[strand][end];
                let placed = give(hands, strand, i, tip, material, waiting);
                hands.films.state.reservoir[strand][end] -= placed;
            }
        }
    }
}

/// Shares a volume out among the particles around a vertex; returns what could be placed [m³].
fn give(hands: &mut Hands<'_>, strand: usize, i: usize, v: usize, material: u16, volume: f64) -> f64 {
    if volume <= 0.0 {
        return 0.0;
    }
    let x = hands.rods.position[v];
    let moves = hands.film_velocity(strand, i);
    let density = hands.film.density[strand];
    let lattice = hands.flow.grid.lattice();
    let particles = &mut hands.fluid.particles;
    let mut near: Vec<Near> = Vec::new();
    hands.submersion.particles.around(lattice, &x, &particles.position, |n| {
        if particles.material[n.index] == material {
            near.push(n);
        }
    });
    let mut left = volume;
    for n in near {
        let takes = (n.weight * particles.rest_volume[n.index]).min(left);
        if takes <= 0.0 {
            continue;
        }
        let (has, more) = (particles.mass[n.index], density * takes);
        particles.velocity[n.index] = (particles.velocity[n.index] * has + moves * more) / (has + more);
        particles.mass[n.index] = has + more;
        particles.rest_volume[n.index] += takes;
        left -= takes;
    }
    let placed = volume - left;
    if placed > 0.0 {
        let mass = density * placed;
        hands.fluid.ledger.exchanged(mass, placed, &(moves * mass));
        hands.films.ledger.absorbed += mass;
        hands.film.exchanged.absorbed += mass;
        hands.joined(v, -mass);
    }
    placed
}
