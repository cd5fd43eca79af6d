//! Drag between strands and liquid.

use std::f64::consts::PI;

use constitutive::drag::{DragGeometry, DragLaw, DragSettings};
use constitutive::{FlowCurve, Liquid};

use super::{largest, last, whole};
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

/// A strand in a liquid with a yield stress.
pub const YIELD_STICK: Case = Case {
    id: "coupled/yield-stick",
    about: "A strand lies in a tank of yield-stress liquid: below the load that yields it by the drag law it hangs still, above it \
            sinks",
    params: &[
        Param::number("yield_stress", 20.0, "Pa", "yield stress in simple shear"),
        Param::number("below", 0.3, "1", "load below the threshold, as a part of it"),
        Param::number("above", 4.0, "1", "load above the threshold"),
    ],
    run: yield_stick,
};

const RADIUS: f64 = 5e-4;
const LENGTH: f64 = 0.016;
const VERTICES: usize = 9;
const LIQUID: f64 = 1000.0;

/// A strand of the given density lying in a tank.
fn lying(density: f64, flow: &str, shear: f64, end: f64, step: f64) -> String {
    format!(
        "Scene(
            units: Si, time: (end: {end:e}, step: Fixed({step:e})), gravity: [0, -9.81, 0],
            materials: {{
                \"string\": Fibre(density: {density:e}, young_modulus: 1e8, poisson_ratio: 0.45, viscosity: 1e4),
                \"liquid\": Liquid(density: {LIQUID:e}, bulk_modulus: 2e9, shear_modulus: {shear:e}, flow: Rheometer({flow})),
            }},
            strands: [(material: \"string\", radius: {RADIUS:e}, shape: Straight(from: [{:e}, 0.022, 0], to: [{:e}, 0.022, 0], vertices: {VERTICES}))],
            solids: [(name: \"tank\", shape: Box(center: [0, 0.05, 0], half_size: [0.02, 0.05, 0.02]), inverted: true)],
            liquid: (cell: 5e-3, particles_per_cell: 8, tanks: [(material: \"liquid\", shape: Box(center: [0, 0.0175, 0], half_size: [0.02, 0.0175, 0.02]))]),
            disable: [StrandContact],
            output: (frames: Never, checkpoint: Never, probes: [Vertex(name: \"middle\", strand: 0, vertex: 4)]),
        )",
        -0.5 * LENGTH,
        0.5 * LENGTH,
    )
}

/// Drag law and body of a piece of that strand.
fn law(curve: &FlowCurve) -> Result<(DragLaw, DragGeometry, f64), CaseError> {
    let law = DragLaw::new(LIQUID, curve, DragSettings::default()).map_err(CaseError::failed)?;
    let piece = LENGTH / (VERTICES - 1) as f64;
    Ok((law, DragGeometry::capsule(RADIUS, piece, 1.0), piece))
}

/// Density of a strand whose weight under liquid on one piece is `load` [N].
fn density_of(load: f64, piece: f64) -> f64 {
    LIQUID + load / (9.81 * PI * RADIUS * RADIUS * piece)
}

fn yield_stick(p: &Params) -> Result<Outcome, CaseError> {
    let stress = p.positive("yield_stress")?;
    let (below, above) = (p.number_in("below", 0.0, 1.0)?, p.number_in("above", 1.0, 100.0)?);
    let (law, body, piece) = law(&FlowCurve::Rheometer { yield_stress: stress, consistency: 1.0, index: 1.0 })?;
    let threshold = law.yield_force(&body, 1.0, 3.7);
    let flow = format!("yield_stress: {stress:e}, consistency: 1, index: 1");
    let mut out = Outcome::new();
    out.info("threshold", threshold);
    let sink = |part: f64| -> Result<(f64, f64), CaseError> {
        let run = whole(&lying(density_of(part * threshold, piece), &flow, 2000.0, 0.1, 2e-3), "yield-stick.ron")?;
        let y = run.series.column("middle_y")?;
        Ok((y[0] - last(&run, "middle_y")?, last(&run, "submerged_stuck")?))
    };
    let (still, stuck) = sink(below)?;
    let (moved, loose) = sink(above)?;
    out.info("sunk_below", still);
    out.info("sunk_above", moved);
    out.measure(
        "stuck_below",
        stuck,
        |x| x == VERTICES as f64,
        "below the threshold every vertex sticks to the liquid",
    );
    out.measure("stuck_above", loose, |x| x == 0.0, "above it none does");
    out.measure(
        "sinks",
        moved / still.abs().max(1e-12),
        |x| x > 5.0,
        "above the threshold it sinks, below it does not",
    );
    Ok(out)
}

/// A strand that falls through a Newtonian liquid.
pub const TERMINAL_VELOCITY: Case = Case {
    id: "coupled/terminal-velocity",
    about: "A short strand falls across a tank of Newtonian liquid: its speed against that of the drag law. The liquid near it \
            moves along, so it falls a little faster than in liquid at rest",
    params: &[
        Param::number("viscosity", 0.02, "Pa·s", "viscosity"),
        Param::number("density", 1300.0, "kg/m³", "density of the strand"),
    ],
    run: terminal_velocity,
};

fn terminal_velocity(p: &Params) -> Result<Outcome, CaseError> {
    let (viscosity, density) = (p.positive("viscosity")?, p.positive("density")?);
    let curve = FlowCurve::newtonian(viscosity);
    let (law, body, piece) = law(&curve)?;
    let weight = (density - LIQUID) * 9.81 * PI * RADIUS * RADIUS * piece;
    let expected = law.terminal_speed(weight, &body, 1.0);
    let flow = format!("yield_stress: 0, consistency: {viscosity:e}, index: 1");
    let run = whole(&lying(density, &flow, 0.0, 0.2, 2e-3), "terminal-velocity.ron")?;
    let speed = run.series.column("middle_vy")?;
    // the mean of the last quarter, before the floor is near
    let late = &speed[3 * speed.len() / 4..];
    let measured = -late.iter().sum::<f64>() / late.len() as f64;
    let mut out = Outcome::new();
    out.compare("speed", measured, expected, 0.25);
    out.info("submerged", largest(&run, "submerged_vertices")?);
    out.note("the reference is the drag law in liquid at rest; what the strand drags along is on the grid");
    Ok(out)
}
