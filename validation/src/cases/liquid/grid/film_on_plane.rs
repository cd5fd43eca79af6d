use mpm::{HalfSpace, LiquidSettings, Vector};
use particle_grid::Lattice;

use super::profile::{Elastic, Shear, stiffening};
use super::setup::{self, GRAVITY, Run};
use crate::case::{Case, CaseError, Outcome, Param, Params};

/// Time to run over the time that gravity alone takes to reach the mean speed.
const SPIN_UP: f64 = 6.0;
/// Longest run [s].
const LONGEST: f64 = 10.0;

pub const CASE: Case = Case {
    id: "liquid/film-on-plane",
    about: "A thick layer flowing down an incline with a free surface: mean and surface speed against the closed form; below \
            the yield height it rests.",
    params: &[
        Param::text("material", "shaving-cream", "name of the liquid"),
        Param::number("height", 0.02655, "m", "height of the layer, normal to the plane"),
        Param::number("angle", 45.0, "deg", "slope of the plane"),
        Param::count("cells", 16, "cells over the height"),
        Param::count("per_axis", 3, "particles per cell and direction"),
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
        Param::number("dt", 1e-3, "s", "largest step"),
        Param::number("time", 0.0, "s", "time to run (0: 0.4 s, or as much as the layer needs to become steady)"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let mut liquid = setup::preset(p)?;
    let shear = Shear::of(&liquid);
    let cells = p.count_in("cells", 4, 128)?;
    let per_axis = p.count_in("per_axis", 1, 8)?;
    let (height, dt) = (p.positive("height")?, p.positive("dt")?);
    let angle = p.number_in("angle", 0.1, 89.0)?.to_radians();
    let gradient = liquid.density * GRAVITY * angle.sin();
    liquid.shear_modulus *= stiffening(p.number_in("stiffening", 0.0, 1e6)?, liquid.shear_modulus, gradient * height);
    let elastic = Elastic { shear, modulus: liquid.shear_modulus, dimensions: 2 };
    let (reference, surface) = (elastic.mean(gradient, height), elastic.velocity(gradient, height, 0.0));
    if !reference.is_finite() {
        return Err(p.reject("stiffening", "large enough for the liquid to bear the stress at the plane"));
    }
    // Gravity alone takes this long to reach the mean speed; a viscous layer comes within 1 % of it in some six times as long.
    let acceleration = reference / (GRAVITY * angle.sin());
    let time = match p.number_in("time", 0.0, 100.0)? {
        0.0 => (SPIN_UP * acceleration).max(0.4),
        given => given,
    };
    if time < SPIN_UP * acceleration {
        return Err(
            p.reject("time", &format!("at least {:.1} s, in which this layer becomes steady", SPIN_UP * acceleration))
        );
    }
    if time > LONGEST {
        return Err(p.reject(
            "height",
            &format!("lower: the laminar flow of this layer runs at {reference:.3e} m/s and takes {time:.3e} s to become steady"),
        ));
    }
    let dx = height / cells as f64;
    let lattice = Lattice { dx, origin: Vector::<2>::zeros(), periods: [1, 0] };
    let materials = vec![setup::material(&liquid)?];
    let high = Vector::<2>::new(4.0 * dx, height);
    let particles = setup::region(&lattice, per_axis, Vector::<2>::zeros(), high, |_| true, &materials);
    let floor = [HalfSpace { point: Vector::<2>::zeros(), normal: Vector::<2>::new(0.0, 1.0), stick: 1.0 }];
    let body = Vector::<2>::new(GRAVITY * angle.sin(), -GRAVITY * angle.cos());
    let mut settings = LiquidSettings { particles_per_axis: per_axis, ..Default::default() };
    setup::couple(&mut settings, p)?;
    let mut run = Run::new(lattice, particles, materials, &floor, body, settings);
    let mut average = (0.0, 0.0, 0.0);
    while run.time < time {
        let step = run.allowed(dt);
        run.step(step)?;
        // Averages over the last quarter: the surface keeps swinging a little.
        if run.time > 0.75 * time {
            let n = run.particles.len() as f64;
            let mean = run.particles.velocity.iter().map(|v| v[0]).sum::<f64>() / n;
            let top: Vec<f64> = (0..run.particles.len())
                .filter(|&i| run.particles.position[i][1] > height - dx)
                .map(|i| run.particles.velocity[i][0])
                .collect();
            average.0 += mean * step;
            average.1 += top.iter().sum::<f64>() / top.len().max(1) as f64 * step;
            average.2 += step;
        }
    }
    let (mean, top) = (average.0 / average.2, average.1 / average.2);
    let mut out = Outcome::new();
    if reference > 0.0 {
        let tolerance = 0.05 * (16.0 / cells as f64).max(1.0);
        out.compare("mean_speed", mean, reference, tolerance);
        out.compare("surface_speed", top, surface, tolerance);
    } else {
        let scale = (GRAVITY * height).sqrt();
        out.measure("mean_speed", mean, |u| u.abs() < 1e-3 * scale, "rests below the yield height");
    }
    out.info("mean_speed_small_strain", shear.mean(gradient, height));
    out.info("plug_height", shear.plug(gradient).min(height));
    let totals = run.particles.totals(&run.materials, dx);
    out.compare("centre_height", totals.centre[1], 0.5 * height, 0.02);
    Ok(out)
}
