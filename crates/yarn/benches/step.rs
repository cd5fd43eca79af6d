//! Steps of bundles of yarns: vertices per second of processor time on one core in 2-D and 3-D, explicit and implicit, and the
//! bandwidth of the memory to compare with.

use std::hint::black_box;
use std::path::Path;
use std::time::Duration;

use criterion::measurement::{Measurement, ValueFormatter};
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

/// Processor time of the calling thread, which other programs on the machine do not lengthen.
struct ProcessorTime;

impl ProcessorTime {
    /// Nanoseconds on the processor so far; wall clock where the system does not say.
    fn now() -> f64 {
        let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
        match text.split(' ').next().and_then(|word| word.parse().ok()) {
            Some(nanoseconds) => nanoseconds,
            None => START.elapsed().as_nanos() as f64,
        }
    }
}

static START: std::sync::LazyLock<std::time::Instant> = std::sync::LazyLock::new(std::time::Instant::now);

impl Measurement for ProcessorTime {
    type Intermediate = f64;
    type Value = f64;

    fn start(&self) -> f64 {
        Self::now()
    }

    fn end(&self, start: f64) -> f64 {
        Self::now() - start
    }

    fn add(&self, a: &f64, b: &f64) -> f64 {
        a + b
    }

    fn zero(&self) -> f64 {
        0.0
    }

    fn to_f64(&self, value: &f64) -> f64 {
        *value
    }

    fn formatter(&self) -> &dyn ValueFormatter {
        &Nanoseconds
    }
}

/// Writes times in milliseconds and throughputs per second.
struct Nanoseconds;

impl ValueFormatter for Nanoseconds {
    fn scale_values(&self, _typical: f64, values: &mut [f64]) -> &'static str {
        values.iter_mut().for_each(|value| *value *= 1e-6);
        "ms"
    }

    fn scale_throughputs(&self, _typical: f64, throughput: &Throughput, values: &mut [f64]) -> &'static str {
        let (amount, unit) = match throughput {
            Throughput::Elements(count) => (*count as f64 * 1e3, "million/s"),
            Throughput::Bytes(count) => (*count as f64, "GB/s"),
            _ => (1e9, "1/s"),
        };
        values.iter_mut().for_each(|value| *value = amount / *value);
        unit
    }

    fn scale_for_machines(&self, _values: &mut [f64]) -> &'static str {
        "ns"
    }
}

/// Runs `work` on one thread, which is the one that is measured.
fn on_one_thread<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread can be had").install(work)
}

fn explicit<const D: usize>(criterion: &mut Criterion<ProcessorTime>, sizes: &[usize]) {
    let mut group = criterion.benchmark_group(format!("yarn/step/{D}d"));
    group.sample_size(10).warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(2));
    for &size in sizes {
        let vertices = bundle::<D>(size, Integrator::Explicit).model().len();
        group.throughput(Throughput::Elements(vertices as u64));
        group.bench_function(BenchmarkId::from_parameter(size), |bencher| {
            on_one_thread(|| {
                let mut system: YarnSystem<D> = bundle(size, Integrator::Explicit);
                bencher.iter(|| black_box(system.advance(5e-5).expect("the step is within its bounds")));
            });
        });
    }
    group.finish();
}

fn implicit(criterion: &mut Criterion<ProcessorTime>) {
    let mut group = criterion.benchmark_group("yarn/implicit-step/3d");
    group.sample_size(10).warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(2));
    let vertices = bundle::<3>(10_000, Integrator::Explicit).model().len();
    group.throughput(Throughput::Elements(vertices as u64));
    group.bench_function(BenchmarkId::from_parameter(10_000), |bencher| {
        on_one_thread(|| {
            let mut system: YarnSystem<3> = bundle(10_000, Integrator::Implicit(ImplicitSettings::default()));
            bencher.iter(|| black_box(system.advance(5e-4).expect("the solve converges")));
        });
    });
    group.finish();
}

/// What the memory gives to one thread: `a = b + s c` on arrays far larger than the caches.
fn bandwidth(criterion: &mut Criterion<ProcessorTime>) {
    let mut group = criterion.benchmark_group("yarn/memory");
    group.sample_size(10).warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(2));
    let n = 16_000_000;
    group.throughput(Throughput::Bytes(24 * n as u64));
    group.bench_function("triad", |bencher| {
        on_one_thread(|| {
            let (mut a, b, c) = (vec![0.0f64; n], vec![1.0f64; n], vec![2.0f64; n]);
            bencher.iter(|| {
                a.iter_mut().zip(&b).zip(&c).for_each(|((a, b), c)| *a = b + 0.5 * c);
                black_box(&a);
            });
        });
    });
    group.finish();
}

fn step(criterion: &mut Criterion<ProcessorTime>) {
    bandwidth(criterion);
    explicit::<2>(criterion, &[10_000, 100_000, 1_000_000]);
    explicit::<3>(criterion, &[10_000, 100_000, 1_000_000]);
    implicit(criterion);
}

criterion_group! { name = benches; config = Criterion::default().with_measurement(ProcessorTime); targets = step }
criterion_main!(benches);
