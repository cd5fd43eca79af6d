//! Initial yarns: groups of polylines from a few numbers.
//!
//! Every generator gives polylines whose segments have about the length asked for; material, velocity and rest lengths are
//! the group's. Nothing here knows a grid.

mod count;
mod curve;
mod hair;
mod polyline;
mod textile;

#[cfg(test)]
mod tests;

pub use polyline::{PolylineError, parse_polylines};

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use crate::YarnError;
use crate::settings::{positive, range, vector};

/// One yarn as a polyline.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Strand<const D: usize> {
    /// Vertices [m].
    pub points: Vec<SVector<f64, D>>,
    /// Rest lengths [m], one per segment.
    pub rest: Vec<f64>,
    /// Initial velocities [m/s], one per vertex.
    pub velocity: Vec<SVector<f64, D>>,
}

/// Yarns of one kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct YarnGroup {
    /// Name of the material.
    #[serde(default = "default_material")]
    pub material: String,
    /// Shape.
    pub shape: YarnShape,
    /// Length of a segment [m]; left out: half a cell. Polylines given point by point keep their own.
    #[serde(default)]
    pub segment_length: Option<f64>,
    /// Initial velocity [m/s]; empty: at rest.
    #[serde(default)]
    pub velocity: Vec<f64>,
    /// Initial stretch: rest lengths are the built lengths divided by it; positive.
    #[serde(default = "one")]
    pub stretch: f64,
}

fn default_material() -> String {
    "yarn".to_owned()
}

fn one() -> f64 {
    1.0
}

/// Shapes that yarns can start in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum YarnShape {
    /// One straight yarn.
    Line {
        /// First end [m].
        from: Vec<f64>,
        /// Last end [m].
        to: Vec<f64>,
    },
    /// Straight yarns side by side: the note's scene.
    Lines {
        /// First end of the first yarn [m].
        from: Vec<f64>,
        /// Last end of the first yarn [m].
        to: Vec<f64>,
        /// Number of yarns, from 1.
        count: usize,
        /// From one yarn to the next [m].
        step: Vec<f64>,
    },
    /// An arc of a circle; the two ends of a full turn stay apart by one segment.
    Circle {
        /// Centre [m].
        center: Vec<f64>,
        /// Radius [m], positive.
        radius: f64,
        /// Normal of its plane (3-D); left out: z.
        #[serde(default)]
        normal: Vec<f64>,
        /// Angle of the first vertex [rad].
        #[serde(default)]
        start: f64,
        /// Angle swept [rad]; left out: a full turn less one segment.
        #[serde(default)]
        sweep: Option<f64>,
    },
    /// A helix (3-D).
    Helix {
        /// Foot of the axis [m].
        from: Vec<f64>,
        /// Head of the axis [m].
        to: Vec<f64>,
        /// Radius [m], positive.
        radius: f64,
        /// Turns between foot and head; negative is left-handed.
        turns: f64,
    },
    /// A plain woven sheet, 0/90 (3-D).
    Weave {
        /// Centre of the sheet [m].
        center: Vec<f64>,
        /// Direction of the warp; left out: x.
        #[serde(default)]
        warp: Vec<f64>,
        /// Direction of the weft, made normal to the warp; left out: y.
        #[serde(default)]
        weft: Vec<f64>,
        /// Number of warp and weft yarns, from 1.
        count: (usize, usize),
        /// Distance between neighbouring yarns [m], positive.
        spacing: f64,
        /// Height of the crossings above and below the middle plane [m], not negative.
        amplitude: f64,
        /// Length of the yarns beyond the outermost crossing [m]; left out: half the spacing.
        #[serde(default)]
        overhang: Option<f64>,
    },
    /// Rows of knit loops (plain jersey), each row one yarn (3-D).
    Knit {
        /// Centre of the swatch [m].
        center: Vec<f64>,
        /// Number of rows, from 1.
        rows: usize,
        /// Loops per row, from 1.
        loops: usize,
        /// Width of a loop [m], positive.
        width: f64,
        /// Distance from row to row [m], positive; a loop is twice as high.
        height: f64,
        /// Depth of the loops [m]; yarns of neighbouring rows pass at about 0.45 of it.
        depth: f64,
    },
    /// Yarns of random course in a ball (disc in 2-D).
    HairBall {
        /// Centre [m].
        center: Vec<f64>,
        /// Radius [m], positive.
        radius: f64,
        /// Number of yarns, from 1.
        count: usize,
        /// Length of each [m], positive.
        length: f64,
        /// Length over which the course forgets its direction [m], positive.
        curl: f64,
        /// Seed.
        #[serde(default)]
        seed: u64,
    },
    /// Straight cut pieces of random place and direction in a box.
    CutPile {
        /// Low corner [m].
        low: Vec<f64>,
        /// High corner [m].
        high: Vec<f64>,
        /// Number of pieces, from 1.
        count: usize,
        /// Length of each [m], positive.
        length: f64,
        /// Seed.
        #[serde(default)]
        seed: u64,
    },
    /// Given point by point; rest lengths and velocities where they differ from the group's.
    Polyline {
        /// Vertices [m], at least two.
        points: Vec<Vec<f64>>,
        /// Rest lengths [m], one per segment; empty: as built.
        #[serde(default)]
        rest_lengths: Vec<f64>,
        /// Velocities [m/s], one per vertex; empty: the group's.
        #[serde(default)]
        velocities: Vec<Vec<f64>>,
    },
    /// Several yarns, each point by point (from a file).
    Polylines {
        /// Vertices of each yarn [m], at least two each.
        yarns: Vec<Vec<Vec<f64>>>,
    },
}

