//! Shapes as a scene describes them, and the checks that turn them into [`Shape`]s.

use super::Shape;
use crate::mesh::{MeshError, TriangleMesh};
use crate::{Pose, Vector3};
use nalgebra::UnitQuaternion;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use thiserror::Error;

/// A direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Axis {
    /// First coordinate axis.
    X,
    /// Second coordinate axis.
    #[default]
    Y,
    /// Third coordinate axis.
    Z,
    /// Any direction; its length does not matter.
    Along(#[serde(with = "crate::vector_format")] Vector3),
}

impl Axis {
    /// Unit vector, or none if the direction is zero or not finite.
    #[must_use]
    pub fn unit(self) -> Option<Vector3> {
        match self {
            Axis::X => Some(Vector3::x()),
            Axis::Y => Some(Vector3::y()),
            Axis::Z => Some(Vector3::z()),
            Axis::Along(v) => {
                let largest = v.amax();
                (largest > 0.0 && largest.is_finite() && v.iter().all(|x| x.is_finite()))
                    .then(|| (v / largest).normalize())
            }
        }
    }
}

/// A shape as written in a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum ShapeDescription {
    /// Ball.
    Sphere {
        /// Centre [m].
        #[serde(default, with = "crate::vector_format")]
        center: Vector3,
        /// Radius [m], positive.
        radius: f64,
    },
    /// Cuboid.
    Box {
        /// Centre [m].
        #[serde(default, with = "crate::vector_format")]
        center: Vector3,
        /// Half sides, rounding included [m], positive.
        #[serde(with = "crate::vector_format")]
        half_extents: Vector3,
        /// Rotation vector: axis times angle [rad].
        #[serde(default, with = "crate::vector_format")]
        rotation: Vector3,
        /// Radius of the edges [m], from 0 to the smallest half side.
        #[serde(default)]
        rounding: f64,
    },
    /// Closed circular cylinder.
    Cylinder {
        /// Centre [m].
        #[serde(default, with = "crate::vector_format")]
        center: Vector3,
        /// Axis.
        #[serde(default)]
        axis: Axis,
        /// Radius, rounding included [m], positive.
        radius: f64,
        /// Half length, rounding included [m], positive.
        half_length: f64,
        /// Radius of the rims [m], from 0 to the smaller of radius and half length.
        #[serde(default)]
        rounding: f64,
    },
    /// All points within a radius of a segment.
    Capsule {
        /// First end of the segment [m].
        #[serde(with = "crate::vector_format")]
        from: Vector3,
        /// Second end of the segment [m].
        #[serde(with = "crate::vector_format")]
        to: Vector3,
        /// Radius [m], positive.
        radius: f64,
    },
    /// All points behind a plane.
    HalfSpace {
        /// A point of the plane [m].
        #[serde(default, with = "crate::vector_format")]
        point: Vector3,
        /// Normal out of the solid; its length does not matter.
        #[serde(with = "crate::vector_format")]
        normal: Vector3,
    },
    /// Ring with a circular section.
    Torus {
        /// Centre [m].
        #[serde(default, with = "crate::vector_format")]
        center: Vector3,
        /// Axis.
        #[serde(default)]
        axis: Axis,
        /// Radius of the centre line [m], larger than the minor radius.
        major_radius: f64,
        /// Radius of the section [m], positive.
        minor_radius: f64,
    },
    /// Closed triangle mesh from an OBJ or STL file.
    Mesh {
        /// File, relative to the scene.
        file: PathBuf,
        /// Scale applied first, positive.
        #[serde(default = "one")]
        scale: f64,
        /// Then a rotation vector: axis times angle [rad].
        #[serde(default, with = "crate::vector_format")]
        rotation: Vector3,
        /// Then a translation [m].
        #[serde(default, with = "crate::vector_format")]
        translation: Vector3,
    },
    /// A shape with its surface moved outward, which rounds its edges.
    Rounded {
        /// What is rounded.
        shape: Box<ShapeDescription>,
        /// How far the surface moves [m], positive.
        radius: f64,
    },
    /// Inside out: the cavity of that shape in a solid without end.
    Complement(Box<ShapeDescription>),
    /// All points in any of the parts.
    Union(Vec<ShapeDescription>),
}

