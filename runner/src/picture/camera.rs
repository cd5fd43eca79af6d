//! What is in view, and where a point falls in the picture.

use nalgebra::Vector3;

use super::PictureOptions;
use crate::record::frame::{Field, FieldValues, Frame, Piece, Topology};

/// Everything that moves must be in view; a run that blows up may not shrink the rest to a dot beyond this factor.
const LARGEST_GROWTH: f64 = 6.0;
/// Share of the picture left free at each edge.
const MARGIN: f64 = 0.06;

/// The region to show, gathered over the frames of a run.
#[derive(Clone, Debug, Default)]
pub struct Framing {
    first: Option<Bounds>,
    all: Option<Bounds>,
    fallback: Option<Bounds>,
    left_out: usize,
}

#[derive(Clone, Copy, Debug)]
struct Bounds {
    min: Vector3<f64>,
    max: Vector3<f64>,
}

impl Bounds {
    fn merge(self, other: Bounds) -> Bounds {
        Bounds { min: self.min.inf(&other.min), max: self.max.sup(&other.max) }
    }

    fn diagonal(&self) -> f64 {
        (self.max - self.min).norm()
    }
}

fn bounds_of(piece: &Piece, left_out: &mut usize) -> Option<Bounds> {
    let radius = piece.point_field("radius");
    let mut bounds: Option<Bounds> = None;
    // discs in a plane have no thickness: they are seen at right angles
    let in_plane = piece.positions.len() > 1 && piece.positions.iter().all(|x| x[2] == 0.0);
    let plane = in_plane && (matches!(piece.topology, Topology::Points) || piece.name == "yarns");
    for (i, position) in piece.positions.iter().enumerate() {
        if !position.iter().all(|x| x.is_finite()) {
            *left_out += 1;
            continue;
        }
        let r = radius.map_or(0.0, |field| scalar(field, i));
        let r = if r.is_finite() { Vector3::new(r, r, if plane { 0.0 } else { r }) } else { Vector3::zeros() };
        let p = Vector3::from(*position);
        let own = Bounds { min: p - r, max: p + r };
        bounds = Some(bounds.map_or(own, |b| b.merge(own)));
    }
    bounds
}

/// Value of a scalar field at a point, the norm of a vector's.
pub(super) fn scalar(field: &Field, i: usize) -> f64 {
    let n = field.components;
    match &field.values {
        FieldValues::F64(values) if n == 1 => values.get(i).copied().unwrap_or(0.0),
        FieldValues::F64(values) => {
            values.get(i * n..(i + 1) * n).map_or(0.0, |v| v.iter().map(|x| x * x).sum::<f64>().sqrt())
        }
        FieldValues::I64(values) => values.get(i * n).map_or(0.0, |&v| v as f64),
    }
}

impl Framing {
    /// Adds what a frame shows. Solids count only where nothing else is there: a floor has no end.
    pub fn include(&mut self, frame: &Frame) {
        let mut moving: Option<Bounds> = None;
        for piece in frame.pieces.iter().filter(|p| !matches!(p.topology, Topology::Lattice { .. })) {
            let Some(bounds) = bounds_of(piece, &mut self.left_out) else { continue };
            let to = if piece.name == "solids" { &mut self.fallback } else { &mut moving };
            *to = Some(to.map_or(bounds, |b| b.merge(bounds)));
        }
        if let Some(bounds) = moving {
            self.first.get_or_insert(bounds);
            self.all = Some(self.all.map_or(bounds, |b| b.merge(bounds)));
        }
    }

    /// How many points were not finite.
    #[must_use]
    pub fn left_out(&self) -> usize {
        self.left_out
    }

    /// Whether the run spread so far that the view does not hold all of it.
    #[must_use]
    pub fn is_clipped(&self) -> bool {
        matches!((self.first, self.all), (Some(first), Some(all)) if all.diagonal() > LARGEST_GROWTH * first.diagonal().max(1e-300) * 1.000_001)
    }

    fn bounds(&self) -> Bounds {
        let unit = Bounds { min: Vector3::repeat(-0.5), max: Vector3::repeat(0.5) };
        let Some(all) = self.all.or(self.fallback) else { return unit };
        let bounds = match self.first {
            Some(first) if self.is_clipped() && first.diagonal() > 0.0 => {
                let center = (first.min + first.max) * 0.5;
                let reach = Vector3::repeat(0.5 * LARGEST_GROWTH * first.diagonal());
                Bounds { min: all.min.sup(&(center - reach)), max: all.max.inf(&(center + reach)) }
            }
            _ => all,
        };
        if bounds.diagonal() > 0.0 && bounds.diagonal().is_finite() {
            return bounds;
        }
        let half = Vector3::repeat(0.5 * bounds.min.amax().clamp(1e-6, 1e12) * 1e-3);
        Bounds { min: bounds.min - half, max: bounds.max + half }
    }
}

/// A fixed view.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Right, up and towards the eye.
    pub(super) axes: [Vector3<f64>; 3],
    center: Vector3<f64>,
    /// Distance of the eye from the centre [m]; infinite for parallel projection.
    distance: f64,
    /// Pixels per metre at the centre's depth.
    scale: f64,
    /// Half the diagonal of what is shown [m].
    pub(super) reach: f64,
}

/// A point in the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Projected {
    /// Pixels from the left.
    pub x: f64,
    /// Pixels from the top.
    pub y: f64,
    /// Depth behind the centre [m]; grows away from the eye.
    pub depth: f64,
    /// Pixels per metre there.
    pub scale: f64,
}

