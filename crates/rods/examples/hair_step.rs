//! Times steps of many free hair strands in CPU seconds: `hair_step [strands] [steps]`.
//!
//! Prints microseconds per vertex and step, Newton iterations, and the share of each part of an iteration.

use nalgebra::Vector3;
use rods::*;
use std::time::Instant;

fn cpu_seconds() -> f64 {
    // user and system ticks of this process (fields 14 and 15 after the name), 100 per second
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let rest = text.rsplit(')').next().unwrap_or_default();
    let f: Vec<f64> = rest.split_whitespace().filter_map(|w| w.parse().ok()).collect();
    f.get(10).zip(f.get(11)).map_or(0.0, |(u, s)| (u + s) / 100.0)
}

fn main() {
    let arguments: Vec<usize> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let strands = arguments.first().copied().unwrap_or(2192);
    let steps = arguments.get(1).copied().unwrap_or(20);
    let vertices = 41;
    let mut rods = RodSet::new();
    for k in 0..strands {
        let phase = 0.37 * k as f64;
        let positions = (0..vertices)
            .map(|i| {
                let s = 2e-3 * i as f64;
                Vector3::new(2e-3 * (80.0 * s + phase).sin() + 1e-3 * k as f64, 2e-3 * (80.0 * s + phase).cos(), -s)
            })
            .collect();
        let mut spec = StrandSpec::new(positions, 5e-5, StrandMaterial::default());
        spec.velocities =
            Some((0..vertices).map(|i| Vector3::new(0.3 * (0.2 * i as f64 + phase).sin(), 0.1, -0.5)).collect());
        rods.add_strand(&spec).expect("strand");
    }
    let loads = Loads::gravity(Vector3::new(0.0, 0.0, -9.81));
    let n = (strands * vertices) as f64;
    let mut stepper = RodStepper::new(RodSettings::default()).expect("settings");
    let report = stepper.advance(&mut rods, 2e-4, &loads, &Boundary::default()).expect("step");
    println!("first step: {report:?}");
    let (cpu, wall) = (cpu_seconds(), Instant::now());
    let mut iterations = 0;
    for _ in 0..steps {
        iterations += stepper.advance(&mut rods, 2e-4, &loads, &Boundary::default()).expect("step").total_iterations;
    }
    let per = |t: f64| 1e6 * t / (n * steps as f64);
    println!(
        "{:.3} us CPU, {:.3} us wall per vertex and step; {:.2} Newton iterations per strand and step",
        per(cpu_seconds() - cpu),
        per(wall.elapsed().as_secs_f64()),
        iterations as f64 / (strands * steps) as f64
    );
    for (name, matrix) in [("energy and gradient", false), ("with matrix", true)] {
        let cpu = cpu_seconds();
        for _ in 0..steps {
            stepper.bench_evaluate(matrix);
        }
        println!("{name}: {:.3} us per vertex", per(cpu_seconds() - cpu));
    }
}