fn one() -> f64 {
    1.0
}

/// What is wrong with a shape.
#[derive(Debug, Error)]
pub enum ShapeError {
    /// A number is out of its range.
    #[error("{shape}: `{field}` = {value} must be {range}")]
    Range {
        /// Which kind of shape.
        shape: &'static str,
        /// Which field.
        field: &'static str,
        /// What was given.
        value: f64,
        /// What is allowed, with unit.
        range: &'static str,
    },
    /// A direction is zero or not finite, or a position is not finite.
    #[error("{shape}: `{field}` must be {wanted}")]
    Vector {
        /// Which kind of shape.
        shape: &'static str,
        /// Which field.
        field: &'static str,
        /// What is allowed.
        wanted: &'static str,
    },
    /// A union of nothing.
    #[error("Union: needs at least one part")]
    EmptyUnion,
    /// The mesh cannot be used.
    #[error("Mesh {}: {source}", file.display())]
    Mesh {
        /// File.
        file: PathBuf,
        /// Why.
        #[source]
        source: MeshError,
    },
}

fn positive(shape: &'static str, field: &'static str, value: f64) -> Result<f64, ShapeError> {
    if value > 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err(ShapeError::Range { shape, field, value, range: "positive and finite [m]" })
    }
}

fn finite(shape: &'static str, field: &'static str, value: &Vector3) -> Result<Vector3, ShapeError> {
    if value.iter().all(|x| x.is_finite()) {
        Ok(*value)
    } else {
        Err(ShapeError::Vector { shape, field, wanted: "finite" })
    }
}

fn direction(shape: &'static str, field: &'static str, axis: Axis) -> Result<Vector3, ShapeError> {
    axis.unit().ok_or(ShapeError::Vector { shape, field, wanted: "finite and not zero" })
}

fn rounding_within(shape: &'static str, value: f64, limit: f64) -> Result<f64, ShapeError> {
    if (0.0..=limit).contains(&value) {
        Ok(value)
    } else {
        Err(ShapeError::Range { shape, field: "rounding", value, range: "between 0 and the smallest half side [m]" })
    }
}

/// Moves a surface outward; convex primitives stay primitives.
fn rounded(mut shape: Shape, offset: f64) -> Shape {
    match &mut shape {
        Shape::Sphere { radius, .. } | Shape::Capsule { radius, .. } => *radius += offset,
        Shape::Cuboid { rounding, .. } | Shape::Cylinder { rounding, .. } => *rounding += offset,
        Shape::HalfSpace { point, normal } => *point += *normal * offset,
        Shape::Torus { major_radius, minor_radius, .. } if *minor_radius + offset < *major_radius => {
            *minor_radius += offset
        }
        _ => return Shape::Rounded { shape: Box::new(shape), radius: offset },
    }
    shape
}

