//! The room that strands take from the liquid.

use nalgebra::Vector3;
use particle_grid::{BlockGrid, Lattice, ParticleOrder};
use runner::world::submersion::volume::{add_rates, add_shares};

use super::{largest, whole};
use crate::case::{Case, CaseError, Outcome, Param, Params};

/// Shares of cells and their rate.
pub const VOLUME_FRACTION: Case = Case {
    id: "coupled/volume-fraction",
    about: "Shares of cells that moving strands take in a periodic box: they add up to the volume of the strands, their rates to \
            zero, and the rate is the derivative following the liquid (S51)",
    params: &[
        Param::count("points", 200, "points of the strands"),
        Param::number("step", 1e-5, "1", "step of the difference, in cells"),
    ],
    run: volume_fraction,
};

fn volume_fraction(p: &Params) -> Result<Outcome, CaseError> {
    let count = p.count_in("points", 1, 1_000_000)?;
    let step = p.number_in("step", 1e-8, 1e-2)?;
    let lattice = Lattice { dx: 0.01, origin: Vector3::zeros(), periods: [2; 3] };
    let side = 0.08;
    // points and velocities without a pattern
    let draw = |k: usize, a: usize| ((k * 3 + a) as f64 * 0.754_877_666).fract();
    let positions: Vec<Vector3<f64>> = (0..count).map(|k| Vector3::from_fn(|a, _| side * draw(k, a))).collect();
    let velocities: Vec<Vector3<f64>> = (0..count).map(|k| Vector3::from_fn(|a, _| draw(k + 7, a) - 0.5)).collect();
    let volumes: Vec<f64> = (0..count).map(|k| 1e-9 * (1.0 + draw(k, 1))).collect();
    let mut grid = BlockGrid::new(lattice);
    grid.rebuild(&ParticleOrder::new(), &positions);
    let cell = lattice.dx.powi(3);
    let shares = |positions: &[Vector3<f64>]| {
        let mut share = vec![0.0; grid.node_count()];
        add_shares(&grid, positions, &volumes, &mut share);
        share
    };
    let share = shares(&positions);
    let mut out = Outcome::new();
    out.compare("volume", share.iter().sum::<f64>() * cell, volumes.iter().sum(), 1e-12);
    let mut rate = vec![0.0; grid.node_count()];
    add_rates(&grid, &positions, &velocities, &volumes, |_| Vector3::zeros(), &mut rate);
    let size = rate.iter().map(|r| r.abs()).sum::<f64>();
    out.measure(
        "rate_sum",
        rate.iter().sum::<f64>().abs() / size,
        |x| x <= 1e-12,
        "liquid at rest: the rates add up to zero",
    );
    // following liquid that moves as one is moving the points the other way
    let stream = Vector3::new(0.3, -0.2, 0.1);
    rate.fill(0.0);
    add_rates(&grid, &positions, &velocities, &volumes, |_| stream, &mut rate);
    let h = step * lattice.dx;
    let moved = |sign: f64| -> Vec<Vector3<f64>> {
        let shift = |(x, v): (&Vector3<f64>, &Vector3<f64>)| {
            let mut y = x + (v - stream) * (sign * h);
            lattice.wrap(&mut y);
            y
        };
        positions.iter().zip(&velocities).map(shift).collect()
    };
    let (ahead, behind) = (shares(&moved(1.0)), shares(&moved(-1.0)));
    let largest_rate = rate.iter().fold(0.0f64, |m, r| m.max(r.abs()));
    let difference = (0..rate.len())
        // the liquid's share is what the strands leave
        .map(|c| (rate[c] + (ahead[c] - behind[c]) / (2.0 * h)).abs())
        .fold(0.0, f64::max);
    let why = "the rate is the difference of the shares following the liquid (second order in the step)";
    out.measure("rate_difference", difference / largest_rate, |x| x <= 1e-6, why);
    Ok(out)
}

/// Liquid at rest among frozen strands.
pub const POROUS_HYDROSTATIC: Case = Case {
    id: "coupled/porous-hydrostatic",
    about: "Water stands among frozen strands that take half the room: the pressure carries it as without them, nothing moves",
    params: &[
        Param::number("share", 0.5, "1", "share of the room that the strands take"),
        Param::number("step", 2e-3, "s", "time step"),
    ],
    run: porous_hydrostatic,
};

