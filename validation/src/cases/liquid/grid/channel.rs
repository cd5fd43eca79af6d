use mpm::settings::{ShearOperator, Tangent};
use mpm::{HalfSpace, LiquidSettings, Tensor, Vector};
use particle_grid::Lattice;

use super::profile::{Elastic, Shear, stiffening};
use super::setup::{self, Run};
use crate::case::{Case, CaseError, Curve, Outcome, Param, Params};

pub const CASE: Case = Case {
    id: "liquid/channel",
    about: "Steady flow between plates driven by a body force: peak speed, plug and profile of a Herschel–Bulkley liquid. The \
            reference is the flow of the elastic liquid with the modulus used, the closed form where elastic strains are small.",
    params: &[
        Param::text("material", "drilling-mud", "name of the liquid"),
        Param::count("cells", 16, "cells across the channel"),
        Param::count("per_axis", 3, "particles per cell and direction"),
        Param::number("width", 0.01, "m", "distance of the plates"),
        Param::number("mean", 0.01, "m/s", "mean speed"),
        Param::number("dt", 1e-3, "s", "largest step"),
        Param::count("newton", 4, "most Newton iterations of the shear solve"),
        Param::number("newton_tolerance", 0.05, "1", "relative residual at which Newton stops"),
        Param::text("operator", "automatic", "shear operator: automatic, quadrature or particles"),
        Param::text("tangent", "symmetric", "tangent: symmetric, definite or secant"),
        Param::number("tolerance", 1e-6, "1", "relative tolerance of the shear solve"),
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
        Param::number("time", 0.0, "s", "time to run (0: ten relaxation times of the flow, within 0.25 to 1 s)"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let mut liquid = setup::preset(p)?;
    let shear = Shear::of(&liquid);
    let cells = p.count_in("cells", 4, 256)?;
    let per_axis = p.count_in("per_axis", 1, 8)?;
    let (half, mean) = (0.5 * p.positive("width")?, p.positive("mean")?);
    let dt = p.positive("dt")?;
    let gradient = shear.gradient_for(mean, half);
    liquid.shear_modulus *= stiffening(p.number_in("stiffening", 0.0, 1e6)?, liquid.shear_modulus, gradient * half);
    let elastic = Elastic { shear, modulus: liquid.shear_modulus, dimensions: 2 };
    let peak = elastic.velocity(gradient, half, 0.0);
    if !peak.is_finite() {
        return Err(p.reject("stiffening", "large enough for the liquid to bear the stress at the wall"));
    }
    let effective = gradient * half * half / (3.0 * mean);
    let relaxation = liquid.density * half * half / effective;
    let asked = p.number_in("time", 0.0, 1e3)?;
    let time = if asked > 0.0 { asked } else { (10.0 * relaxation).clamp(0.25, 1.0) };
    let dx = 2.0 * half / cells as f64;
    let lattice = Lattice { dx, origin: Vector::<2>::zeros(), periods: [1, 0] };
    let materials = vec![setup::material(&liquid)?];
    let high = Vector::<2>::new(4.0 * dx, 2.0 * half);
    let mut particles = setup::region(&lattice, per_axis, Vector::<2>::zeros(), high, |_| true, &materials);
    let mu = liquid.shear_modulus;
    // A liquid without a yield stress takes long to speed up; it starts with the profile, the others from rest.
    if mu == 0.0 {
        for i in 0..particles.len() {
            let y = particles.position[i][1] - half;
            particles.velocity[i][0] = shear.velocity(gradient, half, y);
            let e = 1e-4 * half;
            let slope = (shear.velocity(gradient, half, y + e) - shear.velocity(gradient, half, y - e)) / (2.0 * e);
            particles.affine[i] = Tensor::<2>::new(0.0, slope, 0.0, 0.0);
        }
    }
    let wall = |y: f64, sign: f64| HalfSpace {
        point: Vector::<2>::new(0.0, y),
        normal: Vector::<2>::new(0.0, sign),
        stick: 1.0,
    };
    let walls = [wall(0.0, 1.0), wall(2.0 * half, -1.0)];
    let body = Vector::<2>::new(gradient / liquid.density, 0.0);
    let mut settings = LiquidSettings { particles_per_axis: per_axis, ..Default::default() };
    settings.shear.newton_iterations = p.count_in("newton", 1, 20)?;
    settings.shear.newton_tolerance = p.positive("newton_tolerance")?;
    settings.shear.pcg.tolerance = p.positive("tolerance")?;
    settings.shear.operator = match p.text("operator")? {
        "automatic" => ShearOperator::Automatic,
        "quadrature" => ShearOperator::CellQuadrature,
        "particles" => ShearOperator::Particles,
        _ => return Err(p.reject("operator", "automatic, quadrature or particles")),
    };
    settings.shear.tangent = match p.text("tangent")? {
        "symmetric" => Tangent::Symmetric,
        "definite" => Tangent::PositiveDefinite,
        "secant" => Tangent::Secant,
        _ => return Err(p.reject("tangent", "symmetric, definite or secant")),
    };
    setup::couple(&mut settings, p)?;
    let mut run = Run::new(lattice, particles, materials, &walls, body, settings);
    let mut iterations = 0;
    while run.time < time {
        let step = run.allowed(dt);
        let report = run.step(step)?;
        iterations += report.shear.solve.iterations + report.shear_again.map_or(0, |s| s.solve.iterations);
    }
    let mut out = Outcome::new();
    // Row averages of the particles.
    let mut sums = vec![(0.0, 0.0); cells];
    let (mut still, mut all) = (0.0, 0.0);
    for i in 0..run.particles.len() {
        let y = run.particles.position[i][1];
        let row = ((y / dx) as usize).min(cells - 1);
        sums[row].0 += run.particles.velocity[i][0];
        sums[row].1 += 1.0;
        all += run.particles.volume(i);
        if mu > 0.0 && run.particles.flags[i] & mpm::YIELDED == 0 {
            still += run.particles.volume(i);
        }
    }
    let (mut error, mut points, mut exact) = (0.0f64, Vec::new(), Vec::new());
    let mut measured_peak = 0.0f64;
    for (row, (sum, count)) in sums.iter().enumerate() {
        if *count > 0.0 {
            let y = (row as f64 + 0.5) * dx - half;
            let u = sum / count;
            // The mean over the row of the exact profile.
            let m = 8;
            let reference = (0..m)
                .map(|k| elastic.velocity(gradient, half, y + ((f64::from(k) + 0.5) / f64::from(m) - 0.5) * dx))
                .sum::<f64>()
                / f64::from(m);
            error += (u - reference) * (u - reference);
            measured_peak = measured_peak.max(u);
            points.push([y, u]);
            exact.push([y, reference]);
        }
    }
    error = (error / cells as f64).sqrt() / peak;
    let tolerance = 0.03 * (32.0 / cells as f64).max(1.0);
    out.compare("u_max", measured_peak, peak, tolerance);
    if mu > 0.0 {
        let plug = half * still / all;
        out.compare_absolute(
            "plug_half_width",
            plug / half,
            shear.plug(gradient) / half,
            0.03f64.max(2.0 / cells as f64),
        );
    }
    out.measure("profile_error", error, |e| e < tolerance, "root mean square over the rows, of the peak speed");
    out.info("u_max_small_strain", shear.velocity(gradient, half, 0.0));
    out.info("shear_modulus", mu);
    out.info("steps", run.steps as f64);
    out.info("shear_iterations", iterations as f64);
    out.info("pressure_gradient", gradient);
    out.curve(Curve {
        title: format!("speed across the channel: {}", p.text("material")?),
        x_label: "distance from the middle [m]".into(),
        y_label: "speed [m/s]".into(),
        log_x: false,
        log_y: false,
        series: vec![("particles".into(), points), ("steady flow".into(), exact)],
    });
    Ok(out)
}
