use constitutive::FlowCurve;
use mpm::{HalfSpace, LiquidSettings, Vector};
use particle_grid::Lattice;

use super::setup::{self, GRAVITY, Run};
use crate::case::{Case, CaseError, Outcome, Param, Params};

pub const CASE: Case = Case {
    id: "liquid/thin-spread",
    about: "A heap of a yield-stress liquid spreads on a floor until the yield stress holds it: radius against Roussel and \
            Coussot (2005); a quarter is computed.",
    params: &[
        Param::number("density", 1000.0, "kg/m³", "density"),
        Param::number("volume", 1e-4, "m³", "volume of the heap"),
        Param::number("tau_s", 10.0, "Pa", "yield stress in shear"),
        Param::number("cell", 0.006, "m", "cell size"),
        Param::count("per_axis", 2, "particles per cell and direction"),
        Param::number("dt", 5e-3, "s", "largest step"),
        Param::number("time", 2.0, "s", "longest time to run"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let (density, volume, tau) = (p.positive("density")?, p.positive("volume")?, p.positive("tau_s")?);
    let (dx, dt, time) = (p.positive("cell")?, p.positive("dt")?, p.positive("time")?);
    let per_axis = p.count_in("per_axis", 1, 6)?;
    let reference =
        (225.0 * density * GRAVITY * volume * volume / (128.0 * std::f64::consts::PI.powi(2) * tau)).powf(0.2);
    let central = (2.0 * tau * reference / (density * GRAVITY)).sqrt();
    if reference / dx > 100.0 || central < 1.5 * dx {
        return Err(
            p.reject("cell", "small enough for the heap to be more than 1.5 cells thick, large enough for 100 cells")
        );
    }
    let consistency = 0.05 * tau * (central / GRAVITY).sqrt() * 20.0;
    let flow = FlowCurve::Rheometer { yield_stress: tau, consistency, index: 1.0 };
    let liquid = setup::liquid(density, 50.0 * tau, flow)?;
    let materials = vec![setup::material(&liquid)?];
    let lattice = Lattice::<3>::new(dx);
    // Starts as a flat cylinder of half the final radius.
    let radius = 0.55 * reference;
    let height = volume / (std::f64::consts::PI * radius * radius);
    let high = Vector::<3>::new(radius, radius, height);
    let particles =
        setup::region(&lattice, per_axis, Vector::<3>::zeros(), high, |x| x[0].hypot(x[1]) < radius, &materials);
    let held = 4.0 * particles.totals(&materials, dx).volume;
    // The reference follows the volume that the samples really hold.
    let reference = reference * (held / volume).powf(0.4);
    let wall = |axis: usize, stick: f64| {
        let mut normal = Vector::<3>::zeros();
        normal[axis] = 1.0;
        HalfSpace { point: Vector::<3>::zeros(), normal, stick }
    };
    let walls = [wall(0, 0.0), wall(1, 0.0), wall(2, 1.0)];
    let body = Vector::<3>::new(0.0, 0.0, -GRAVITY);
    let settings = LiquidSettings { particles_per_axis: per_axis, ..Default::default() };
    let mut run = Run::new(lattice, particles, materials, &walls, body, settings);
    let scale = (GRAVITY * central).sqrt();
    let mut arrested = false;
    while run.time < time && !arrested {
        let step = run.allowed(dt);
        run.step(step)?;
        if run.time > 0.2 * time {
            let speed = run.particles.velocity.iter().map(|v| v.norm()).sum::<f64>() / run.particles.len() as f64;
            arrested = speed < 2e-3 * scale;
        }
    }
    // Radius within which 98 % of the liquid lies, for the profile h ∝ √(1 − r/R): its complement is (1 − x)^{3/2}(1 + 3x/2).
    let mut radii: Vec<f64> = run.particles.position.iter().map(|x| x[0].hypot(x[1])).collect();
    radii.sort_by(f64::total_cmp);
    let inner = radii[(radii.len() * 98 / 100).min(radii.len() - 1)];
    let (mut low, mut high) = (0.0f64, 1.0f64);
    for _ in 0..60 {
        let x = 0.5 * (low + high);
        if (1.0 - x).powf(1.5) * (1.0 + 1.5 * x) > 0.02 {
            low = x;
        } else {
            high = x;
        }
    }
    let mut out = Outcome::new();
    out.compare("radius", inner / low, reference, 0.1);
    out.info("arrested", f64::from(u8::from(arrested)));
    out.info("steps", run.steps as f64);
    out.info("particles", run.particles.len() as f64);
    out.info("thickness_in_cells", central / dx);
    Ok(out)
}
