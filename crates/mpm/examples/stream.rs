//! Cost of a step of a falling stream of cream, stage by stage, and of the parts of a step: one thread, processor time.
//!
//! `cargo run -p mpm --example stream -- 10000 [steps] [material] [threads] [radius in mm]`: a column four radii high, or as high as a given radius makes it.

use constitutive::{LawSettings, Liquid};
use mpm::{HalfSpace, LiquidMaterial, LiquidSettings, LiquidStepper, Particle, Particles, Vector, fill};
use particle_grid::Lattice;
use std::time::Instant;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let number = |k: usize, default: usize| arguments.get(k).and_then(|a| a.parse().ok()).unwrap_or(default);
    let (count, steps) = (number(1, 10_000), number(2, 50));
    let name = arguments.get(3).map_or("shaving-cream", String::as_str);
    let lattice = Lattice::<3>::new(5e-3);
    let liquid = Liquid::preset(name).expect("a liquid");
    let materials = vec![LiquidMaterial::new(&liquid, LawSettings::default()).expect("a liquid")];
    let volume = fill::sample_volume(&lattice, 4);
    let area = |radius: f64| std::f64::consts::PI * radius * radius;
    let radius = match number(5, 0) {
        0 => (count as f64 * volume / area(2.0)).cbrt(),
        given => given as f64 * 1e-3,
    };
    let height = count as f64 * volume / area(radius);
    let (low, high) = (Vector::<3>::new(-radius, -radius, 0.0), Vector::<3>::new(radius, radius, height));
    let mut particles = Particles::new(&materials);
    for x in fill::fill(&lattice, 4, &low, &high, |x| x.x.hypot(x.y) < radius) {
        let mut p = Particle::new(x, volume, 0, liquid.density);
        p.velocity = Vector::<3>::new(0.05 * (x.y * 300.0).sin(), 0.0, -0.5 - 2.0 * x.z);
        p.affine = nalgebra::Matrix3::from_diagonal(&Vector::<3>::new(1.0, 1.0, -2.0));
        particles.push(p);
    }
    let floor = [HalfSpace { point: Vector::<3>::zeros(), normal: Vector::<3>::z(), stick: 1.0 }];
    let body = Vector::<3>::new(0.0, 0.0, -9.81);
    let settings = LiquidSettings::default();
    let mut stepper = LiquidStepper::new(lattice);
    let single = rayon::ThreadPoolBuilder::new().num_threads(number(4, 1)).build().expect("threads");
    let (mut shear, mut pressure, mut newton) = (0, 0, 0);
    let start = Instant::now();
    for k in 0..steps {
        let report = single
            .install(|| stepper.advance(&mut particles, &materials, &floor, &floor, &body, 1e-3, k as u64, &settings))
            .expect("a step");
        shear += report.shear.solve.iterations;
        newton += report.shear.newton_iterations;
        pressure += report.pressure.map_or(0, |p| p.multigrid.solve.iterations)
            + report.prediction.map_or(0, |p| p.multigrid.solve.iterations);
        if k + 1 == steps {
            println!(
                "cells {} blocks {} occupied {}; bytes a particle: grid {}, shear {}",
                report.weights.liquid_cells,
                report.transfer.blocks,
                report.transfer.occupied,
                stepper.grid.bytes() / particles.len(),
                stepper.shear.bytes() / particles.len(),
            );
        }
    }
    let seconds = start.elapsed().as_secs_f64() / steps as f64;
    let n = particles.len();
    let totals = particles.totals(&materials, lattice.dx);
    println!(
        "{n} particles: {:.3e} s a step, {:.0} ns a particle; per step {:.1} shear iterations, {:.2} Newton, {:.1} pressure; {} + {} bytes a particle; energy {:.6e} {:.6e}",
        seconds,
        seconds / n as f64 * 1e9,
        shear as f64 / steps as f64,
        newton as f64 / steps as f64,
        pressure as f64 / steps as f64,
        particles.bytes() / n,
        stepper.bytes() / n,
        totals.kinetic_energy,
        totals.elastic_energy,
    );
}
