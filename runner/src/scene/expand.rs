//! From the groups of a scene to single strands: vertices, radii, clamps, rest shapes, starting velocities.

use super::error::{Problem, ProblemKind};
use super::motion::Motion;
use super::random::{Channel, factor, uniform};
use super::strands::{
    Along, Clamp, ClampTwist, Curl, Handedness, Placement, RestShape, Spread, StrandGroup, StrandShape,
};
use super::tree::Span;
use super::{Scene, obj, presets};
use crate::scene::materials::Material;
use nalgebra::{Rotation3, Vector3};
use std::f64::consts::{FRAC_PI_3, TAU};

/// The shape of one strand without load.
#[derive(Clone, Debug, PartialEq)]
pub enum RestGeometry {
    /// The shape it is given in.
    AsGiven,
    /// Straight and untwisted, edges as long as given.
    Straight,
    /// Curvatures [1/m] towards the two material directors and twist [rad/m], edges as long as given.
    Curvature {
        /// Towards the first director [1/m].
        first: f64,
        /// Towards the second director [1/m].
        second: f64,
        /// Twist [rad/m].
        twist: f64,
    },
    /// The shape for which the given one is in equilibrium under gravity.
    Sagfree,
    /// These vertices [m].
    Polyline(Vec<Vector3<f64>>),
}

/// Vertices of a strand that are held, or moved as prescribed.
#[derive(Clone, Debug, PartialEq)]
pub struct ClampGeometry {
    /// Held vertices, ascending.
    pub vertices: Vec<usize>,
    /// Edges whose twist is held (both ends are in `vertices`), ascending.
    pub edges: Vec<usize>,
    /// Motion; empty: at rest.
    pub motion: Vec<Motion>,
    /// Centre of turns that name none: the mean of the held vertices of the whole group at the start [m].
    pub center: Vector3<f64>,
    /// When it lets go [s].
    pub until: Option<f64>,
}

/// One strand, in SI.
#[derive(Clone, Debug, PartialEq)]
pub struct StrandGeometry {
    /// Its group in the scene.
    pub group: usize,
    /// Its place in the group.
    pub index: usize,
    /// Vertices [m], root first; at least two.
    pub positions: Vec<Vector3<f64>>,
    /// Velocities at the start [m/s], one per vertex.
    pub velocities: Vec<Vector3<f64>>,
    /// Half-width along the first director [m], one per vertex.
    pub radius: Vec<f64>,
    /// Half-width along the second director [m], one per vertex.
    pub second_radius: Vec<f64>,
    /// Factor on Young's modulus, one per vertex.
    pub stiffness: Vec<f64>,
    /// Turn of the section about the centreline [rad].
    pub section_angle: f64,
    /// Wish for the first director of the first edge (unit vector).
    pub director: Option<Vector3<f64>>,
    /// Twist put in at the start from first to last edge [rad].
    pub twist: f64,
    /// Shape without load.
    pub rest: RestGeometry,
    /// Held vertices.
    pub clamps: Vec<ClampGeometry>,
    /// Film height at the start [m], one per vertex; empty without a film.
    pub film_height: Vec<f64>,
}

/// Memory of a run per strand vertex [bytes], for estimates.
pub const BYTES_PER_VERTEX: f64 = 1536.0;
/// Memory of a run per liquid particle [bytes], for estimates.
pub const BYTES_PER_PARTICLE: f64 = 800.0;
/// Scenes that need more memory than this are refused [bytes].
pub const MEMORY_LIMIT: f64 = 256.0 * 1024.0 * 1024.0 * 1024.0;

/// The number of strands of a group and of vertices of each, without making them; `None` for strands from a file.
#[must_use]
pub fn counts(shape: &StrandShape) -> Option<(usize, usize)> {
    Some(match shape {
        StrandShape::Polyline(shape) => (1, shape.points.len()),
        StrandShape::Straight(shape) => (1, shape.vertices),
        StrandShape::Helix(shape) => (1, shape.vertices),
        StrandShape::Circle(shape) => (1, shape.vertices),
        StrandShape::Arc(shape) => (1, shape.vertices),
        StrandShape::HexBundle(shape) => (shape.count, shape.vertices),
        StrandShape::Wisp(shape) => (shape.count, shape.vertices),
        StrandShape::Bundle(shape) => (shape.count, shape.vertices),
        StrandShape::Obj(_) => return None,
    })
}

