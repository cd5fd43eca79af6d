//! Cost of the implicit drag solve of one strand vertex, moving and stuck.

use std::hint::black_box;

use constitutive::Liquid;
use constitutive::drag::{DragGeometry, DragLaw, DragSettings};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

fn drag(c: &mut Criterion) {
    const COUNT: usize = 1024;
    let mut group = c.benchmark_group("constitutive/drag");
    group.throughput(Throughput::Elements(COUNT as u64));
    group.sample_size(20);
    let body = DragGeometry::capsule(5e-5, 2e-3, 0.7);
    for material in ["water", "drilling-mud", "shaving-cream"] {
        let liquid = Liquid::preset(material).unwrap();
        let law = DragLaw::new(liquid.density, &liquid.flow, DragSettings::default()).unwrap();
        group.bench_function(format!("solve/{material}"), |b| {
            b.iter(|| {
                let mut sum = 0.0;
                for i in 0..COUNT {
                    let speed = 1e-3 + i as f64 * 2e-3;
                    sum += law.solve(black_box(speed), 2e-8, 1e-3, &body, 0.8).speed;
                }
                black_box(sum)
            });
        });
    }
    group.finish();
}

criterion_group!(benches, drag);
criterion_main!(benches);
