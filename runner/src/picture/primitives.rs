//! A frame as tubes, balls and triangles in picture coordinates.

use nalgebra::Vector3;

use super::camera::{Camera, Projected, scalar};
use super::color::{Color, ColorBy, colormap, linear, of_piece, of_state};
use crate::record::frame::{FieldValues, Frame, Piece, Topology};

/// A tube between two balls (or one ball), in supersampled pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Capsule {
    /// Ends: from left, from top.
    pub ends: [[f32; 2]; 2],
    /// Depth of the ends [m].
    pub depth: [f32; 2],
    /// Radii [pixels].
    pub radius: [f32; 2],
    /// Radius [m] at the first end, by which the middle of the tube rises towards the eye.
    pub rise: f32,
    /// Colours of the ends.
    pub color: [Color; 2],
    /// Share of the tube's true width when it is drawn wider than it is, so that thin hair stays visible but faint.
    pub coverage: f32,
}

/// A triangle in supersampled pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    /// Corners: from left, from top.
    pub corners: [[f32; 2]; 3],
    /// Depth of the corners [m].
    pub depth: [f32; 3],
    /// Normals at the corners: right, up, towards the eye.
    pub normals: [[f32; 3]; 3],
    /// Colours of the corners.
    pub color: [Color; 3],
}

/// Everything that is drawn.
#[derive(Clone, Debug, Default)]
pub(super) struct Primitives {
    pub capsules: Vec<Capsule>,
    pub triangles: Vec<Triangle>,
}

/// Smallest radius drawn, as a share of the picture's height: hair is far thinner than a pixel and must still be seen.
const MIN_RADIUS: f64 = 0.0016;
/// How strongly the thinnest hair is drawn.
const MIN_COVERAGE: f64 = 0.94;

pub(super) fn collect(frame: &Frame, camera: &Camera, color: &ColorBy, factor: usize) -> Primitives {
    let mut all = Primitives::default();
    let lift = thickness(frame);
    for piece in frame.pieces.iter().filter(|piece| !only_hides(piece, color)) {
        let mut brush = Brush::new(piece, camera, color, factor);
        if piece.name != "grains" {
            brush.lift = lift;
        }
        match &piece.topology {
            Topology::Points => (0..piece.positions.len()).for_each(|i| brush.tube(i, i, &mut all)),
            Topology::Polylines { offsets } => {
                for pair in offsets.windows(2) {
                    let (first, end) = (pair[0] as usize, pair[1] as usize);
                    (first + 1..end).for_each(|v| brush.tube(v - 1, v, &mut all));
                    if end == first + 1 {
                        brush.tube(first, first, &mut all);
                    }
                }
            }
            Topology::Segments(pairs) => pairs.iter().for_each(|p| brush.tube(p[0] as usize, p[1] as usize, &mut all)),
            Topology::Triangles(triangles) => brush.mesh(triangles, &mut all),
            // a cut would hide what it cuts
            Topology::Lattice { .. } => {}
        }
    }
    all
}

/// Whether a piece lies on what the picture is about and has no part in it: contacts and films where strands are coloured by a
/// field that those lack.
fn only_hides(piece: &Piece, color: &ColorBy) -> bool {
    let lies_on_others = piece.name == "contacts" || piece.name == "films";
    matches!(color, ColorBy::Field { name, .. } if lies_on_others && piece.point_field(name).is_none())
}

/// Contacts up to which their balls have the usual size; the balls of more are smaller, lest they hide what touches.
const FEW_CONTACTS: f64 = 50.0;

/// Radius of the balls of contacts relative to that of other points.
fn dot_size(piece: &Piece) -> f64 {
    if piece.name == "contacts" { (piece.positions.len() as f64 / FEW_CONTACTS).max(1.0).cbrt().recip() } else { 1.0 }
}

