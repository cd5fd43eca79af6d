//! Boxes around shapes.

use super::Shape;
use crate::{Aabb, Vector3};

impl Shape {
    /// Smallest axis-aligned box around the shape, or none if it has no end (half-space, cavity).
    #[must_use]
    pub fn bounds(&self) -> Option<Aabb> {
        let around =
            |center: &Vector3, half: Vector3| Some(Aabb { min: (center - half).into(), max: (center + half).into() });
        match self {
            Shape::Sphere { center, radius } => around(center, Vector3::repeat(*radius)),
            Shape::Cuboid { center, rotation, core, rounding } => {
                let m = rotation.to_rotation_matrix();
                around(center, (m.matrix().abs() * core).add_scalar(*rounding))
            }
            Shape::Cylinder { center, axis, core_radius, core_half_length, rounding } => {
                around(center, axis.map(|a| core_half_length * a.abs() + core_radius * rim(a) + rounding))
            }
            Shape::Capsule { from, to, radius } => Some(Aabb::around_segment(from, to, *radius)),
            Shape::Torus { center, axis, major_radius, minor_radius } => {
                around(center, axis.map(|a| major_radius * rim(a) + minor_radius))
            }
            Shape::Mesh(mesh) => Some(mesh.bounds()),
            Shape::Rounded { shape, radius } => shape.bounds().map(|b| b.inflated(*radius)),
            Shape::HalfSpace { .. } | Shape::Complement(_) => None,
            Shape::Union(parts) => {
                parts.iter().map(Shape::bounds).try_fold(Aabb::EMPTY, |all, part| part.map(|b| all.merge(&b)))
            }
        }
    }
}

/// Extent of a unit circle along a coordinate axis, from that component of the circle's axis.
fn rim(component: f64) -> f64 {
    (1.0 - component * component).max(0.0).sqrt()
}
