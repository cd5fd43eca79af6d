//! Throughput of sorting and of the transfers: 64 particles a cell (8 in the last rows), one face component and all three.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::{Matrix3, Vector3};
use particle_grid::{
    BlockGrid, Contribution, Lanes, Lattice, ParticleOrder, ScatterScratch, gather, mac_offset, permute, scatter,
};
use std::hint::black_box;

fn jittered(per_axis: usize, per_cell_axis: usize, dx: f64) -> Vec<Vector3<f64>> {
    let n = per_axis;
    let s = dx / per_cell_axis as f64;
    let mut out = Vec::with_capacity(n * n * n);
    for i in 0..n * n * n {
        let (a, b, c) = (i % n, (i / n) % n, i / (n * n));
        let t = i as f64;
        let jitter = Vector3::new((t * 12.9898).sin(), (t * 78.233).sin(), (t * 37.719).sin()) * 0.3 * s;
        out.push(Vector3::new(a as f64 + 0.5, b as f64 + 0.5, c as f64 + 0.5) * s + jitter);
    }
    out
}

fn transfers(c: &mut Criterion) {
    let single = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let mut group = c.benchmark_group("particle-grid");
    group.sample_size(10);
    for (per_axis, per_cell_axis) in [(22, 4), (46, 4), (100, 4), (100, 2)] {
        let lattice = Lattice::<3>::new(1.0);
        let mut x = jittered(per_axis, per_cell_axis, lattice.dx);
        let n = x.len();
        let name = format!("{n}x{}", per_cell_axis.pow(3));
        let mut order = ParticleOrder::new();
        order.build(&lattice, &x).unwrap();
        permute(&mut x, order.index(), &mut Vec::new());
        order.build(&lattice, &x).unwrap();
        let mut grid = BlockGrid::new(lattice);
        grid.rebuild(&order, &[]);
        let mut v: Vec<Vector3<f64>> = x.iter().map(|x| x.map(f64::sin)).collect();
        let mut affine: Vec<Matrix3<f64>> = x.iter().map(|x| Matrix3::from_element(0.1) * x.x.cos()).collect();
        let mut out: [Vec<Lanes>; 3] = std::array::from_fn(|_| vec![Lanes::ZERO; grid.node_count()]);
        let fields: Vec<Vec<f64>> = (0..3).map(|a| (0..grid.node_count()).map(|i| (i + a) as f64).collect()).collect();
        let mut scratch = ScatterScratch::default();
        group.throughput(Throughput::Elements(n as u64));
        group.bench_function(BenchmarkId::new("p2g_mac", &name), |b| {
            b.iter(|| {
                single.install(|| {
                    for a in 0..3 {
                        let give = |i: usize| Contribution {
                            value: Lanes([1.0, v[i][a], 1.0, 0.0]),
                            gradient: std::array::from_fn(|k| Lanes([0.0, affine[i][(a, k)], 0.0, affine[i][(k, a)]])),
                        };
                        scatter(&grid, &order, &x, &mac_offset(a), 0.0, give, &mut scratch, &mut out[a]);
                    }
                    black_box(&out);
                });
            });
        });
        group.bench_function(BenchmarkId::new("g2p_mac", &name), |b| {
            b.iter(|| {
                single.install(|| {
                    let slices = [fields[0].as_slice(), fields[1].as_slice(), fields[2].as_slice()];
                    gather(&grid, &order, &x, slices, std::array::from_fn(mac_offset), &mut v, &mut affine);
                });
            });
        });
        group.bench_function(BenchmarkId::new("order", &name), |b| {
            b.iter(|| single.install(|| order.build(&lattice, black_box(&x)).unwrap()));
        });
        group.bench_function(BenchmarkId::new("permute_matrices", &name), |b| {
            let index = order.index().to_vec();
            let mut spare = Vec::new();
            b.iter(|| single.install(|| permute(&mut affine, &index, &mut spare)));
        });
    }
    group.finish();
}

criterion_group!(benches, transfers);
criterion_main!(benches);
