//! Shapes and motions of a two-dimensional scene: what a description in space means in the x–y plane.
//!
//! Bodies go on for ever along z, and the z of places does not count. What has no meaning in the plane is refused.

use std::f64::consts::PI;

use geometry::planar::PlanarShape;
use nalgebra::Vector3;

use crate::scene::motion::Motion;
use crate::scene::solids::Volume;

/// The shape that a volume is in the plane.
///
/// # Errors
/// Says what has no meaning there.
pub fn shape(volume: &Volume) -> Result<PlanarShape, String> {
    let circle = |center: &Vector3<f64>, radius: f64| PlanarShape::Circle { center: center.xy(), radius };
    Ok(match volume {
        Volume::Sphere(s) => circle(&s.center, s.radius),
        Volume::Box(b) => {
            if b.rotate.x != 0.0 || b.rotate.y != 0.0 {
                return Err("a box can only be turned about z".to_owned());
            }
            PlanarShape::Rectangle {
                center: b.center.xy(),
                half_extents: b.half_size.xy(),
                angle: b.rotate.z,
                rounding: 0.0,
            }
        }
        Volume::Cylinder(c) => match direction(&c.axis.0) {
            Direction::AcrossPlane => circle(&c.center, c.radius),
            Direction::InPlane(angle) => PlanarShape::Rectangle {
                center: c.center.xy(),
                half_extents: nalgebra::Vector2::new(c.half_length, c.radius),
                angle,
                rounding: 0.0,
            },
            Direction::Oblique => return Err("the axis of a cylinder lies in the plane or along z".to_owned()),
        },
        Volume::Capsule(c) => match direction(&c.axis.0) {
            Direction::AcrossPlane => circle(&c.center, c.radius),
            Direction::InPlane(_) => {
                let half = c.axis.0.normalize() * c.half_length;
                PlanarShape::Capsule { from: (c.center - half).xy(), to: (c.center + half).xy(), radius: c.radius }
            }
            Direction::Oblique => return Err("the axis of a capsule lies in the plane or along z".to_owned()),
        },
        Volume::HalfSpace(h) => match direction(&h.normal.0) {
            Direction::InPlane(_) => PlanarShape::HalfPlane { point: h.point.xy(), normal: h.normal.0.xy() },
            _ => return Err("the normal of a half-space lies in the plane".to_owned()),
        },
        Volume::Torus(t) => match direction(&t.axis.0) {
            Direction::AcrossPlane => PlanarShape::Complement(Box::new(PlanarShape::Union(vec![
                PlanarShape::Complement(Box::new(circle(&t.center, t.major_radius + t.minor_radius))),
                circle(&t.center, t.major_radius - t.minor_radius),
            ]))),
            _ => return Err("the axis of a ring is z".to_owned()),
        },
        Volume::Mesh(_) => return Err("a mesh has no shape in the plane".to_owned()),
    })
}

enum Direction {
    AcrossPlane,
    /// With the angle against x [rad].
    InPlane(f64),
    Oblique,
}

fn direction(axis: &Vector3<f64>) -> Direction {
    let tolerance = 1e-12 * axis.norm();
    if axis.z.abs() <= tolerance {
        let angle = axis.y.atan2(axis.x);
        Direction::InPlane(if angle <= -PI { PI } else { angle })
    } else if axis.x.abs() <= tolerance && axis.y.abs() <= tolerance {
        Direction::AcrossPlane
    } else {
        Direction::Oblique
    }
}

/// Whether a motion stays in the plane.
///
/// # Errors
/// Says which part leaves it.
pub fn check_motion(script: &[Motion]) -> Result<(), String> {
    let about_z = |axis: &Vector3<f64>| matches!(direction(axis), Direction::AcrossPlane);
    for part in script {
        let sound = match part {
            Motion::Rotate(m) => about_z(&m.axis.0),
            Motion::Spin(m) => about_z(&m.axis.0),
            Motion::Keyframes(m) => m.poses.iter().all(|p| p.rotate.x == 0.0 && p.rotate.y == 0.0),
            Motion::Translate(_) | Motion::Glide(_) | Motion::Oscillate(_) | Motion::Scale(_) => true,
        };
        if !sound {
            return Err("in two dimensions things turn about z only".to_owned());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::ShapeDescription;

    fn volume(text: &str) -> Volume {
        let scene = format!("Scene(units: Si, time: (end: 1, step: Fixed(1e-3)), solids: [(shape: {text})])");
        crate::scene::load_str(&scene, "shape.ron", &[]).unwrap().scene.solids[0].shape.clone()
    }

    /// A body that goes on along z has the distance of its planar shape everywhere outside.
    #[test]
    fn planar_shapes_are_slices_of_long_bodies() {
        let shapes = [
            "Sphere(center: [0.1, 0.2, 0], radius: 0.3)",
            "Box(center: [0.1, 0, 0], half_size: [0.3, 0.2, 10], rotate: [0, 0, 30])",
            "Cylinder(center: [0.1, 0, 0], axis: Z, radius: 0.3, half_length: 10)",
            "Cylinder(center: [0.1, 0, 0], axis: [1, 2, 0], radius: 0.3, half_length: 0.7)",
            "Capsule(center: [0.1, 0, 0], axis: [1, -2, 0], radius: 0.3, half_length: 0.7)",
            "HalfSpace(point: [0, 0.1, 0], normal: [0.3, 1, 0])",
            "Torus(center: [0, 0.1, 0], axis: Z, major_radius: 0.5, minor_radius: 0.1)",
        ];
        for text in shapes {
            let volume = volume(text);
            let planar = shape(&volume).unwrap();
            planar.check().unwrap();
            let solid: ShapeDescription = crate::world::solids::describe(&volume, 1.0);
            let solid = solid.build(std::path::Path::new("")).unwrap();
            for k in 0..400 {
                let (x, y) = (f64::from(k % 20) * 0.1 - 1.0, f64::from(k / 20) * 0.1 - 1.0);
                let here = planar.signed_distance(&nalgebra::Vector2::new(x, y));
                let there = solid.signed_distance(&Vector3::new(x, y, 0.0));
                assert!((here - there).abs() < 1e-9, "{text}: {here} and {there} at {x}, {y}");
            }
        }
        for text in [
            "Box(center: [0, 0, 0], half_size: [1, 1, 1], rotate: [10, 0, 0])",
            "Cylinder(center: [0, 0, 0], axis: [0, 1, 1], radius: 1, half_length: 1)",
            "HalfSpace(point: [0, 0, 0], normal: Z)",
            "Torus(center: [0, 0, 0], axis: Y, major_radius: 1, minor_radius: 0.1)",
        ] {
            assert!(shape(&volume(text)).is_err(), "{text}");
        }
    }
}
