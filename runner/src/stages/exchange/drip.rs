//! Drops that fall from the ends of strands.

use crate::world::World;

/// Without bulk liquid a drop is followed no further: its mass and momentum go to the ledgers.
pub fn to_ledger(world: &mut World) {
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
