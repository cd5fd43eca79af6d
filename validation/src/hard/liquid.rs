//! Hard scenes of bulk liquid.

use runner::run::Ending;

use super::{OVERRIDE, SceneRun};
use crate::case::{Case, CaseError, Outcome, Params};

macro_rules! scene {
    ($name:literal) => {
        (include_str!(concat!("../../../scenes/hard/", $name, ".ron")), concat!($name, ".ron"))
    };
}

/// The cases.
pub fn cases() -> Vec<Case> {
    let case = |id, about, run| Case { id, about, params: OVERRIDE, run };
    vec![
        case("hard/liquid-thin-index", "n = 0.1 and a tiny consistency: powers of 10¹⁰", thin_index),
        case("hard/liquid-near-bingham", "the flow index passes through one without a jump", near_bingham),
        case("hard/liquid-thickening", "n = 2: flow stops in finite time", thickening),
        case("hard/liquid-no-resistance", "shear modulus without yield stress and consistency", no_resistance),
        case("hard/liquid-no-load", "nothing acts and nothing moves", no_load),
        case("hard/liquid-stiff-elastic", "elastic waves that cross a cell and more in a step", stiff_elastic),
        case("hard/liquid-large-strain", "the tangent is indefinite", large_strain),
        case("hard/liquid-torn-thread", "a thread is drawn out and tears", torn_thread),
        case("hard/liquid-drawn-stream", "a stream that thins below the size of a cell", drawn_stream),
        case("hard/liquid-long-step", "steps that invert particles are halved", long_step),
        case("hard/liquid-modulus-contrast", "bulk moduli of 10⁴ and 10¹³ Pa side by side", modulus_contrast),
        case("hard/liquid-no-air", "a closed box full of water", no_air),
        case("hard/liquid-one-particle", "a single particle falls as a stone", one_particle),
        case("hard/liquid-droplet-on-faces", "a free surface that lies on cell faces", droplet_on_faces),
        case("hard/liquid-tiny-faces", "faces that hold next to nothing", tiny_faces),
        case("hard/liquid-coincident", "particles in the same place", coincident),
        case("hard/liquid-head-on", "merging with opposing velocities", head_on),
        case("hard/liquid-fast-particle", "forty cells in a step", fast_particle),
    ]
}

fn run_of((text, name): (&str, &str), params: &Params) -> Result<SceneRun, CaseError> {
    SceneRun::hard(text, name, params)
}

/// What holds for every scene: it ends, all numbers are finite, the mass is exact.
fn judged(run: &SceneRun) -> Result<Outcome, CaseError> {
    let mut out = Outcome::new();
    out.measure("completed", run.completed(), |x| x == 1.0, "the run comes to its end");
    common(&mut out, run)?;
    Ok(out)
}

fn common(out: &mut Outcome, run: &SceneRun) -> Result<(), CaseError> {
    let finite = f64::from(u8::from(run.series.all_finite()));
    out.measure("finite", finite, |x| x == 1.0, "every recorded number is finite");
    let mass = largest(run.series.column("liquid_mass_defect")?);
    out.measure("mass_defect", mass, |x| x <= 1e-12, "no mass is lost or gained");
    out.info("steps", run.figure("steps"));
    out.info("rejected_steps", run.figure("rejected_steps"));
    Ok(())
}

fn largest(column: &[f64]) -> f64 {
    column.iter().fold(0.0, |most, x| f64::max(most, x.abs()))
}

fn last(run: &SceneRun, column: &str) -> Result<f64, CaseError> {
    run.series.column(column)?.last().copied().ok_or_else(|| CaseError::Failed("the series is empty".to_owned()))
}

/// Largest growth of the energy above any earlier value, relative to the largest there was.
fn growth(run: &SceneRun) -> Result<f64, CaseError> {
    let column = run.series.column("liquid_total_energy")?;
    let scale = largest(column);
    let (mut least, mut worst) = (f64::INFINITY, 0.0_f64);
    for energy in column {
        least = least.min(*energy);
        worst = worst.max(energy - least);
    }
    Ok(if scale > 0.0 { worst / scale } else { 0.0 })
}

