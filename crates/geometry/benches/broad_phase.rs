//! Cost of the broad phase per member, for bundles of hair (aligned, crowded), loose clouds of segments and points.
//!
//! Linear time shows as equal time per element over the sizes.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use geometry::broad_phase::{BoxGrid, Nearness, PointGrid, SegmentGrid, Segments};
use geometry::{Aabb, Vector3};
use std::hint::black_box;

/// Numbers in [0, 1) from an index.
fn noise(i: usize, k: u64) -> f64 {
    let mut h = (i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ k.wrapping_mul(0xD6E8_FEB8_6659_FD93);
    h = (h ^ (h >> 32)).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    h = (h ^ (h >> 32)).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    ((h ^ (h >> 32)) >> 11) as f64 / (1u64 << 53) as f64
}

/// Wavy strands of 41 vertices, radius 50 µm, 2.5 radii apart, edges of 2.5 mm, running along `direction` and bent into an arc of
/// `bend` radians.
fn bundle(strands: usize, direction: Vector3, bend: f64) -> Vec<[Vector3; 2]> {
    let along = direction.normalize();
    let u = along.cross(&Vector3::new(0.3, 0.2, 1.0)).normalize();
    let v = along.cross(&u);
    let side = (strands as f64).sqrt().ceil() as usize;
    let length = 40.0 * 2.5e-3;
    (0..strands)
        .flat_map(|s| {
            let (a, b) = ((s % side) as f64 * 2.5 * RADIUS, (s / side) as f64 * 2.5 * RADIUS);
            let vertex = move |k: usize| {
                let t = k as f64 / 40.0;
                let wave = 0.3 * RADIUS;
                let (a, b) = (a + wave * (k as f64 + noise(s, 1)).sin(), b + wave * (k as f64).cos());
                if bend == 0.0 {
                    return along * (t * length) + u * a + v * b;
                }
                // Concentric arcs in the plane of `along` and `u`.
                let (r, angle) = (length / bend + a, bend * t);
                along * (r * angle.sin()) + u * (r * angle.cos()) + v * b
            };
            (0..40).map(move |k| [vertex(k), vertex(k + 1)])
        })
        .collect()
}

const RADIUS: f64 = 5e-5;

fn segments(c: &mut Criterion) {
    let mut group = c.benchmark_group("geometry/segment_pairs");
    group.sample_size(10);
    for strands in [137, 548, 2192] {
        let diagonal = Vector3::new(1.0, 1.0, 1.0);
        let cases = [
            ("bundle_axis", bundle(strands, Vector3::x(), 0.0)),
            ("bundle_diagonal", bundle(strands, diagonal, 0.0)),
            ("bundle_quarter_arc", bundle(strands, diagonal, 1.57)),
        ];
        for (name, segments) in cases {
            let reach = vec![1.2 * RADIUS; segments.len()];
            let (mut grid, mut pairs) = (SegmentGrid::default(), Vec::new());
            let all = Segments { ends: &segments, reach: &reach, motion: None };
            let apart = |i: u32, j: u32, _: Nearness| i / 40 != j / 40 || j - i >= 2;
            group.throughput(Throughput::Elements(segments.len() as u64));
            group.bench_function(BenchmarkId::new(name, segments.len()), |b| {
                b.iter(|| grid.near_pairs(black_box(all), apart, &mut pairs).unwrap());
            });
            eprintln!("{name}/{}: {} pairs", segments.len(), pairs.len());
        }
    }
    group.finish();
}

fn cloud(n: usize) -> Vec<Aabb> {
    let side = (n as f64).cbrt();
    (0..n)
        .map(|i| {
            let a = Vector3::new(noise(i, 1), noise(i, 2), noise(i, 3)) * side;
            let d = Vector3::new(noise(i, 4) - 0.5, noise(i, 5) - 0.5, noise(i, 6) - 0.5);
            Aabb::around_segment(&a, &(a + d), 0.05)
        })
        .collect()
}

fn boxes(c: &mut Criterion) {
    let mut group = c.benchmark_group("geometry/box_pairs");
    group.sample_size(10);
    let mut run = |name: &str, boxes: Vec<Aabb>| {
        group.throughput(Throughput::Elements(boxes.len() as u64));
        let (mut grid, mut pairs) = (BoxGrid::default(), Vec::new());
        group.bench_function(BenchmarkId::new(name, boxes.len()), |b| {
            b.iter(|| {
                grid.build(black_box(&boxes)).unwrap();
                grid.overlapping_pairs(&mut pairs);
                pairs.len()
            });
        });
        eprintln!("{name}/{}: {} pairs", boxes.len(), pairs.len());
    };
    for n in [5_000, 20_000, 80_000] {
        run("cloud", cloud(n));
    }
    group.finish();
}

fn points(c: &mut Criterion) {
    let mut group = c.benchmark_group("geometry/point_grid");
    group.sample_size(10);
    for n in [10_000usize, 100_000] {
        let side = (n as f64).cbrt();
        let points: Vec<[f64; 3]> =
            (0..n).map(|i| [noise(i, 1) * side, noise(i, 2) * side, noise(i, 3) * side]).collect();
        let mut grid = PointGrid::default();
        group.throughput(Throughput::Elements(n as u64));
        group.bench_function(BenchmarkId::new("build_and_neighbours", n), |b| {
            b.iter(|| {
                grid.build(black_box(&points), 1.0).unwrap();
                let mut near = 0usize;
                points.iter().for_each(|p| grid.for_each_within(p, 1.0, |_, _| near += 1));
                near
            });
        });
    }
    group.finish();
}

criterion_group!(benches, segments, boxes, points);
criterion_main!(benches);