/// A number of bytes for a reader: `3.1 TB`.
#[must_use]
pub fn show_bytes(bytes: f64) -> String {
    let units = ["B", "kB", "MB", "GB", "TB", "PB", "EB"];
    let mut value = bytes;
    let mut unit = 0;
    while value >= 1000.0 && unit + 1 < units.len() {
        value /= 1000.0;
        unit += 1;
    }
    if value < 1e4 { format!("{value:.1} {}", units[unit]) } else { format!("{value:.1e} {}", units[unit]) }
}

/// Makes every strand of a scene, group by group.
///
/// # Errors
/// When a file of polylines cannot be read, or when the strands would need more memory than any machine has (said with
/// the estimate, before anything is allocated).
pub fn expand(scene: &Scene) -> Result<Vec<StrandGeometry>, Problem> {
    #[allow(clippy::cast_precision_loss)]
    let vertices: f64 = scene
        .strands
        .iter()
        .filter_map(|group| counts(&group.shape))
        .map(|(strands, vertices)| strands as f64 * vertices as f64)
        .sum();
    let bytes = vertices * BYTES_PER_VERTEX;
    if bytes > MEMORY_LIMIT {
        let message =
            format!("the strands have {vertices:.3e} vertices and need about {} of memory", show_bytes(bytes));
        return Err(Problem::new(ProblemKind::TooLarge, message, Span::NONE, &[]).at("strands"));
    }
    let mut strands = Vec::new();
    for (group, description) in scene.strands.iter().enumerate() {
        let first = strands.len();
        for (index, (points, scale)) in centrelines(scene, group)?.into_iter().enumerate() {
            strands.push(strand(scene, description, group, index, points, scale));
        }
        set_clamps(scene, description, &mut strands[first..]);
    }
    Ok(strands)
}

/// The centrelines of a group, each with the factor on its radius.
pub(super) fn centrelines(scene: &Scene, group: usize) -> Result<Vec<(Vec<Vector3<f64>>, f64)>, Problem> {
    let description = &scene.strands[group];
    let seed = scene.seed;
    let mut lines: Vec<(Vec<Vector3<f64>>, f64)> = match &description.shape {
        StrandShape::Polyline(shape) => vec![(shape.points.clone(), 1.0)],
        StrandShape::Straight(shape) => {
            let line = match &shape.spacing {
                None => straight(shape.from, shape.to, shape.vertices),
                Some(spacing) => {
                    let total: f64 = spacing.iter().sum();
                    let mut sum = 0.0;
                    let mut line = vec![shape.from];
                    for (i, share) in spacing.iter().enumerate() {
                        sum += share;
                        let fraction = if i + 1 == spacing.len() { 1.0 } else { sum / total };
                        line.push(shape.from + (shape.to - shape.from) * fraction);
                    }
                    line
                }
            };
            vec![(line, 1.0)]
        }
        StrandShape::Helix(shape) => {
            let sense = if shape.hand == Handedness::Right { 1.0 } else { -1.0 };
            let line = coil(
                Coil {
                    center: shape.center,
                    axis: shape.axis.0,
                    radius: shape.radius,
                    rise: shape.pitch * shape.turns,
                    start: shape.start,
                    angle: sense * TAU * shape.turns,
                },
                shape.vertices,
            );
            vec![(line, 1.0)]
        }
        StrandShape::Circle(shape) => {
            let coiled = Coil {
                center: shape.center,
                axis: shape.axis.0,
                radius: shape.radius,
                rise: 0.0,
                start: shape.start,
                angle: TAU,
            };
            let mut line = coil(coiled, shape.vertices);
            if let Some(last) = line.len().checked_sub(1) {
                line[last] = line[0];
            }
            vec![(line, 1.0)]
        }
        StrandShape::Arc(shape) => {
            let coiled = Coil {
                center: shape.center,
                axis: shape.axis.0,
                radius: shape.radius,
                rise: 0.0,
                start: shape.start,
                angle: shape.angle,
            };
            vec![(coil(coiled, shape.vertices), 1.0)]
        }
        StrandShape::HexBundle(shape) => {
            let (normal, binormal) = frame((shape.to - shape.from).normalize());
            hexagonal(shape.count)
                .into_iter()
                .map(|(x, y)| {
                    let offset = (binormal * x + normal * y) * shape.spacing;
                    (straight(shape.from + offset, shape.to + offset, shape.vertices), 1.0)
                })
                .collect()
        }
        StrandShape::Wisp(shape) => {
            let tip = shape.root + shape.direction.0 * shape.length;
            let discs = (shape.disc, shape.tip_disc.unwrap_or(shape.disc));
            let grower =
                Grower { seed, group, root: shape.root, tip, discs, curl: shape.curl.as_ref(), spread: &shape.spread };
            (0..shape.count).map(|index| grower.grow(index, shape.vertices)).collect()
        }
        StrandShape::Bundle(shape) => {
            let discs = (shape.disc, shape.disc);
            let grower = Grower {
                seed,
                group,
                root: shape.from,
                tip: shape.to,
                discs,
                curl: shape.curl.as_ref(),
                spread: &shape.spread,
            };
            (0..shape.count).map(|index| grower.grow(index, shape.vertices)).collect()
        }
        StrandShape::Obj(shape) => {
            let lines = obj::read(&shape.file.path).map_err(|message| {
                Problem::new(ProblemKind::File, message, Span::NONE, &[]).at(format!("strands[{group}].shape.file"))
            })?;
            let unit = super::quantity::Quantity::Length.to_si(shape.scale, scene.unit_system());
            lines.into_iter().map(|line| (line.into_iter().map(|point| point * unit).collect(), 1.0)).collect()
        }
    };
    for (line, _) in &mut lines {
        place(&description.placement, line);
    }
    Ok(lines)
}