fn thin_index(params: &Params) -> Result<Outcome, CaseError> {
    let run = run_of(scene!("liquid-thin-index"), params)?;
    let mut out = judged(&run)?;
    // uniaxial yield stress 10 Pa: norm sqrt(2/3) of it; the flow adds next to nothing
    let worst = largest(run.series.column("liquid_max_stress")?) / (10.0 * (2.0_f64 / 3.0).sqrt());
    out.measure("stress_over_yield", worst, |x| x <= 1.001, "the stress after flow stays at the yield stress");
    Ok(out)
}

fn near_bingham(params: &Params) -> Result<Outcome, CaseError> {
    let (text, name) = scene!("liquid-near-bingham");
    let run = SceneRun::hard(text, name, params)?;
    let mut out = judged(&run)?;
    let front = last(&run, "liquid_high_x")?;
    for (label, index) in [("below", "0.999999"), ("above", "1.000001")] {
        let set = format!("materials.liquid.flow.index={index}");
        let other = SceneRun::of(text, name, &[set])?;
        let difference = (last(&other, "liquid_high_x")? / front - 1.0).abs();
        let why = "the front ends in the same place";
        out.measure(&format!("front_{label}"), difference, |x| x <= 1e-4 && other.completed() == 1.0, why);
    }
    Ok(out)
}

fn thickening(params: &Params) -> Result<Outcome, CaseError> {
    let run = run_of(scene!("liquid-thickening"), params)?;
    let mut out = judged(&run)?;
    let energy = run.series.column("liquid_kinetic_energy")?;
    let rest = last(&run, "liquid_kinetic_energy")? / largest(energy).max(f64::MIN_POSITIVE);
    out.measure("kinetic_energy_left", rest, |x| x <= 0.05, "kinetic energy dies out");
    Ok(out)
}

fn no_resistance(params: &Params) -> Result<Outcome, CaseError> {
    let run = run_of(scene!("liquid-no-resistance"), params)?;
    let mut out = judged(&run)?;
    let stress = largest(run.series.column("liquid_max_stress")?);
    out.measure("stress", stress, |x| x <= 1e-9, "there is no shear stress");
    Ok(out)
}

fn no_load(params: &Params) -> Result<Outcome, CaseError> {
    let run = run_of(scene!("liquid-no-load"), params)?;
    let mut out = judged(&run)?;
    out.measure("speed", largest(run.series.column("liquid_max_speed")?), |x| x <= 1e-12, "nothing moves");
    out.measure("stress", largest(run.series.column("liquid_max_stress")?), |x| x <= 1e-9, "there is no stress");
    Ok(out)
}

fn stiff_elastic(params: &Params) -> Result<Outcome, CaseError> {
    let (text, name) = scene!("liquid-stiff-elastic");
    let run = SceneRun::hard(text, name, params)?;
    let mut out = judged(&run)?;
    out.measure("energy_growth", growth(&run)?, |x| x <= 0.01, "the energy does not grow");
    for (label, modulus) in [("at_1e4_pa", "1e4"), ("at_1e7_pa", "1e7")] {
        let set = format!("materials.liquid.shear_modulus={modulus}");
        let other = SceneRun::of(text, name, &[set])?;
        let why = "neither when blocks are softer or stiffer";
        out.measure(&format!("energy_growth_{label}"), growth(&other)?, |x| x <= 0.01 && other.completed() == 1.0, why);
    }
    Ok(out)
}

fn large_strain(params: &Params) -> Result<Outcome, CaseError> {
    let run = run_of(scene!("liquid-large-strain"), params)?;
    let mut out = judged(&run)?;
    let residual = largest(run.series.column("shear_residual")?);
    out.measure("shear_residual", residual, |x| x <= 1e-6, "every shear solve reaches its tolerance");
    Ok(out)
}

/// A piece of a falling stream between two heights.
struct Section {
    /// Depth of its middle below the nozzle [m].
    depth: f64,
    /// Cross-section of the liquid in it [m²].
    area: f64,
    /// Mean square distance from the axis [m²].
    square: f64,
}

/// The stream in pieces of four cells, without what the tip of a young stream still changes.
fn sections(positions: &[[f64; 3]]) -> Vec<Section> {
    let (length, volume) = (0.02, (5e-3_f64 / 4.0).powi(3));
    (0..6)
        .map(|k| {
            let depth = (f64::from(k) + 0.5) * length;
            let inside = positions.iter().filter(|x| (-x[1] - depth).abs() <= 0.5 * length);
            let (count, sum) = inside.fold((0.0, 0.0), |(n, sum), x| (n + 1.0, sum + x[0] * x[0] + x[2] * x[2]));
            Section { depth, area: count * volume / length, square: sum / count }
        })
        .collect()
}

