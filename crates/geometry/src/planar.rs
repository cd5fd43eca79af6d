//! Signed-distance shapes in the plane, for two-dimensional scenes.

use crate::{ShapeError, Vector2};
use serde::{Deserialize, Serialize};

/// A shape in the plane.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum PlanarShape {
    /// Disc.
    Circle {
        /// Centre [m].
        #[serde(default, with = "crate::vector_format")]
        center: Vector2,
        /// Radius [m], positive.
        radius: f64,
    },
    /// Rectangle.
    Rectangle {
        /// Centre [m].
        #[serde(default, with = "crate::vector_format")]
        center: Vector2,
        /// Half sides, rounding included [m], positive.
        #[serde(with = "crate::vector_format")]
        half_extents: Vector2,
        /// Angle of the first side against the first axis [rad].
        #[serde(default)]
        angle: f64,
        /// Radius of the corners [m], from 0 to the smaller half side.
        #[serde(default)]
        rounding: f64,
    },
    /// All points within a radius of a segment.
    Capsule {
        /// First end [m].
        #[serde(with = "crate::vector_format")]
        from: Vector2,
        /// Second end [m].
        #[serde(with = "crate::vector_format")]
        to: Vector2,
        /// Radius [m], positive.
        radius: f64,
    },
    /// All points behind a line.
    HalfPlane {
        /// A point of the line [m].
        #[serde(default, with = "crate::vector_format")]
        point: Vector2,
        /// Normal out of the solid; its length does not matter.
        #[serde(with = "crate::vector_format")]
        normal: Vector2,
    },
    /// Inside out.
    Complement(Box<PlanarShape>),
    /// All points in any of the parts.
    Union(Vec<PlanarShape>),
}

impl PlanarShape {
    /// Checks every number.
    ///
    /// # Errors
    /// [`ShapeError`] names the shape, the field, the value and what is allowed.
    pub fn check(&self) -> Result<(), ShapeError> {
        let positive = |shape, field, value: f64| {
            if value > 0.0 && value.is_finite() {
                Ok(())
            } else {
                Err(ShapeError::Range { shape, field, value, range: "positive and finite [m]" })
            }
        };
        let finite = |shape, field, value: &Vector2| {
            if value.iter().all(|x| x.is_finite()) {
                Ok(())
            } else {
                Err(ShapeError::Vector { shape, field, wanted: "finite" })
            }
        };
        match self {
            PlanarShape::Circle { center, radius } => {
                finite("Circle", "center", center)?;
                positive("Circle", "radius", *radius)
            }
            PlanarShape::Rectangle { center, half_extents, angle, rounding } => {
                finite("Rectangle", "center", center)?;
                positive("Rectangle", "half_extents", half_extents.x)?;
                positive("Rectangle", "half_extents", half_extents.y)?;
                if !angle.is_finite() {
                    return Err(ShapeError::Range {
                        shape: "Rectangle",
                        field: "angle",
                        value: *angle,
                        range: "finite [rad]",
                    });
                }
                if !(0.0..=half_extents.min()).contains(rounding) {
                    let range = "between 0 and the smaller half side [m]";
                    return Err(ShapeError::Range { shape: "Rectangle", field: "rounding", value: *rounding, range });
                }
                Ok(())
            }
            PlanarShape::Capsule { from, to, radius } => {
                finite("Capsule", "from", from)?;
                finite("Capsule", "to", to)?;
                positive("Capsule", "radius", *radius)
            }
            PlanarShape::HalfPlane { point, normal } => {
                finite("HalfPlane", "point", point)?;
                finite("HalfPlane", "normal", normal)?;
                if normal.norm() > 0.0 {
                    Ok(())
                } else {
                    Err(ShapeError::Vector { shape: "HalfPlane", field: "normal", wanted: "not zero" })
                }
            }
            PlanarShape::Complement(shape) => shape.check(),
            PlanarShape::Union(parts) if parts.is_empty() => Err(ShapeError::EmptyUnion),
            PlanarShape::Union(parts) => parts.iter().try_for_each(PlanarShape::check),
        }
    }

    /// Signed distance [m], negative inside.
    #[must_use]
    pub fn signed_distance(&self, point: &Vector2) -> f64 {
        self.sample(point).0
    }

