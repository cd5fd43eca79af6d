//! Detection and Delassus assembly in bundles of strands.

use contact::assembly::assemble;
use contact::detection::{DetectionSettings, Detector};
use contact::families::{Chains, bundle};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;

/// Bundles of 137, 548 and 2192 strands with 41 vertices: 1×, 4×, 16×; the last has 89,872 vertices.
const STRANDS: [usize; 3] = [137, 548, 2192];

fn detection(c: &mut Criterion) {
    let mut group = c.benchmark_group("contact/detection");
    group.sample_size(10);
    for strands in STRANDS {
        let b = bundle(strands, 41);
        let (mut detector, mut contacts) = (Detector::default(), Vec::new());
        let settings = DetectionSettings::default();
        group.throughput(Throughput::Elements((strands * 41) as u64));
        group.bench_function(BenchmarkId::new("new_step", strands * 41), |bench| {
            bench.iter(|| {
                detector.forget();
                detector.detect(black_box(&b.strands()), None, &[], &settings, &mut contacts)
            });
        });
        group.bench_function(BenchmarkId::new("again", strands * 41), |bench| {
            bench.iter(|| detector.detect(black_box(&b.strands()), None, &[], &settings, &mut contacts));
        });
    }
    group.finish();
}

fn delassus(c: &mut Criterion) {
    let mut group = c.benchmark_group("contact/delassus");
    group.sample_size(10);
    let dynamics = Chains { vertices: 11, mass: 1e-8, coupling: 1e-6 };
    for strands in [7, 28, 112, 2192] {
        let b = bundle(strands, 11);
        let mut contacts = Vec::new();
        if Detector::default().detect(&b.strands(), None, &[], &DetectionSettings::default(), &mut contacts).is_err() {
            continue;
        }
        let posed: Vec<_> = contacts.iter().map(|c| c.posed(0.3, 0.0, 3)).collect();
        let v = vec![0.0; 33];
        let velocities: Vec<&[f64]> = (0..strands).map(|_| v.as_slice()).collect();
        group.throughput(Throughput::Elements(posed.len() as u64));
        group.bench_function(BenchmarkId::from_parameter(posed.len()), |bench| {
            bench.iter(|| assemble(black_box(&posed), &dynamics, strands, &velocities, 1e-3, 0.2));
        });
    }
    group.finish();
}

criterion_group!(benches, detection, delassus);
criterion_main!(benches);
