//! Short runs of liquids with parameters drawn from far beyond what anyone pours: each ends, or stops with a reason; no number
//! that is not finite is ever written, and the mass is exact.
//!
//! `VISCOSE_FUZZ=500 cargo test -p runner --test liquid_fuzz -- --ignored --nocapture` runs a long sweep; `VISCOSE_FUZZ_SEED` starts
//! it elsewhere.

use runner::prepare;
use runner::run::{Ending, RunOptions, Silent, execute};
use runner::scene::load_str;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::AtomicBool;

/// A small generator with a good spread (SplitMix64).
struct Draw(u64);

impl Draw {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
    /// Evenly in the logarithm.
    fn decades(&mut self, low: f64, high: f64) -> f64 {
        10f64.powf(self.between(low, high))
    }
    /// Zero one time in five.
    fn or_zero(&mut self, low: f64, high: f64) -> f64 {
        if self.unit() < 0.2 { 0.0 } else { self.decades(low, high) }
    }
    fn one_of<'a>(&mut self, list: &[&'a str]) -> &'a str {
        list[(self.next() % list.len() as u64) as usize]
    }
}

/// A liquid without limits: bulk modulus 10⁴ to 10¹⁰ Pa, everything else from nothing to huge.
fn material(draw: &mut Draw) -> String {
    format!(
        "Liquid(density: {:e}, bulk_modulus: {:e}, shear_modulus: {:e}, flow: J2(yield_stress: {:e}, consistency: {:e}, index: {:e}), \
         tearing_strain: {:e}, recovery_time: {:e}, shear_damping: {:e})",
        draw.decades(1.0, 4.0),
        draw.decades(4.0, 10.0),
        draw.or_zero(-3.0, 9.0),
        draw.or_zero(-6.0, 8.0),
        draw.or_zero(-9.0, 8.0),
        draw.between(0.05, 3.0),
        draw.decades(-2.0, 3.0),
        draw.decades(-4.0, 2.0),
        if draw.unit() < 0.5 { 0.0 } else { 1e-3 },
    )
}

