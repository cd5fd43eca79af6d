//! Cost of the flow maps and of the strain update of a particle.
//!
//! `constitutive/return_map/<map>/<material>`: 4096 stresses between half and four times yield. `.../update_3d`: the whole
//! strain update (trial, map, determinant) of 4096 particles.

use std::hint::black_box;

use constitutive::liquid_law::elastic_trial;
use constitutive::{DeterminantPolicy, FlowMap, LawSettings, Liquid};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::Matrix3;

const COUNT: usize = 4096;

fn return_map(c: &mut Criterion) {
    let mut group = c.benchmark_group("constitutive/return_map");
    group.throughput(Throughput::Elements(COUNT as u64));
    group.sample_size(20);
    for material in ["drilling-mud", "shaving-cream", "milk-chocolate"] {
        let law = Liquid::preset(material).unwrap().law(LawSettings::default()).unwrap();
        let flow = law.flow;
        let trials: Vec<f64> = (0..COUNT).map(|i| flow.yield_norm() * (0.5 + 3.5 * i as f64 / COUNT as f64)).collect();
        for map in FlowMap::ALL {
            group.bench_function(format!("{}/{material}", map.name()), |b| {
                b.iter(|| {
                    let mut sum = 0.0;
                    for &s in &trials {
                        let out = flow.return_map(map, s, 0.9 * s, law.shear_modulus, 1e-3);
                        sum += out.stress + out.by_trial + out.by_modulus;
                    }
                    black_box(sum)
                });
            });
        }
    }
    for determinant in [DeterminantPolicy::Exact, DeterminantPolicy::Trace] {
        let law = Liquid::preset("shaving-cream")
            .unwrap()
            .law(LawSettings { determinant, ..LawSettings::default() })
            .unwrap();
        let steps: Vec<Matrix3<f64>> = (0..COUNT)
            .map(|i| {
                let x = i as f64 / COUNT as f64;
                Matrix3::new(1.0, 0.02 * x, 0.001, -0.003, 1.0 + 0.005 * x, 0.002, 0.001, 0.0, 1.0 - 0.004 * x)
            })
            .collect();
        let start = elastic_trial(&Matrix3::identity(), &Matrix3::new(1.0, 0.2, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0));
        let start = start.unwrap().strain;
        group.bench_function(format!("update_3d/{determinant:?}"), |b| {
            b.iter(|| {
                let mut sum = 0.0;
                for f in &steps {
                    let trial = elastic_trial(&start, f).unwrap();
                    sum += law.relax(&trial.strain, &start, 1e-3).unwrap().strain[(0, 1)];
                }
                black_box(sum)
            });
        });
    }
    group.finish();
}

criterion_group!(benches, return_map);
criterion_main!(benches);
