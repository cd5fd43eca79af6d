//! What the yarns look like: lines with their fields, and the solids they meet.

use yarn::YarnSystem;

use crate::record::frame::{Field, Frame, Piece, Topology};

/// Facets around a round solid in pictures.
const SOLID_SEGMENTS: usize = 48;
/// Width of the outline of a solid in the plane, as a share of the size of the scene.
const OUTLINE: f64 = 5e-4;

/// The visible state.
///
/// Vertices carry `id`, `yarn`, `radius` [m], `velocity` [m/s], and the mean of the segments beside them of `tension` [N],
/// `pressure` [Pa] (of the cross-section, compression positive) and `slip` [m] (between fibres, since the start).
/// `segment_tension`, `segment_pressure` and `segment_slip` are those of the segment that starts at the vertex, zero at the
/// last one of a yarn.
pub(super) fn frame<const D: usize>(system: &YarnSystem<D>, extent: f64, step: u64, time: f64) -> Frame {
    let mut pieces = vec![yarns(system)];
    if system.obstacles().next().is_some() {
        pieces.push(if D == 2 { flat_solids(system, extent, time) } else { solids(system, extent, time) });
    }
    Frame { time, step, pieces }
}

fn yarns<const D: usize>(system: &YarnSystem<D>) -> Piece {
    let data = system.frame_data();
    let count = data.yarn_start.len() - 1;
    Piece {
        name: "yarns".to_owned(),
        topology: Topology::Polylines { offsets: data.yarn_start.iter().map(|first| *first as u32).collect() },
        positions: data.position,
        point_fields: vec![
            Field::integer("id", data.id.iter().map(|id| *id as i64).collect()),
            Field::integer("yarn", data.yarn.iter().map(|yarn| i64::from(*yarn)).collect()),
            Field::scalar("radius", data.width.iter().map(|width| 0.5 * width).collect()),
            Field::vector("velocity", &data.velocity),
            Field::scalar("tension", data.tension),
            Field::scalar("pressure", data.pressure),
            Field::scalar("slip", data.slip),
            Field::scalar("segment_tension", data.segment_tension),
            Field::scalar("segment_pressure", data.segment_pressure),
            Field::scalar("segment_slip", data.segment_slip),
        ],
        cell_fields: vec![Field::integer("yarn_id", (0..count as i64).collect())],
    }
}

fn solids<const D: usize>(system: &YarnSystem<D>, extent: f64, time: f64) -> Piece {
    let (mut positions, mut triangles, mut of) = (Vec::new(), Vec::new(), Vec::new());
    for (index, solid) in system.obstacles().enumerate() {
        let mesh = solid.at(time).tessellate(SOLID_SEGMENTS, extent);
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

/// Solids in the plane: their shadow along z, and the line in which they cut the plane.
fn flat_solids<const D: usize>(system: &YarnSystem<D>, extent: f64, time: f64) -> Piece {
    let (mut positions, mut triangles, mut of) = (Vec::new(), Vec::new(), Vec::new());
    let width = OUTLINE * extent;
    let mut add = |corners: &[[f64; 2]], index: usize| {
        let first = positions.len() as u32;
        positions.extend(corners.iter().map(|c| [c[0], c[1], 0.0]));
        for k in 2..corners.len() as u32 {
            triangles.push([first, first + k - 1, first + k]);
            of.push(index as i64);
        }
    };
    for (index, solid) in system.obstacles().enumerate() {
        let mesh = solid.at(time).tessellate(SOLID_SEGMENTS, extent);
        for triangle in &mesh.triangles {
            let p = triangle.map(|corner| mesh.positions[corner as usize]);
            let (a, b) = (p[1] - p[0], p[2] - p[0]);
            // Twice the area of the shadow, positive for faces that look up.
            let shadow = a.x * b.y - a.y * b.x;
            if shadow > 1e-12 * (a.norm_squared() + b.norm_squared()) {
                add(&p.map(|x| [x.x, x.y]), index);
            }
            let cuts: Vec<[f64; 2]> = (0..3)
                .filter_map(|k| {
                    let (from, to) = (p[k], p[(k + 1) % 3]);
                    ((from.z >= 0.0) != (to.z >= 0.0)).then(|| {
                        let x = from + (to - from) * (from.z / (from.z - to.z));
                        [x.x, x.y]
                    })
                })
                .collect();
            if let [from, to] = cuts[..] {
                let along = [to[0] - from[0], to[1] - from[1]];
                let length = along[0].hypot(along[1]);
                if length > 0.0 {
                    let side = [-along[1] / length * width, along[0] / length * width];
                    let shifted = |x: [f64; 2], sign: f64| [x[0] + sign * side[0], x[1] + sign * side[1]];
                    add(&[shifted(from, -1.0), shifted(to, -1.0), shifted(to, 1.0), shifted(from, 1.0)], index);
                }
            }
        }
    }
    Piece {
        name: "solids".to_owned(),
        topology: Topology::Triangles(triangles),
        positions,
        point_fields: Vec::new(),
        cell_fields: vec![Field::integer("solid", of)],
    }
}