fn place(placement: &Placement, line: &mut [Vector3<f64>]) {
    let turn = Rotation3::new(placement.rotate);
    let still = placement.rotate == Vector3::zeros();
    for point in line {
        let scaled = point.component_mul(&placement.scale.0);
        *point = if still { scaled } else { turn * scaled } + placement.translate;
    }
}

/// Two unit vectors at right angles to `direction` and to each other, right-handed: `direction × first = second`.
pub(super) fn frame(direction: Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    // The coordinate axis least along the direction, x before y before z among equals.
    let least = (0..3).fold(0, |best, i| if direction[i].abs() < direction[best].abs() { i } else { best });
    let mut helper = Vector3::zeros();
    helper[least] = 1.0;
    let first = (helper - direction * direction[least]).normalize();
    (first, direction.cross(&first))
}

#[allow(clippy::cast_precision_loss)]
fn fraction(vertex: usize, vertices: usize) -> f64 {
    if vertices < 2 { 0.0 } else { vertex as f64 / (vertices - 1) as f64 }
}

fn straight(from: Vector3<f64>, to: Vector3<f64>, vertices: usize) -> Vec<Vector3<f64>> {
    (0..vertices)
        .map(|i| {
            let s = fraction(i, vertices);
            from * (1.0 - s) + to * s
        })
        .collect()
}

struct Coil {
    center: Vector3<f64>,
    axis: Vector3<f64>,
    radius: f64,
    rise: f64,
    start: f64,
    angle: f64,
}

fn coil(shape: Coil, vertices: usize) -> Vec<Vector3<f64>> {
    let (first, second) = frame(shape.axis);
    (0..vertices)
        .map(|i| {
            let s = fraction(i, vertices);
            let (sin, cos) = (shape.start + shape.angle * s).sin_cos();
            shape.center + shape.axis * (shape.rise * s) + (first * cos + second * sin) * shape.radius
        })
        .collect()
}

