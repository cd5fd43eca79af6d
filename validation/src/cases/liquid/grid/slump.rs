use constitutive::FlowCurve;
use mpm::{HalfSpace, LiquidSettings, Vector};
use particle_grid::Lattice;

use super::setup::{self, GRAVITY, Run};
use crate::case::{Case, CaseError, Outcome, Param, Params};

pub const CASE: Case = Case {
    id: "liquid/slump",
    about: "A cylinder of a yield-stress liquid sinks under its weight and arrests: loss of height against Pashias (1996); a \
            quarter is computed.",
    params: &[
        Param::number("tau_prime", 0.1, "1", "yield stress over weight, τ_s/(ρ g H)"),
        Param::number("height", 0.1, "m", "height of the cylinder; its diameter is the same"),
        Param::count("cells", 8, "cells over the height"),
        Param::count("per_axis", 2, "particles per cell and direction"),
        Param::number(
            "viscosity",
            0.0,
            "1",
            "consistency over ρ g H √(H/g): large enough not to overshoot, small enough to arrest (0: 12 τ'², which is both)",
        ),
        Param::text(
            "coupling",
            "once",
            "shear and pressure: once, twice (shear again after it), projected (and it again)",
        ),
        Param::number("dt", 2e-3, "s", "largest step"),
        Param::number("time", 4.0, "s", "longest time to run"),
    ],
    run,
};

/// Time before which the heap may not have begun to move [s].
const START: f64 = 0.2;

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let tau_prime = p.number_in("tau_prime", 0.02, 0.6)?;
    let height = p.positive("height")?;
    let cells = p.count_in("cells", 4, 48)?;
    let per_axis = p.count_in("per_axis", 1, 6)?;
    let (dt, time) = (p.positive("dt")?, p.positive("time")?);
    let density = 1000.0;
    let yield_stress = tau_prime * density * GRAVITY * height;
    // Viscous enough not to overshoot by inertia, thin enough to arrest within the run.
    let viscosity = match p.number_in("viscosity", 0.0, 10.0)? {
        0.0 => 12.0 * tau_prime * tau_prime,
        given => given,
    };
    let consistency = viscosity * density * GRAVITY * height * (height / GRAVITY).sqrt();
    let flow = FlowCurve::Rheometer { yield_stress, consistency, index: 1.0 };
    let liquid = setup::liquid(density, 50.0 * yield_stress, flow)?;
    let materials = vec![setup::material(&liquid)?];
    let dx = height / cells as f64;
    let lattice = Lattice::<3>::new(dx);
    let radius = 0.5 * height;
    let high = Vector::<3>::new(radius, radius, height);
    let particles =
        setup::region(&lattice, per_axis, Vector::<3>::zeros(), high, |x| x[0].hypot(x[1]) < radius, &materials);
    let wall = |axis: usize, stick: f64| {
        let mut normal = Vector::<3>::zeros();
        normal[axis] = 1.0;
        HalfSpace { point: Vector::<3>::zeros(), normal, stick }
    };
    let walls = [wall(0, 0.0), wall(1, 0.0), wall(2, 1.0)];
    let body = Vector::<3>::new(0.0, 0.0, -GRAVITY);
    let mut settings = LiquidSettings { particles_per_axis: per_axis, ..Default::default() };
    setup::couple(&mut settings, p)?;
    let mut run = Run::new(lattice, particles, materials, &walls, body, settings);
    let top = |run: &Run<'_, 3, HalfSpace<3>>| {
        // Height of the column over the middle: the uppermost particles near the axis, half a sample above their centres.
        let mut heights: Vec<f64> =
            run.particles.position.iter().filter(|x| x[0].hypot(x[1]) < 0.4 * radius).map(|x| x[2]).collect();
        heights.sort_by(f64::total_cmp);
        let count = (heights.len() / 20).clamp(1, 50);
        heights.iter().rev().take(count).sum::<f64>() / count as f64 + 0.5 * dx / per_axis as f64
    };
    let start = top(&run);
    let mut arrested = false;
    let scale = (GRAVITY * height).sqrt();
    while run.time < time && !arrested {
        let step = run.allowed(dt);
        run.step(step)?;
        if run.time > START {
            let speed = run.particles.velocity.iter().map(|v| v.norm()).sum::<f64>() / run.particles.len() as f64;
            arrested = speed < 2e-3 * scale;
        }
    }
    let measured = (start - top(&run)) / start;
    let reference = if tau_prime < 0.5 { 1.0 - 2.0 * tau_prime * (1.0 - (2.0 * tau_prime).ln()) } else { 0.0 };
    let mut out = Outcome::new();
    if tau_prime <= 0.2 {
        out.compare_absolute("slump", measured, reference, 0.05);
    } else {
        out.measure("slump", measured, |s| (-0.01..=reference + 0.1).contains(&s), "at most a tenth above Pashias");
        out.info("pashias", reference);
    }
    out.info("time", run.time);
    out.info("arrested", f64::from(u8::from(arrested)));
    out.info("steps", run.steps as f64);
    out.info("particles", run.particles.len() as f64);
    Ok(out)
}
