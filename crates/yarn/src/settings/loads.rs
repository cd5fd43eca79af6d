//! Scripted loads.

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

use super::{YarnSettings, positive, vector};
use crate::YarnError;

/// How a path runs between its points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Interpolation {
    /// Straight, at constant speed.
    #[default]
    Linear,
    /// Cubic through the points with continuous velocity (Catmull–Rom with tangents for uneven times).
    CatmullRom,
}

/// A moving point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum PathSettings {
    /// A fixed point [m].
    Fixed(Vec<f64>),
    /// Through given points at given times; at rest before the first and after the last.
    Points {
        /// `(time [s], position [m])` with strictly rising times.
        points: Vec<(f64, Vec<f64>)>,
        /// Curve between them.
        #[serde(default)]
        interpolation: Interpolation,
    },
    /// On an ellipse in the plane of the first two axes: `center + (r₁ cos(ω t + φ), r₂ sin(ω t + φ))`.
    Orbit {
        /// Centre [m].
        center: Vec<f64>,
        /// Half axes [m].
        radii: (f64, f64),
        /// Angular velocity [rad/s].
        angular_velocity: f64,
        /// Angle at time zero [rad].
        #[serde(default)]
        phase: f64,
    },
    /// On a straight line from one point at constant velocity.
    Line {
        /// Position at time zero [m].
        from: Vec<f64>,
        /// Velocity [m/s].
        velocity: Vec<f64>,
    },
}

impl PathSettings {
    /// Checks points and times.
    ///
    /// # Errors
    /// The first entry that is wrong, under `path`.
    pub fn check(&self, path: &str, settings: &YarnSettings) -> Result<(), YarnError> {
        match self {
            Self::Fixed(point) => settings.vector(path, point),
            Self::Points { points, .. } => {
                if points.is_empty() {
                    return Err(YarnError::setting(format!("{path}.points"), "needs at least one point"));
                }
                for (i, (time, point)) in points.iter().enumerate() {
                    settings.vector(&format!("{path}.points[{i}]"), point)?;
                    if !time.is_finite() || (i > 0 && *time <= points[i - 1].0) {
                        return Err(YarnError::setting(format!("{path}.points[{i}]"), "times must be finite and rise"));
                    }
                }
                Ok(())
            }
            Self::Orbit { center, radii, angular_velocity, phase } => {
                settings.vector(&format!("{path}.center"), center)?;
                if ![radii.0, radii.1, *angular_velocity, *phase].iter().all(|x| x.is_finite()) {
                    return Err(YarnError::setting(path, "radii, angular velocity and phase must be finite"));
                }
                Ok(())
            }
            Self::Line { from, velocity } => {
                settings.vector(&format!("{path}.from"), from)?;
                settings.vector(&format!("{path}.velocity"), velocity)
            }
        }
    }

    /// Position at `time` [m]; the settings must have been checked for this dimension.
    #[must_use]
    pub fn at<const D: usize>(&self, time: f64) -> SVector<f64, D> {
        match self {
            Self::Fixed(point) => SVector::from_column_slice(point),
            Self::Points { points, interpolation } => {
                let p = |i: usize| SVector::<f64, D>::from_column_slice(&points[i].1);
                let next = points.partition_point(|(t, _)| *t <= time);
                if next == 0 {
                    return p(0);
                }
                if next == points.len() {
                    return p(next - 1);
                }
                let (t0, t1) = (points[next - 1].0, points[next].0);
                let (a, b) = (p(next - 1), p(next));
                let u = (time - t0) / (t1 - t0);
                if *interpolation == Interpolation::Linear {
                    return a + (b - a) * u;
                }
                let tangent = |i: usize| {
                    let (low, high) = (i.saturating_sub(1), (i + 1).min(points.len() - 1));
                    (p(high) - p(low)) / (points[high].0 - points[low].0)
                };
                let (ma, mb) = (tangent(next - 1) * (t1 - t0), tangent(next) * (t1 - t0));
                let (u2, u3) = (u * u, u * u * u);
                a * (2.0 * u3 - 3.0 * u2 + 1.0) + ma * (u3 - 2.0 * u2 + u) + b * (3.0 * u2 - 2.0 * u3) + mb * (u3 - u2)
            }
            Self::Orbit { center, radii, angular_velocity, phase } => {
                let mut point = SVector::<f64, D>::from_column_slice(center);
                let angle = angular_velocity * time + phase;
                point[0] += radii.0 * angle.cos();
                point[1] += radii.1 * angle.sin();
                point
            }
            Self::Line { from, velocity } => {
                SVector::<f64, D>::from_column_slice(from) + SVector::<f64, D>::from_column_slice(velocity) * time
            }
        }
    }
}

/// An acceleration `s (p − x)/(|p − x| + softening)` towards a moving point: the note's mouse, made repeatable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AttractorSettings {
    /// Where it is.
    pub path: PathSettings,
    /// Strength `(time [s], s [m/s²])`, linear between; a single entry is constant; negative repels.
    pub strength: Vec<(f64, f64)>,
    /// Length over which the pull fades near the point [m], positive.
    #[serde(default = "default_softening")]
    pub softening: f64,
}

fn default_softening() -> f64 {
    0.01
}

impl AttractorSettings {
    pub(super) fn check(&self, settings: &YarnSettings) -> Result<(), YarnError> {
        self.path.check("attractor.path", settings)?;
        positive("attractor.softening", self.softening)?;
        if self.strength.is_empty()
            || self.strength.iter().any(|(t, s)| !t.is_finite() || !s.is_finite())
            || self.strength.windows(2).any(|w| w[0].0 >= w[1].0)
        {
            return Err(YarnError::setting(
                "attractor.strength",
                "needs (time, strength) pairs, finite, with rising times",
            ));
        }
        Ok(())
    }

    /// Strength at `time` [m/s²].
    #[must_use]
    pub fn strength_at(&self, time: f64) -> f64 {
        let next = self.strength.partition_point(|(t, _)| *t <= time);
        if next == 0 {
            return self.strength[0].1;
        }
        if next == self.strength.len() {
            return self.strength[next - 1].1;
        }
        let ((t0, a), (t1, b)) = (self.strength[next - 1], self.strength[next]);
        a + (b - a) * (time - t0) / (t1 - t0)
    }

    /// Point and strength at one instant.
    pub(crate) fn sample<const D: usize>(&self, time: f64) -> AttractorSample<D> {
        AttractorSample { point: self.path.at(time), strength: self.strength_at(time), softening: self.softening }
    }
}

/// The attractor at one instant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AttractorSample<const D: usize> {
    point: SVector<f64, D>,
    strength: f64,
    softening: f64,
}

impl<const D: usize> AttractorSample<D> {
    /// Acceleration at a position [m/s²].
    #[inline]
    pub fn acceleration(&self, x: &SVector<f64, D>) -> SVector<f64, D> {
        let to = self.point - x;
        to * (self.strength / (to.norm() + self.softening))
    }
}

/// Gravity as a vector; empty settings mean none.
pub(crate) fn gravity<const D: usize>(settings: &YarnSettings) -> Result<SVector<f64, D>, YarnError> {
    if settings.gravity.is_empty() { Ok(SVector::zeros()) } else { vector("gravity", &settings.gravity) }
}