/// The first `count` points of the hexagonal lattice with unit spacing, ring by ring from the middle.
fn hexagonal(count: usize) -> Vec<(f64, f64)> {
    let corner = |k: usize| {
        let (sin, cos) = (FRAC_PI_3 * (k % 6) as f64).sin_cos();
        (cos, sin)
    };
    let mut points = vec![(0.0, 0.0)];
    let mut ring = 1;
    while points.len() < count {
        #[allow(clippy::cast_precision_loss)]
        for side in 0..6 {
            let (x0, y0) = corner(side);
            let (x1, y1) = corner(side + 1);
            for step in 0..ring {
                let (a, b) = ((ring - step) as f64, step as f64);
                points.push((x0 * a + x1 * b, y0 * a + y1 * b));
            }
        }
        ring += 1;
    }
    points.truncate(count);
    points
}

/// Makes the strands of a wisp or bundle.
struct Grower<'a> {
    seed: u64,
    group: usize,
    root: Vector3<f64>,
    tip: Vector3<f64>,
    discs: (f64, f64),
    curl: Option<&'a Curl>,
    spread: &'a Spread,
}

impl Grower<'_> {
    fn grow(&self, index: usize, vertices: usize) -> (Vec<Vector3<f64>>, f64) {
        let draw = |channel| uniform(self.seed, self.group, index, channel);
        let vary = |spread, channel| factor(spread, self.seed, self.group, index, channel);
        let axis = (self.tip - self.root).normalize();
        let (first, second) = frame(axis);
        // Square root: even over the area of the disc.
        let (sin, cos) = (TAU * draw(Channel::DiscAngle)).sin_cos();
        let offset = (first * cos + second * sin) * draw(Channel::DiscRadius).sqrt();
        let root = self.root + offset * self.discs.0;
        let tip = self.tip + offset * self.discs.1;
        let length = (tip - root).norm() * vary(self.spread.length, Channel::Length);
        let mut direction = (tip - root).normalize();
        if self.spread.direction > 0.0 {
            let (first, second) = frame(direction);
            let (sin, cos) = (TAU * draw(Channel::Azimuth)).sin_cos();
            let (tilt_sin, tilt_cos) = (self.spread.direction * draw(Channel::Tilt).sqrt()).sin_cos();
            direction = (direction * tilt_cos + (first * cos + second * sin) * tilt_sin).normalize();
        }
        let line = match self.curl {
            None => straight(root, root + direction * length, vertices),
            Some(curl) => {
                let size = vary(self.spread.curl, Channel::Curl);
                let (radius, pitch) = (curl.radius * size, curl.pitch * size);
                let phase = curl.phase_spread * draw(Channel::Phase);
                let (first, second) = frame(direction);
                let bend = |s: f64| {
                    let grown = if curl.onset > 0.0 { (s / curl.onset).min(1.0) } else { 1.0 };
                    let (sin, cos) = (TAU * s / pitch + phase).sin_cos();
                    (first * cos + second * sin) * (radius * grown * grown * (3.0 - 2.0 * grown))
                };
                let at_root = bend(0.0);
                (0..vertices)
                    .map(|i| {
                        let s = length * fraction(i, vertices);
                        root + direction * s + bend(s) - at_root
                    })
                    .collect()
            }
        };
        (line, vary(self.spread.radius, Channel::Radius))
    }
}

/// The radius a group's strands have when it names none: that of its material's preset.
pub(super) fn usual_radius(scene: &Scene, group: &StrandGroup) -> Option<f64> {
    match scene.materials.get(&group.material)? {
        Material::Fibre(fibre) => presets::fibre(fibre.preset.as_ref()?).map(|preset| preset.radius),
        Material::Liquid(_) => None,
    }
}

