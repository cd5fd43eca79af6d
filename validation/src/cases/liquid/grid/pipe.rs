use mpm::{LiquidSettings, Solid, Vector};
use particle_grid::Lattice;

use super::profile::{Elastic, Shear, stiffening};
use super::setup::{self, Run};
use crate::case::{Case, CaseError, Outcome, Param, Params};

pub const CASE: Case = Case {
    id: "liquid/pipe",
    about: "Steady flow in a round pipe driven by a body force, on a grid that does not fit the wall: mean speed against the \
            closed form of a Herschel–Bulkley liquid.",
    params: &[
        Param::text("material", "drilling-mud", "name of the liquid"),
        Param::count("cells", 12, "cells across the pipe"),
        Param::count("per_axis", 2, "particles per cell and direction"),
        Param::number("radius", 0.005, "m", "radius of the pipe"),
        Param::text(
            "coupling",
            "once",
            "shear and pressure: once, twice (shear again after it), projected (and it again)",
        ),
        Param::number(
            "stiffening",
            0.0,
            "1",
            "factor on the shear modulus (0: as much as keeps elastic strains below 1/40, where the closed form holds)",
        ),
        Param::number("dt", 2e-3, "s", "largest step"),
        Param::number("time", 0.3, "s", "time to run"),
    ],
    run,
};

/// Everything outside a cylinder along z.
struct Bore {
    radius: f64,
}

impl Solid<3> for Bore {
    fn distance(&self, x: &Vector<3>) -> f64 {
        self.radius - x[0].hypot(x[1])
    }
    fn sample(&self, x: &Vector<3>) -> (f64, Vector<3>) {
        let r = x[0].hypot(x[1]);
        let normal =
            if r > 0.0 { Vector::<3>::new(-x[0] / r, -x[1] / r, 0.0) } else { Vector::<3>::new(1.0, 0.0, 0.0) };
        (self.radius - r, normal)
    }
    fn velocity(&self, _: &Vector<3>) -> Vector<3> {
        Vector::<3>::zeros()
    }
    fn stick(&self) -> f64 {
        1.0
    }
}

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let mut liquid = setup::preset(p)?;
    let shear = Shear::of(&liquid);
    let cells = p.count_in("cells", 6, 64)?;
    let per_axis = p.count_in("per_axis", 1, 8)?;
    let (radius, dt, time) = (p.positive("radius")?, p.positive("dt")?, p.positive("time")?);
    // Twice the gradient that drives a mean of one diameter per second between plates one diameter apart.
    let gradient = 2.0 * shear.gradient_for(2.0 * radius, radius);
    liquid.shear_modulus *=
        stiffening(p.number_in("stiffening", 0.0, 1e6)?, liquid.shear_modulus, 0.5 * gradient * radius);
    let elastic = Elastic { shear, modulus: liquid.shear_modulus, dimensions: 3 };
    let dx = 2.0 * radius / cells as f64;
    let lattice = Lattice { dx, origin: Vector::<3>::new(0.0, 0.0, 0.0), periods: [0, 0, 1] };
    let materials = vec![setup::material(&liquid)?];
    let high = Vector::<3>::new(radius, radius, 4.0 * dx);
    let low = Vector::<3>::new(-radius, -radius, 0.0);
    let inside = |x: &Vector<3>| x[0].hypot(x[1]) < radius;
    let mut particles = setup::region(&lattice, per_axis, low, high, inside, &materials);
    // Starting with the profile saves the time in which a thin liquid speeds up; stresses still start from zero.
    for i in 0..particles.len() {
        let x = particles.position[i];
        particles.velocity[i][2] = shear.pipe_velocity(gradient, radius, x[0].hypot(x[1]));
    }
    let walls = [Bore { radius }];
    let body = Vector::<3>::new(0.0, 0.0, gradient / liquid.density);
    let mut settings = LiquidSettings { particles_per_axis: per_axis, ..Default::default() };
    setup::couple(&mut settings, p)?;
    let mut run = Run::new(lattice, particles, materials, &walls, body, settings);
    while run.time < time {
        let step = run.allowed(dt);
        run.step(step)?;
    }
    let momentum: f64 = (0..run.particles.len()).map(|i| run.particles.mass[i] * run.particles.velocity[i][2]).sum();
    let mass: f64 = run.particles.mass.iter().sum();
    let mut out = Outcome::new();
    let tolerance = 0.05 * (16.0 / cells as f64).max(1.0);
    out.compare("mean_speed", momentum / mass, elastic.pipe_mean(gradient, radius), tolerance);
    let peak = run.particles.velocity.iter().fold(0.0f64, |m, v| m.max(v[2]));
    out.compare("u_max", peak, elastic.velocity(0.5 * gradient, radius, 0.0), tolerance);
    out.info("mean_speed_small_strain", shear.pipe_mean(gradient, radius));
    out.info("steps", run.steps as f64);
    out.info("particles", run.particles.len() as f64);
    Ok(out)
}
