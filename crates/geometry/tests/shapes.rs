//! Distances are exact: the foot of every point is on the surface, and the ball up to it holds no surface.

use geometry::{Shape, ShapeDescription, TriangleMesh, Vector3};
use proptest::prelude::*;
use std::path::Path;
use std::sync::Arc;

fn shape(text: &str) -> Shape {
    ron::from_str::<ShapeDescription>(text).unwrap().build(Path::new(".")).unwrap()
}

fn exact_shapes() -> Vec<(&'static str, Shape)> {
    [
        "Sphere(center: (0.2, 0.1, -0.3), radius: 0.7)",
        "Box(center: (0.1, 0, 0.3), half_extents: (0.8, 0.4, 0.2), rotation: (0.3, 0.5, 1))",
        "Box(half_extents: (0.8, 0.4, 0.5), rounding: 0.3)",
        "Box(half_extents: (0.4, 0.4, 0.4), rounding: 0.4)",
        "Cylinder(center: (0.1, 0, 0.2), axis: Along((1, 2, 0.5)), radius: 0.6, half_length: 0.8)",
        "Cylinder(axis: Z, radius: 0.6, half_length: 0.3, rounding: 0.2)",
        "Capsule(from: (-0.5, 0, 0.2), to: (0.5, 0.5, 0), radius: 0.3)",
        "HalfSpace(point: (0, 0.2, 0), normal: (1, 2, -1))",
        "Torus(center: (0, 0.1, 0), axis: Along((0.2, 1, 0)), major_radius: 0.8, minor_radius: 0.3)",
        "Rounded(shape: Box(half_extents: (0.5, 0.3, 0.4)), radius: 0.2)",
        "Complement(Box(half_extents: (1.2, 1.4, 1.1), rounding: 0.1))",
        "Union([Sphere(center: (-0.9, 0, 0), radius: 0.5), Sphere(center: (0.9, 0, 0), radius: 0.6)])",
    ]
    .into_iter()
    .map(|text| (text, shape(text)))
    .collect()
}

/// Directions spread evenly over the sphere.
fn directions(n: usize) -> impl Iterator<Item = Vector3> {
    (0..n).map(move |i| {
        let y = 1.0 - 2.0 * (i as f64 + 0.5) / n as f64;
        let angle = i as f64 * 2.399_963_229_728_653;
        let r = (1.0 - y * y).sqrt();
        Vector3::new(r * angle.cos(), y, r * angle.sin())
    })
}

proptest! {
    #[test]
    fn distance_is_exact_and_gradient_is_the_unit_normal(x in [-2.0..2.0f64, -2.0..2.0, -2.0..2.0]) {
        let point = Vector3::from(x);
        for (text, shape) in exact_shapes() {
            let sample = shape.sample(&point);
            prop_assert!((sample.normal.norm() - 1.0).abs() < 1e-13, "{text}");
            prop_assert!((shape.signed_distance(&point) - sample.distance).abs() < 1e-14, "{text}");
            let foot = point - sample.normal * sample.distance;
            prop_assert!(shape.signed_distance(&foot).abs() < 1e-12, "{text}: foot at {}", shape.signed_distance(&foot));
            for direction in directions(60) {
                let rim = point + direction * (sample.distance.abs() * (1.0 - 1e-9));
                prop_assert!(shape.signed_distance(&rim) * sample.distance >= 0.0, "{text}: surface inside the free ball");
            }
            // |∇φ| = 1 by central differences, wherever the difference does not straddle the medial axis.
            let h = 1e-6;
            let gradient = Vector3::from_fn(|k, _| {
                let mut step = Vector3::zeros();
                step[k] = h;
                (shape.signed_distance(&(point + step)) - shape.signed_distance(&(point - step))) / (2.0 * h)
            });
            let nearby = shape.normal(&(point + sample.normal * 1e-5));
            if (nearby - sample.normal).norm() < 1e-3 && sample.distance.abs() > 1e-3 && (gradient.norm() - 1.0).abs() > 1e-6 {
                // Only the medial axis may do this: the normals on its two sides differ.
                let jumps = directions(20).any(|d| (shape.normal(&(point + d * (2.0 * h))) - sample.normal).norm() > 1e-2);
                prop_assert!(jumps, "{text}: gradient {} at {point}", gradient.norm());
            }
        }
    }

    #[test]
    fn bounds_hold_the_shape_and_are_tight(x in [-2.0..2.0f64, -2.0..2.0, -2.0..2.0]) {
        let point = Vector3::from(x);
        for (text, shape) in exact_shapes() {
            let Some(bounds) = shape.bounds() else { continue };
            if shape.signed_distance(&point) <= 0.0 {
                prop_assert!(bounds.contains(&point), "{text}");
            }
        }
    }
}