impl ShapeDescription {
    /// Checks the description and makes the shape; files are looked up from `base`.
    ///
    /// # Errors
    /// [`ShapeError`] names the shape, the field, the value and what is allowed.
    pub fn build(&self, base: &Path) -> Result<Shape, ShapeError> {
        Ok(match self {
            ShapeDescription::Sphere { center, radius } => Shape::Sphere {
                center: finite("Sphere", "center", center)?,
                radius: positive("Sphere", "radius", *radius)?,
            },
            ShapeDescription::Box { center, half_extents, rotation, rounding } => {
                for side in half_extents.iter() {
                    positive("Box", "half_extents", *side)?;
                }
                let rounding = rounding_within("Box", *rounding, half_extents.min())?;
                Shape::Cuboid {
                    center: finite("Box", "center", center)?,
                    rotation: UnitQuaternion::from_scaled_axis(finite("Box", "rotation", rotation)?),
                    core: half_extents.add_scalar(-rounding),
                    rounding,
                }
            }
            ShapeDescription::Cylinder { center, axis, radius, half_length, rounding } => {
                positive("Cylinder", "radius", *radius)?;
                positive("Cylinder", "half_length", *half_length)?;
                let rounding = rounding_within("Cylinder", *rounding, radius.min(*half_length))?;
                Shape::Cylinder {
                    center: finite("Cylinder", "center", center)?,
                    axis: direction("Cylinder", "axis", *axis)?,
                    core_radius: radius - rounding,
                    core_half_length: half_length - rounding,
                    rounding,
                }
            }
            ShapeDescription::Capsule { from, to, radius } => Shape::Capsule {
                from: finite("Capsule", "from", from)?,
                to: finite("Capsule", "to", to)?,
                radius: positive("Capsule", "radius", *radius)?,
            },
            ShapeDescription::HalfSpace { point, normal } => Shape::HalfSpace {
                point: finite("HalfSpace", "point", point)?,
                normal: direction("HalfSpace", "normal", Axis::Along(*normal))?,
            },
            ShapeDescription::Torus { center, axis, major_radius, minor_radius } => {
                positive("Torus", "major_radius", *major_radius)?;
                positive("Torus", "minor_radius", *minor_radius)?;
                if minor_radius >= major_radius {
                    let range = "smaller than `major_radius` [m]";
                    return Err(ShapeError::Range {
                        shape: "Torus",
                        field: "minor_radius",
                        value: *minor_radius,
                        range,
                    });
                }
                Shape::Torus {
                    center: finite("Torus", "center", center)?,
                    axis: direction("Torus", "axis", *axis)?,
                    major_radius: *major_radius,
                    minor_radius: *minor_radius,
                }
            }
            ShapeDescription::Mesh { file, scale, rotation, translation } => {
                positive("Mesh", "scale", *scale)?;
                let pose = Pose {
                    scale: *scale,
                    rotation: UnitQuaternion::from_scaled_axis(finite("Mesh", "rotation", rotation)?),
                    translation: finite("Mesh", "translation", translation)?,
                };
                let mesh = TriangleMesh::load(&base.join(file), &pose);
                Shape::Mesh(Arc::new(mesh.map_err(|source| ShapeError::Mesh { file: file.clone(), source })?))
            }
            ShapeDescription::Rounded { shape, radius } => {
                rounded(shape.build(base)?, positive("Rounded", "radius", *radius)?)
            }
            ShapeDescription::Complement(shape) => Shape::Complement(Box::new(shape.build(base)?)),
            ShapeDescription::Union(parts) if parts.is_empty() => return Err(ShapeError::EmptyUnion),
            ShapeDescription::Union(parts) => {
                Shape::Union(parts.iter().map(|part| part.build(base)).collect::<Result<_, _>>()?)
            }
        })
    }

