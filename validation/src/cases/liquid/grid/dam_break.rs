use mpm::{HalfSpace, LiquidSettings, Vector};
use particle_grid::Lattice;

use super::setup::{self, GRAVITY, Run};
use crate::case::{Case, CaseError, Curve, Outcome, Param, Params};

pub const CASE: Case = Case {
    id: "liquid/dam-break",
    about: "A column of water collapses over a dry floor: front against the experiment of Martin and Moyce (1952) and the bound \
            of shallow water.",
    params: &[
        Param::number("width", 0.05715, "m", "width of the column; it is twice as high"),
        Param::count("cells", 16, "cells over the width"),
        Param::count("per_axis", 3, "particles per cell and direction"),
        Param::number("cfl", 0.7, "1", "cells that the fastest particle may cross in a step"),
    ],
    run,
};

/// Time T = t √(2g/a) and front Z = z/a, as usually quoted.
const EXPERIMENT: [[f64; 2]; 15] = [
    [0.41, 1.11],
    [0.84, 1.22],
    [1.19, 1.44],
    [1.43, 1.67],
    [1.63, 1.89],
    [1.83, 2.11],
    [1.98, 2.33],
    [2.20, 2.56],
    [2.32, 2.78],
    [2.51, 3.00],
    [2.65, 3.22],
    [2.83, 3.44],
    [2.97, 3.67],
    [3.11, 3.89],
    [3.33, 4.11],
];

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let a = p.positive("width")?;
    let cells = p.count_in("cells", 4, 128)?;
    let per_axis = p.count_in("per_axis", 1, 8)?;
    let dx = a / cells as f64;
    let lattice = Lattice::<2>::new(dx);
    let water = constitutive::Liquid::preset("water").map_err(CaseError::failed)?;
    let materials = vec![setup::material(&water)?];
    let high = Vector::<2>::new(a, 2.0 * a);
    let particles = setup::region(&lattice, per_axis, Vector::<2>::zeros(), high, |_| true, &materials);
    let wall = |normal: Vector<2>| HalfSpace { point: Vector::<2>::zeros(), normal, stick: 0.0 };
    let walls = [wall(Vector::<2>::new(0.0, 1.0)), wall(Vector::<2>::new(1.0, 0.0))];
    let body = Vector::<2>::new(0.0, -GRAVITY);
    let mut settings = LiquidSettings { particles_per_axis: per_axis, ..Default::default() };
    settings.step.cfl = p.number_in("cfl", 0.05, 2.0)?;
    let mut run = Run::new(lattice, particles, materials, &walls, body, settings);
    let scale = (2.0 * GRAVITY / a).sqrt();
    let volume = run.particles.totals(&run.materials, dx).volume;
    let mut front = vec![[0.0, 1.0]];
    let mut iterations = 0usize;
    while front[front.len() - 1][1] < 4.3 && run.time * scale < 6.0 {
        let step = run.allowed(2e-3);
        let report = run.step(step)?;
        iterations = iterations.max(report.pressure.map_or(0, |r| r.multigrid.solve.iterations));
        // The front is where the layer is half a cell thick: single drops ahead of it do not count.
        let mut columns = std::collections::BTreeMap::<i64, f64>::new();
        for i in 0..run.particles.len() {
            *columns.entry((run.particles.position[i][0] / dx).floor() as i64).or_default() += run.particles.volume(i);
        }
        let reach = columns.iter().filter(|(_, v)| **v > 0.25 * dx * dx).map(|(c, _)| *c).max().unwrap_or(0);
        let z =
            run.particles.position.iter().map(|x| x[0]).filter(|&x| x < (reach + 1) as f64 * dx).fold(0.0, f64::max);
        front.push([run.time * scale, z / a]);
    }
    // Time at which the front passes a place.
    let passes = |z: f64| {
        front
            .windows(2)
            .find(|w| w[0][1] <= z && w[1][1] > z)
            .map(|w| w[0][0] + (z - w[0][1]) / (w[1][1] - w[0][1]) * (w[1][0] - w[0][0]))
    };
    let measured_slope = match (passes(1.5), passes(3.5)) {
        (Some(s), Some(e)) => 2.0 / (e - s),
        _ => f64::NAN,
    };
    let at = |z: f64| {
        let k = EXPERIMENT.windows(2).position(|w| w[0][1] <= z && w[1][1] > z).unwrap_or(0);
        let (s, e) = (EXPERIMENT[k], EXPERIMENT[k + 1]);
        s[0] + (z - s[1]) / (e[1] - s[1]) * (e[0] - s[0])
    };
    let slope = 2.0 / (at(3.5) - at(1.5));
    // Best shift in time, then the spread in Z by the local slope.
    let pairs: Vec<(f64, f64)> =
        EXPERIMENT.iter().filter(|e| e[1] >= 1.4).filter_map(|e| passes(e[1]).map(|t| (t, e[0]))).collect();
    let shift = pairs.iter().map(|(t, e)| e - t).sum::<f64>() / pairs.len().max(1) as f64;
    let rms = (pairs.iter().map(|(t, e)| (e - t - shift) * (e - t - shift)).sum::<f64>() / pairs.len().max(1) as f64)
        .sqrt()
        * slope;
    let mut out = Outcome::new();
    out.compare("front_slope", measured_slope, slope, 0.05);
    out.measure("rms_after_shift", rms, |r| r < 0.1, "root mean square in Z below 0.1 after the best shift in T");
    out.info("shift", shift);
    let bound = 2.0 * (GRAVITY * 2.0 * a).sqrt();
    let fastest =
        front.windows(6).map(|w| (w[5][1] - w[0][1]) / (w[5][0] - w[0][0]).max(1e-12) * a * scale).fold(0.0, f64::max);
    out.measure(
        "front_over_ritter",
        fastest / bound,
        |r| r < 1.05,
        "never faster than the shallow-water front, 5 % allowed",
    );
    let totals = run.particles.totals(&run.materials, dx);
    out.compare("volume", totals.volume, volume, 1e-12);
    out.measure("pressure_iterations", iterations as f64, |i| i <= 15.0, "at most 15");
    out.info("steps", run.steps as f64);
    out.curve(Curve {
        title: "front of the collapsing column".into(),
        x_label: "t √(2g/a)".into(),
        y_label: "front / a".into(),
        log_x: false,
        log_y: false,
        series: vec![("particles".into(), front), ("Martin and Moyce 1952".into(), EXPERIMENT.to_vec())],
    });
    Ok(out)
}
