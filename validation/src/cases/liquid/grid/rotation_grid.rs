use mpm::{LiquidSettings, NoSolid, Tensor, Vector};
use particle_grid::Lattice;

use super::setup::{self, Run};
use crate::case::{Case, CaseError, Outcome, Param, Params};

pub const CASE: Case = Case {
    id: "liquid/rotation-grid",
    about: "A disc of particles turning freely, transfers only: angular momentum, momentum and mass do not change.",
    params: &[
        Param::number("radius", 0.05, "m", "radius of the disc"),
        Param::count("cells", 5, "cells over the radius"),
        Param::count("steps", 200, "steps of one revolution"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let radius = p.positive("radius")?;
    let cells = p.count_in("cells", 2, 200)?;
    let steps = p.count_in("steps", 20, 100_000)?;
    let dx = radius / cells as f64;
    let lattice = Lattice::<2>::new(dx);
    let water = constitutive::Liquid::preset("water").map_err(CaseError::failed)?;
    let materials = vec![setup::material(&water)?];
    let square = Vector::<2>::repeat(radius);
    let mut particles = setup::region(&lattice, 3, -square, square, |x| x.norm() < radius, &materials);
    let spin = Tensor::<2>::new(0.0, -1.0, 1.0, 0.0);
    for i in 0..particles.len() {
        particles.velocity[i] = spin * particles.position[i];
        particles.affine[i] = spin;
    }
    let mut settings = LiquidSettings { particles_per_axis: 3, ..Default::default() };
    settings.shear.enabled = false;
    settings.pressure.enabled = false;
    settings.resample.enabled = false;
    let walls: [NoSolid; 0] = [];
    let mut run = Run::new(lattice, particles, materials, &walls, Vector::<2>::zeros(), settings);
    let before = run.particles.totals(&run.materials, dx);
    let dt = std::f64::consts::TAU / steps as f64;
    for _ in 0..steps {
        run.step(dt)?;
    }
    let after = run.particles.totals(&run.materials, dx);
    let mut out = Outcome::new();
    out.compare("angular_momentum", after.angular_momentum[0], before.angular_momentum[0], 1e-10);
    out.compare("mass", after.mass, before.mass, 1e-14);
    let scale = before.mass * before.max_speed;
    out.compare_absolute("momentum", (after.momentum - before.momentum).norm() / scale, 0.0, 1e-12);
    out.info("kinetic_energy_ratio", after.kinetic_energy / before.kinetic_energy);
    Ok(out)
}
