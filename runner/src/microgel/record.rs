//! What is left of a run besides the common record: the published table, and moduli with their errors.

use super::system::MicrogelSystem;
use granular::demodulation::Demodulation;
use granular::experiment::{Drive, Ensemble, Experiment, GateLevel, Measure, Moduli, Rheometer, Summary, figures};
use granular::model::Mode;
use granular::statistics::{Estimate, bootstrap, estimate};
use granular::stress::{COLUMNS, Row};
use serde_json::{Map, Value, json};
use std::fmt::Write as _;

/// Points of a Lissajous curve at most.
const LISSAJOUS_POINTS: usize = 400;
/// Draws of a bootstrap band.
const DRAWS: usize = 2000;

/// The last shear stress by the headline measure of the mode [Pa].
pub(super) fn headline_stress(rheometer: &Rheometer) -> f64 {
    match rheometer.headline() {
        Measure::Overall => rheometer.last_row().overall_stress(),
        Measure::Surface => rheometer.last_row().surface_stress(),
        Measure::Bulk => rheometer.last_row().stress.bulk.shear(),
    }
}

/// `microgel.csv`: the 42 columns of the published table.
pub(super) fn table(rows: &[Row]) -> Vec<u8> {
    let mut text = COLUMNS.join(",");
    text.push('\n');
    for row in rows {
        let _ = write!(text, "{}", row.index);
        for value in &row.columns()[1..] {
            let _ = write!(text, ",{value}");
        }
        text.push('\n');
    }
    text.into_bytes()
}

fn pick(moduli: &Moduli, measure: Measure) -> &Demodulation {
    match measure {
        Measure::Overall => &moduli.overall,
        Measure::Surface => &moduli.surface,
        Measure::Bulk => &moduli.bulk,
    }
}

fn name(measure: Measure) -> &'static str {
    match measure {
        Measure::Overall => "overall",
        Measure::Surface => "surface",
        Measure::Bulk => "bulk",
    }
}

fn headline(runs: &[Summary]) -> Measure {
    match runs.first().map(|run| run.mode) {
        Some(Mode::Compat) => Measure::Overall,
        _ => Measure::Bulk,
    }
}

/// One modulus over the samples: mean, spread, interval, bootstrap band, and the mean error of a single sample.
fn over_samples(values: &[f64], errors: &[f64], seed: u64) -> Value {
    let Estimate { count, mean, sd, half_width } = estimate(values);
    let mut value = json!({ "count": count, "mean": mean, "sd": sd, "half_width": half_width });
    if count > 1 {
        value["bootstrap"] = json!(bootstrap(values, 0.95, DRAWS, seed));
    }
    value["standard_error_of_a_sample"] = json!(estimate(errors).mean);
    value
}

/// Moduli of every sine of every segment over all samples.
fn moduli(runs: &[Summary]) -> Vec<Value> {
    let mut list = Vec::new();
    let Some(first) = runs.first() else { return list };
    for (k, segment) in first.segments.iter().enumerate() {
        for (w, sine) in segment.moduli.iter().enumerate() {
            let of_all: Vec<&Moduli> =
                runs.iter().filter_map(|run| run.segments.get(k).and_then(|s| s.moduli.get(w))).collect();
            let mut entry = json!({ "segment": k + 1, "amplitude": sine.amplitude, "frequency": sine.frequency });
            for measure in [Measure::Overall, Measure::Surface, Measure::Bulk] {
                let gather = |figure: fn(&Demodulation) -> f64| -> Vec<f64> {
                    of_all.iter().map(|m| figure(pick(m, measure))).collect()
                };
                entry[name(measure)] = json!({
                    "g_prime": over_samples(&gather(|d| d.g_prime), &gather(|d| d.g_prime_error), first.seed),
                    "g_double_prime":
                        over_samples(&gather(|d| d.g_double_prime), &gather(|d| d.g_double_prime_error), first.seed),
                });
            }
            list.push(entry);
        }
    }
    list
}

/// The last whole period of every oscillating segment of one sample: strain against stress.
fn lissajous(rheometer: &Rheometer) -> Vec<Value> {
    let mut curves = Vec::new();
    for (k, (segment, signal)) in rheometer.segments().iter().zip(rheometer.signals()).enumerate() {
        let Drive::Oscillation { window, .. } = &segment.drive else { continue };
        let time = |periods: f64| signal.time.partition_point(|t| *t < periods / window.frequency);
        let end = window.pre + window.periods;
        let (from, to) = (time(end - window.periods.min(1.0)), time(end));
        if to <= from {
            continue;
        }
        let stride = (to - from).div_ceil(LISSAJOUS_POINTS);
        let thin = |values: &[f64]| values[from..to].iter().step_by(stride).copied().collect::<Vec<f64>>();
        let zero = signal.strain.first().copied().unwrap_or(0.0);
        curves.push(json!({
            "segment": k + 1,
            "amplitude": window.amplitude,
            "strain": thin(&signal.strain).into_iter().map(|strain| strain - zero).collect::<Vec<f64>>(),
            "surface": thin(&signal.surface),
            "overall": thin(&signal.overall),
            "bulk": thin(&signal.bulk),
        }));
    }
    curves
}

/// Gates of all samples that are not good: what, where, and how far off.
fn gates(runs: &[Summary], level: GateLevel) -> Vec<String> {
    let mut list = Vec::new();
    for run in runs {
        for (k, segment) in run.segments.iter().enumerate() {
            for gate in segment.gates.iter().filter(|gate| gate.level == level) {
                list.push(format!(
                    "{} {:.3} (aim {}) in segment {} of seed {}",
                    gate.name,
                    gate.value,
                    gate.aim,
                    k + 1,
                    run.seed
                ));
            }
        }
    }
    list
}

