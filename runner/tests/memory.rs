//! Memory of a long run, in a process of its own.
#![cfg(target_os = "linux")]

use std::path::Path;

use runner::stepper::{StepControl, Stepper};

/// Memory does not grow: ten thousand steps of a strand that goes in and out of a little water.
#[test]
fn memory_does_not_grow_over_ten_thousand_steps() {
    let text = r#"Scene(
        units: Cgs, time: (end: 10, step: Fixed(1e-3)), gravity: [0, -981, 0],
        materials: { "rubber": Fibre(density: 1.3, young_modulus: 1e8, poisson_ratio: 0.45, viscosity: 1e5), "water": Liquid(preset: "water") },
        strands: [(material: "rubber", radius: 0.05, shape: Straight(from: [0, 1.6, 0], to: [0, 0.3, 0], vertices: 6), clamp: [First(2)],
                   motion: [Oscillate(amplitude: [0, 0.4, 0], frequency: 2)])],
        solids: [(name: "pot", shape: Box(center: [0, 3, 0], half_size: [0.5, 3, 0.5]), inverted: true)],
        liquid: (cell: 0.5, particles_per_cell: 8, tanks: [(material: "water", shape: Box(center: [0, 0.25, 0], half_size: [0.5, 0.25, 0.5]))]),
        output: (frames: Never, checkpoint: Never),
    )"#;
    let resident = || {
        let status = std::fs::read_to_string("/proc/self/statm").unwrap();
        status.split_whitespace().nth(1).unwrap().parse::<f64>().unwrap() * 4096.0
    };
    let loaded = runner::scene::load_str(text, Path::new("scene.ron"), &[]).unwrap();
    let mut job = runner::prepare::job(loaded, 1).unwrap();
    let mut early = 0.0;
    let mut stepper = Stepper::new(StepControl::Fixed(1e-3), 10.0);
    while !stepper.done() {
        let whole = stepper.state.whole_steps;
        stepper.advance(job.system.as_mut(), f64::INFINITY).unwrap_or_else(|failure| panic!("{failure:?}"));
        if whole < 1000 && stepper.state.whole_steps >= 1000 {
            early = resident();
        }
    }
    let more = resident() - early;
    println!("{:.2} MB after 1000 steps, {:.2} MB more after 10 000", early / 1e6, more / 1e6);
    assert!(more < 1e6, "{:.2} MB more", more / 1e6);
}
