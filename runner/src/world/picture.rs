//! What the world looks like: strands as lines with their fields, solids as meshes.

use super::World;
use super::liquid::seen_in_its_dimension;
use crate::record::frame::{Field, Frame, Piece, Topology};

/// Facets around a round solid in pictures.
const SOLID_SEGMENTS: usize = 48;

/// The visible state.
#[must_use]
pub fn frame(world: &World, step: u64, time: f64) -> Frame {
    let mut pieces = Vec::new();
    if world.strands.is_some() {
        pieces.push(strands(world));
    }
    if let (Some(film), Some(films)) = (&world.film, &world.state.film) {
        pieces[0].point_fields.extend(super::film::picture::fields(film, films));
        pieces.extend(super::film::picture::tubes(world, film, films));
    }
    if let Some(contact) = &world.contact {
        pieces.push(super::contact::record::picture(contact));
    }
    let flat = seen_in_its_dimension!(world, None, |flow, state| {
        pieces.push(flow.particles(state));
        pieces.extend(flow.cuts(state));
        flow.outlines(&world.solids, time, world.extent)
    });
    match flat {
        Some(outlines) => pieces.push(outlines),
        None if !world.solids.is_empty() => pieces.push(solids(world, time)),
        None => {}
    }
    Frame { time, step, pieces }
}

fn strands(world: &World) -> Piece {
    let rods = &world.state.rods;
    let count = rods.strand_count();
    let offsets = rods.first_vertex.iter().map(|first| *first as u32).collect();
    let positions: Vec<[f64; 3]> = rods.position.iter().map(|x| [x.x, x.y, x.z]).collect();
    let velocity: Vec<[f64; 3]> = rods.velocity.iter().map(|v| [v.x, v.y, v.z]).collect();
    let (mut curvature, mut twist, mut tension) = (Vec::new(), Vec::new(), Vec::new());
    let (mut strand_of, mut director) = (Vec::new(), Vec::new());
    for strand in 0..count {
        curvature.extend(rods.curvature(strand));
        twist.extend(rods.twist(strand));
        // a vertex shows the mean tension of its edges
        let edges = rods.tension(strand);
        let last = edges.len() - 1;
        tension.extend((0..=edges.len()).map(|i| 0.5 * (edges[i.saturating_sub(1)] + edges[i.min(last)])));
        strand_of.extend(rods.vertices(strand).map(|_| strand as i64));
        for i in 0..rods.vertices(strand).len() {
            let m = rods.material_directors(strand, i.min(last)).0;
            director.push([m.x, m.y, m.z]);
        }
    }
    Piece {
        name: "strands".to_owned(),
        topology: Topology::Polylines { offsets },
        positions,
        point_fields: vec![
            Field::integer("id", (0..rods.vertex_count() as i64).collect()),
            Field::integer("strand", strand_of),
            Field::scalar("radius", rods.radius.iter().map(|r| r[0]).collect()),
            Field::vector("velocity", &velocity),
            Field::scalar("curvature", curvature),
            Field::scalar("twist", twist),
            Field::scalar("tension", tension),
            Field::vector("director", &director),
        ],
        cell_fields: vec![Field::integer("strand_id", (0..count as i64).collect())],
    }
}

fn solids(world: &World, time: f64) -> Piece {
    let (mut positions, mut triangles, mut of) = (Vec::new(), Vec::new(), Vec::new());
    for (index, solid) in world.solids.iter().enumerate() {
        let mesh = solid.solid.at(time).tessellate(SOLID_SEGMENTS, world.extent);
        let first = positions.len() as u32;
        positions.extend(mesh.positions.iter().map(|x| [x.x, x.y, x.z]));
        of.extend(mesh.triangles.iter().map(|_| index as i64));
        triangles.extend(mesh.triangles.iter().map(|t| t.map(|corner| corner + first)));
    }
    Piece {
        name: "solids".to_owned(),
        topology: Topology::Triangles(triangles),
        positions,
        point_fields: Vec::new(),
        cell_fields: vec![Field::integer("solid", of)],
    }
}

/// Half width of endless solids in pictures: several times the size of everything at the start, so that floors keep their
/// edges where they are.
pub(super) fn extent(rods: &rods::RodSet, scene: &crate::scene::Scene) -> f64 {
    let mut low = nalgebra::Vector3::repeat(f64::INFINITY);
    let mut high = -low;
    for x in &rods.position {
        low = low.inf(x);
        high = high.sup(x);
    }
    let mesh_unit = super::solids::mesh_unit(scene);
    if let Some(liquid) = &scene.liquid {
        let shapes = liquid.tanks.iter().map(|t| &t.shape).chain(liquid.sources.iter().map(|s| &s.shape));
        for shape in shapes {
            let built = super::solids::describe(shape, mesh_unit).build(std::path::Path::new(""));
            if let Some(bounds) = built.ok().and_then(|shape| shape.bounds()) {
                low = low.inf(&bounds.min.into());
                high = high.sup(&bounds.max.into());
            }
        }
        for corner in liquid.domain.iter().flat_map(|domain| [domain.low, domain.high]) {
            low = low.inf(&corner);
            high = high.sup(&corner);
        }
    }
    let size = (high - low).norm();
    if size.is_finite() && size > 0.0 { 4.0 * size } else { 1.0 }
}