fn scene(draw: &mut Draw) -> String {
    let plane = draw.unit() < 0.7;
    let (dimensions, per_cell) =
        if plane { ("Two", draw.one_of(&["1", "4", "9", "16"])) } else { ("Three", draw.one_of(&["1", "8", "27"])) };
    let cell = draw.decades(-3.0, -1.0);
    let size = cell * draw.between(0.6, if plane { 6.0 } else { 2.5 });
    let speed = if draw.unit() < 0.3 { 0.0 } else { draw.decades(-2.0, 1.5) };
    let dt = draw.decades(-4.5, -1.7);
    let step = if draw.unit() < 0.5 {
        format!("Fixed({dt:e})")
    } else {
        format!("Adaptive(max: {dt:e}, min: {:e})", dt / 20.0)
    };
    let shape = draw
        .one_of(&["Sphere(center: [0, 0, 0], radius: SIZE)", "Box(center: [0, 0, 0], half_size: [SIZE, SIZE, SIZE])"]);
    let floor = match draw.next() % 4 {
        0 => String::new(),
        1 => format!(
            "(shape: HalfSpace(point: [0, {:e}, 0], normal: Y), liquid_friction: {:e})",
            -size * 1.1,
            draw.unit()
        ),
        2 => format!("(shape: Box(center: [0, 0, 0], half_size: [{0:e}, {0:e}, {0:e}]), inverted: true)", size * 1.01),
        _ => format!(
            "(shape: Sphere(center: [0, {:e}, 0], radius: {size:e}), motion: [Glide(velocity: [0, {:e}, 0])])",
            -2.2 * size,
            draw.between(0.0, 3.0)
        ),
    };
    let disable = draw.one_of(&[
        "",
        "",
        "",
        "",
        "Pressure",
        "Shear",
        "PlasticFlow",
        "Compressibility",
        "Resampling",
        "Advection",
    ]);
    format!(
        "Scene(units: Si, seed: 1, time: (end: {:e}, step: {step}), gravity: [0, {:e}, 0],
            materials: {{ \"a\": {}, \"b\": {} }},
            liquid: (cell: {cell:e}, particles_per_cell: {per_cell}, dimensions: {dimensions}, flow_map: {}, shear: (tangent: {}, operator: {}),
                tanks: [(material: \"a\", shape: {}, velocity: [{:e}, {:e}, 0], spin: [0, 0, {:e}])],
                sources: [(material: \"b\", shape: Sphere(center: [0, {:e}, 0], radius: {cell:e}), velocity: [0, {:e}, 0])]),
            solids: [{floor}], disable: [{disable}], output: (frames: Never, checkpoint: Never))",
        8.0 * dt,
        -draw.or_zero(-1.0, 2.0),
        material(draw),
        material(draw),
        draw.one_of(&["Implicit", "Split", "Forced"]),
        draw.one_of(&["Symmetric", "Safe", "Newton"]),
        draw.one_of(&["Automatic", "Automatic", "Cells", "Particles"]),
        shape.replace("SIZE", &format!("{size:e}")),
        draw.between(-speed, speed),
        -speed,
        draw.between(-20.0, 20.0),
        1.5 * size,
        -draw.decades(-1.0, 1.0),
    )
}

/// How one run ended, or what was wrong with it.
fn verdict(text: &str) -> Result<String, String> {
    let loaded = load_str(text, "drawn.ron", &[]).map_err(|error| format!("not read: {}", error.lines().join("; ")))?;
    let job = match prepare::job(loaded, 1) {
        Ok(job) => job,
        Err(error) => return Ok(format!("refused: {error}")),
    };
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    let options = RunOptions { out: folder.path().join("run"), wall_limit: Some(20.0), ..RunOptions::default() };
    let outcome = execute(job, &options, &mut Silent, &AtomicBool::new(false)).map_err(|error| error.to_string())?;
    let series = std::fs::read_to_string(outcome.folder.join("series.csv")).map_err(|error| error.to_string())?;
    let header: Vec<&str> = series.lines().next().unwrap_or_default().split(',').collect();
    for line in series.lines().skip(1) {
        for (name, value) in header.iter().zip(line.split(',')).filter(|(name, _)| **name != "limiter") {
            let value: f64 = value.parse().map_err(|_| format!("{name} is {value}"))?;
            if !value.is_finite() {
                return Err(format!("{name} is {value}"));
            }
            if *name == "liquid_mass_defect" && value.abs() > 1e-12 {
                return Err(format!("mass defect {value:e}"));
            }
        }
    }
    match &outcome.ending {
        Ending::Completed => Ok("ended".to_owned()),
        Ending::Stopped(why) => Ok(format!("stopped: {why}")),
        Ending::Failed(failure) if failure.rejection.detail.is_empty() => Err("it failed without a reason".to_owned()),
        Ending::Failed(failure) => Ok(format!("gave up in {}: {}", failure.rejection.stage, failure.rejection.reason)),
    }
}

fn sweep(runs: u64, seed: u64) {
    let mut endings: BTreeMap<String, usize> = BTreeMap::new();
    let mut faults = Vec::new();
    for k in 0..runs {
        let text = scene(&mut Draw(seed.wrapping_add(k).wrapping_mul(0x2545_f491_4f6c_dd1d)));
        let start = std::time::Instant::now();
        let result =
            catch_unwind(AssertUnwindSafe(|| verdict(&text))).unwrap_or_else(|_| Err("it panicked".to_owned()));
        let seconds = start.elapsed().as_secs_f64();
        match result {
            Ok(ending) => {
                if ending != "ended" || seconds > 5.0 {
                    println!("run {k}: {ending} ({seconds:.1} s)");
                }
                *endings.entry(ending).or_default() += 1;
            }
            Err(fault) => {
                println!("run {k}: FAULT {fault}");
                faults.push(format!("run {k}: {fault}\n{text}"));
            }
        }
    }
    println!("{runs} runs: {endings:#?}");
    assert!(faults.is_empty(), "{} faults, the first:\n{}", faults.len(), faults[0]);
    let ended = endings.get("ended").copied().unwrap_or(0);
    assert!(ended as f64 >= 0.8 * runs as f64, "only {ended} of {runs} runs came to their end: {endings:#?}");
}

#[test]
fn drawn_liquids_end_or_stop_with_a_reason() {
    sweep(20, 1);
}

#[test]
#[ignore = "a sweep of minutes, for the night"]
fn many_drawn_liquids_end_or_stop_with_a_reason() {
    let number = |name: &str, default| std::env::var(name).ok().and_then(|n| n.parse().ok()).unwrap_or(default);
    sweep(number("VISCOSE_FUZZ", 500), number("VISCOSE_FUZZ_SEED", 1000));
}