impl Camera {
    /// The view that shows the whole framing.
    #[must_use]
    pub fn new(framing: &Framing, options: &PictureOptions) -> Camera {
        let (width, height) = (options.width.max(16), options.height.max(16));
        let bounds = framing.bounds();
        let size = bounds.max - bounds.min;
        let up = Vector3::from(options.up).try_normalize(1e-12).unwrap_or_else(Vector3::y);
        let flat = (0..3).find(|&k| size[k] < 1e-3 * size.amax() && (options.from.is_none()));
        let flat = flat.filter(|&k| up[k].abs() < 0.5 && (0..3).all(|j| j == k || size[j] > 0.05 * size.amax()));
        let toward_eye = match (options.from, flat) {
            (Some(from), _) => Vector3::from(from).try_normalize(1e-12).unwrap_or_else(Vector3::z),
            (None, Some(k)) => Vector3::from_fn(|j, _| if j == k { 1.0 } else { 0.0 }),
            (None, None) => default_direction(&size, &up),
        };
        let right = up
            .cross(&toward_eye)
            .try_normalize(1e-6)
            .unwrap_or_else(|| toward_eye.cross(&Vector3::x()).try_normalize(1e-6).unwrap_or_else(Vector3::x));
        let axes = [right, toward_eye.cross(&right), toward_eye];
        let center = (bounds.min + bounds.max) * 0.5;
        let corners: Vec<[f64; 3]> = (0..8)
            .map(|c| {
                let corner =
                    Vector3::from_fn(|k, _| if c >> k & 1 == 0 { bounds.min[k] } else { bounds.max[k] }) - center;
                axes.map(|axis| axis.dot(&corner))
            })
            .collect();
        let reach = 0.5 * size.norm();
        let (free_x, free_y) = (0.5 * width as f64 * (1.0 - 2.0 * MARGIN), 0.5 * height as f64 * (1.0 - 2.0 * MARGIN));
        let distance = if flat.is_some() { f64::INFINITY } else { 6.0 * reach };
        // The smallest scale at which every corner, at its own depth, stays within the margins.
        let near = |z: f64| if distance.is_finite() { distance / (distance - z) } else { 1.0 };
        let scale = corners
            .iter()
            .map(|c| (free_x / (c[0] * near(c[2])).abs()).min(free_y / (c[1] * near(c[2])).abs()))
            .fold(f64::INFINITY, f64::min);
        let scale = if scale.is_finite() { scale } else { free_y / reach.max(1e-300) };
        Camera { width, height, axes, center, distance, scale, reach }
    }

    pub(super) fn project(&self, point: &Vector3<f64>) -> Projected {
        let offset = point - self.center;
        let [x, y, z] = self.axes.map(|axis| axis.dot(&offset));
        let scale =
            if self.distance.is_finite() { self.scale * self.distance / (self.distance - z) } else { self.scale };
        Projected { x: 0.5 * self.width as f64 + x * scale, y: 0.5 * self.height as f64 - y * scale, depth: -z, scale }
    }

    /// The point [m] at a place in the picture and a depth.
    pub(super) fn unproject(&self, x: f64, y: f64, depth: f64) -> Vector3<f64> {
        let scale =
            if self.distance.is_finite() { self.scale * self.distance / (self.distance + depth) } else { self.scale };
        let (a, b) = ((x - 0.5 * self.width as f64) / scale, (0.5 * self.height as f64 - y) / scale);
        self.center + self.axes[0] * a + self.axes[1] * b - self.axes[2] * depth
    }

    /// Distance of the eye from the centre [m].
    pub(super) fn eye_distance(&self) -> f64 {
        self.distance
    }

    /// From 0 within the scene to 1 far outside it.
    pub(super) fn remoteness(&self, place: &Vector3<f64>) -> f32 {
        let away = ((place - self.center).norm() / self.reach - 1.3) / 2.2;
        let u = away.clamp(0.0, 1.0) as f32;
        u * u * (3.0 - 2.0 * u)
    }

    /// The same scene as seen from a light, given by its direction in this camera's axes, on a square of `side` pixels.
    pub(super) fn seen_from_light(&self, direction: [f32; 3], side: usize) -> Camera {
        let toward = (0..3).map(|k| self.axes[k] * f64::from(direction[k])).sum::<Vector3<f64>>().normalize();
        let right = self.axes[1].cross(&toward).try_normalize(1e-6).unwrap_or(self.axes[0]);
        let axes = [right, toward.cross(&right), toward];
        let scale = 0.5 * side as f64 / (1.2 * self.reach.max(1e-300));
        Camera {
            width: side,
            height: side,
            axes,
            center: self.center,
            distance: f64::INFINITY,
            scale,
            reach: self.reach,
        }
    }

    /// Depth of the nearest point that can be drawn [m].
    pub(super) fn near_depth(&self) -> f64 {
        if self.distance.is_finite() { -0.95 * self.distance } else { f64::NEG_INFINITY }
    }

    /// A round length that spans between a tenth and a third of the picture's width [m], and how many pixels that is.
    #[must_use]
    pub fn scale_bar(&self) -> (f64, f64) {
        let target = 0.25 * self.width as f64 / self.scale;
        let power = 10f64.powf(target.log10().floor());
        let length = [5.0, 2.0, 1.0].map(|k| k * power).into_iter().find(|l| *l <= target).unwrap_or(power);
        (length, length * self.scale)
    }
}

/// In front and a little above, from the side that shows most.
fn default_direction(size: &Vector3<f64>, up: &Vector3<f64>) -> Vector3<f64> {
    let k = up.iamax();
    let (a, b) = ((k + 1) % 3, (k + 2) % 3);
    // For up = y: b is x, a is z. Look along the shorter of the two horizontal sides.
    let (front, side) = if size[b] >= size[a] { (a, b) } else { (b, a) };
    let mut direction = Vector3::zeros();
    direction[front] = 1.0;
    direction[side] = 0.45;
    (direction.normalize() + up * 0.38).normalize()
}