fn strand(
    scene: &Scene,
    group: &StrandGroup,
    group_index: usize,
    index: usize,
    positions: Vec<Vector3<f64>>,
    radius_factor: f64,
) -> StrandGeometry {
    let n = positions.len();
    let mut arc = vec![0.0; n];
    for i in 1..n {
        arc[i] = arc[i - 1] + (positions[i] - positions[i - 1]).norm();
    }
    let total = arc.last().copied().filter(|&total| total > 0.0).unwrap_or(1.0);
    let along = |quantity: &Along| -> Vec<f64> { (0..n).map(|i| quantity.at(arc[i] / total, i)).collect() };
    let usual = Along::Constant(usual_radius(scene, group).unwrap_or(5e-5));
    let scaled =
        |quantity: &Along| -> Vec<f64> { along(quantity).into_iter().map(|value| value * radius_factor).collect() };
    let radius = scaled(group.radius.as_ref().unwrap_or(&usual));
    let second_radius = group.second_radius.as_ref().map_or_else(|| radius.clone(), scaled);

    let mut velocities = vec![group.velocity; n];
    if let Some(spin) = &group.spin {
        let center = spin.center.unwrap_or_else(|| center_of_mass(&positions, &arc, &radius, &second_radius));
        for (velocity, position) in velocities.iter_mut().zip(&positions) {
            *velocity += (spin.axis.0 * spin.rate).cross(&(position - center));
        }
    }
    let rest = match &group.rest {
        RestShape::AsGiven => RestGeometry::AsGiven,
        RestShape::Straight => RestGeometry::Straight,
        RestShape::Sagfree => RestGeometry::Sagfree,
        RestShape::Curvature(natural) => {
            RestGeometry::Curvature { first: natural.first, second: natural.second, twist: natural.twist }
        }
        RestShape::Polyline(shape) => {
            let mut points = shape.points.clone();
            place(&group.placement, &mut points);
            RestGeometry::Polyline(points)
        }
    };
    StrandGeometry {
        group: group_index,
        index,
        velocities,
        second_radius,
        radius,
        stiffness: along(&group.stiffness),
        section_angle: group.section_angle,
        director: group.director.map(|axis| axis.0),
        twist: group.twist,
        rest,
        clamps: Vec::new(),
        film_height: group.film.as_ref().map_or_else(Vec::new, |film| along(&film.height)),
        positions,
    }
}

fn center_of_mass(positions: &[Vector3<f64>], arc: &[f64], radius: &[f64], second_radius: &[f64]) -> Vector3<f64> {
    let n = positions.len();
    let mut sum = Vector3::zeros();
    let mut mass = 0.0;
    for i in 0..n {
        let length = 0.5 * (arc[(i + 1).min(n - 1)] - arc[i.saturating_sub(1)]);
        let weight = length * radius[i] * second_radius[i];
        sum += positions[i] * weight;
        mass += weight;
    }
    if mass > 0.0 { sum / mass } else { positions[0] }
}

/// The vertices a clamp holds on a strand of `n` vertices, ascending, without repetition.
pub(super) fn held_vertices(clamp: &Clamp, n: usize) -> Vec<usize> {
    let mut vertices: Vec<usize> = match clamp {
        Clamp::First(end) => (0..end.count.min(n)).collect(),
        Clamp::Last(end) => (n - end.count.min(n)..n).collect(),
        Clamp::Vertices(list) => list.vertices.iter().copied().filter(|&vertex| vertex < n).collect(),
    };
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}

fn set_clamps(scene: &Scene, group: &StrandGroup, strands: &mut [StrandGeometry]) {
    for clamp in &group.clamp {
        let (twist, script, until) = match clamp {
            Clamp::First(end) | Clamp::Last(end) => (&end.twist, &end.motion, end.until),
            Clamp::Vertices(list) => (&list.twist, &list.motion, list.until),
        };
        let motion = scene.script(script.as_ref().unwrap_or(&group.motion)).to_vec();
        let mut sum = Vector3::zeros();
        let mut count = 0.0;
        for strand in &*strands {
            for vertex in held_vertices(clamp, strand.positions.len()) {
                sum += strand.positions[vertex];
                count += 1.0;
            }
        }
        let center = if count > 0.0 { sum / count } else { sum };
        for strand in &mut *strands {
            let vertices = held_vertices(clamp, strand.positions.len());
            let edges = match twist {
                ClampTwist::Held => {
                    vertices.windows(2).filter(|pair| pair[1] == pair[0] + 1).map(|pair| pair[0]).collect()
                }
                ClampTwist::Free => Vec::new(),
            };
            strand.clamps.push(ClampGeometry { vertices, edges, motion: motion.clone(), center, until });
        }
    }
}
