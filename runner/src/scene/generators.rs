//! The centrelines of strands, from the shapes that describe them.

use super::error::{Problem, ProblemKind};
use super::quantity::Quantity;
use super::random::{Channel, factor, uniform};
use super::strands::{Arrangement, Curl, Handedness, Placement, Spread, StrandGroup, StrandShape};
use super::tree::Span;
use super::{Scene, obj};
use nalgebra::{Rotation3, Vector3};
use std::f64::consts::{FRAC_PI_3, TAU};

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

/// The vertices of a strand [m] and the factor on its radius.
pub(super) type Centreline = (Vec<Vector3<f64>>, f64);

/// The centrelines of a group.
pub(super) fn centrelines(scene: &Scene, group: usize, description: &StrandGroup) -> Result<Vec<Centreline>, Problem> {
    let seed = scene.seed;
    let mut lines: Vec<Centreline> = match &description.shape {
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
            let even = (shape.arrangement == Arrangement::Even).then_some(shape.count);
            let grower = Grower {
                seed,
                group,
                root: shape.root,
                tip,
                discs,
                even,
                curl: shape.curl.as_ref(),
                spread: &shape.spread,
            };
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
                even: None,
                curl: shape.curl.as_ref(),
                spread: &shape.spread,
            };
            (0..shape.count).map(|index| grower.grow(index, shape.vertices)).collect()
        }
        StrandShape::Obj(shape) => {
            let lines = obj::read(&shape.file.path).map_err(|message| {
                Problem::new(ProblemKind::File, message, Span::NONE, &[]).at(format!("strands[{group}].shape.file"))
            })?;
            let unit = Quantity::Length.to_si(shape.scale, scene.unit_system());
            lines.into_iter().map(|line| (line.into_iter().map(|point| point * unit).collect(), 1.0)).collect()
        }
    };
    for (line, _) in &mut lines {
        place(&description.placement, line);
    }
    Ok(lines)
}

pub(super) fn place(placement: &Placement, line: &mut [Vector3<f64>]) {
    let turn = Rotation3::new(placement.rotate);
    let still = placement.rotate == Vector3::zeros();
    for point in line {
        let scaled = point.component_mul(&placement.scale.0);
        *point = if still { scaled } else { turn * scaled } + placement.translate;
    }
}

/// Two unit vectors at right angles to `direction` and to each other, right-handed: `direction × first = second`.
fn frame(direction: Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
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

/// Angle between one root and the next that fills a disc evenly, at any count: `π (3 − √5)`.
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653_3;

/// Makes the strands of a wisp or bundle.
struct Grower<'a> {
    seed: u64,
    group: usize,
    root: Vector3<f64>,
    tip: Vector3<f64>,
    discs: (f64, f64),
    /// Number of strands, where they are spread evenly instead of at random.
    even: Option<usize>,
    curl: Option<&'a Curl>,
    spread: &'a Spread,
}

impl Grower<'_> {
    fn grow(&self, index: usize, vertices: usize) -> Centreline {
        let draw = |channel| uniform(self.seed, self.group, index, channel);
        let vary = |spread, channel| factor(spread, self.seed, self.group, index, channel);
        let axis = (self.tip - self.root).normalize();
        let (first, second) = frame(axis);
        // Square root: even over the area of the disc.
        let (angle, area) = match self.even {
            None => (TAU * draw(Channel::DiscAngle), draw(Channel::DiscRadius)),
            #[allow(clippy::cast_precision_loss)]
            Some(count) => (GOLDEN_ANGLE * index as f64, (index as f64 + 0.5) / count as f64),
        };
        let (sin, cos) = angle.sin_cos();
        let offset = (first * cos + second * sin) * area.sqrt();
        let root = self.root + offset * self.discs.0;
        let tip = self.tip + offset * self.discs.1;
        let length = (tip - root).norm() * vary(self.spread.length, Channel::Length);
        let mut direction = (tip - root).normalize();
        if self.even.is_some() {
            // shifts of the tips in proportion to the roots' place: lines of such a fan never meet
            direction = (direction + offset * self.spread.direction.tan()).normalize();
        } else if self.spread.direction > 0.0 {
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