    /// The same shape with all lengths multiplied (unit conversion); a mesh file is taken to be in that unit.
    #[must_use]
    pub fn with_length_unit(&self, unit: f64) -> ShapeDescription {
        let mut scaled = self.clone();
        match &mut scaled {
            ShapeDescription::Sphere { center, radius } => (*center, *radius) = (*center * unit, *radius * unit),
            ShapeDescription::Box { center, half_extents, rounding, .. } => {
                *center *= unit;
                *half_extents *= unit;
                *rounding *= unit;
            }
            ShapeDescription::Cylinder { center, radius, half_length, rounding, .. } => {
                *center *= unit;
                *radius *= unit;
                *half_length *= unit;
                *rounding *= unit;
            }
            ShapeDescription::Capsule { from, to, radius } => {
                *from *= unit;
                *to *= unit;
                *radius *= unit;
            }
            ShapeDescription::HalfSpace { point, .. } => *point *= unit,
            ShapeDescription::Torus { center, major_radius, minor_radius, .. } => {
                *center *= unit;
                *major_radius *= unit;
                *minor_radius *= unit;
            }
            ShapeDescription::Mesh { scale, translation, .. } => {
                *scale *= unit;
                *translation *= unit;
            }
            ShapeDescription::Rounded { shape, radius } => {
                **shape = shape.with_length_unit(unit);
                *radius *= unit;
            }
            ShapeDescription::Complement(shape) => **shape = shape.with_length_unit(unit),
            ShapeDescription::Union(parts) => parts.iter_mut().for_each(|part| *part = part.with_length_unit(unit)),
        }
        scaled
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn build(text: &str) -> Result<Shape, String> {
        let description: ShapeDescription = ron::from_str(text).map_err(|e| e.to_string())?;
        let again: ShapeDescription = ron::from_str(&ron::to_string(&description).unwrap()).unwrap();
        assert_eq!(format!("{description:?}"), format!("{again:?}"));
        description.build(Path::new(".")).map_err(|e| e.to_string())
    }

    #[test]
    fn reads_both_brackets_and_all_kinds() {
        for text in [
            "Sphere(radius: 1)",
            "Sphere(center: [0, 1.5, -2], radius: 1)",
            "Box(center: (0, 0, 0), half_extents: [1, 2, 3], rotation: [0, 0, 1.0], rounding: 0.5)",
            "Cylinder(center: [0, 16, 0], axis: Y, radius: 0.433, half_length: 0.5)",
            "Cylinder(axis: Along([1, 1, 0]), radius: 1, half_length: 2)",
            "Capsule(from: (0, 0, 0), to: (1, 0, 0), radius: 0.1)",
            "HalfSpace(point: [0, -20, 0], normal: [0, 1, 0])",
            "Torus(axis: Z, major_radius: 2, minor_radius: 1)",
            "Union([Sphere(radius: 1), Complement(Rounded(shape: Sphere(radius: 2), radius: 1))])",
        ] {
            build(text).unwrap();
        }
    }

    #[test]
    fn refuses_with_field_value_and_range() {
        for (text, needle) in [
            ("Sphere(radius: -1)", "`radius` = -1 must be positive"),
            ("Sphere(radius: NaN)", "`radius` = NaN"),
            ("Sphere(centre: (0, 0, 0), radius: 1)", "centre"),
            ("Sphere(center: (0, 0), radius: 1)", "3 numbers"),
            ("Sphere(center: (0, 0, 0, 0), radius: 1)", ""),
            ("Sphere(center: (0, inf, 0), radius: 1)", "`center` must be finite"),
            ("HalfSpace(normal: (0, 0, 0))", "`normal` must be finite and not zero"),
            ("Box(half_extents: (1, 1, 0.1), rounding: 0.2)", "`rounding` = 0.2"),
            ("Torus(major_radius: 1, minor_radius: 2)", "smaller than `major_radius`"),
            ("Union([])", "at least one"),
            ("Mesh(file: \"nothing.obj\")", "nothing.obj"),
        ] {
            let error = build(text).unwrap_err();
            assert!(error.contains(needle), "{text}: {error}");
        }
    }

    #[test]
    fn length_unit_scales_distances() {
        for text in [
            "Box(center: (1, 0, 0), half_extents: (1, 2, 3), rounding: 0.5)",
            "Torus(major_radius: 2, minor_radius: 1)",
            "Union([Cylinder(radius: 1, half_length: 2), Rounded(shape: Capsule(from: (0, 0, 0), to: (5, 0, 0), radius: 1), radius: 1)])",
            "Complement(HalfSpace(point: (0, 3, 0), normal: (0, 1, 0)))",
        ] {
            let description: ShapeDescription = ron::from_str(text).unwrap();
            let (one, small) = (
                description.build(Path::new(".")).unwrap(),
                description.with_length_unit(0.01).build(Path::new(".")).unwrap(),
            );
            let x = Vector3::new(3.0, 1.0, 0.5);
            approx::assert_relative_eq!(
                one.signed_distance(&x) * 0.01,
                small.signed_distance(&(x * 0.01)),
                max_relative = 1e-12
            );
        }
    }
}
