//! Triangles of shapes, for pictures and for sampling surfaces.

use super::Shape;
use super::distance::any_perpendicular;
use crate::Vector3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// A triangle surface, counter-clockwise seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceMesh {
    /// Vertices [m].
    pub positions: Vec<Vector3>,
    /// Triangles.
    pub triangles: Vec<[u32; 3]>,
}

impl SurfaceMesh {
    fn append(&mut self, other: SurfaceMesh) {
        let base = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + base)));
    }

    fn flipped(mut self) -> SurfaceMesh {
        self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        self
    }

    /// Volume enclosed [m³], positive if the triangles face outward.
    #[must_use]
    pub fn volume(&self) -> f64 {
        let p = |v: u32| self.positions[v as usize];
        self.triangles.iter().map(|t| p(t[0]).dot(&p(t[1]).cross(&p(t[2]))) / 6.0).sum()
    }
}

impl Shape {
    /// Triangles of the surface with about `segments` edges around a circle (at least 4). What has no end is cut off at
    /// `extent` [m] from its centre.
    #[must_use]
    pub fn tessellate(&self, segments: usize, extent: f64) -> SurfaceMesh {
        let n = segments.max(4).div_ceil(4) * 4;
        match self {
            Shape::Sphere { center, radius } => {
                lathe(center, &Vector3::y(), n, &arc(0.0, 0.0, *radius, -FRAC_PI_2, FRAC_PI_2, n / 2))
            }
            Shape::Cuboid { center, rotation, core, rounding } => {
                let mut surface = rounded_cuboid(core, *rounding, n);
                surface.positions.iter_mut().for_each(|p| *p = rotation * *p + center);
                surface
            }
            Shape::Cylinder { center, axis, core_radius, core_half_length, rounding } => {
                let quarter = if *rounding > 0.0 { n / 4 } else { 0 };
                let mut profile = vec![(0.0, -core_half_length - rounding)];
                profile.extend(arc(*core_radius, -core_half_length, *rounding, -FRAC_PI_2, 0.0, quarter));
                profile.extend(arc(*core_radius, *core_half_length, *rounding, 0.0, FRAC_PI_2, quarter));
                profile.push((0.0, core_half_length + rounding));
                lathe(center, axis, n, &profile)
            }
            Shape::Capsule { from, to, radius } => {
                let half = 0.5 * (to - from).norm();
                let axis = (to - from).try_normalize(0.0).unwrap_or_else(Vector3::y);
                let mut profile = arc(0.0, -half, *radius, -FRAC_PI_2, 0.0, n / 4);
                profile.extend(arc(0.0, half, *radius, 0.0, FRAC_PI_2, n / 4));
                lathe(&((from + to) * 0.5), &axis, n, &profile)
            }
            Shape::HalfSpace { point, normal } => {
                let u = any_perpendicular(normal);
                let v = normal.cross(&u);
                let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
                SurfaceMesh {
                    positions: corners.map(|(a, b)| point + (u * a + v * b) * extent).to_vec(),
                    triangles: vec![[0, 1, 2], [0, 2, 3]],
                }
            }
            Shape::Torus { center, axis, major_radius, minor_radius } => {
                let mut profile = arc(*major_radius, 0.0, *minor_radius, -PI, PI, n / 2);
                profile[n / 2] = profile[0];
                lathe(center, axis, n, &profile)
            }
            Shape::Mesh(mesh) => SurfaceMesh { positions: mesh.positions(), triangles: mesh.triangles().to_vec() },
            Shape::Rounded { shape, radius } => {
                let mut surface = shape.tessellate(segments, extent);
                for position in &mut surface.positions {
                    *position += shape.normal(position) * *radius;
                }
                surface
            }
            Shape::Complement(shape) => shape.tessellate(segments, extent).flipped(),
            Shape::Union(parts) => parts.iter().fold(SurfaceMesh::default(), |mut all, part| {
                all.append(part.tessellate(segments, extent));
                all
            }),
        }
    }
}

/// Points `(radius, height)` on an arc, ends included; a single point if `steps` is zero.
fn arc(rho: f64, height: f64, radius: f64, from: f64, to: f64, steps: usize) -> Vec<(f64, f64)> {
    (0..=steps)
        .map(|i| {
            let angle = from + (to - from) * i as f64 / steps.max(1) as f64;
            let reach = radius * angle.cos();
            // Poles are points, to the last bit: otherwise a sphere has pinholes.
            let reach = if reach.abs() < 1e-15 * radius { 0.0 } else { reach };
            (rho + reach, height + radius * angle.sin())
        })
        .collect()
}

/// Turns a profile `(radius, height)`, rising along the outside, about an axis.
fn lathe(center: &Vector3, axis: &Vector3, segments: usize, profile: &[(f64, f64)]) -> SurfaceMesh {
    let u = any_perpendicular(axis);
    let v = axis.cross(&u);
    let mut surface = SurfaceMesh::default();
    for &(rho, height) in profile {
        for k in 0..segments {
            let angle = TAU * k as f64 / segments as f64;
            surface.positions.push(center + axis * height + (u * angle.cos() + v * angle.sin()) * rho);
        }
    }
    for ring in 1..profile.len() {
        for k in 0..segments {
            let next = (k + 1) % segments;
            let at = |r: usize, s: usize| (r * segments + s) as u32;
            let corners = [at(ring - 1, k), at(ring - 1, next), at(ring, next), at(ring, k)];
            push_quad(&mut surface, corners);
        }
    }
    surface
}

