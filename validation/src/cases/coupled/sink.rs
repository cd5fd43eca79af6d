//! A strand that sinks, or hangs, in a tank of liquid.

use std::f64::consts::PI;

use constitutive::drag::{DragGeometry, DragLaw, DragSettings, voidage_exponent};
use constitutive::{FlowCurve, Liquid};

use super::whole;
use crate::case::{Case, CaseError, Outcome, Param, Params};
use crate::hard::SceneRun;

/// A strand in a liquid with a yield stress.
pub const YIELD_STICK: Case = Case {
    id: "coupled/yield-stick",
    about: "A heavy strand in a liquid with a yield stress: below the threshold of its drag law it hangs still, above it it sinks",
    params: &[
        Param::text("liquid", "drilling-mud", "preset of the liquid, with a yield stress"),
        Param::number("below", 0.7, "1", "weight in liquid over the yield force of the strand that hangs"),
        Param::number("above", 1.5, "1", "the same of the strand that sinks"),
        Param::number(
            "radius",
            2.5e-4,
            "m",
            "radius of the strand, thin against a cell: the grid spreads its weight over some cells, which must bear it",
        ),
        Param::number("step", 2e-3, "s", "time step"),
        Param::number("time", 0.4, "s", "how long it is watched"),
        Param::count("iterations", 20, "solves of strand and liquid in a step, at most"),
    ],
    run: yield_stick,
};

/// A strand in a Newtonian liquid.
pub const TERMINAL_VELOCITY: Case = Case {
    id: "coupled/terminal-velocity",
    about: "A straight strand falls across its axis through a Newtonian tank: its speed against the liquid around it is that at which \
            the drag law bears its weight in liquid",
    params: &[
        Param::number("viscosity", 0.05, "Pa s", "viscosity of the liquid"),
        Param::number("excess", 500.0, "kg/m3", "density of the strand above that of the liquid"),
        Param::number("radius", 5e-4, "m", "radius of the strand"),
        Param::number("step", 2e-3, "s", "time step"),
        Param::number("time", 0.3, "s", "time of the fall"),
        Param::number("cell", 5e-3, "m", "cell of the liquid"),
        Param::count("iterations", 1, "solves of strand and liquid in a step, at most"),
    ],
    run: terminal_velocity,
};

const LENGTH: f64 = 0.02;
const VERTICES: usize = 9;
const GRAVITY: f64 = 9.81;

/// A tank of 3 cm × 3 cm × 4 cm with a free strand in the middle.
struct Tank<'a> {
    liquid: &'a str,
    radius: f64,
    density: f64,
    step: f64,
    time: f64,
    cell: f64,
    iterations: usize,
}

