//! Cost of the exact friction: 1000 strands of 100 vertices, Newtonian and yield-stress films.

use std::hint::black_box;

use constitutive::Liquid;
use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::Vector3;
use surface_flow::{FilmLiquid, FilmSettings, FilmSolver, FilmState, StrandSlices, film_area};

const STRANDS: usize = 1000;
const VERTICES: usize = 100;

struct Strands {
    edge_length: Vec<f64>,
    tangent: Vec<Vector3<f64>>,
    semi_axes: Vec<[f64; 2]>,
    acceleration: Vec<Vector3<f64>>,
}

impl Strands {
    fn view(&self) -> StrandSlices<'_> {
        StrandSlices {
            edge_length: &self.edge_length,
            tangent: &self.tangent,
            semi_axes: &self.semi_axes,
            acceleration: &self.acceleration,
        }
    }
}

fn bench(c: &mut Criterion) {
    let strands = Strands {
        edge_length: vec![1e-3; STRANDS * (VERTICES - 1)],
        tangent: vec![Vector3::x(); STRANDS * (VERTICES - 1)],
        semi_axes: vec![[5e-5, 5e-5]; STRANDS * VERTICES],
        acceleration: vec![Vector3::zeros(); STRANDS * VERTICES],
    };
    let mut state = FilmState::new(&[VERTICES; STRANDS]);
    for (i, a) in state.area.iter_mut().enumerate() {
        *a = film_area(1e-4 * (0.3 * i as f64).sin().max(0.0), 1e-4);
    }
    for (j, u) in state.velocity.iter_mut().enumerate() {
        *u = 0.4 * (0.01 * j as f64).sin();
    }
    let mut group = c.benchmark_group("surface-flow/friction");
    group.throughput(Throughput::Elements((STRANDS * VERTICES) as u64)).sample_size(10);
    for material in ["water", "drilling-mud", "shaving-cream"] {
        let liquid = FilmLiquid::new(&Liquid::preset(material).unwrap()).unwrap();
        let mut solver = FilmSolver::new(liquid, FilmSettings::default()).unwrap();
        group.bench_function(material, |b| {
            b.iter_batched(
                || state.clone(),
                |mut state| black_box(solver.rub(&mut state, strands.view(), 1e-3).unwrap().wet),
                BatchSize::LargeInput,
            );
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
