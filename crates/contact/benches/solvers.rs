//! Local solver, Gauss–Seidel, Newton, alternating directions and the cone solver at growing numbers of contacts.

use contact::cross_check::{OracleSettings, convex_model};
use contact::families::{Random, boxes, spheres};
use contact::local::{LocalContact, LocalMethod};
use contact::{ContactProblem, ContactSettings, SolverChoice, solve};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use std::hint::black_box;

/// Loose sphere piles of about the given number of contacts.
fn pile(contacts: usize) -> ContactProblem {
    let mut random = Random::new(contacts as u64);
    spheres(&mut random, (contacts * 10 / 14).max(3), 0.3, 0.05, 0.0)
}

fn local(c: &mut Criterion) {
    let mut group = c.benchmark_group("contact/mfb_local");
    let mut random = Random::new(1);
    let cases: Vec<(LocalContact, [f64; 3], [f64; 3])> = (0..256)
        .map(|_| {
            let h: Vec<f64> = (0..12).map(|_| random.normal()).collect();
            let mut w = [0.0; 9];
            for i in 0..3 {
                for j in 0..3 {
                    w[3 * i + j] = (0..4).map(|k| h[4 * i + k] * h[4 * j + k]).sum();
                }
            }
            let l = LocalContact::new(&w, random.uniform(0.1, 1.0));
            let b = [-random.uniform(0.0, 1.0), random.normal(), random.normal()];
            // a start near the answer, as in a late sweep
            let mut near = b;
            near[1] += 1e-3;
            let start = l.solve(&near, &[0.0; 3], LocalMethod::Enumerative).impulse;
            (l, b, start)
        })
        .collect();
    for method in [LocalMethod::Enumerative, LocalMethod::Newton] {
        group.bench_function(BenchmarkId::new("256 contacts", format!("{method:?}")), |bench| {
            bench.iter(|| cases.iter().map(|(l, b, s)| l.solve(black_box(b), s, method).impulse[0]).sum::<f64>());
        });
    }
    group.finish();
}

fn solvers(c: &mut Criterion) {
    for solver in [SolverChoice::GaussSeidel, SolverChoice::Newton, SolverChoice::Admm] {
        let mut group = c.benchmark_group(format!("contact/{}", solver.name()));
        group.sample_size(10);
        for n in [1, 20, 100, 1000, 20_000] {
            if n == 20_000 && solver != SolverChoice::GaussSeidel {
                // factorisations of piles this large are declined by the work limit
                continue;
            }
            let p = pile(n);
            let tolerance = if n >= 1000 { 1e-4 } else { 1e-8 };
            let settings = ContactSettings { solver, tolerance, max_sweeps: 2000, ..ContactSettings::default() };
            group.bench_function(BenchmarkId::from_parameter(p.len()), |b| {
                b.iter(|| solve(black_box(&p), None, &settings))
            });
        }
        let mut random = Random::new(2);
        let wall = boxes(&mut random, 4, 4, 0.5, [1.0, 0.0, -9.81], 0.02, 0.0);
        let settings = ContactSettings { solver, max_sweeps: 2000, ..ContactSettings::default() };
        group.bench_function(BenchmarkId::new("box wall", wall.len()), |b| {
            b.iter(|| solve(black_box(&wall), None, &settings))
        });
        group.finish();
    }
}

fn clarabel(c: &mut Criterion) {
    let mut group = c.benchmark_group("contact/clarabel");
    group.sample_size(10);
    for n in [1, 20, 100, 1000] {
        let p = pile(n);
        group.bench_function(BenchmarkId::from_parameter(p.len()), |b| {
            b.iter(|| convex_model(black_box(&p), &OracleSettings { tolerance: 1e-8, ..Default::default() }));
        });
    }
    group.finish();
}

criterion_group!(benches, local, solvers, clarabel);
criterion_main!(benches);
