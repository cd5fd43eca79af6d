//! Similarity transforms and the velocity fields they move with.

use crate::Vector3;
use nalgebra::UnitQuaternion;

/// A similarity: `x = scale · R X + translation`, from the shape's own frame to the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Rotation.
    pub rotation: UnitQuaternion<f64>,
    /// Uniform scale, positive.
    pub scale: f64,
    /// Translation [m].
    pub translation: Vector3,
}

impl Pose {
    /// The pose that moves nothing.
    #[must_use]
    pub fn identity() -> Pose {
        Pose { rotation: UnitQuaternion::identity(), scale: 1.0, translation: Vector3::zeros() }
    }

    /// World position of a point of the shape [m].
    #[inline]
    #[must_use]
    pub fn apply(&self, point: &Vector3) -> Vector3 {
        self.rotation * (point * self.scale) + self.translation
    }

    /// The point of the shape that lies at a world position [m].
    #[inline]
    #[must_use]
    pub fn apply_inverse(&self, position: &Vector3) -> Vector3 {
        self.rotation.inverse_transform_vector(&(position - self.translation)) / self.scale
    }

    /// First `self`, then `next`.
    #[must_use]
    pub fn then(&self, next: &Pose) -> Pose {
        Pose {
            rotation: next.rotation * self.rotation,
            scale: next.scale * self.scale,
            translation: next.apply(&self.translation),
        }
    }
}

/// Velocity of every point of a moving, turning and growing body: `v(x) = linear + angular × x + growth · x`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VelocityField {
    /// Velocity at the world origin [m/s].
    pub linear: Vector3,
    /// Angular velocity [rad/s].
    pub angular: Vector3,
    /// Relative growth rate of lengths [1/s].
    pub growth: f64,
}

impl VelocityField {
    /// Velocity of the body at a world position [m/s].
    #[inline]
    #[must_use]
    pub fn at(&self, position: &Vector3) -> Vector3 {
        self.linear + self.angular.cross(position) + position * self.growth
    }

    /// A field given by the velocity `velocity` of one point, an angular velocity and a growth rate.
    #[must_use]
    pub fn about(point: &Vector3, velocity: Vector3, angular: Vector3, growth: f64) -> VelocityField {
        VelocityField { linear: velocity - angular.cross(point) - point * growth, angular, growth }
    }
}
