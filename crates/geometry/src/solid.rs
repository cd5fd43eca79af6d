//! Solids that move by script.

use crate::motion::MotionError;
use crate::shape::SurfaceSample;
use crate::{Aabb, Motion, Pose, Shape, Vector3, VelocityField};
use serde::{Deserialize, Serialize};

/// What a solid's surface does to what touches it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Surface {
    /// Coulomb coefficient, from 0 (slippery); larger holds steeper slopes.
    pub friction: f64,
    /// Whether liquid sticks to the surface instead of sliding along it.
    pub sticky: bool,
}

impl Default for Surface {
    fn default() -> Surface {
        Surface { friction: 0.3, sticky: true }
    }
}

/// A shape with a script and a surface. What it does at time `t` depends on `t` alone.
#[derive(Clone, Debug)]
pub struct MovingSolid {
    /// The shape as described at rest.
    pub shape: Shape,
    /// The script.
    pub motion: Motion,
    /// The surface.
    pub surface: Surface,
    center: Vector3,
}

impl MovingSolid {
    /// Puts shape, script and surface together.
    ///
    /// # Errors
    /// [`MotionError`] if the script is wrong.
    pub fn new(shape: Shape, motion: Motion, surface: Surface) -> Result<MovingSolid, MotionError> {
        motion.check()?;
        Ok(MovingSolid { center: shape.center(), shape, motion, surface })
    }

    /// The solid at one instant [s], for many questions.
    #[must_use]
    pub fn at(&self, time: f64) -> PosedSolid<'_> {
        let (pose, field) = self.motion.evaluate(&self.center, time);
        PosedSolid { solid: self, pose, field, still: pose == Pose::identity() }
    }

    /// Signed distance at a position and time [m].
    #[must_use]
    pub fn signed_distance(&self, position: &Vector3, time: f64) -> f64 {
        self.at(time).signed_distance(position)
    }

    /// Outward unit normal of the nearest surface point.
    #[must_use]
    pub fn normal(&self, position: &Vector3, time: f64) -> Vector3 {
        self.at(time).sample(position).normal
    }

    /// Velocity of the solid, extended beyond its surface as a rigid, growing frame [m/s].
    #[must_use]
    pub fn velocity_at(&self, position: &Vector3, time: f64) -> Vector3 {
        self.at(time).velocity_at(position)
    }

    /// How far the point of the solid that is at `position` at time `from` has moved by time `to` [m].
    #[must_use]
    pub fn displacement(&self, position: &Vector3, from: f64, to: f64) -> Vector3 {
        let (start, end) = (self.motion.pose(&self.center, from), self.motion.pose(&self.center, to));
        end.apply(&start.apply_inverse(position)) - position
    }
}

/// A solid at one instant.
#[derive(Clone, Copy, Debug)]
pub struct PosedSolid<'a> {
    solid: &'a MovingSolid,
    pose: Pose,
    field: VelocityField,
    still: bool,
}

impl PosedSolid<'_> {
    /// The solid itself.
    #[must_use]
    pub fn solid(&self) -> &MovingSolid {
        self.solid
    }

    /// Where it is.
    #[must_use]
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// How it moves.
    #[must_use]
    pub fn velocity_field(&self) -> &VelocityField {
        &self.field
    }

    /// Signed distance [m].
    #[inline]
    #[must_use]
    pub fn signed_distance(&self, position: &Vector3) -> f64 {
        if self.still {
            return self.solid.shape.signed_distance(position);
        }
        self.solid.shape.signed_distance(&self.pose.apply_inverse(position)) * self.pose.scale
    }

    /// Signed distance [m] and outward unit normal.
    #[inline]
    #[must_use]
    pub fn sample(&self, position: &Vector3) -> SurfaceSample {
        if self.still {
            return self.solid.shape.sample(position);
        }
        let local = self.solid.shape.sample(&self.pose.apply_inverse(position));
        SurfaceSample { distance: local.distance * self.pose.scale, normal: self.pose.rotation * local.normal }
    }

    /// Velocity of the solid at a world position [m/s].
    #[inline]
    #[must_use]
    pub fn velocity_at(&self, position: &Vector3) -> Vector3 {
        self.field.at(position)
    }

    /// A box around the solid [m], or none if it has no end. Not the smallest when the solid is turned.
    #[must_use]
    pub fn bounds(&self) -> Option<Aabb> {
        let local = self.solid.shape.bounds()?;
        let (center, half) = (local.center(), Vector3::from_fn(|k, _| 0.5 * (local.max[k] - local.min[k])));
        let turned = self.pose.rotation.to_rotation_matrix().matrix().abs() * half * self.pose.scale;
        let center = self.pose.apply(&center);
        Some(Aabb { min: (center - turned).into(), max: (center + turned).into() })
    }

    /// Triangles of the surface where it is now, for pictures (see [`Shape::tessellate`]).
    #[must_use]
    pub fn tessellate(&self, segments: usize, extent: f64) -> crate::shape::SurfaceMesh {
        let mut surface = self.solid.shape.tessellate(segments, extent);
        surface.positions.iter_mut().for_each(|p| *p = self.pose.apply(p));
        surface
    }
}
