//! Solid bodies: signed distance, motion, restitution and friction.

use std::path::Path;

use geometry::{MovingSolid, PosedSolid, Surface};
use nalgebra::SVector;

use super::{embed, project};
use crate::YarnError;
use crate::settings::ObstacleSettings;

/// A body with its contact numbers.
#[derive(Clone, Debug)]
pub(crate) struct Obstacle {
    solid: MovingSolid,
    friction: f64,
    restitution: f64,
}

/// A body at one instant.
pub(crate) struct PosedObstacle<'a> {
    posed: PosedSolid<'a>,
    friction: f64,
    restitution: f64,
}

impl Obstacle {
    pub fn build(given: &ObstacleSettings, path: &str, base: &Path) -> Result<Self, YarnError> {
        let shape = given.shape.build(base).map_err(|e| YarnError::setting(format!("{path}.shape"), e.to_string()))?;
        let surface = Surface { friction: given.friction, ..Surface::default() };
        let solid = MovingSolid::new(shape, given.motion.clone(), surface)
            .map_err(|e| YarnError::setting(format!("{path}.motion"), e.to_string()))?;
        Ok(Self { solid, friction: given.friction, restitution: given.restitution })
    }

    pub fn at(&self, time: f64) -> PosedObstacle<'_> {
        PosedObstacle { posed: self.solid.at(time), friction: self.friction, restitution: self.restitution }
    }

    /// Smallest side of its box, where it has one [m].
    pub fn smallest_width(&self, dimension: usize) -> Option<f64> {
        let bounds = self.solid.at(0.0).bounds()?;
        Some((0..dimension).map(|a| bounds.max[a] - bounds.min[a]).fold(f64::INFINITY, f64::min))
    }

    /// The body itself.
    pub fn solid(&self) -> &MovingSolid {
        &self.solid
    }
}

impl PosedObstacle<'_> {
    /// Signed distance [m] and outward normal; in 2-D the normal is cut to the plane.
    #[inline]
    pub fn sample<const D: usize>(&self, x: &SVector<f64, D>) -> (f64, SVector<f64, D>) {
        let sample = self.posed.sample(&embed(x));
        let mut normal: SVector<f64, D> = project(&sample.normal);
        if D == 2 {
            let length = normal.norm();
            if length > 0.0 {
                normal /= length;
            } else {
                normal[0] = 1.0;
            }
        }
        (sample.distance, normal)
    }

    /// Velocity of the body at a point [m/s].
    #[inline]
    pub fn velocity_at<const D: usize>(&self, x: &SVector<f64, D>) -> SVector<f64, D> {
        project(&self.posed.velocity_at(&embed(x)))
    }

    /// Largest speed of the body on its box, or of its centre where it has none [m/s].
    pub fn speed(&self) -> f64 {
        match self.posed.bounds() {
            Some(bounds) => (0..8)
                .map(|corner| {
                    let p =
                        nalgebra::Vector3::from_fn(
                            |a, _| if corner >> a & 1 == 0 { bounds.min[a] } else { bounds.max[a] },
                        );
                    self.posed.velocity_at(&p).norm()
                })
                .fold(0.0, f64::max),
            None => self.posed.velocity_field().linear.norm(),
        }
    }

    /// Coulomb coefficient and restitution.
    pub fn surface(&self) -> (f64, f64) {
        (self.friction, self.restitution)
    }

    /// Velocity of a node after contact: approaching nodes inside the body are reflected and rubbed.
    #[inline]
    pub fn contact<const D: usize>(&self, x: &SVector<f64, D>, velocity: SVector<f64, D>) -> SVector<f64, D> {
        let (distance, normal) = self.sample(x);
        if distance >= 0.0 {
            return velocity;
        }
        let body = self.velocity_at(x);
        let relative = velocity - body;
        let approach = relative.dot(&normal);
        if approach >= 0.0 {
            return velocity;
        }
        let along = rub(relative - normal * approach, self.friction * (1.0 + self.restitution) * approach.abs());
        body + along - normal * (self.restitution * approach)
    }
}

/// A sliding velocity less at most `bound` of its magnitude.
#[inline]
pub(crate) fn rub<const D: usize>(along: SVector<f64, D>, bound: f64) -> SVector<f64, D> {
    let speed = along.norm();
    if speed > bound { along * (1.0 - bound / speed) } else { SVector::zeros() }
}
