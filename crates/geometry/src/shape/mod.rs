//! Signed-distance shapes.
//!
//! [`ShapeDescription`] is what a scene says; [`ShapeDescription::build`] checks it, normalises axes and loads meshes into a [`Shape`].
//! Every primitive, rounded or not, and its complement gives the exact Euclidean distance everywhere; a union is exact outside and
//! where its parts do not overlap, and never overestimates the depth's magnitude wrongly in sign elsewhere.

mod bounding;
mod describe;
mod distance;
mod tessellate;

pub use describe::{Axis, ShapeDescription, ShapeError};
pub use tessellate::SurfaceMesh;

use crate::{TriangleMesh, Vector3};
use nalgebra::UnitQuaternion;
use std::sync::Arc;

/// Distance and direction to the surface of a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceSample {
    /// Signed distance [m], negative inside.
    pub distance: f64,
    /// Outward unit normal of the nearest surface point. Where the nearest point is not unique (centre of a sphere, medial
    /// axis) one of the candidates is taken, always the same.
    pub normal: Vector3,
}

/// A checked shape, ready to be asked. Cheap to clone (meshes are shared).
#[derive(Clone, Debug)]
pub enum Shape {
    /// Ball.
    Sphere {
        /// Centre [m].
        center: Vector3,
        /// Radius [m].
        radius: f64,
    },
    /// Cuboid whose edges are rounded.
    Cuboid {
        /// Centre [m].
        center: Vector3,
        /// From the shape's axes to the world's.
        rotation: UnitQuaternion<f64>,
        /// Half sides without the rounding [m].
        core: Vector3,
        /// Radius of the edges [m].
        rounding: f64,
    },
    /// Closed circular cylinder whose rims are rounded.
    Cylinder {
        /// Centre [m].
        center: Vector3,
        /// Unit axis.
        axis: Vector3,
        /// Radius without the rounding [m].
        core_radius: f64,
        /// Half length without the rounding [m].
        core_half_length: f64,
        /// Radius of the rims [m].
        rounding: f64,
    },
    /// All points within a radius of a segment.
    Capsule {
        /// First end of the segment [m].
        from: Vector3,
        /// Second end of the segment [m].
        to: Vector3,
        /// Radius [m].
        radius: f64,
    },
    /// All points behind a plane.
    HalfSpace {
        /// A point of the plane [m].
        point: Vector3,
        /// Unit normal, out of the solid.
        normal: Vector3,
    },
    /// Ring with a circular section.
    Torus {
        /// Centre [m].
        center: Vector3,
        /// Unit axis.
        axis: Vector3,
        /// Radius of the centre line [m].
        major_radius: f64,
        /// Radius of the section [m].
        minor_radius: f64,
    },
    /// Closed triangle mesh.
    Mesh(Arc<TriangleMesh>),
    /// Every surface point moved outward.
    Rounded {
        /// What is rounded.
        shape: Box<Shape>,
        /// How far the surface moves [m].
        radius: f64,
    },
    /// Inside out: a cavity.
    Complement(Box<Shape>),
    /// All points in any of the parts.
    Union(Vec<Shape>),
}

impl Shape {
    /// The point that the shape turns and grows about unless told otherwise [m].
    #[must_use]
    pub fn center(&self) -> Vector3 {
        match self {
            Shape::Sphere { center, .. }
            | Shape::Cuboid { center, .. }
            | Shape::Cylinder { center, .. }
            | Shape::Torus { center, .. } => *center,
            Shape::Capsule { from, to, .. } => (from + to) * 0.5,
            Shape::HalfSpace { point, .. } => *point,
            Shape::Mesh(mesh) => mesh.centroid(),
            Shape::Rounded { shape, .. } | Shape::Complement(shape) => shape.center(),
            Shape::Union(parts) => parts.iter().map(Shape::center).sum::<Vector3>() / parts.len() as f64,
        }
    }
}
