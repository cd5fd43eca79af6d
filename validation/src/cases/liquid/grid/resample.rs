use mpm::resample::sampling;
use mpm::{LiquidGrid, LiquidSettings, NoSolid, ResampleScratch, Tensor, Vector, particles_to_grid};
use particle_grid::Lattice;

use super::setup;
use crate::case::{Case, CaseError, Curve, Outcome, Param, Params};

pub const CASE: Case = Case {
    id: "liquid/resample",
    about: "Splitting, merging and spreading of particles of very unequal volumes: mass, volume, centre, momentum and angular \
            momentum are kept; crowding fades.",
    params: &[
        Param::count("cells", 6, "cells along the edge of the block"),
        Param::count("per_axis", 3, "particles per cell and direction"),
        Param::number("spread", 10.0, "1", "ratio of the largest to the smallest volume"),
        Param::count("passes", 30, "passes of maintenance"),
        Param::count("seed", 1, "seed"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let cells = p.count_in("cells", 4, 40)?;
    let per_axis = p.count_in("per_axis", 2, 6)?;
    let range = p.number_in("spread", 1.0, 100.0)?.ln();
    let passes = p.count_in("passes", 1, 1000)?;
    let seed = p.count("seed")? as u64;
    let cream = constitutive::Liquid::preset("shaving-cream").map_err(CaseError::failed)?;
    let materials = [setup::material(&cream)?];
    let dx = 0.01;
    let lattice = Lattice::<3>::new(dx);
    let high = Vector::<3>::repeat(cells as f64 * dx);
    let mut particles = setup::region(&lattice, per_axis, Vector::<3>::zeros(), high, |_| true, &materials);
    let random = |i: usize, k: u64| mpm::random::uniform(&[seed, i as u64, k]) - 0.5;
    for i in 0..particles.len() {
        let x = particles.position[i];
        particles.velocity[i] =
            Vector::<3>::new(1.0 + 30.0 * x[1], (100.0 * x[0]).sin(), 0.3) + Vector::<3>::repeat(random(i, 1));
        particles.affine[i] = Tensor::<3>::from_fn(|a, b| 5.0 * random(i, 10 + (3 * a + b) as u64));
        particles.position[i] += Vector::<3>::from_fn(|a, _| 0.5 * dx / per_axis as f64 * random(i, 20 + a as u64));
        let factor = (range * random(i, 2)).exp();
        particles.mass[i] *= factor;
        particles.rest_volume[i] *= factor;
    }
    let settings = LiquidSettings { particles_per_axis: per_axis, ..Default::default() };
    let mut grid = LiquidGrid::new(lattice);
    let mut scratch = ResampleScratch::default();
    let before = particles.totals(&materials, dx);
    let (mut split, mut merged) = (0, 0);
    let mut unevenness = Vec::new();
    for pass in 0..passes {
        let report = mpm::resample::<3, NoSolid>(
            &mut particles,
            &materials,
            &mut grid,
            &[],
            4e-3,
            pass as u64,
            &settings,
            &mut scratch,
        )
        .map_err(CaseError::failed)?;
        split += report.split;
        merged += report.merged;
        particles_to_grid::activate(&mut particles, &materials, &[], &mut grid).map_err(CaseError::failed)?;
        let (mean, deviation) = sampling(&grid, per_axis);
        unevenness.push([pass as f64, deviation / mean.max(1e-300)]);
    }
    particles.check().map_err(CaseError::failed)?;
    let after = particles.totals(&materials, dx);
    let mut out = Outcome::new();
    out.compare("mass", after.mass, before.mass, 1e-12);
    out.compare("rest_volume", after.rest_volume, before.rest_volume, 1e-12);
    out.compare("volume", after.volume, before.volume, 1e-12);
    let scale = before.mass * before.max_speed;
    out.compare_absolute("momentum", (after.momentum - before.momentum).norm() / scale, 0.0, 1e-12);
    let length = cells as f64 * dx;
    out.compare_absolute("centre", (after.centre - before.centre).norm() / length, 0.0, 1e-12);
    let turn = (0..3).fold(0.0f64, |m, k| m.max((after.angular_momentum[k] - before.angular_momentum[k]).abs()));
    out.compare_absolute("angular_momentum", turn / (scale * length), 0.0, 1e-11);
    out.measure(
        "kinetic_energy",
        after.kinetic_energy / before.kinetic_energy,
        |r| r <= 1.05,
        "not created: at most 5 % by spreading",
    );
    out.info("split", split as f64);
    out.info("merged", merged as f64);
    out.info("particles", particles.len() as f64);
    let (first, last) = (unevenness[0][1], unevenness[unevenness.len() - 1][1]);
    out.measure("unevenness", last / first, |r| r <= 1.05, "spread of particles per cell does not grow");
    out.curve(Curve {
        title: "spread of particles per cell".into(),
        x_label: "pass".into(),
        y_label: "standard deviation over mean".into(),
        log_x: false,
        log_y: false,
        series: vec![("inside the liquid".into(), unevenness)],
    });
    Ok(out)
}
