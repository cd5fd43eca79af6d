//! Steps of bundles of yarns: vertices per second in 2-D and 3-D, explicit and implicit.

use std::hint::black_box;
use std::path::Path;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use yarn::settings::{ImplicitSettings, Integrator};
use yarn::{YarnGroup, YarnSettings, YarnShape, YarnSystem};

/// A dense block of parallel yarns about one cell apart with `vertices` vertices in all.
fn bundle<const D: usize>(vertices: usize, integrator: Integrator) -> YarnSystem<D> {
    let cell = 1.0 / 64.0;
    let side = (vertices as f64 / 2.0).powf(1.0 / D as f64).max(4.0);
    let count = side.round() as usize;
    let length = 0.5 * cell * (vertices as f64 / count.pow(D as u32 - 1) as f64).round();
    let groups = (0..if D == 3 { count } else { 1 })
        .map(|layer| {
            let mut from = vec![0.0; D];
            from[D - 1] = 0.3 + layer as f64 * cell * f64::from(u8::from(D == 3));
            let mut to = from.clone();
            to[0] += length;
            let mut step = vec![0.0; D];
            step[1] = 1.01 * cell;
            let shape = YarnShape::Lines { from, to, count, step };
            let mut velocity = vec![0.0; D];
            velocity[1] = if layer % 2 == 0 { 0.1 } else { -0.1 };
            YarnGroup { velocity, ..YarnGroup::new(shape) }
        })
        .collect();
    let mut settings =
        YarnSettings { dimension: D, cell, yarns: groups, gravity: vec![0.0; D], ..YarnSettings::default() };
    settings.gravity[1] = -9.8;
    settings.step.integrator = integrator;
    YarnSystem::build(&settings, Path::new(".")).expect("the bundle is a valid scene")
}

fn explicit<const D: usize>(criterion: &mut Criterion, sizes: &[usize]) {
    let mut group = criterion.benchmark_group(format!("yarn/step/{D}d"));
    group.sample_size(10);
    for &size in sizes {
        let mut system: YarnSystem<D> = bundle(size, Integrator::Explicit);
        group.throughput(Throughput::Elements(system.model().len() as u64));
        group.bench_function(BenchmarkId::from_parameter(size), |bencher| {
            bencher.iter(|| black_box(system.advance(5e-5).expect("the step is within its bounds")));
        });
    }
    group.finish();
}

fn implicit(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("yarn/implicit-step/3d");
    group.sample_size(10);
    let mut system: YarnSystem<3> = bundle(10_000, Integrator::Implicit(ImplicitSettings::default()));
    group.throughput(Throughput::Elements(system.model().len() as u64));
    group.bench_function(BenchmarkId::from_parameter(10_000), |bencher| {
        bencher.iter(|| black_box(system.advance(5e-4).expect("the solve converges")));
    });
    group.finish();
}

fn step(criterion: &mut Criterion) {
    explicit::<2>(criterion, &[10_000, 100_000]);
    explicit::<3>(criterion, &[10_000, 100_000, 1_000_000]);
    implicit(criterion);
}

criterion_group!(benches, step);
criterion_main!(benches);
