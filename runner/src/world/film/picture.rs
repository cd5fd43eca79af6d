//! Films in frames: fields on the strands, and tubes around them.

use super::{FilmWorld, Films};
use crate::record::frame::{Field, Piece, Topology};
use crate::world::World;

/// Films thinner than this many strand radii are not drawn.
const SEEN: f64 = 0.02;

/// Fields of the films on the vertices of the strands.
pub fn fields(film: &FilmWorld, films: &Films) -> Vec<Field> {
    vec![
        Field::scalar("film_height", film.height.clone()),
        Field::scalar("film_mass", film.mass.clone()),
        Field::scalar("film_speed", vertex_speeds(films)),
        Field::scalar("film_strain", films.state.log_strain.clone()),
    ]
}

/// Speed of the film at vertices: the mean of the adjacent edges.
fn vertex_speeds(films: &Films) -> Vec<f64> {
    let state = &films.state;
    let mut speeds = Vec::with_capacity(state.area.len());
    for strand in 0..state.strands() {
        let edges = &state.velocity[state.edges(strand)];
        let last = edges.len().saturating_sub(1);
        let at = |j: usize| edges.get(j).copied().unwrap_or(0.0);
        speeds.extend((0..=edges.len()).map(|i| 0.5 * (at(i.saturating_sub(1)) + at(i.min(last)))));
    }
    speeds
}

/// The films as tubes around the wet parts of the strands; none where all are dry.
pub fn tubes(world: &World, film: &FilmWorld, films: &Films) -> Option<Piece> {
    let rods = &world.state.rods;
    let speeds = vertex_speeds(films);
    let (mut positions, mut radius, mut height, mut speed) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let (mut offsets, mut strand_of, mut liquid) = (vec![0u32], Vec::new(), Vec::new());
    for strand in 0..rods.strand_count() {
        let wet = |v: usize| film.height[v] > SEEN * rods.radius[v][0];
        let vertices = rods.vertices(strand);
        let mut open = false;
        for v in vertices.clone() {
            let alone = !wet(v) && (v == vertices.start || !wet(v - 1)) && (v + 1 == vertices.end || !wet(v + 1));
            // a run goes one vertex beyond its wet ones, where the tube tapers to the strand
            if !alone {
                let x = &rods.position[v];
                positions.push([x.x, x.y, x.z]);
                radius.push(rods.radius[v][0] + film.height[v]);
                height.push(film.height[v]);
                speed.push(speeds[v]);
                open = true;
            }
            let ends = alone || v + 1 == vertices.end;
            if open && ends {
                offsets.push(positions.len() as u32);
                strand_of.push(strand as i64);
                liquid.push(i64::from(film.liquid_of[strand]));
                open = false;
            }
        }
    }
    (!positions.is_empty()).then(|| Piece {
        name: "films".to_owned(),
        topology: Topology::Polylines { offsets },
        positions,
        point_fields: vec![
            Field::scalar("radius", radius),
            Field::scalar("film_height", height),
            Field::scalar("film_speed", speed),
        ],
        cell_fields: vec![Field::integer("strand_id", strand_of), Field::integer("liquid", liquid)],
    })
}
