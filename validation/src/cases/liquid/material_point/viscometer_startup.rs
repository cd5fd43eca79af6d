use constitutive::viscometer::{Sample, TensorReference, Viscometer};

use super::liquid_choice::choose;
use crate::case::{Case, CaseError, Curve, Outcome, Param, Params, Table};

pub const CASE: Case = Case {
    id: "liquid/viscometer-startup",
    about: "Start-up of simple shear from rest against the tensor equation integrated by an independent implicit method of \
            fifth order; a Maxwell liquid also against its closed form.",
    params: &[
        Param::text("material", "none", "preset name, with its own shear modulus; none: the numbers below"),
        Param::number("tau_s", 0.0, "Pa", "yield stress in simple shear"),
        Param::number("k", 0.5, "Pa s^n", "consistency in simple shear"),
        Param::number("n", 1.0, "1", "flow index"),
        Param::number("mu", 0.0, "Pa", "shear modulus; 0: the material's own, or 100 Pa for numbers"),
        Param::number("rate", 1.0, "1/s", "shear rate"),
        Param::number("time", 5e-3, "s", "time of shearing"),
        Param::count("steps", 2000, "steps of the coarsest of four runs, each twice as fine"),
        Param::text("map", "implicit", "flow map: exact, implicit or forced"),
        Param::text("determinant", "exact", "determinant policy: exact or trace"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let rate = p.number_in("rate", 1e-6, 1e6)?;
    let time = p.positive("time")?;
    let steps = p.count_in("steps", 10, 1_000_000)?;
    if rate * time > 100.0 {
        return Err(p.reject("time", "a strain rate*time of at most 100"));
    }
    let mut choice = choose(p, rate)?;
    if choice.stiff {
        choice.law.shear_modulus = 100.0;
    }
    let law = &choice.law;
    let meter = Viscometer::new(law);
    let (shear, norm) = TensorReference::new(law).start_up(rate, time).map_err(CaseError::failed)?;
    // enough steps that none shears by more than a fiftieth
    let base = steps.max((50.0 * rate * time).ceil() as usize);
    let ends: Vec<Sample> = (0..4)
        .map(|k| meter.start_up_end(rate, time, base << k))
        .collect::<Result<_, _>>()
        .map_err(CaseError::failed)?;
    // error expansion in powers of the step: eliminate the first three
    let extrapolated = |pick: fn(&Sample) -> f64| {
        let mut row: Vec<f64> = ends.iter().map(pick).collect();
        for order in 1..4 {
            let factor = f64::from(1 << order);
            row = row.windows(2).map(|w| (factor * w[1] - w[0]) / (factor - 1.0)).collect();
        }
        row[0]
    };
    let mut out = Outcome::new();
    let finest = ends[3];
    out.compare("shear_stress", extrapolated(|s| s.stress_norm), norm, 1e-6);
    out.compare("sigma_xy", extrapolated(|s| s.shear_stress), shear, 1e-6);
    out.compare("sigma_xy_finest_step", finest.shear_stress, shear, 1e-2);
    let error = |s: &Sample| (s.shear_stress - shear).abs();
    let rounding = 1e-12 * shear.abs();
    if error(&finest) > 1e4 * rounding {
        let order = (error(&ends[2]) / error(&finest)).log2();
        out.measure("order", order, |o| o > 0.9, "observed order of convergence above 0.9");
    }
    let (tau, k, n) = choice.curve.rheometer();
    if tau == 0.0 && n == 1.0 && law.is_shear_elastic() {
        let closed = k * rate * (1.0 - (-law.shear_modulus * time / k).exp());
        out.compare("closed_form", finest.shear_stress, closed, 1e-2);
    }
    out.table(Table {
        title: "Convergence".to_owned(),
        columns: ["steps", "sigma_xy [Pa]", "relative error"].map(String::from).to_vec(),
        rows: ends
            .iter()
            .enumerate()
            .map(|(i, s)| {
                let relative = s.shear_stress / shear - 1.0;
                vec![(base << i).to_string(), format!("{:.8}", s.shear_stress), format!("{relative:.3e}")]
            })
            .collect(),
    });
    let course = meter.start_up(rate, time, 400.max((50.0 * rate * time) as usize)).map_err(CaseError::failed)?;
    let series = |name: &str, pick: fn(&Sample) -> f64| {
        (name.to_owned(), course.iter().map(|s| [s.strain, pick(s)]).collect::<Vec<_>>())
    };
    out.curve(Curve {
        title: "Start-up of shear".to_owned(),
        x_label: "strain".to_owned(),
        y_label: "stress [Pa]".to_owned(),
        log_x: false,
        log_y: false,
        series: vec![series("sigma_xy", |s| s.shear_stress), series("N1", |s| s.normal_difference)],
    });
    Ok(out)
}
