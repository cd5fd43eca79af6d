//! Cost of the stages and of a whole step: shaving cream, 64 particles a cell, one thread.
//!
//! `cargo bench -p mpm --bench stages -- mpm/step` and so on; `MPM_BENCH_SIZES=10000,100000` picks the sizes. For each set-up a table
//! says how many bytes a stage must move at least (every array once), and which share of the bandwidth of the memory that is.

use constitutive::{LawSettings, Liquid};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use mpm::settings::{ShearOperator, ShearSettings};
use mpm::shear_operator::{OperatorScratch, apply_particles};
use mpm::shear_quadrature::Quadrature;
use mpm::{
    FaceCoupling, HalfSpace, LiquidGrid, LiquidMaterial, LiquidSettings, LiquidStepper, Particle, Particles,
    PressureSolver, ShearSolver, Vector, fill, grid_to_particles, particles_to_grid, shear_solve, weights,
};
use particle_grid::Lattice;
use std::time::Instant;

/// A falling column of shaving cream of about `count` particles, 64 to a cell, as the stream of the reference scene.
fn column(count: usize) -> (Lattice<3>, Vec<LiquidMaterial>, Particles<3>) {
    let lattice = Lattice::<3>::new(5e-3);
    let cream = LiquidMaterial::new(&Liquid::preset("shaving-cream").unwrap(), LawSettings::default()).unwrap();
    let materials = vec![cream];
    let volume = fill::sample_volume(&lattice, 4);
    let radius = (count as f64 * volume / (4.0 * std::f64::consts::PI)).cbrt();
    let length = 4.0 * radius;
    let low = Vector::<3>::new(-radius, -radius, 0.0);
    let high = Vector::<3>::new(radius, radius, length);
    let mut particles = Particles::new(&materials);
    for x in fill::fill(&lattice, 4, &low, &high, |x| x.x.hypot(x.y) < radius) {
        let mut p = Particle::new(x, volume, 0, cream.density);
        p.velocity = Vector::<3>::new(0.05 * (x.y * 300.0).sin(), 0.0, -0.5 - 2.0 * x.z);
        p.affine = nalgebra::Matrix3::from_diagonal(&Vector::<3>::new(1.0, 1.0, -2.0));
        particles.push(p);
    }
    (lattice, materials, particles)
}

/// Bandwidth of the memory for one thread [B/s]: `a = b + s c` over arrays far larger than any cache.
fn bandwidth() -> f64 {
    let n = 1 << 23;
    let (mut a, b, c) = (vec![0.0f64; n], vec![1.0f64; n], vec![2.0f64; n]);
    let mut best = f64::INFINITY;
    for k in 0..5 {
        let start = Instant::now();
        for ((a, b), c) in a.iter_mut().zip(&b).zip(&c) {
            *a = b + f64::from(k) * c;
        }
        best = best.min(start.elapsed().as_secs_f64());
        std::hint::black_box(&a);
    }
    24.0 * n as f64 / best
}

/// Times some work and prints how much of the memory's bandwidth it uses.
fn moved(name: &str, n: usize, bytes: f64, memory: f64, mut work: impl FnMut()) {
    let mut best = f64::INFINITY;
    for _ in 0..3 {
        let start = Instant::now();
        work();
        best = best.min(start.elapsed().as_secs_f64());
    }
    println!(
        "{name:>24} {n:>8}: {:7.1} ns a particle, {:7.1} bytes a particle, {:6.2} GB/s, {:5.1} % of {:.1} GB/s",
        1e9 * best / n as f64,
        bytes / n as f64,
        1e-9 * bytes / best,
        100.0 * bytes / best / memory,
        1e-9 * memory
    );
}

