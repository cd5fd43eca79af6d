//! Solids: shapes that do not deform, with scripted motion. The same shapes fill with liquid, emit and remove it.

use super::declare::{choice, section};
use super::field::FileName;
use super::motion::{Axis, Script};
use super::quantity::{above, at_least};
use nalgebra::Vector3;

section! {
    /// A ball.
    pub struct Sphere {
        /// Centre.
        center: Vector3<f64> = [required] (Length) "";
        /// Radius.
        radius: f64 = [required] (Length, above(0.0)) "";
    }
}

section! {
    /// A box.
    pub struct Cuboid {
        /// Centre.
        center: Vector3<f64> = [required] (Length) "";
        /// Half of its edges, rounding included.
        half_size: Vector3<f64> = [required] (Length, above(0.0)) "";
        /// Turn about the centre, as axis times angle.
        rotate: Vector3<f64> = [Vector3::zeros()] (Angle) "";
        /// Radius of its edges; at most the smallest half of them.
        rounding: f64 = [0.0] (Length, at_least(0.0)) "";
    }
}

section! {
    /// A cylinder with flat ends.
    pub struct Cylinder {
        /// Centre.
        center: Vector3<f64> = [required] (Length) "";
        /// Axis.
        axis: Axis = [Axis::y()] () "";
        /// Radius.
        radius: f64 = [required] (Length, above(0.0)) "";
        /// Half of its length, rounding included.
        half_length: f64 = [required] (Length, above(0.0)) "";
        /// Radius of its rims; at most its radius and half length.
        rounding: f64 = [0.0] (Length, at_least(0.0)) "";
    }
}

section! {
    /// A cylinder with round ends.
    pub struct Capsule {
        /// Centre.
        center: Vector3<f64> = [required] (Length) "";
        /// Axis.
        axis: Axis = [Axis::y()] () "";
        /// Radius.
        radius: f64 = [required] (Length, above(0.0)) "";
        /// Half of the length between the centres of the round ends.
        half_length: f64 = [required] (Length, above(0.0)) "";
    }
}

section! {
    /// Everything on one side of a plane.
    pub struct HalfSpace {
        /// A point of the plane.
        point: Vector3<f64> = [required] (Length) "";
        /// Direction out of the solid.
        normal: Axis = [Axis::y()] () "";
    }
}

section! {
    /// A ring.
    pub struct Torus {
        /// Centre.
        center: Vector3<f64> = [required] (Length) "";
        /// Axis of the ring.
        axis: Axis = [Axis::y()] () "";
        /// Radius of the ring's centreline.
        major_radius: f64 = [required] (Length, above(0.0)) "";
        /// Radius of its cross-section.
        minor_radius: f64 = [required] (Length, above(0.0)) "";
    }
}

section! {
    /// A closed triangle mesh from an OBJ or STL file.
    pub struct MeshFile {
        /// File, relative to the scene file.
        file: FileName = [required] () "";
        /// Factor on its coordinates, which are read in the units of the scene.
        scale: f64 = [1.0] (Number, above(0.0)) "";
        /// Displacement after scaling and turning.
        translate: Vector3<f64> = [Vector3::zeros()] (Length) "";
        /// Turn about its origin, as axis times angle.
        rotate: Vector3<f64> = [Vector3::zeros()] (Angle) "";
    }
}

choice! {
    /// A shape in space.
    pub enum Volume {
        /// A ball.
        Sphere(Sphere) ();
        /// A box.
        Box(Cuboid) ();
        /// A cylinder.
        Cylinder(Cylinder) ();
        /// A cylinder with round ends.
        Capsule(Capsule) ();
        /// One side of a plane.
        HalfSpace(HalfSpace) ();
        /// A ring.
        Torus(Torus) ();
        /// A mesh from a file.
        Mesh(MeshFile) ();
    }
}

section! {
    /// A solid that strands and liquid meet.
    pub struct Solid {
        /// Name, for records.
        name: Option<String> = [None] () "";
        /// Shape.
        shape: Volume = [required] () "";
        /// Solid outside the shape instead of inside: a container.
        inverted: bool = [false] () "";
        /// Motion.
        motion: Script = [Script::still()] () "";
        /// Coefficient of friction with strands; a pair takes the geometric mean.
        friction: f64 = [0.3] (Number, at_least(0.0).up_to(10.0)) "";
        /// What it does to liquid along it: 0 slips freely, 1 sticks.
        liquid_friction: f64 = [1.0] (Number, at_least(0.0).up_to(1.0)) "";
        /// Fraction of the approach velocity with which strands bounce back.
        restitution: f64 = [0.0] (Number, at_least(0.0).up_to(1.0)) "";
    }
}