fn porous_hydrostatic(p: &Params) -> Result<Outcome, CaseError> {
    let (share, step) = (p.number_in("share", 0.0, 0.8)?, p.positive("step")?);
    let (cell, across) = (0.01f64, 4);
    let side = cell * f64::from(across);
    // one strand per cell of the cross-section, frozen from end to end
    let radius = cell * (share / std::f64::consts::PI).sqrt();
    let mut strands = String::new();
    for i in 0..across {
        for k in 0..across {
            let (x, z) = (cell * (f64::from(i) + 0.5) - 0.5 * side, cell * (f64::from(k) + 0.5) - 0.5 * side);
            strands += &format!(
                "(material: \"string\", radius: {radius:e}, shape: Straight(from: [{x:e}, -0.01, {z:e}], to: [{x:e}, 0.09, {z:e}], vertices: 21), clamp: [First(21)]),"
            );
        }
    }
    let half = 0.5 * side;
    let text = format!(
        "Scene(
            units: Si, time: (end: {:e}, step: Fixed({step:e})), gravity: [0, -9.81, 0],
            materials: {{ \"string\": Fibre(density: 1000, young_modulus: 1e7, poisson_ratio: 0.45), \"water\": Liquid(preset: \"water\") }},
            strands: [{strands}],
            solids: [(name: \"tank\", shape: Box(center: [0, 0.1, 0], half_size: [{half:e}, 0.1, {half:e}]), inverted: true)],
            liquid: (cell: {cell:e}, particles_per_cell: 8, tanks: [(material: \"water\", shape: Box(center: [0, 0.03, 0], half_size: [{half:e}, 0.03, {half:e}]))]),
            disable: [StrandContact, Capture],
            output: (frames: Never, checkpoint: Never),
        )",
        20.0 * step
    );
    let run = whole(&text, "porous-hydrostatic.ron")?;
    let mut out = Outcome::new();
    let scale = (9.81 * cell).sqrt();
    let why = "no current faster than 1e-3 of the speed of free fall through a cell";
    out.measure("speed", largest(&run, "liquid_max_speed")? / scale, |x| x <= 1e-3, why);
    out.info("solid_fraction", largest(&run, "solid_fraction_max")?);
    // the pressure at the centres of the lowest cells, under a column as high as the water
    let pressure = run.series.column("liquid_max_pressure")?;
    out.compare("pressure", pressure[pressure.len() - 1], 1000.0 * 9.81 * (0.06 - 0.5 * cell), 0.05);
    Ok(out)
}

/// Compressible liquids of rising stiffness.
pub const INCOMPRESSIBLE_LIMIT: Case = Case {
    id: "coupled/incompressible-limit",
    about: "Strands are pushed into liquids of rising bulk modulus: the change of volume falls as one over the modulus",
    params: &[
        Param::number("softest", 1e4, "Pa", "smallest bulk modulus"),
        Param::count("decades", 3, "decades of bulk modulus"),
    ],
    run: incompressible_limit,
};

fn incompressible_limit(p: &Params) -> Result<Outcome, CaseError> {
    let (softest, decades) = (p.positive("softest")?, p.count_in("decades", 1, 6)?);
    let mut out = Outcome::new();
    let mut before: Option<f64> = None;
    for k in 0..=decades {
        let modulus = softest * 10f64.powi(k as i32);
        let text = format!(
            "Scene(
                units: Si, time: (end: 0.04, step: Fixed(2e-3)), gravity: [0, -9.81, 0],
                materials: {{
                    \"string\": Fibre(density: 1000, young_modulus: 1e8, poisson_ratio: 0.45, viscosity: 1e4),
                    \"liquid\": Liquid(density: 1000, bulk_modulus: {modulus:e}, shear_modulus: 0, flow: Rheometer(yield_stress: 0, consistency: 0.1, index: 1)),
                }},
                strands: [(material: \"string\", radius: 1e-3, shape: Straight(from: [0, 0.1, 0], to: [0, 0.045, 0], vertices: 12),
                           clamp: [First(2)], motion: [Translate(by: [0, -0.02, 0], during: (0, 0.04), ease: Smooth)])],
                solids: [(name: \"tank\", shape: Box(center: [0, 0.1, 0], half_size: [0.02, 0.1, 0.02]), inverted: true)],
                liquid: (cell: 1e-2, particles_per_cell: 8, tanks: [(material: \"liquid\", shape: Box(center: [0, 0.02, 0], half_size: [0.02, 0.02, 0.02]))]),
                disable: [StrandContact, Capture],
                output: (frames: Never, checkpoint: Never),
            )"
        );
        let run = whole(&text, "incompressible-limit.ron")?;
        let change = run.series.column("liquid_min_volume_ratio")?.iter().fold(0.0f64, |m, j| m.max((1.0 - j).abs()));
        out.info(&format!("volume_change_{k}"), change);
        if let Some(before) = before {
            let name = format!("falls_{k}");
            out.measure(
                &name,
                before / change,
                |x| x > 5.0 && x < 20.0,
                "ten times stiffer: a tenth of the change, within two",
            );
        }
        before = Some(change);
    }
    Ok(out)
}