fn drawn_stream(params: &Params) -> Result<Outcome, CaseError> {
    let (text, name) = scene!("liquid-drawn-stream");
    let run = SceneRun::hard(text, name, params)?;
    let mut out = judged(&run)?;
    let none = || CaseError::Failed("no frames".to_owned());
    let frames = run.frames("particles")?;
    let cream = sections(&frames.last().ok_or_else(none)?.1);
    // a round stream full of liquid has 2π⟨r²⟩ = A
    let swollen =
        cream.iter().map(|s| (2.0 * std::f64::consts::PI * s.square / s.area - 1.0).abs()).fold(0.0, f64::max);
    out.measure("thickness_error", swollen, |x| x <= 0.12, "the stream is as thick as the liquid in it");
    let set = r#"materials.liquid=Liquid(preset:"water")"#.to_owned();
    let water = SceneRun::of(text, name, &[set])?;
    out.measure("water_completed", water.completed(), |x| x == 1.0, "water comes to its end, too");
    let frames = water.frames("particles")?;
    let water = sections(&frames.last().ok_or_else(none)?.1);
    let mouth = 52.0 * (5e-3_f64 / 4.0).powi(2);
    let narrowing = |s: &Section| s.area / mouth * (0.64 + 2.0 * 9.81 * s.depth).sqrt() / 0.8;
    let mean = water.iter().map(narrowing).sum::<f64>() / water.len() as f64;
    out.measure("torricelli", (mean - 1.0).abs(), |x| x <= 0.03, "water narrows as its speed grows");
    out.info("front_of_cream", last(&run, "liquid_low_y")?);
    Ok(out)
}

fn torn_thread(params: &Params) -> Result<Outcome, CaseError> {
    let run = run_of(scene!("liquid-torn-thread"), params)?;
    let mut out = judged(&run)?;
    out.measure("torn", largest(run.series.column("liquid_torn")?), |x| x >= 1.0, "some of it tears");
    Ok(out)
}

fn long_step(params: &Params) -> Result<Outcome, CaseError> {
    let run = run_of(scene!("liquid-long-step"), params)?;
    let mut out = Outcome::new();
    common(&mut out, &run)?;
    let fair = match &run.ending {
        Ending::Completed => true,
        Ending::Failed(failure) => {
            !failure.rejection.detail.is_empty() && run.summary["failure"]["saved_state"].is_string()
        }
        Ending::Stopped(_) => false,
    };
    let why = "the run ends, or stops with a reason and a saved state";
    out.measure("ends_fairly", f64::from(u8::from(fair)), |x| x == 1.0, why);
    out.info("completed", run.completed());
    Ok(out)
}

fn modulus_contrast(params: &Params) -> Result<Outcome, CaseError> {
    let run = run_of(scene!("liquid-modulus-contrast"), params)?;
    let mut out = judged(&run)?;
    let most = largest(run.series.column("pressure_iterations")?);
    out.measure("pressure_iterations", most, |x| x <= 60.0, "the multigrid does not depend on the contrast");
    Ok(out)
}

fn no_air(params: &Params) -> Result<Outcome, CaseError> {
    let run = run_of(scene!("liquid-no-air"), params)?;
    let mut out = judged(&run)?;
    out.measure("speed", largest(run.series.column("liquid_max_speed")?), |x| x <= 1e-6, "the water stays at rest");
    Ok(out)
}

fn one_particle(params: &Params) -> Result<Outcome, CaseError> {
    let run = run_of(scene!("liquid-one-particle"), params)?;
    let mut out = judged(&run)?;
    out.measure("particles", last(&run, "liquid_particles")?, |x| x == 1.0, "there is one particle");
    let (time, x) = (run.series.column("time")?, run.series.column("liquid_center_x")?);
    let y = run.series.column("liquid_center_y")?;
    // symplectic Euler: after n steps the fall is g dt² n (n + 1) / 2
    let (g, dt) = (9.81, 1e-3);
    let off = |k: usize| {
        let fall = 0.5 * g * time[k] * (time[k] + dt);
        (x[k] - x[0] - time[k]).abs().max((y[0] - y[k] - fall).abs())
    };
    let worst = (0..time.len()).map(off).fold(0.0, f64::max);
    out.measure("place_error", worst, |x| x <= 1e-9, "it falls as a stone");
    Ok(out)
}