#[test]
fn bounds_touch_the_surface_on_every_side() {
    for (text, shape) in exact_shapes() {
        let Some(bounds) = shape.bounds() else { continue };
        let surface = shape.tessellate(240, 1.0);
        let mut seen = geometry::Aabb::EMPTY;
        surface.positions.iter().for_each(|p| seen.include(p));
        for k in 0..3 {
            assert!(
                (seen.min[k] - bounds.min[k]).abs() < 2e-3 && (seen.max[k] - bounds.max[k]).abs() < 2e-3,
                "{text}: {seen:?} {bounds:?}"
            );
        }
    }
}

#[test]
fn degenerate_points_still_get_a_unit_normal() {
    for (text, shape) in exact_shapes() {
        let center = shape.center();
        let sample = shape.sample(&center);
        assert!((sample.normal.norm() - 1.0).abs() < 1e-12, "{text}");
        assert!(sample.distance.is_finite());
    }
    let ring = shape("Torus(axis: Y, major_radius: 2, minor_radius: 0.5)");
    assert_eq!(ring.sample(&Vector3::new(2.0, 0.0, 0.0)).distance, -0.5);
    let needle = shape("Capsule(from: (1, 0, 0), to: (1, 0, 0), radius: 0.5)");
    assert_eq!(needle.signed_distance(&Vector3::new(1.0, 2.0, 0.0)), 1.5);
}

fn mesh_of(text: &str, segments: usize) -> (Shape, TriangleMesh) {
    let shape = shape(text);
    let surface = shape.tessellate(segments, 1.0);
    let vertices: Vec<[f64; 3]> = surface.positions.iter().map(|p| (*p).into()).collect();
    (shape, TriangleMesh::new(&vertices, &surface.triangles).unwrap())
}

#[test]
fn mesh_of_a_box_has_the_distance_of_the_box() {
    let (shape, mesh) = mesh_of("Box(center: (0.3, 0, 0), half_extents: (1, 0.6, 0.4), rotation: (0.2, 0.4, 0.1))", 8);
    assert!((mesh.volume() - 8.0 * 0.24).abs() < 1e-12);
    assert!((mesh.centroid() - Vector3::new(0.3, 0.0, 0.0)).norm() < 1e-12);
    let mesh = Shape::Mesh(Arc::new(mesh));
    for (i, direction) in directions(4000).enumerate() {
        let point = direction * (0.1 + 2.0 * (i as f64 * 0.618).fract());
        let (ours, exact) = (mesh.sample(&point), shape.sample(&point));
        assert!((ours.distance - exact.distance).abs() < 1e-12, "{point}: {} {}", ours.distance, exact.distance);
        let foot = point - ours.normal * ours.distance;
        assert!(shape.signed_distance(&foot).abs() < 1e-12);
    }
}

#[test]
fn mesh_sign_is_right_everywhere_on_a_torus_with_coarse_facets() {
    let (_, mesh) = mesh_of("Torus(axis: Along((0.3, 1, 0.2)), major_radius: 1, minor_radius: 0.4)", 16);
    let positions = mesh.positions();
    for (i, direction) in directions(3000).enumerate() {
        let point = direction * (2.0 * (i as f64 * 0.618).fract());
        // Winding number by solid angles: 1 inside, 0 outside, whatever the facets.
        let winding: f64 = mesh
            .triangles()
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| positions[v as usize] - point);
                let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
                let triple = a.dot(&b.cross(&c));
                2.0 * triple.atan2(la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb)
            })
            .sum::<f64>()
            / (4.0 * std::f64::consts::PI);
        let sample = mesh.sample(&point);
        assert_eq!(sample.distance < 0.0, winding > 0.5, "{point}: {} winding {winding}", sample.distance);
    }
}

#[test]
fn on_the_mesh_the_normal_is_that_of_the_facet() {
    let (shape, mesh) = mesh_of("Box(half_extents: (1, 1, 1))", 4);
    for point in [Vector3::new(1.0, 0.3, 0.2), Vector3::new(1.0 + 1e-12, 0.3, 0.2), Vector3::new(1.0 - 1e-12, 0.3, 0.2)]
    {
        assert!((mesh.sample(&point).normal - Vector3::x()).norm() < 1e-12);
        assert!((mesh.sample(&point).distance - shape.signed_distance(&point)).abs() < 1e-15);
    }
}
