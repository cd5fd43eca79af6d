//! Kernels of the rods for 1, 64 and 4096 strands of 41 vertices, and the hair step of the speed goals.
//!
//! Bounds per vertex (one of four lanes; AVX2, two 4-wide operations per cycle): evaluation with matrix ≈ 800 flops and
//! 640 B, band factor and solve ≈ 4·(11² + 4·11) ≈ 700 flops and 2·352 B.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::Vector3;
use numerics::banded::BatchedBand;
use numerics::lanes::F4;
use rods::*;
use std::hint::black_box;
use std::time::Duration;

const VERTICES: usize = 41;

/// Gently curled free hair, slightly out of its rest shape.
fn hair(strands: usize) -> RodSet {
    let mut rods = RodSet::new();
    for k in 0..strands {
        let phase = 0.37 * k as f64;
        let positions = (0..VERTICES)
            .map(|i| {
                let s = 2e-3 * i as f64;
                Vector3::new(2e-3 * (80.0 * s + phase).sin() + 1e-3 * k as f64, 2e-3 * (80.0 * s + phase).cos(), -s)
            })
            .collect();
        let mut spec = StrandSpec::new(positions, 5e-5, StrandMaterial::default());
        spec.velocities = Some(
            (0..VERTICES).map(|i| Vector3::new(0.3 * (0.2 * i as f64 + phase).sin(), 0.1, -0.5)).collect(),
        );
        rods.add_strand(&spec).unwrap();
    }
    rods
}

fn benches(c: &mut Criterion) {
    let loads = Loads::gravity(Vector3::new(0.0, 0.0, -9.81));
    let free = Boundary::default();
    let mut group = c.benchmark_group("rods");
    group.sample_size(10).warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_millis(700));
    for strands in [1, 64, 4096] {
        let rods = hair(strands);
        group.throughput(Throughput::Elements((strands * VERTICES) as u64));
        let mut stepper = RodStepper::new(RodSettings::default()).unwrap();
        stepper.solve(&rods, 2e-4, &loads, &free).unwrap();
        group.bench_function(BenchmarkId::new("energy", strands), |b| {
            b.iter(|| black_box(stepper.bench_evaluate(false)));
        });
        group.bench_function(BenchmarkId::new("gradient_hessian", strands), |b| {
            b.iter(|| black_box(stepper.bench_evaluate(true)));
        });
        let mut band = BatchedBand::<11>::zeros(4 * VERTICES);
        for (j, column) in band.columns.iter_mut().enumerate() {
            for i in 0..11.min(4 * VERTICES - j) {
                column[i] = F4::splat(if i == 0 { 30.0 } else { 1.0 / (i + j % 3) as f64 });
            }
        }
        let mut work = band.clone();
        let mut rhs = vec![F4::splat(1.0); 4 * VERTICES];
        group.bench_function(BenchmarkId::new("banded_solve", strands), |b| {
            b.iter(|| {
                for _ in 0..strands.div_ceil(4) {
                    work.columns.copy_from_slice(&band.columns);
                    work.factor();
                    work.solve(&mut rhs);
                }
                black_box(rhs[0][0])
            });
        });
        group.bench_function(BenchmarkId::new("newton_step", strands), |b| {
            b.iter(|| black_box(stepper.solve(&rods, 2e-4, &loads, &free).unwrap().total_iterations));
        });
    }
    // the speed goal: 2192 free hair strands, dt = 2e-4 s, whole steps
    let mut rods = hair(2192);
    let mut stepper = RodStepper::new(RodSettings::default()).unwrap();
    group.throughput(Throughput::Elements((2192 * VERTICES) as u64));
    group.bench_function("hair_step/2192", |b| {
        b.iter(|| black_box(stepper.advance(&mut rods, 2e-4, &loads, &free).unwrap().total_iterations));
    });
    group.finish();
}

criterion_group!(rods_benches, benches);
criterion_main!(rods_benches);
