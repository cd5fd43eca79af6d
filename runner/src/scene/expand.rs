//! From the groups of a scene to single strands: vertices, radii, clamps, rest shapes, starting velocities.

use super::error::{Problem, ProblemKind};
pub use super::generators::counts;
use super::generators::{centrelines, place};
use super::materials::Material;
use super::motion::Motion;
use super::strands::{Along, Clamp, ClampTwist, RestShape, StrandGroup};
use super::tree::Span;
use super::{Scene, presets};
use nalgebra::Vector3;

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
    /// These vertices \[m\].
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
    /// Centre of turns that name none: the mean of the held vertices of the whole group at the start \[m\].
    pub center: Vector3<f64>,
    /// When it lets go \[s\].
    pub until: Option<f64>,
}

/// One strand, in SI.
#[derive(Clone, Debug, PartialEq)]
pub struct StrandGeometry {
    /// Its group in the scene.
    pub group: usize,
    /// Its place in the group.
    pub index: usize,
    /// Vertices \[m\], root first; at least two.
    pub positions: Vec<Vector3<f64>>,
    /// Velocities at the start [m/s], one per vertex.
    pub velocities: Vec<Vector3<f64>>,
    /// Half-width along the first director \[m\], one per vertex.
    pub radius: Vec<f64>,
    /// Half-width along the second director \[m\], one per vertex.
    pub second_radius: Vec<f64>,
    /// Factor on Young's modulus, one per vertex.
    pub stiffness: Vec<f64>,
    /// Turn of the section about the centreline \[rad\].
    pub section_angle: f64,
    /// Wish for the first director of the first edge (unit vector).
    pub director: Option<Vector3<f64>>,
    /// Twist put in at the start from first to last edge \[rad\].
    pub twist: f64,
    /// Shape without load.
    pub rest: RestGeometry,
    /// Held vertices.
    pub clamps: Vec<ClampGeometry>,
    /// Film height at the start \[m\], one per vertex; empty without a film.
    pub film_height: Vec<f64>,
}

/// Memory of a run per strand vertex \[bytes\], for estimates.
pub const BYTES_PER_VERTEX: f64 = 1536.0;
/// Memory of a run per liquid particle \[bytes\], for estimates.
pub const BYTES_PER_PARTICLE: f64 = 800.0;
/// Scenes that need more memory than this are refused \[bytes\].
pub const MEMORY_LIMIT: f64 = 256.0 * 1024.0 * 1024.0 * 1024.0;

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
        for (index, (points, scale)) in centrelines(scene, group, description)?.into_iter().enumerate() {
            strands.push(strand(scene, description, group, index, points, scale));
        }
        set_clamps(scene, description, &mut strands[first..]);
    }
    Ok(strands)
}

/// The radius a group's strands have when it names none: that of its material's preset.
pub(super) fn usual_radius(scene: &Scene, group: &StrandGroup) -> Option<f64> {
    match scene.materials.get(&group.material)? {
        Material::Fibre(fibre) => presets::fibre(fibre.preset.as_ref()?).map(|preset| preset.radius),
        Material::Liquid(_) | Material::Yarn(_) => None,
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
