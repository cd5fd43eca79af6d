//! Cost of the stages and of a whole step: shaving cream, 64 particles a cell, one thread.
//!
//! `cargo bench -p mpm -- mpm/step` and so on. Bytes moved per particle are printed beside each set-up.

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

fn stages(c: &mut Criterion) {
    let single = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let settings = LiquidSettings::default();
    let floor = [HalfSpace { point: Vector::<3>::zeros(), normal: Vector::<3>::z(), stick: 1.0 }];
    let body = Vector::<3>::new(0.0, 0.0, -9.81);
    let dt = 1e-3;
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
        let mut pressure = PressureSolver::default();
        group.bench_function(BenchmarkId::new("pressure_solve", n), |b| {
            b.iter(|| {
                single.install(|| {
                    pressure.build(&grid, dt, &settings.pressure);
                    pressure.solve(&mut grid, None, dt, &settings.pressure).unwrap()
                })
            });
        });
        for (name, operator) in [("step", ShearOperator::CellQuadrature), ("step/particles", ShearOperator::Particles)]
        {
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
