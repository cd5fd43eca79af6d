//! A whole step of strands in liquid, the mixture solve and the stages around it: the main scene once cream lies on the strands.
//!
//! `cargo bench -p runner --bench mixture`

use criterion::{Criterion, criterion_group, criterion_main};
use std::path::Path;

/// When the step is taken [s].
const BEGIN: f64 = 0.06;
const STEP: f64 = 1e-3;

fn bench(c: &mut Criterion) {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/coupled/pour-on-strands.ron");
    let mut group = c.benchmark_group("mixture/step");
    group.sample_size(10);
    for (name, set) in
        [("one after the other", "solver.coupling.iterations=1"), ("iterated", "solver.coupling.iterations=5")]
    {
        let set = [set.to_owned(), format!("time.step=Fixed({STEP})")];
        let loaded = match runner::scene::load(&scene, &set) {
            Ok(loaded) => loaded,
            Err(error) => panic!("{error}"),
        };
        let mut system = runner::prepare::job(loaded, 1).unwrap_or_else(|error| panic!("{error}")).system;
        let mut time = 0.0;
        while time < BEGIN {
            system.advance(time, STEP).unwrap_or_else(|rejection| panic!("{rejection}"));
            time += STEP;
        }
        system.snapshot();
        group.bench_function(name, |b| {
            b.iter(|| {
                system.advance(time, STEP).unwrap_or_else(|rejection| panic!("{rejection}"));
                system.restore();
            });
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
