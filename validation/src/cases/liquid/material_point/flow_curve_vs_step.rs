use std::time::Instant;

use constitutive::presets::LIQUID_NAMES;
use constitutive::viscometer::{TensorReference, Viscometer};
use constitutive::{FlowMap, LawSettings, Liquid};

use super::liquid_choice::preset;
use crate::case::{Case, CaseError, Curve, Outcome, Param, Params, Table};

pub const CASE: Case = Case {
    id: "liquid/flow-curve-vs-step",
    about: "Steady shear stress against the step for the three flow maps: what each loses, for each material at its own \
            shear modulus, against the steady state of the tensor equation; with the cost of each map.",
    params: &[
        Param::text("material", "all", "preset name, or all for the eight published ones"),
        Param::number("rate", 0.0, "1/s", "shear rate; 0: 1, 10, 50, 100 and 1000"),
        Param::number("step", 1e-3, "s", "largest step; the others are a tenth and a hundredth of it"),
    ],
    run,
};

/// Largest strain of one step that is still tried: beyond it the grid would not let a step through.
const MAX_STRAIN: f64 = 1.0;

/// Steps over the memory of the liquid beyond which a step is as good as none.
const MAX_STEPS: f64 = 2e4;

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let names: Vec<&str> = if p.text("material")? == "all" {
        LIQUID_NAMES[..8].to_vec()
    } else {
        preset(p, "material")?;
        vec![p.text("material")?]
    };
    let rate = p.number("rate")?;
    if !(0.0..=1e5).contains(&rate) {
        return Err(p.reject("rate", "a number from 0 to 1e5"));
    }
    let rates = if rate > 0.0 { vec![rate] } else { vec![1.0, 10.0, 50.0, 100.0, 1000.0] };
    let largest = p.number_in("step", 1e-6, 1.0)?;
    let steps = [largest, 0.1 * largest, 0.01 * largest];
    let mut out = Outcome::new();
    let mut rows = Vec::new();
    // per map: worst error over everything, worst at the smallest step, seconds, marched steps
    let (mut worst, mut smallest, mut seconds, mut marched) = ([0.0f64; 3], [0.0f64; 3], [0.0f64; 3], [0usize; 3]);
    let mut series: Vec<(String, Vec<[f64; 2]>)> = Vec::new();
    for name in names {
        let liquid = Liquid::preset(name).map_err(CaseError::failed)?;
        for &rate in &rates {
            let law =
                |flow_map| liquid.law(LawSettings { flow_map, ..LawSettings::default() }).map_err(CaseError::failed);
            let reference = TensorReference::new(&law(FlowMap::Exact)?).steady(rate).map_err(CaseError::failed)?.1;
            let memory = if liquid.shear_modulus > 0.0 {
                Viscometer::new(&law(FlowMap::Exact)?).memory_strain(rate)
            } else {
                0.0
            };
            for &dt in steps.iter().filter(|dt| **dt * rate <= MAX_STRAIN && memory <= MAX_STEPS * **dt * rate) {
                let mut row = vec![name.to_owned(), format!("{rate}"), format!("{dt:.0e}")];
                for (k, map) in FlowMap::ALL.into_iter().enumerate() {
                    let law = law(map)?;
                    let clock = Instant::now();
                    let stress = Viscometer::new(&law).steady_shear(rate, dt).map_err(CaseError::failed)?;
                    seconds[k] += clock.elapsed().as_secs_f64();
                    marched[k] += stress.steps;
                    let fraction = stress.stress_norm / reference;
                    worst[k] = worst[k].max((fraction - 1.0).abs());
                    if dt == steps[2] {
                        smallest[k] = smallest[k].max((fraction - 1.0).abs());
                    }
                    row.push(format!("{fraction:.4}"));
                    let label = format!("{} {name}", map.name());
                    if rate == rates[rates.len() / 2] {
                        match series.iter_mut().find(|s| s.0 == label) {
                            Some(s) => s.1.push([dt, fraction]),
                            None => series.push((label, vec![[dt, fraction]])),
                        }
                    }
                }
                rows.push(row);
            }
        }
    }
    for (k, map) in FlowMap::ALL.into_iter().enumerate() {
        out.info(&format!("worst_{}", map.name()), worst[k]);
        out.info(&format!("worst_{}_smallest_step", map.name()), smallest[k]);
        out.info(&format!("nanoseconds_{}", map.name()), 1e9 * seconds[k] / marched[k].max(1) as f64);
    }
    start_up(largest, &mut out)?;
    for k in [1, 2] {
        let name = FlowMap::ALL[k].name();
        out.measure(
            &format!("{name}_over_exact"),
            worst[k] / worst[0].max(1e-12),
            |r| r <= 1.0,
            "loses no more than the exact relaxation of the trial stress",
        );
    }
    out.measure(
        "smallest_step_gain",
        smallest[1] / worst[1].max(1e-12),
        |r| r <= 1.0,
        "the implicit map's error does not grow as the step shrinks",
    );
    if p.text("material")? == "all" || p.text("material")? == "drilling-mud" {
        // the measured figure that made the default: mud at 50 /s and 1 ms, from the theory of the splitting error
        let liquid = Liquid::preset("drilling-mud").map_err(CaseError::failed)?;
        let fraction = |flow_map| {
            let law = liquid.law(LawSettings { flow_map, ..LawSettings::default() })?;
            let meter = Viscometer::new(&law).steady_shear(50.0, 1e-3)?;
            Ok::<_, constitutive::RheologyError>(meter.shear_stress / liquid.flow.shear_stress(50.0))
        };
        for (map, expected) in [(FlowMap::Exact, 0.589), (FlowMap::Implicit, 0.997), (FlowMap::Forced, 0.997)] {
            let measured = fraction(map).map_err(CaseError::failed)?;
            out.compare(&format!("mud_50_{}", map.name()), measured, expected, 1e-2);
        }
    }
    out.table(Table {
        title: "Steady stress over the true one".to_owned(),
        columns: ["material", "rate [1/s]", "step [s]", "exact", "implicit", "forced"].map(String::from).to_vec(),
        rows,
    });
    out.curve(Curve {
        title: format!("Steady stress over the true one at {} 1/s", rates[rates.len() / 2]),
        x_label: "step [s]".to_owned(),
        y_label: "fraction".to_owned(),
        log_x: true,
        log_y: false,
        series,
    });
    Ok(out)
}