impl Tank<'_> {
    fn run(&self) -> Result<SceneRun, CaseError> {
        let Tank { liquid, radius, density, step, time, cell, iterations } = self;
        let half = 0.5 * LENGTH;
        let text = format!(
            "Scene(
                units: Si, time: (end: {time:e}, step: Fixed({step:e})), gravity: [0, {:e}, 0],
                materials: {{ \"strand\": Fibre(density: {density:e}, young_modulus: 1e9, poisson_ratio: 0.4, viscosity: 1e5), \"liquid\": {liquid} }},
                strands: [(material: \"strand\", radius: {radius:e}, shape: Straight(from: [{:e}, 0.025, 0], to: [{half:e}, 0.025, 0], vertices: {VERTICES}))],
                solids: [(name: \"pot\", shape: Box(center: [0, 0.05, 0], half_size: [0.015, 0.05, 0.015]), inverted: true)],
                liquid: (cell: {cell:e}, particles_per_cell: 8, tanks: [(material: \"liquid\", shape: Box(center: [0, 0.02, 0], half_size: [0.015, 0.02, 0.015]))]),
                solver: (coupling: (iterations: {iterations})),
                disable: [StrandContact, Capture, VolumeFraction],
                output: (frames: Never, checkpoint: Never, probes: [Vertex(name: \"middle\", strand: 0, vertex: 4)]),
            )",
            -GRAVITY, -half,
        );
        whole(&text, "sink.ron")
    }

    /// Weight in liquid of the given density [N].
    fn weight(&self, liquid: f64) -> f64 {
        PI * self.radius * self.radius * LENGTH * (self.density - liquid) * GRAVITY
    }
}

/// The pieces of the strand as the drag law sees them when it moves across its axis.
fn pieces(radius: f64) -> impl Iterator<Item = DragGeometry> {
    let edge = LENGTH / (VERTICES - 1) as f64;
    (0..VERTICES).map(move |i| {
        let length = if i == 0 || i == VERTICES - 1 { 0.5 * edge } else { edge };
        DragGeometry::capsule(radius, length, 1.0)
    })
}

/// Drag of the strand that moves across its axis, without crowding [N].
fn drag(law: &DragLaw, radius: f64, speed: f64) -> f64 {
    pieces(radius)
        .map(|body| law.force(speed, &body, 1.0, voidage_exponent(law.reynolds(speed, body.diameter, 1.0))).total())
        .sum()
}

/// Mean fall speed over the last quarter of the run [m/s].
fn fall_speed(run: &SceneRun) -> Result<f64, CaseError> {
    let (time, y) = (run.series.column("time")?, run.series.column("middle_y")?);
    let (last, from) = (time.len() - 1, 3 * time.len() / 4);
    Ok((y[from] - y[last]) / (time[last] - time[from]))
}

/// Mean of a column over the last quarter.
fn late(run: &SceneRun, name: &str) -> Result<f64, CaseError> {
    let column = run.series.column(name)?;
    let tail = &column[3 * column.len() / 4..];
    Ok(tail.iter().sum::<f64>() / tail.len() as f64)
}

fn yield_stick(p: &Params) -> Result<Outcome, CaseError> {
    let name = p.text("liquid")?;
    let liquid = Liquid::preset(name).map_err(CaseError::failed)?;
    let law = DragLaw::new(liquid.density, &liquid.flow, DragSettings::default()).map_err(CaseError::failed)?;
    let radius = p.positive("radius")?;
    let threshold: f64 = pieces(radius).map(|body| law.yield_force(&body, 1.0, 3.7)).sum();
    if threshold <= 0.0 {
        return Err(p.reject("liquid", "a liquid with a yield stress"));
    }
    let tank = |share: f64| {
        Tank {
            liquid: &format!("Liquid(preset: \"{name}\")"),
            radius,
            density: liquid.density + share * threshold / (GRAVITY * PI * radius * radius * LENGTH),
            step: p.number("step").unwrap_or(2e-3),
            time: p.number("time").unwrap_or(0.4),
            cell: 5e-3,
            iterations: p.count("iterations").unwrap_or(1),
        }
        .run()
    };
    let (below, above) = (p.number_in("below", 0.0, 0.99)?, p.number_in("above", 1.01, 10.0)?);
    let (hangs, sinks) = (tank(below)?, tank(above)?);
    // speed that the law gives to the strand that sinks
    let (mut low, mut high) = (0.0, 1e3);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if drag(&law, radius, middle) > above * threshold { high = middle } else { low = middle }
    }
    let mut out = Outcome::new();
    let (still, moving) = (fall_speed(&hangs)?, fall_speed(&sinks)?);
    out.info("yield_force", threshold);
    out.info("sinking_speed_of_the_law", low);
    out.info("speed_above", moving);
    let slip = late(&hangs, "slip_max")? / low;
    out.measure("slip_below", slip, |x| x <= 1e-6, "below the threshold the strand does not pass the liquid");
    out.measure(
        "speed_below",
        still.abs() / low,
        |x| x <= 1e-2,
        "and hangs still, over the speed of the one that sinks",
    );
    out.measure("stuck_below", late(&hangs, "submerged_stuck")?, |x| x == VERTICES as f64, "all of it sticks");
    out.compare("slip_above", late(&sinks, "slip_mean")?, low, 0.1);
    out.measure("speed_above_share", moving / low, |x| x > 0.5, "above the threshold it sinks");
    Ok(out)
}

fn terminal_velocity(p: &Params) -> Result<Outcome, CaseError> {
    let (viscosity, excess, radius) = (p.positive("viscosity")?, p.positive("excess")?, p.positive("radius")?);
    let density = 1000.0;
    let flow = FlowCurve::Rheometer { yield_stress: 0.0, consistency: viscosity, index: 1.0 };
    let law = DragLaw::new(density, &flow, DragSettings::default()).map_err(CaseError::failed)?;
    let liquid = format!(
        "Liquid(density: {density:e}, bulk_modulus: 1e9, shear_modulus: 0, \
         flow: Rheometer((yield_stress: 0, consistency: {viscosity:e}, index: 1)))"
    );
    let tank = Tank {
        liquid: &liquid,
        radius,
        density: density + excess,
        step: p.positive("step")?,
        time: p.positive("time")?,
        cell: p.positive("cell")?,
        iterations: p.count_in("iterations", 1, 1000)?,
    };
    let run = tank.run()?;
    let weight = tank.weight(density);
    let (mut low, mut high) = (0.0, 1e3);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if drag(&law, radius, middle) > weight { high = middle } else { low = middle }
    }
    let mut out = Outcome::new();
    out.compare("slip", late(&run, "slip_mean")?, low, 0.02);
    let falls = fall_speed(&run)?;
    // the liquid around goes down with the strand: what a finer grid resolves is no longer slip
    out.info("fall_speed", falls);
    out.info("fall_over_slip", falls / low);
    out.info("reynolds", density * low * 2.0 * radius / viscosity);
    Ok(out)
}