/// How far lines must be lifted to lie on top of grains in a plane, which are drawn as balls [m]; zero without such grains.
fn thickness(frame: &Frame) -> f64 {
    let Some(grains) = frame.pieces.iter().find(|piece| piece.name == "grains") else { return 0.0 };
    if grains.positions.iter().any(|x| x[2] != 0.0) {
        return 0.0;
    }
    let radius = grains.point_field("radius");
    let largest = radius.map_or(0.0, |field| (0..grains.positions.len()).map(|i| scalar(field, i)).fold(0.0, f64::max));
    if largest.is_finite() { 1.05 * largest } else { 0.0 }
}

/// Whole numbers of a field on the cells of a piece.
fn cell_numbers<'a>(piece: &'a Piece, name: &str) -> Option<&'a [i64]> {
    match &piece.cell_fields.iter().find(|field| field.name == name)?.values {
        FieldValues::I64(values) => Some(values),
        FieldValues::F64(_) => None,
    }
}

/// Draws the points of one piece.
struct Brush<'a> {
    piece: &'a Piece,
    camera: &'a Camera,
    factor: f64,
    colors: Vec<Color>,
    radius: Option<&'a crate::record::frame::Field>,
    default_radius: f64,
    /// Smallest radius drawn [pixels of the finished picture].
    thinnest: f64,
    lift: f64,
    /// Points of segments that are drawn thicker: force chains.
    strong: Vec<bool>,
}

impl<'a> Brush<'a> {
    fn new(piece: &'a Piece, camera: &'a Camera, color: &ColorBy, factor: usize) -> Brush<'a> {
        let thin = if matches!(piece.topology, Topology::Points) { 6e-3 } else { 3e-3 };
        Brush {
            piece,
            camera,
            factor: factor as f64,
            colors: colors(piece, color),
            radius: piece.point_field("radius"),
            default_radius: thin * camera.reach * dot_size(piece),
            thinnest: (MIN_RADIUS * camera.height as f64).max(0.7),
            lift: 0.0,
            strong: strong(piece),
        }
    }

    fn point(&self, i: usize) -> Option<(Vector3<f64>, Projected, f64)> {
        let position = Vector3::from(*self.piece.positions.get(i)?);
        let thin = if self.strong.get(i) == Some(&true) { 2.5 * self.default_radius } else { self.default_radius };
        let radius = self.radius.map_or(thin, |field| scalar(field, i));
        let mut projected = self.camera.project(&position);
        projected.depth -= self.lift;
        let sound =
            position.iter().all(|x| x.is_finite()) && radius.is_finite() && projected.depth > self.camera.near_depth();
        sound.then_some((position, projected, radius.max(0.0)))
    }

    fn tube(&self, i: usize, j: usize, all: &mut Primitives) {
        let (Some(a), Some(b)) = (self.point(i), self.point(j)) else { return };
        let true_radius = [a.2 * a.1.scale, b.2 * b.1.scale];
        let radius = true_radius.map(|r| (r.max(self.thinnest) * self.factor) as f32);
        let mean = 0.5 * (true_radius[0] + true_radius[1]);
        let at = |p: &Projected| [(p.x * self.factor) as f32, (p.y * self.factor) as f32];
        all.capsules.push(Capsule {
            ends: [at(&a.1), at(&b.1)],
            depth: [a.1.depth as f32, b.1.depth as f32],
            radius,
            rise: a.2.max(self.thinnest / a.1.scale) as f32,
            color: [self.colors[i], self.colors[j]],
            coverage: (mean / self.thinnest).clamp(MIN_COVERAGE, 1.0) as f32,
        });
    }

    fn mesh(&self, triangles: &[[u32; 3]], all: &mut Primitives) {
        let position = |v: u32| Vector3::from(self.piece.positions[v as usize]);
        let face = |t: &[u32; 3]| (position(t[1]) - position(t[0])).cross(&(position(t[2]) - position(t[0])));
        // The near walls of a container would hide what is in it; of a solid body the far side is never seen.
        let one_sided = self.piece.name == "solids";
        let mut vertex_normals = vec![Vector3::zeros(); self.piece.positions.len()];
        for t in triangles {
            let normal = face(t);
            t.iter().for_each(|&v| vertex_normals[v as usize] += normal);
        }
        for t in triangles {
            let Some(normal) = face(t).try_normalize(0.0) else { continue };
            let mut corners = Vec::with_capacity(4);
            for &v in t {
                // Smooth over shallow edges, keep sharp ones.
                let smooth =
                    vertex_normals[v as usize].try_normalize(0.0).filter(|n| n.dot(&normal) > 0.75).unwrap_or(normal);
                let seen = self.camera.axes.map(|axis| axis.dot(&smooth) as f32);
                corners.push((position(v), seen, self.colors[v as usize]));
            }
            if corners.iter().any(|c| !c.0.iter().all(|x| x.is_finite())) {
                continue;
            }
            let corners = self.clip(&corners);
            for k in 2..corners.len() {
                let three = [&corners[0], &corners[k - 1], &corners[k]];
                let projected = three.map(|c| self.camera.project(&c.0));
                let corners = projected.map(|p| [(p.x * self.factor) as f32, (p.y * self.factor) as f32]);
                if one_sided && turned_away(corners) {
                    continue;
                }
                all.triangles.push(Triangle {
                    corners,
                    depth: projected.map(|p| p.depth as f32),
                    normals: three.map(|c| c.1),
                    color: three.map(|c| c.2),
                });
            }
        }
    }

    /// Cuts a polygon at the near plane, so that a floor may run past the eye.
    fn clip(&self, polygon: &[(Vector3<f64>, [f32; 3], Color)]) -> Vec<(Vector3<f64>, [f32; 3], Color)> {
        let near = self.camera.near_depth();
        let inside = |p: &Vector3<f64>| self.camera.project(p).depth - near;
        let mut kept = Vec::with_capacity(4);
        for k in 0..polygon.len() {
            let (a, b) = (&polygon[k], &polygon[(k + 1) % polygon.len()]);
            let (da, db) = (inside(&a.0), inside(&b.0));
            if da > 0.0 {
                kept.push(*a);
            }
            if (da > 0.0) != (db > 0.0) {
                kept.push((a.0 + (b.0 - a.0) * (da / (da - db)), a.1, a.2));
            }
        }
        kept
    }
}