/// Two triangles, leaving out those without area.
fn push_quad(surface: &mut SurfaceMesh, [a, b, c, d]: [u32; 4]) {
    for triangle in [[a, b, c], [a, c, d]] {
        let p = triangle.map(|v| surface.positions[v as usize]);
        let (e, f) = (p[1] - p[0], p[2] - p[0]);
        if e.cross(&f).norm() > 1e-12 * (e.norm_squared() + f.norm_squared()) {
            surface.triangles.push(triangle);
        }
    }
}

/// Support points of a cuboid rounded by a ball: a sphere split at the coordinate planes and pulled apart to the corners.
/// Directions avoid the planes, so that the strips in between become the flat faces and the edges.
fn rounded_cuboid(core: &Vector3, rounding: f64, n: usize) -> SurfaceMesh {
    let per_octant = if rounding > 0.0 { n / 4 } else { 1 };
    let octant = |i: usize| {
        let (quarter, step) = (i / (per_octant + 1), i % (per_octant + 1));
        let signs = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)][quarter % 4];
        (FRAC_PI_2 * (quarter as f64 + step as f64 / per_octant as f64), signs)
    };
    let around = 4 * (per_octant + 1);
    let mut surface = SurfaceMesh::default();
    let mut rings = 0;
    for half in [-1.0, 1.0] {
        for step in 0..=per_octant {
            let fraction = step as f64 / per_octant as f64;
            let polar = if half < 0.0 { -FRAC_PI_2 * (1.0 - fraction) } else { FRAC_PI_2 * fraction };
            for k in 0..around {
                let (angle, (sx, sz)) = octant(k);
                let direction = Vector3::new(polar.cos() * angle.cos(), polar.sin(), polar.cos() * angle.sin());
                surface.positions.push(Vector3::new(sx * core.x, half * core.y, sz * core.z) + direction * rounding);
            }
            rings += 1;
        }
    }
    // The first and last rings are the rims of the flat lids.
    let lids = [(0usize, -1.0), (rings - 1, 1.0)];
    for (ring, sign) in lids {
        let middle = surface.positions.len() as u32;
        surface.positions.push(Vector3::new(0.0, sign * (core.y + rounding), 0.0));
        for k in 0..around {
            let (a, b) = ((ring * around + k) as u32, (ring * around + (k + 1) % around) as u32);
            let corners = if sign > 0.0 { [middle, b, a, a] } else { [middle, a, b, b] };
            push_quad(&mut surface, corners);
        }
    }
    for ring in 1..rings {
        for k in 0..around {
            let next = (k + 1) % around;
            let at = |r: usize, s: usize| (r * around + s) as u32;
            push_quad(&mut surface, [at(ring - 1, next), at(ring - 1, k), at(ring, k), at(ring, next)]);
        }
    }
    surface
}

#[cfg(test)]
mod tests {
    use crate::shape::ShapeDescription;
    use std::path::Path;

    #[test]
    fn triangles_lie_on_the_surface_face_out_and_enclose_the_volume() {
        let tau = std::f64::consts::TAU;
        let rounded = {
            // Steiner's formula for a ball of 0.3 rolled over a core cuboid of half sides (0.7, 1.7, 2.7).
            let (a, b, c, r) = (1.4, 3.4, 5.4, 0.3f64);
            a * b * c
                + 2.0 * r * (a * b + b * c + c * a)
                + tau / 2.0 * r * r * (a + b + c)
                + 2.0 / 3.0 * tau * r.powi(3)
        };
        for (text, volume) in [
            ("Sphere(center: (1, 2, 3), radius: 2)", 2.0 / 3.0 * tau * 8.0),
            ("Box(center: (1, 2, 3), half_extents: (1, 2, 3), rotation: (0.3, 1, 0))", 48.0),
            ("Box(center: (1, 2, 3), half_extents: (1, 2, 3), rotation: (0.3, 1, 0), rounding: 0.3)", rounded),
            ("Cylinder(center: (1, 0, 0), axis: Along((1, 1, 0)), radius: 1, half_length: 2)", tau * 2.0),
            ("Capsule(from: (0, 0, 0), to: (3, 4, 0), radius: 1)", 2.0 / 3.0 * tau + tau / 2.0 * 5.0),
            ("Torus(axis: X, major_radius: 2, minor_radius: 0.5)", tau * 2.0 * tau / 2.0 * 0.25),
        ] {
            let description: ShapeDescription = ron::from_str(text).unwrap();
            let shape = description.build(Path::new(".")).unwrap();
            let surface = shape.tessellate(96, 1.0);
            for position in &surface.positions {
                assert!(shape.signed_distance(position).abs() < 1e-12, "{text}: {}", shape.signed_distance(position));
            }
            assert!((surface.volume() / volume - 1.0).abs() < 4e-3, "{text}: {} against {volume}", surface.volume());
        }
    }
}