    /// Signed distance [m] and outward unit normal of the nearest point of the outline.
    #[must_use]
    pub fn sample(&self, point: &Vector2) -> (f64, Vector2) {
        match self {
            PlanarShape::Circle { center, radius } => from_core(&(point - center), Vector2::y(), *radius),
            PlanarShape::Rectangle { center, half_extents, angle, rounding } => {
                let turn = nalgebra::Rotation2::new(*angle);
                let local = turn.inverse_transform_vector(&(point - center));
                let q = local.abs() - half_extents.add_scalar(-rounding);
                let p = q.map(|x| x.max(0.0));
                let outside = p.norm();
                let k = if outside > 0.0 { 2 } else { q.imax() };
                let normal = Vector2::from_fn(|i, _| {
                    let size = if k == 2 { p[i] / outside } else { f64::from(u8::from(i == k)) };
                    if size == 0.0 { 0.0 } else { size.copysign(local[i]) }
                });
                (if k == 2 { outside } else { q[k] } - rounding, turn * normal)
            }
            PlanarShape::Capsule { from, to, radius } => {
                let d = to - from;
                let dd = d.norm_squared();
                let s = if dd > 0.0 { ((point - from).dot(&d) / dd).clamp(0.0, 1.0) } else { 0.0 };
                let side = Vector2::new(-d.y, d.x).try_normalize(0.0).unwrap_or_else(Vector2::y);
                from_core(&(point - (from + d * s)), side, *radius)
            }
            PlanarShape::HalfPlane { point: on_line, normal } => {
                let normal = normal.normalize();
                ((point - on_line).dot(&normal), normal)
            }
            PlanarShape::Complement(shape) => {
                let (distance, normal) = shape.sample(point);
                (-distance, -normal)
            }
            PlanarShape::Union(parts) => {
                let far = (f64::INFINITY, Vector2::y());
                parts
                    .iter()
                    .map(|part| part.sample(point))
                    .fold(far, |best, next| if next.0 < best.0 { next } else { best })
            }
        }
    }
}

fn from_core(offset: &Vector2, fallback: Vector2, radius: f64) -> (f64, Vector2) {
    let length = offset.norm();
    (length - radius, if length > 0.0 { offset / length } else { fallback })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn shapes() -> Vec<PlanarShape> {
        [
            "Circle(center: (0.2, 0.1), radius: 0.7)",
            "Rectangle(center: (0.1, 0), half_extents: (0.8, 0.4), angle: 0.5)",
            "Rectangle(half_extents: (0.8, 0.4), rounding: 0.3)",
            "Capsule(from: (-0.5, 0), to: (0.5, 0.5), radius: 0.3)",
            "HalfPlane(point: (0, 0.2), normal: (1, 2))",
            "Complement(Circle(radius: 1.2))",
        ]
        .into_iter()
        .map(|text| ron::from_str(text).unwrap())
        .collect()
    }

    proptest! {
        /// The foot of every point lies on the outline, and the disc up to it holds no outline: the distance is exact.
        #[test]
        fn distance_is_exact(x in -2.0..2.0f64, y in -2.0..2.0f64) {
            for shape in shapes() {
                shape.check().unwrap();
                let point = Vector2::new(x, y);
                let (distance, normal) = shape.sample(&point);
                prop_assert!((normal.norm() - 1.0).abs() < 1e-14);
                prop_assert!(shape.signed_distance(&(point - normal * distance)).abs() < 1e-12);
                for i in 0..64 {
                    let angle = f64::from(i) * std::f64::consts::TAU / 64.0;
                    let rim = point + Vector2::new(angle.cos(), angle.sin()) * (distance.abs() * (1.0 - 1e-9));
                    prop_assert!(shape.signed_distance(&rim) * distance >= 0.0);
                }
            }
        }
    }

    #[test]
    fn bad_shapes_are_refused() {
        for text in [
            "Circle(radius: 0)",
            "Rectangle(half_extents: (1, 2), rounding: 1.5)",
            "HalfPlane(normal: (0, 0))",
            "Union([])",
        ] {
            assert!(ron::from_str::<PlanarShape>(text).unwrap().check().is_err(), "{text}");
        }
    }
}