/// What a study varies.
fn recipe(system: &MicrogelSystem) -> Value {
    let settings = system.state.samples[0].rheometer.settings();
    let mut recipe = json!({
        "grains": settings.model.grains,
        "packing": settings.model.packing,
        "friction": settings.model.friction,
        "young_modulus": settings.model.young_modulus,
        "removed_links": settings.preparation.remove_links,
    });
    if let Experiment::Oscillation(oscillation) = &settings.experiment {
        recipe["amplitude"] = json!(oscillation.amplitude);
        recipe["relative_frequency"] = json!(oscillation.relative_frequency);
    }
    recipe
}

/// Whether there are moduli.
fn oscillates(runs: &[Summary]) -> bool {
    runs.first().and_then(|run| run.segments.first()).is_some_and(|segment| !segment.moduli.is_empty())
}

/// `rheology.json`.
pub(super) fn rheology(system: &MicrogelSystem) -> Vec<u8> {
    let (runs, failed) = system.summaries();
    let measure = headline(&runs);
    let constants = system.state.samples[0].rheometer.settings().model.constants();
    let mut value = json!({
        "mode": runs.first().map(|run| run.mode),
        "headline": name(measure),
        "complete": system.state.done >= system.schedule().steps,
        "characteristic_time": constants.time,
        "recipe": recipe(system),
        "moduli": moduli(&runs),
        "gates_missed": gates(&runs, GateLevel::Missed),
        "gates_doubtful": gates(&runs, GateLevel::Doubtful),
        "lissajous": lissajous(&system.state.samples[0].rheometer),
    });
    let ensemble = Ensemble::new(runs, failed);
    if oscillates(&ensemble.runs) {
        value["g_prime"] = json!(ensemble.g_prime);
        value["g_double_prime"] = json!(ensemble.g_double_prime);
    }
    let figures = figures(&ensemble.runs);
    if !figures.is_empty() {
        value["figures"] = json!(figures);
    }
    value["samples"] = json!(ensemble.runs);
    value["failed"] = json!(ensemble.failed);
    let mut text = serde_json::to_string_pretty(&value).unwrap_or_default();
    text.push('\n');
    text.into_bytes()
}

/// Mass defect, and net momentum against the flow relative to the sum of its magnitudes.
fn balances(system: &MicrogelSystem) -> [f64; 2] {
    let assembly = system.state.samples[0].rheometer.assembly();
    let (grains, cell) = (assembly.grains(), assembly.cell());
    let (mut mass, mut net, mut all) = (0.0, [0.0; 2], 0.0f64);
    for i in 0..grains.len() {
        let vx = grains.vx[i] - cell.rate * (grains.y[i] - 0.5 * cell.height);
        let (px, py) = (grains.mass[i] * vx, grains.mass[i] * grains.vy[i]);
        mass += grains.mass[i];
        net[0] += px;
        net[1] += py;
        all += px.hypot(py);
    }
    [(mass - system.state.mass).abs() / system.state.mass, net[0].hypot(net[1]) / all.max(f64::MIN_POSITIVE)]
}

/// Figures for `summary.json`.
pub(super) fn summary(system: &MicrogelSystem) -> Map<String, Value> {
    let mut summary = Map::new();
    let mut put = |name: &str, value: Value| summary.insert(name.to_owned(), value);
    let first = &system.state.samples[0].rheometer;
    let (runs, failed) = system.summaries();
    put("grains", json!(first.assembly().len()));
    put("samples", json!(system.state.samples.len()));
    if !failed.is_empty() {
        put("failed_samples", json!(failed));
    }
    put("grain_steps", json!(system.state.done as f64 * first.assembly().len() as f64 * runs.len() as f64));
    let [mass_defect, net_momentum] = balances(system);
    put("mass_defect", json!(mass_defect));
    put("net_momentum", json!(net_momentum));
    if system.state.done <= system.schedule().prepared || runs.is_empty() {
        return summary;
    }
    let of = |figure: fn(&Summary) -> f64| estimate(&runs.iter().map(figure).collect::<Vec<f64>>());
    put("headline_measure", json!(name(headline(&runs))));
    let mut estimates: Vec<(String, Estimate)> =
        figures(&runs).into_iter().map(|figure| (figure.name, figure.estimate)).collect();
    if oscillates(&runs) {
        estimates.push(("g_prime".into(), of(|run| run.g_prime)));
        estimates.push(("g_double_prime".into(), of(|run| run.g_double_prime)));
    }
    for (name, of) in estimates {
        put(&name, json!(of.mean));
        if of.count > 1 {
            put(&format!("{name}_sd"), json!(of.sd));
            put(&format!("{name}_half_width"), json!(of.half_width));
        }
    }
    put("packing", json!(of(|run| run.sample.packing).mean));
    put("links", json!(of(|run| run.sample.links as f64).mean));
    put("particles", json!(of(|run| run.sample.particles as f64).mean));
    put("coordination", json!(of(|run| run.coordination).mean));
    put("slip_fraction", json!(of(|run| run.slip_fraction).mean));
    put("pressure_before", json!(of(|run| run.pressure_before).mean));
    put("extra_steps", json!(runs.iter().map(|run| run.extra_steps).sum::<u64>()));
    put("stress_identity_defect", json!(runs.iter().map(|run| run.identity_defect).fold(0.0, f64::max)));
    for (name, level) in [("gates_missed", GateLevel::Missed), ("gates_doubtful", GateLevel::Doubtful)] {
        put(name, json!(gates(&runs, level)));
    }
    summary
}