fn droplet_on_faces(params: &Params) -> Result<Outcome, CaseError> {
    let run = run_of(scene!("liquid-droplet-on-faces"), params)?;
    let mut out = judged(&run)?;
    let (time, y) = (run.series.column("time")?, run.series.column("liquid_center_y")?);
    let (g, dt, cell) = (9.81, 1e-3, 5e-3);
    let off = |k: usize| (y[0] - y[k] - 0.5 * g * time[k] * (time[k] + dt)).abs() / cell;
    let worst = (0..time.len()).map(off).fold(0.0, f64::max);
    out.measure("place_error", worst, |x| x <= 1e-3, "its centre follows the parabola (in cells)");
    out.measure("momentum_defect", run.figure("liquid_momentum_defect"), |x| x <= 1e-3, "its momentum is kept");
    Ok(out)
}

fn tiny_faces(params: &Params) -> Result<Outcome, CaseError> {
    let run = run_of(scene!("liquid-tiny-faces"), params)?;
    let mut out = judged(&run)?;
    let mut worst = 0.0_f64;
    let frames = run.frames("particles")?;
    if let (Some((_, start)), Some((_, end))) = (frames.first(), frames.last()) {
        out.measure("particles", start.len() as f64, |x| x >= 4.0, "there are some particles");
        let mut sorted = [start.clone(), end.clone()];
        // Particles of a layer stay in it; their heights differ by rounding, which must not change their order.
        let layer = |y: f64, lowest: f64| ((y - lowest) / 1e-5).round() as i64;
        for list in &mut sorted {
            let lowest = list.iter().fold(f64::INFINITY, |low, x| low.min(x[1]));
            list.sort_by_key(|x| (layer(x[1], lowest), layer(x[0], 0.0), layer(x[2], 0.0)));
        }
        let fall = sorted[0][0][1] - sorted[1][0][1];
        for (a, b) in sorted[0].iter().zip(&sorted[1]) {
            worst = worst.max((a[0] - b[0]).abs()).max((a[1] - b[1] - fall).abs()).max((a[2] - b[2]).abs());
        }
    }
    out.measure("relative_motion", worst, |x| x <= 1e-9, "all fall together");
    Ok(out)
}

fn coincident(params: &Params) -> Result<Outcome, CaseError> {
    let run = run_of(scene!("liquid-coincident"), params)?;
    let mut out = judged(&run)?;
    let frames = run.frames("particles")?;
    let (_, positions) = frames.last().ok_or_else(|| CaseError::Failed("no frames".to_owned()))?;
    let mut keys: Vec<[u64; 2]> = positions.iter().map(|x| [x[0].to_bits(), x[1].to_bits()]).collect();
    keys.sort_unstable();
    keys.dedup();
    let share = keys.len() as f64 / positions.len().max(1) as f64;
    out.measure("distinct", share, |x| x > 0.99, "particles have places of their own");
    Ok(out)
}

fn head_on(params: &Params) -> Result<Outcome, CaseError> {
    let run = run_of(scene!("liquid-head-on"), params)?;
    let mut out = judged(&run)?;
    out.measure("momentum_defect", run.figure("liquid_momentum_defect"), |x| x <= 1e-3, "momentum stays");
    out.measure("energy_growth", growth(&run)?, |x| x <= 0.01, "the energy does not grow");
    Ok(out)
}

fn fast_particle(params: &Params) -> Result<Outcome, CaseError> {
    let run = run_of(scene!("liquid-fast-particle"), params)?;
    let mut out = judged(&run)?;
    let way = [100.0, 20.0, -30.0].map(|v: f64| v * 0.1);
    let mut worst = 0.0_f64;
    for (axis, way) in ["x", "y", "z"].into_iter().zip(way) {
        let column = run.series.column(&format!("liquid_center_{axis}"))?;
        worst = worst.max((column[column.len() - 1] - column[0] - way).abs());
    }
    out.measure("place_error", worst / 10.0, |x| x <= 1e-6, "it arrives where its speed takes it");
    Ok(out)
}