/// Whether a triangle shows its back: its corners, seen from outside, run against the clock, and rows count downwards.
fn turned_away([a, b, c]: [[f32; 2]; 3]) -> bool {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0
}

/// Which points end a segment of a force chain.
fn strong(piece: &Piece) -> Vec<bool> {
    let (Topology::Segments(pairs), Some(chain)) = (&piece.topology, cell_numbers(piece, "chain")) else {
        return Vec::new();
    };
    let mut strong = vec![false; piece.positions.len()];
    for (pair, _) in pairs.iter().zip(chain).filter(|(_, chain)| **chain != 0) {
        pair.iter().for_each(|&i| strong[i as usize] = true);
    }
    strong
}

fn colors(piece: &Piece, by: &ColorBy) -> Vec<Color> {
    let n = piece.positions.len();
    if let ColorBy::Field { name, low, high } = by {
        let Some(field) = piece.point_field(name) else {
            let grey = if piece.name == "solids" { of_piece("solids", 0, 1) } else { linear([150, 150, 155]) };
            return vec![grey; n];
        };
        let width = if high > low { high - low } else { 1.0 };
        return (0..n).map(|i| linear(colormap((scalar(field, i) - low) / width))).collect();
    }
    match &piece.topology {
        Topology::Polylines { offsets } => {
            let count = offsets.len().saturating_sub(1);
            let mut colors = Vec::with_capacity(n);
            for (line, pair) in offsets.windows(2).enumerate() {
                colors.resize(pair[1] as usize, of_piece(&piece.name, line, count));
            }
            colors
        }
        Topology::Points => {
            let id =
                |i: usize| match piece.point_field("particle").or(piece.point_field("id")).map(|field| &field.values) {
                    Some(FieldValues::I64(ids)) => ids.get(i).map_or(i, |&id| id.unsigned_abs() as usize),
                    _ => i,
                };
            (0..n).map(|i| of_piece(&piece.name, id(i), n)).collect()
        }
        Topology::Segments(pairs) => {
            let mut colors = vec![of_piece(&piece.name, 0, 1); n];
            for (pair, &state) in pairs.iter().zip(cell_numbers(piece, "state").unwrap_or_default()) {
                if let Some(color) = of_state(state) {
                    pair.iter().for_each(|&i| colors[i as usize] = color);
                }
            }
            colors
        }
        Topology::Triangles(_) | Topology::Lattice { .. } => vec![of_piece(&piece.name, 0, 1); n],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::PictureOptions;
    use crate::picture::camera::Framing;

    /// Depths of the triangles that are drawn of a shape.
    fn drawn(shape: &geometry::Shape) -> Vec<f64> {
        let mesh = shape.tessellate(16, 1.0);
        let solids = Piece {
            name: "solids".to_owned(),
            topology: Topology::Triangles(mesh.triangles.clone()),
            positions: mesh.positions.iter().map(|x| [x.x, x.y, x.z]).collect(),
            point_fields: Vec::new(),
            cell_fields: Vec::new(),
        };
        let frame = Frame { time: 0.0, step: 0, pieces: vec![solids] };
        let mut framing = Framing::default();
        framing.include(&frame);
        let options = PictureOptions::default();
        let camera = Camera::new(&framing, &options);
        let all = collect(&frame, &camera, &options.color, 1);
        all.triangles.iter().map(|t| f64::from(t.depth.iter().sum::<f32>() / 3.0)).collect()
    }

    #[test]
    fn of_a_body_the_near_sides_are_drawn_and_of_a_container_the_far_ones() {
        let ball = geometry::Shape::Sphere { center: Vector3::zeros(), radius: 1.0 };
        let body = drawn(&ball);
        let container = drawn(&geometry::Shape::Complement(Box::new(ball.clone())));
        assert_eq!(body.len() + container.len(), ball.tessellate(16, 1.0).triangles.len());
        assert!(!body.is_empty() && !container.is_empty());
        let nearest = |depths: &[f64]| depths.iter().copied().fold(f64::INFINITY, f64::min);
        let farthest = |depths: &[f64]| depths.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        assert!(nearest(&body) < nearest(&container) && farthest(&body) < farthest(&container));
    }

    /// Coloured by a field, what lies on the strands without having it is left out; of many contacts the balls are small.
    #[test]
    fn contacts_and_films_do_not_hide_strands() {
        let line = |name: &str| Piece {
            name: name.to_owned(),
            topology: Topology::Polylines { offsets: vec![0, 2] },
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0]],
            point_fields: Vec::new(),
            cell_fields: Vec::new(),
        };
        let contacts = |count: usize| Piece {
            topology: Topology::Points,
            positions: vec![[0.5, 0.0, 0.0]; count],
            ..line("contacts")
        };
        let fast = Piece {
            point_fields: vec![crate::record::frame::Field::vector("velocity", &[[1.0; 3]; 2])],
            ..line("strands")
        };
        let capsules = |count: usize, color: &ColorBy| {
            let frame = Frame { time: 0.0, step: 0, pieces: vec![fast.clone(), line("films"), contacts(count)] };
            let mut framing = Framing::default();
            framing.include(&frame);
            collect(&frame, &Camera::new(&framing, &PictureOptions::default()), color, 1).capsules
        };
        let (few, many) = (capsules(1, &ColorBy::Piece), capsules(50 * 27, &ColorBy::Piece));
        assert_eq!((few.len(), many.len()), (3, 2 + 50 * 27));
        assert!(many[2].rise < few[2].rise);
        let velocity = ColorBy::Field { name: "velocity".into(), low: 0.0, high: 1.0 };
        assert_eq!(capsules(1, &velocity).len(), 1);
    }
}