impl YarnGroup {
    /// A group of one shape, of the material named `yarn`, at rest.
    #[must_use]
    pub fn new(shape: YarnShape) -> Self {
        Self { material: default_material(), shape, segment_length: None, velocity: Vec::new(), stretch: 1.0 }
    }

    /// Builds the yarns of the group.
    ///
    /// - `path`: where the group stands, for errors
    /// - `cell`: edge of a grid cell [m]
    pub(crate) fn build<const D: usize>(&self, path: &str, cell: f64) -> Result<Vec<Strand<D>>, YarnError> {
        let at = |name: &str| format!("{path}.{name}");
        let segment = self.segment_length.unwrap_or(0.5 * cell);
        positive(&at("segment_length"), segment)?;
        range(&at("stretch"), self.stretch, 1e-3, 1e3)?;
        let velocity: SVector<f64, D> =
            if self.velocity.is_empty() { SVector::zeros() } else { vector(&at("velocity"), &self.velocity)? };
        let shape = at("shape");
        let mut given_rest: &[f64] = &[];
        let mut given_velocity: Vec<SVector<f64, D>> = Vec::new();
        let courses: Vec<Vec<SVector<f64, D>>> = match &self.shape {
            YarnShape::Line { from, to } => {
                vec![curve::line(vector(&format!("{shape}.from"), from)?, vector(&format!("{shape}.to"), to)?, segment)]
            }
            YarnShape::Lines { from, to, count, step } => {
                let (from, to): (SVector<f64, D>, SVector<f64, D>) =
                    (vector(&format!("{shape}.from"), from)?, vector(&format!("{shape}.to"), to)?);
                let step: SVector<f64, D> = vector(&format!("{shape}.step"), step)?;
                (0..*count).map(|i| curve::line(from + step * i as f64, to + step * i as f64, segment)).collect()
            }
            YarnShape::Circle { center, radius, normal, start, sweep } => {
                positive(&format!("{shape}.radius"), *radius)?;
                vec![curve::circle(
                    vector(&format!("{shape}.center"), center)?,
                    *radius,
                    &optional::<D>(&format!("{shape}.normal"), normal, D - 1)?,
                    *start,
                    *sweep,
                    segment,
                )]
            }
            YarnShape::Helix { from, to, radius, turns } => {
                three::<D>(&shape)?;
                positive(&format!("{shape}.radius"), *radius)?;
                vec![curve::helix(
                    vector(&format!("{shape}.from"), from)?,
                    vector(&format!("{shape}.to"), to)?,
                    *radius,
                    *turns,
                    segment,
                )]
            }
            YarnShape::Weave { center, warp, weft, count, spacing, amplitude, overhang } => {
                three::<D>(&shape)?;
                positive(&format!("{shape}.spacing"), *spacing)?;
                range(&format!("{shape}.amplitude"), *amplitude, 0.0, f64::MAX)?;
                textile::weave(
                    vector(&format!("{shape}.center"), center)?,
                    optional(&format!("{shape}.warp"), warp, 0)?,
                    optional(&format!("{shape}.weft"), weft, 1)?,
                    *count,
                    *spacing,
                    *amplitude,
                    overhang.unwrap_or(0.5 * spacing),
                    segment,
                )
            }
            YarnShape::Knit { center, rows, loops, width, height, depth } => {
                three::<D>(&shape)?;
                positive(&format!("{shape}.width"), *width)?;
                positive(&format!("{shape}.height"), *height)?;
                textile::knit(
                    vector(&format!("{shape}.center"), center)?,
                    *rows,
                    *loops,
                    *width,
                    *height,
                    *depth,
                    segment,
                )
            }
            YarnShape::HairBall { center, radius, count, length, curl, seed } => {
                for (name, value) in [("radius", radius), ("length", length), ("curl", curl)] {
                    positive(&format!("{shape}.{name}"), *value)?;
                }
                let center = vector(&format!("{shape}.center"), center)?;
                hair::ball(center, *radius, *count, *length, *curl, *seed, segment)
            }
            YarnShape::CutPile { low, high, count, length, seed } => {
                positive(&format!("{shape}.length"), *length)?;
                let (low, high) = (vector(&format!("{shape}.low"), low)?, vector(&format!("{shape}.high"), high)?);
                hair::pile(low, high, *count, *length, *seed, segment)
            }
            YarnShape::Polyline { points, rest_lengths, velocities } => {
                let mut course = Vec::with_capacity(points.len());
                for (i, point) in points.iter().enumerate() {
                    course.push(vector(&format!("{shape}.points[{i}]"), point)?);
                }
                if !rest_lengths.is_empty() && rest_lengths.len() + 1 != points.len() {
                    return Err(YarnError::setting(format!("{shape}.rest_lengths"), "needs one length per segment"));
                }
                if !velocities.is_empty() && velocities.len() != points.len() {
                    return Err(YarnError::setting(format!("{shape}.velocities"), "needs one velocity per vertex"));
                }
                for (i, v) in velocities.iter().enumerate() {
                    given_velocity.push(vector(&format!("{shape}.velocities[{i}]"), v)?);
                }
                given_rest = rest_lengths;
                vec![course]
            }
            YarnShape::Polylines { yarns } => {
                let mut courses = Vec::with_capacity(yarns.len());
                for (k, points) in yarns.iter().enumerate() {
                    let course = points.iter().enumerate();
                    let course = course.map(|(i, point)| vector(&format!("{shape}.yarns[{k}][{i}]"), point));
                    courses.push(course.collect::<Result<_, _>>()?);
                }
                courses
            }
        };
        if courses.is_empty() {
            return Err(YarnError::setting(shape, "makes no yarn: counts must be at least 1"));
        }
        let mut strands = Vec::with_capacity(courses.len());
        for points in courses {
            if points.len() < 2 {
                return Err(YarnError::setting(shape, "a yarn needs at least two vertices"));
            }
            let rest: Vec<f64> = if given_rest.is_empty() {
                points.windows(2).map(|w| (w[1] - w[0]).norm() / self.stretch).collect()
            } else {
                given_rest.to_vec()
            };
            if let Some(segment) = rest.iter().position(|l| !(*l > 0.0 && l.is_finite())) {
                return Err(YarnError::setting(
                    shape,
                    format!("segment {segment} has rest length {} m: lengths must be positive", rest[segment]),
                ));
            }
            let velocity =
                if given_velocity.is_empty() { vec![velocity; points.len()] } else { given_velocity.clone() };
            strands.push(Strand { points, rest, velocity });
        }
        Ok(strands)
    }
}

/// A direction, or the unit vector of `axis` where none is given.
fn optional<const D: usize>(setting: &str, value: &[f64], axis: usize) -> Result<SVector<f64, D>, YarnError> {
    if value.is_empty() {
        let mut unit = SVector::zeros();
        unit[axis] = 1.0;
        return Ok(unit);
    }
    let direction: SVector<f64, D> = vector(setting, value)?;
    positive(setting, direction.norm())?;
    Ok(direction / direction.norm())
}

fn three<const D: usize>(shape: &str) -> Result<(), YarnError> {
    if D == 3 { Ok(()) } else { Err(YarnError::setting(shape, "exists in three dimensions only")) }
}
