//! Cost of one step of a dense packing with all stress tensors: grain-steps per second against the number of grains.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use granular::assembly::Assembly;
use granular::cell::Cell;
use granular::model::{Mode, ModelSettings};
use granular::physical::Rules;
use granular::preparation::random_packing;
use granular::random::Random;

/// A dense packing relaxed far enough that contacts live as long as in a measurement.
fn packing(grains: usize, mode: Mode) -> (Assembly, f64) {
    let side = 500.0 * (grains as f64 / 150.0).sqrt();
    let settings = ModelSettings { grains, width: side, height: side, ..ModelSettings::default() };
    let discs = random_packing(&settings, mode, &mut Random::new(1));
    let cell = Cell::new(side, side);
    let mut assembly =
        Assembly::new(mode, &discs, cell, settings.contact_model(), Rules::default(), 1).expect("admissible settings");
    let tau = settings.constants().time;
    for _ in 0..300 {
        assembly.advance(0.1 * tau, 0.5, true, false).expect("finite");
    }
    assembly.set_rate(2e-2 / tau);
    (assembly, tau / 56.0)
}

fn step(c: &mut Criterion) {
    let mut group = c.benchmark_group("granular/step");
    group.sample_size(10);
    let largest = std::env::var("GRANULAR_BENCH_LARGEST").ok().and_then(|v| v.parse().ok()).unwrap_or(10_000);
    for n in [150, 1_000, 10_000, 100_000] {
        if n > largest {
            continue;
        }
        let (mut assembly, dt) = packing(n, Mode::Physical);
        group.throughput(Throughput::Elements(n as u64));
        group.bench_function(BenchmarkId::new("physical", n), |b| {
            b.iter(|| assembly.advance(dt, 0.9997, true, true).expect("finite"));
        });
    }
    let (mut assembly, dt) = packing(150, Mode::Compat);
    group.throughput(Throughput::Elements(150));
    group.bench_function(BenchmarkId::new("compat", 150), |b| {
        b.iter(|| assembly.advance(dt, 0.9997, true, true).expect("finite"));
    });
    group.finish();
}

criterion_group!(benches, step);
criterion_main!(benches);