fn stages(c: &mut Criterion) {
    let single = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let settings = LiquidSettings::default();
    let floor = [HalfSpace { point: Vector::<3>::zeros(), normal: Vector::<3>::z(), stick: 1.0 }];
    let body = Vector::<3>::new(0.0, 0.0, -9.81);
    let dt = 1e-3;
    let memory = bandwidth();
    let sizes: Vec<usize> = match std::env::var("MPM_BENCH_SIZES") {
        Ok(s) => s.split(',').filter_map(|n| n.parse().ok()).collect(),
        Err(_) => vec![10_000, 100_000, 1_000_000],
    };
    for size in sizes {
        let (lattice, materials, mut particles) = column(size);
        let n = particles.len();
        let mut grid = LiquidGrid::new(lattice);
        particles_to_grid::activate(&mut particles, &materials, &[], &mut grid).unwrap();
        let mut group = c.benchmark_group("mpm");
        group.sample_size(10);
        group.throughput(Throughput::Elements(n as u64));
        group.bench_function(BenchmarkId::new("sort", n), |b| {
            let mut shuffled = particles.clone();
            b.iter(|| {
                // A thousandth of the particles changes its cell between sorts.
                for i in (0..n).step_by(1000) {
                    shuffled.position[i].x += lattice.dx * if (i / 1000) % 2 == 0 { 0.5 } else { -0.5 };
                }
                single.install(|| particles_to_grid::activate(&mut shuffled, &materials, &[], &mut grid).unwrap());
            });
        });
        particles_to_grid::activate(&mut particles, &materials, &[], &mut grid).unwrap();
        let mut shear = ShearSolver::default();
        shear.prepare(&particles, &materials, dt, &settings.shear).unwrap();
        group.bench_function(BenchmarkId::new("shear_state", n), |b| {
            b.iter(|| single.install(|| shear.prepare(&particles, &materials, dt, &settings.shear).unwrap()));
        });
        group.bench_function(BenchmarkId::new("p2g", n), |b| {
            b.iter(|| {
                single.install(|| {
                    particles_to_grid::particles_to_grid(&particles, &materials, Some(&shear.state), &mut grid)
                })
            });
        });
        group.bench_function(BenchmarkId::new("weights", n), |b| {
            b.iter(|| single.install(|| weights::weights(&mut grid, &floor, None, &settings.pressure).unwrap()));
        });
        shear_solve::impose_walls(&mut grid);
        group.bench_function(BenchmarkId::new("g2p", n), |b| {
            let mut copy = particles.clone();
            b.iter(|| single.install(|| grid_to_particles::grid_to_particles(&mut copy, &grid, &settings.damping)));
        });
        let q: Vec<f64> = (0..3 * grid.blocks.node_count()).map(|i| (i as f64 * 0.7).sin()).collect();
        let mut out = vec![0.0; q.len()];
        let mut scratch = OperatorScratch::default();
        group.bench_function(BenchmarkId::new("shear_apply/particles", n), |b| {
            b.iter(|| {
                single.install(|| apply_particles(&particles, &shear.state, &grid, &q, &mut out, &mut scratch));
            });
        });
        let mut quadrature = Quadrature::default();
        group.bench_function(BenchmarkId::new("shear_apply/build", n), |b| {
            b.iter(|| single.install(|| quadrature.build(&particles, &shear.state, &grid)));
        });
        group.bench_function(BenchmarkId::new("shear_apply/quadrature", n), |b| {
            b.iter(|| single.install(|| quadrature.apply(&grid, &q, &mut out, &mut scratch)));
        });
        group.bench_function(BenchmarkId::new("shear_solve", n), |b| {
            let coupling = FaceCoupling::default();
            b.iter(|| {
                single.install(|| {
                    shear.begin(&particles, &grid, &coupling, dt, &settings.shear);
                    shear
                        .solve(&particles, &materials, &mut grid, &coupling, &body, dt, false, &settings.shear)
                        .unwrap()
                })
            });
        });
        let nodes = (8 * grid.blocks.node_count()) as f64;
        let held = particles.bytes() as f64;
        single.install(|| {
            // keys, bins and places once; the arrays read and written
            moved("sort (all moved)", n, 2.0 * held + 16.0 * n as f64, memory, || {
                particles.position.reverse();
                particles_to_grid::activate(&mut particles, &materials, &[], &mut grid).unwrap();
            });
            // per component position, velocity, affine, mass, volume, stress; four lanes a node
            moved("p2g", n, 648.0 * n as f64 + 42.0 * n as f64 + 16.0 * nodes, memory, || {
                particles_to_grid::particles_to_grid(&particles, &materials, Some(&shear.state), &mut grid);
            });
            let mut copy = particles.clone();
            moved("g2p", n, 120.0 * n as f64 + 3.0 * nodes, memory, || {
                grid_to_particles::grid_to_particles(&mut copy, &grid, &settings.damping);
            });
            moved("shear_apply/quadrature", n, quadrature.bytes() as f64 + 6.0 * nodes, memory, || {
                quadrature.apply(&grid, &q, &mut out, &mut scratch);
            });
        });
        // The arrays have to be as they were.
        (_, _, particles) = column(size);
        particles_to_grid::activate(&mut particles, &materials, &[], &mut grid).unwrap();
        shear.prepare(&particles, &materials, dt, &settings.shear).unwrap();
        particles_to_grid::particles_to_grid(&particles, &materials, Some(&shear.state), &mut grid);
        weights::weights(&mut grid, &floor, None, &settings.pressure).unwrap();
        shear_solve::impose_walls(&mut grid);
        let mut pressure = PressureSolver::default();
        group.bench_function(BenchmarkId::new("pressure_solve", n), |b| {
            b.iter(|| {
                single.install(|| {
                    pressure.build(&grid, None, dt, &settings.pressure);
                    pressure.solve(&mut grid, None, dt, &settings.pressure).unwrap()
                })
            });
        });
        for (name, operator) in [("step", ShearOperator::Automatic), ("step/particles", ShearOperator::Particles)] {
            let settings = LiquidSettings { shear: ShearSettings { operator, ..settings.shear }, ..settings };
            let mut stepper = LiquidStepper::new(lattice);
            let mut copy = particles.clone();
            let mut k = 0;
            let mut last = None;
            group.bench_function(BenchmarkId::new(name, n), |b| {
                b.iter(|| {
                    single.install(|| {
                        // The column is set back every few steps, so that every sample sees the same flow.
                        if k % 5 == 0 {
                            copy.clone_from(&particles);
                        }
                        k += 1;
                        last = Some(
                            stepper.advance(&mut copy, &materials, &floor, &floor, &body, dt, k, &settings).unwrap(),
                        );
                    });
                });
            });
            let mut again = particles.clone();
            let bytes = 4.0 * held + 28.0 * nodes;
            moved(name, n, bytes, memory, || {
                single.install(|| {
                    stepper.advance(&mut again, &materials, &floor, &floor, &body, dt, 1, &settings).unwrap()
                });
            });
            if let Some(r) = last {
                println!(
                    "{name} {n}: shear {} + {} iterations, pressure {} iterations on {} cells, {} + {} bytes per particle",
                    r.shear.solve.iterations,
                    r.shear_again.map_or(0, |s| s.solve.iterations),
                    r.pressure.map_or(0, |p| p.multigrid.solve.iterations),
                    r.pressure.map_or(0, |p| p.multigrid.unknowns),
                    copy.bytes() / n,
                    stepper.bytes() / n,
                );
            }
        }
        group.finish();
    }
}

criterion_group!(benches, stages);
criterion_main!(benches);
