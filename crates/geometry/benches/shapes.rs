//! Cost of one question to a shape or script, and of one pair of segments.

use criterion::{Criterion, criterion_group, criterion_main};
use geometry::{Motion, MovingSolid, Shape, ShapeDescription, Surface, TriangleMesh, Vector3};
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;

fn shape(text: &str) -> Shape {
    let description: ShapeDescription = ron::from_str(text).unwrap();
    description.build(Path::new(".")).unwrap()
}

fn questions(c: &mut Criterion) {
    let mut group = c.benchmark_group("geometry/sample");
    group.sample_size(20);
    let points: Vec<Vector3> = (0..1000)
        .map(|i| {
            let x = f64::from(i) * 0.618_034;
            Vector3::new(x.fract(), (x * 7.1).fract(), (x * 31.7).fract()) * 3.0 - Vector3::repeat(1.5)
        })
        .collect();
    let torus = shape("Torus(major_radius: 1, minor_radius: 0.4)").tessellate(64, 1.0);
    let vertices: Vec<[f64; 3]> = torus.positions.iter().map(|p| (*p).into()).collect();
    let mesh = Shape::Mesh(Arc::new(TriangleMesh::new(&vertices, &torus.triangles).unwrap()));
    for (name, shape) in [
        ("sphere", shape("Sphere(radius: 1)")),
        ("box", shape("Box(half_extents: (1, 0.5, 0.7), rotation: (1, 0, 0), rounding: 0.1)")),
        ("cylinder", shape("Cylinder(radius: 1, half_length: 0.5)")),
        ("mesh_4096", mesh),
    ] {
        group.bench_function(format!("{name}/1000"), |b| {
            b.iter(|| points.iter().map(|p| black_box(&shape).sample(p).distance).sum::<f64>());
        });
    }
    let motion: Motion =
        ron::from_str("[Translate(by: (1, 0, 0), during: (0, 2)), Rotate(axis: (0, 1, 0), angle: 3, during: (0, 2))]")
            .unwrap();
    let solid = MovingSolid::new(shape("Sphere(radius: 1)"), motion, Surface::default()).unwrap();
    group.bench_function("moving_sphere/1000", |b| {
        b.iter(|| {
            let posed = solid.at(black_box(1.0));
            points.iter().map(|p| posed.sample(p).distance).sum::<f64>()
        });
    });
    group.finish();
    c.bench_function("geometry/segment_segment/997", |b| {
        b.iter(|| {
            points
                .windows(4)
                .map(|w| geometry::closest::segment_segment(&w[0], &w[1], &w[2], &w[3]).separation.x)
                .sum::<f64>()
        });
    });
}

criterion_group!(benches, questions);
criterion_main!(benches);