/// What each map gets wrong on the way to steady flow: start-up at 10 and 100 /s over twice the memory of the liquid, error
/// of the stress at five times of it, in terms of the steady stress.
fn start_up(dt: f64, out: &mut Outcome) -> Result<(), CaseError> {
    let mut rows = Vec::new();
    let mut sums = [0.0f64; 3];
    let mut count = 0.0;
    for name in &LIQUID_NAMES[2..8] {
        let liquid = Liquid::preset(name).map_err(CaseError::failed)?;
        for rate in [10.0, 100.0] {
            let law =
                |flow_map| liquid.law(LawSettings { flow_map, ..LawSettings::default() }).map_err(CaseError::failed);
            let reference_law = law(FlowMap::Exact)?;
            let reference = TensorReference::new(&reference_law);
            let memory = Viscometer::new(&reference_law).memory_strain(rate);
            let steps = ((2.0 * memory / (rate * dt)).ceil() as usize).max(1);
            let steady = reference.steady(rate).map_err(CaseError::failed)?.1;
            let mut row = vec![(*name).to_owned(), format!("{rate}"), steps.to_string()];
            let mut errors = [0.0f64; 3];
            for part in 1..=5 {
                let taken = (steps * part).div_ceil(5);
                let truth = reference.start_up(rate, taken as f64 * dt).map_err(CaseError::failed)?.1;
                for (k, map) in FlowMap::ALL.into_iter().enumerate() {
                    let end = Viscometer::new(&law(map)?)
                        .start_up_end(rate, taken as f64 * dt, taken)
                        .map_err(CaseError::failed)?;
                    errors[k] = errors[k].max((end.stress_norm - truth).abs() / steady);
                }
            }
            count += 1.0;
            for k in 0..3 {
                sums[k] += errors[k];
                row.push(format!("{:.4}", errors[k]));
            }
            rows.push(row);
        }
    }
    for (k, map) in FlowMap::ALL.into_iter().enumerate() {
        out.info(&format!("mean_start_up_error_{}", map.name()), sums[k] / count);
    }
    out.table(Table {
        title: format!("Largest error during start-up over the steady stress, step {dt:.0e} s"),
        columns: ["material", "rate [1/s]", "steps", "exact", "implicit", "forced"].map(String::from).to_vec(),
        rows,
    });
    Ok(())
}
