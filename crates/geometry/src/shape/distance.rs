//! Exact distance and normal of every shape.

use super::{Shape, SurfaceSample};
use crate::Vector3;

impl Shape {
    /// Signed distance from `point` to the surface [m], negative inside.
    #[must_use]
    pub fn signed_distance(&self, point: &Vector3) -> f64 {
        match self {
            // The kinds with a cheaper way than the full sample.
            Shape::Sphere { center, radius } => (point - center).norm() - radius,
            Shape::HalfSpace { point: on_plane, normal } => (point - on_plane).dot(normal),
            Shape::Capsule { from, to, radius } => crate::closest::point_segment_distance(point, from, to) - radius,
            Shape::Rounded { shape, radius } => shape.signed_distance(point) - radius,
            Shape::Complement(shape) => -shape.signed_distance(point),
            Shape::Union(parts) => parts.iter().map(|part| part.signed_distance(point)).fold(f64::INFINITY, f64::min),
            _ => self.sample(point).distance,
        }
    }

    /// Signed distance and outward unit normal at the nearest surface point.
    #[must_use]
    pub fn sample(&self, point: &Vector3) -> SurfaceSample {
        match self {
            Shape::Sphere { center, radius } => from_core(&(point - center), Vector3::y(), *radius),
            Shape::Cuboid { center, rotation, core, rounding } => {
                let local = rotation.inverse_transform_vector(&(point - center));
                let sample = cuboid(&local, core);
                SurfaceSample { distance: sample.distance - rounding, normal: rotation * sample.normal }
            }
            Shape::Cylinder { center, axis, core_radius, core_half_length, rounding } => {
                let (radial, rho, height) = split(&(point - center), axis);
                let (q0, q1) = (rho - core_radius, height.abs() - core_half_length);
                let cap = axis * 1f64.copysign(height);
                let (p0, p1) = (q0.max(0.0), q1.max(0.0));
                let outside = p0.hypot(p1);
                if outside > 0.0 {
                    SurfaceSample { distance: outside - rounding, normal: (radial * p0 + cap * p1) / outside }
                } else if q0 > q1 {
                    SurfaceSample { distance: q0 - rounding, normal: radial }
                } else {
                    SurfaceSample { distance: q1 - rounding, normal: cap }
                }
            }
            Shape::Capsule { from, to, radius } => {
                let d = to - from;
                let nearest = from + d * crate::closest::point_segment(point, from, to);
                from_core(&(point - nearest), any_perpendicular(&d), *radius)
            }
            Shape::HalfSpace { point: on_plane, normal } => {
                SurfaceSample { distance: (point - on_plane).dot(normal), normal: *normal }
            }
            Shape::Torus { center, axis, major_radius, minor_radius } => {
                let (radial, rho, height) = split(&(point - center), axis);
                from_core(&(radial * (rho - major_radius) + axis * height), radial, *minor_radius)
            }
            Shape::Mesh(mesh) => mesh.sample(point),
            Shape::Rounded { shape, radius } => {
                let sample = shape.sample(point);
                SurfaceSample { distance: sample.distance - radius, normal: sample.normal }
            }
            Shape::Complement(shape) => {
                let sample = shape.sample(point);
                SurfaceSample { distance: -sample.distance, normal: -sample.normal }
            }
            Shape::Union(parts) => {
                let mut best = SurfaceSample { distance: f64::INFINITY, normal: Vector3::y() };
                for part in parts {
                    // The cheap distance first: only the nearest part needs a normal.
                    if part.signed_distance(point) < best.distance {
                        best = part.sample(point);
                    }
                }
                best
            }
        }
    }

    /// Outward unit normal at the nearest surface point.
    #[must_use]
    pub fn normal(&self, point: &Vector3) -> Vector3 {
        self.sample(point).normal
    }
}

/// A ball around a core point, line or ring: `offset` leads from the core to the point.
fn from_core(offset: &Vector3, fallback: Vector3, radius: f64) -> SurfaceSample {
    let length = offset.norm();
    let normal = if length > 0.0 { offset / length } else { fallback };
    SurfaceSample { distance: length - radius, normal }
}

/// Radial unit vector, distance from the axis and height along it. On the axis one fixed radial direction is taken.
fn split(offset: &Vector3, axis: &Vector3) -> (Vector3, f64, f64) {
    let height = offset.dot(axis);
    let radial = offset - axis * height;
    let rho = radial.norm();
    // Below round-off of the subtraction the direction is noise, and would not be perpendicular to the axis.
    if rho > 1e-15 * offset.norm() { (radial / rho, rho, height) } else { (any_perpendicular(axis), rho, height) }
}

/// A unit vector perpendicular to `v`, always the same for the same `v`.
pub(crate) fn any_perpendicular(v: &Vector3) -> Vector3 {
    let k = v.iamin();
    let mut e = Vector3::zeros();
    e[k] = 1.0;
    v.cross(&e).try_normalize(0.0).unwrap_or_else(Vector3::y)
}

fn cuboid(local: &Vector3, half: &Vector3) -> SurfaceSample {
    let q = local.abs() - half;
    let p = q.map(|x| x.max(0.0));
    let outside = p.norm();
    if outside > 0.0 {
        return SurfaceSample {
            distance: outside,
            normal: Vector3::from_fn(|k, _| (p[k] / outside).copysign(local[k])),
        };
    }
    let k = q.imax();
    let mut normal = Vector3::zeros();
    normal[k] = 1f64.copysign(local[k]);
    SurfaceSample { distance: q[k], normal }
}
