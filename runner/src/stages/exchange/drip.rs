//! Drops that fall from the ends of strands.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::Hands;
use crate::world::World;

/// Without bulk liquid a drop is followed no further: its mass and momentum go to the ledgers.
pub(super) fn to_ledger(world: &mut World) {
    let World { state, film: Some(film), .. } = world else { return };
    let Some(films) = &mut state.film else { return };
    if !film.drips {
        return;
    }
    for strand in 0..films.state.strands() {
        let vertices = films.state.vertices(strand);
        for (end, tip) in [vertices.start, vertices.end - 1].into_iter().enumerate() {
            let volume = films.state.reservoir[strand][end];
            let drop = film.drop_volume[strand][end];
            if !(volume > 0.0 && volume >= drop) {
                continue;
            }
            let falls = if drop > 0.0 { ((volume / drop).floor() * drop).min(volume) } else { volume };
            films.state.reservoir[strand][end] = volume - falls;
            let mass = film.density[strand] * falls;
            films.ledger.dripped += mass;
            film.exchanged.dripped += mass;
            // the reservoir moved with the end of the strand
            let momentum = state.rods.velocity[tip] * mass;
            state.ledger.impulse -= momentum;
            state.ledger.impulse_scale += momentum.norm();
        }
    }
}

/// With bulk liquid the ends of strands that lie in one cell pool their reservoirs, and what makes whole particles becomes
/// particles around the middle of those ends.
pub(super) fn to_particles(hands: &mut Hands<'_>) {
    let lattice = *hands.flow.grid.lattice();
    let particle = mpm::fill::sample_volume(&lattice, hands.flow.settings.particles_per_axis);
    // (cell, liquid) of every end with something to let go, in the order of the strands
    let mut ends: Vec<([i64; 3], u32, usize, usize)> = Vec::new();
    for strand in 0..hands.films.state.strands() {
        for (end, waiting) in hands.films.state.reservoir[strand].into_iter().enumerate() {
            if waiting > 0.0 && hands.material(strand).is_some() {
                let cell = lattice.to_cells(&hands.rods.position[hands.tip(strand, end)]).map(|c| c.floor() as i64);
                ends.push((cell, hands.film.liquid_of[strand], strand, end));
            }
        }
    }
    ends.sort_unstable();
    let mut from = 0;
    while from < ends.len() {
        let same = ends[from..].iter().take_while(|e| (e.0, e.1) == (ends[from].0, ends[from].1)).count();
        shed(hands, &ends[from..from + same], particle);
        from += same;
    }
}

/// Lets go of what makes whole particles in the pooled reservoirs of some ends.
fn shed(hands: &mut Hands<'_>, ends: &[([i64; 3], u32, usize, usize)], particle: f64) {
    let volume = |hands: &Hands<'_>, strand: usize, end: usize| hands.films.state.reservoir[strand][end];
    let pool: f64 = ends.iter().map(|(_, _, strand, end)| volume(hands, *strand, *end)).sum();
    let count = (pool / particle).floor();
    let Some(material) = ends.first().and_then(|(_, _, strand, _)| hands.material(*strand)) else { return };
    if count < 1.0 {
        return;
    }
    let (mut center, mut moves) = (Vector3::zeros(), Vector3::zeros());
    for (_, _, strand, end) in ends {
        let share = volume(hands, *strand, *end) / pool;
        let tip = hands.tip(*strand, *end);
        let i = tip - hands.films.state.vertices(*strand).start;
        center += hands.rods.position[tip] * share;
        moves += hands.film_velocity(*strand, i) * share;
    }
    let density = hands.film.density[ends[0].2];
    let radius = if count > 1.0 { (0.75 * count * particle / PI).cbrt() } else { 0.0 };
    let lattice = *hands.flow.grid.lattice();
    for k in 0..count as usize {
        let mut x = center + spread(k, count) * radius;
        lattice.wrap(&mut x);
        let mut drop = mpm::Particle::new(x, particle, material, density);
        drop.velocity = moves;
        hands.fluid.particles.push(drop);
    }
    let falls = count * particle;
    let mass = density * falls;
    hands.fluid.ledger.exchanged(mass, falls, &(moves * mass));
    hands.films.ledger.shed += mass;
    hands.film.exchanged.dripped += mass;
    for (_, _, strand, end) in ends {
        let waiting = volume(hands, *strand, *end);
        let gives = (falls * (waiting / pool)).min(waiting);
        hands.films.state.reservoir[*strand][*end] = waiting - gives;
        hands.joined(hands.tip(*strand, *end), -density * gives);
    }
}

/// Direction number `k` of `count` spread over a sphere; a lone one has none.
fn spread(k: usize, count: f64) -> Vector3<f64> {
    if count < 2.0 {
        return Vector3::zeros();
    }
    let z = 1.0 - (2.0 * k as f64 + 1.0) / count;
    let angle = k as f64 * PI * (3.0 - 5f64.sqrt());
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vector3::new(r * angle.cos(), z, r * angle.sin())
}

impl Hands<'_> {
    /// The vertex at an end of a strand.
    fn tip(&self, strand: usize, end: usize) -> usize {
        let vertices = self.films.state.vertices(strand);
        if end == 0 { vertices.start } else { vertices.end - 1 }
    }
}
