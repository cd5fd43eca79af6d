//! Where things are: signed-distance shapes, triangle meshes, scripted motion and the broad phase of contact detection.
//!
//! A scene gives a [`ShapeDescription`] and a [`Motion`]; [`ShapeDescription::build`] checks them and returns a
//! [`Shape`] that answers distance and normal; a [`MovingSolid`] puts both together and answers at any time. Motion is a
//! pure function of time, so a restarted run sees the same solid. The [`broad_phase`] finds pairs of boxes that overlap
//! and points that are near; [`closest`] measures the pairs it finds.
//!
//! Signs: distance is negative inside, normals point outward (towards growing distance). Lengths in metres, angles in radians.

pub mod bounds;
pub mod broad_phase;
pub mod closest;
pub mod mesh;
pub mod motion;
pub mod planar;
pub mod shape;
pub mod solid;
mod vector_format;

pub use bounds::Aabb;
pub use mesh::{MeshError, TriangleMesh};
pub use motion::{Ease, Motion, Pose, VelocityField};
pub use shape::{Axis, Shape, ShapeDescription, ShapeError, SurfaceSample};
pub use solid::{MovingSolid, PosedSolid, Surface};

/// Position or direction in three dimensions [m, or none].
pub type Vector3 = nalgebra::Vector3<f64>;
/// Position or direction in the plane [m, or none].
pub type Vector2 = nalgebra::Vector2<f64>;
