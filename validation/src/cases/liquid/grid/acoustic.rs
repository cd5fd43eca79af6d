use mpm::{LiquidSettings, NoSolid, Vector};
use particle_grid::Lattice;

use super::setup::{self, Run};
use crate::case::{Case, CaseError, Outcome, Param, Params};

pub const CASE: Case = Case {
    id: "liquid/acoustic",
    about: "A standing sound wave in a compressible liquid, shear off: its period gives the speed √(κ/ρ).",
    params: &[
        Param::text("material", "shaving-cream", "name of a compressible liquid"),
        Param::count("cells", 32, "cells per wavelength, a multiple of 4"),
        Param::number("courant", 0.1, "1", "cells that sound crosses in a step"),
        Param::number("amplitude", 1e-3, "1", "velocity over the speed of sound"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let liquid = setup::preset(p)?;
    if !liquid.is_compressible() {
        return Err(p.reject("material", "a compressible liquid, such as shaving-cream or milk-cream"));
    }
    let cells = p.count_in("cells", 8, 512)?;
    if !cells.is_multiple_of(4) {
        return Err(p.reject("cells", "a multiple of 4"));
    }
    let courant = p.number_in("courant", 1e-3, 10.0)?;
    let amplitude = p.number_in("amplitude", 1e-6, 0.05)?;
    let speed = (liquid.bulk_modulus / liquid.density).sqrt();
    let length = 1.0;
    let dx = length / cells as f64;
    let lattice = Lattice { dx, origin: Vector::<2>::zeros(), periods: [cells as u32 / 4, 1] };
    let materials = vec![setup::material(&liquid)?];
    let high = Vector::<2>::new(length, 4.0 * dx);
    let mut particles = setup::region(&lattice, 2, Vector::<2>::zeros(), high, |_| true, &materials);
    let k = std::f64::consts::TAU / length;
    for i in 0..particles.len() {
        let x = particles.position[i][0];
        particles.velocity[i][0] = amplitude * speed * (k * x).sin();
        particles.affine[i][(0, 0)] = amplitude * speed * k * (k * x).cos();
    }
    let mut settings = LiquidSettings { particles_per_axis: 2, ..Default::default() };
    settings.shear.enabled = false;
    settings.resample.enabled = false;
    let walls: [NoSolid; 0] = [];
    let mut run = Run::new(lattice, particles, materials, &walls, Vector::<2>::zeros(), settings);
    let dt = courant * dx / speed;
    let period = length / speed;
    // The amplitude of the standing wave crosses zero every half period.
    let (mut crossings, mut last) = (Vec::new(), f64::NAN);
    while crossings.len() < 3 && run.time < 4.0 * period {
        run.step(dt)?;
        let wave: f64 = (0..run.particles.len())
            .map(|i| run.particles.velocity[i][0] * (k * run.particles.position[i][0]).sin())
            .sum();
        if last.is_finite() && last * wave < 0.0 {
            crossings.push(run.time - dt * wave / (wave - last));
        }
        last = wave;
    }
    let mut out = Outcome::new();
    let measured = if crossings.len() >= 3 { crossings[2] - crossings[0] } else { f64::NAN };
    out.compare("speed", length / measured, speed, 0.03);
    out.info("steps", run.steps as f64);
    Ok(out)
}
