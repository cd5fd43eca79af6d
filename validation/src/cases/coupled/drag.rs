//! Drag between strands and liquid.

use constitutive::Liquid;

use super::whole;
use crate::case::{Case, CaseError, Outcome, Param, Params};

/// Momentum of a strand shot through a floating cube of liquid.
pub const TWO_WAY: Case = Case {
    id: "coupled/two-way-drag",
    about: "A strand flies through a cube of liquid that floats free, with drag alone: the momentum of both together is constant \
            and their relative velocity never turns round",
    params: &[
        Param::text("liquid", "acrylic-paint", "preset of the liquid"),
        Param::number("speed", 1.0, "m/s", "speed of the strand"),
        Param::number("step", 1e-3, "s", "time step"),
    ],
    run: two_way,
};

fn two_way(p: &Params) -> Result<Outcome, CaseError> {
    let (liquid, speed, step) = (p.text("liquid")?, p.positive("speed")?, p.positive("step")?);
    Liquid::preset(liquid).map_err(CaseError::failed)?;
    let end = 30.0 * step;
    let text = format!(
        "Scene(
            units: Si, time: (end: {end:e}, step: Fixed({step:e})), gravity: [0, 0, 0],
            materials: {{ \"rubber\": Fibre(density: 1100, young_modulus: 1e7, poisson_ratio: 0.45, viscosity: 1e3), \"liquid\": Liquid(preset: \"{liquid}\") }},
            strands: [(material: \"rubber\", radius: 1e-3, shape: Straight(from: [-0.012, 0.001, 0.0005], to: [0.012, -0.001, 0.0005], vertices: 13), velocity: [0, {speed:e}, 0])],
            liquid: (cell: 5e-3, particles_per_cell: 8, tanks: [(material: \"liquid\", shape: Box(center: [0, 0, 0], half_size: [0.02, 0.02, 0.02]))]),
            disable: [Pressure, Shear, Capture, StrandContact],
            output: (frames: Never, checkpoint: Never),
        )"
    );
    let run = whole(&text, "two-way-drag.ron")?;
    let mut out = Outcome::new();
    let mut worst = 0.0f64;
    let strands = run.series.vector("momentum")?;
    let bulk = run.series.vector("liquid_momentum")?;
    let sum = |k: usize| [0, 1, 2].map(|a| strands[k][a] + bulk[k][a]);
    let start = sum(0);
    let scale = start.iter().map(|x| x * x).sum::<f64>().sqrt();
    for k in 0..strands.len() {
        let now = sum(k);
        worst = worst.max((0..3).map(|a| (now[a] - start[a]).powi(2)).sum::<f64>().sqrt() / scale);
    }
    out.measure("momentum_change", worst, |x| x <= 1e-10, "momentum of strand and liquid is constant to 1e-10");
    let speeds: Vec<f64> = strands.iter().map(|m| m[1] / strands[0][1]).collect();
    let rises = speeds.windows(2).map(|w| w[1] - w[0]).fold(f64::NEG_INFINITY, f64::max);
    out.measure("speed_rises", rises, |x| x <= 1e-9, "the strand only slows down");
    out.measure("momentum_passed", 1.0 - speeds[speeds.len() - 1], |x| x > 0.05, "drag acts");
    Ok(out)
}
