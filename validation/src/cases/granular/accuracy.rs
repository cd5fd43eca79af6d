//! What the modulus costs: error against step, scatter against sample size, and what each fault of the original changes.

use super::oscillation::ParameterSet;
use crate::case::{Case, CaseError, Curve, Outcome, Param, Params, Table};
use granular::assembly::Plates;
use granular::demodulation::Drift;
use granular::experiment::{Ensemble, Experiment, MicrogelSettings, Oscillation, Rheometer, run_ensemble};
use granular::model::Mode;
use granular::physical::{Lever, Rules, SlipRule};

fn short(mode: Mode, p: &Params, seeds: u32) -> Result<MicrogelSettings, CaseError> {
    let set = ParameterSet {
        amplitude: p.number_in("amplitude", 1e-4, 5.0)?,
        mu: p.number_in("mu", 0.0, 1000.0)?,
        packing: 1.5,
        links: p.flag("links")?,
        cut_lines: 5,
    };
    let mut s = set.settings(mode, seeds, 1);
    s.model.grains = p.count_in("grains", 10, 100_000)?;
    Ok(s)
}

/// Error against step.
pub const STEP: Case = Case {
    id: "granular/step-error",
    about: "G′ of one prepared sample against the time step in the physical mode: the error falls with the step and is below one \
            per cent at the published one.",
    params: &[
        Param::number("amplitude", 0.2, "1", "strain amplitude"),
        Param::number("mu", 1.0, "1", "Coulomb coefficient"),
        Param::flag("links", true, "cross-links the sample"),
        Param::count("grains", 40, "number of grains"),
    ],
    run: step,
};

fn step(p: &Params) -> Result<Outcome, CaseError> {
    let mut base = short(Mode::Physical, p, 1)?;
    base.experiment = Experiment::Oscillation(Oscillation {
        amplitude: p.number("amplitude")?,
        pre_periods: 0.5,
        periods: 1.5,
        post_periods: 0.3,
        ..Oscillation::default()
    });
    let mut rows = Vec::new();
    for factor in [0.5, 1.0, 4.0, 8.0] {
        // The preparation does not feel the factor: every run measures the same sample.
        let mut r =
            Rheometer::new(&MicrogelSettings { step_factor: factor, ..base.clone() }).map_err(CaseError::failed)?;
        r.run(|_| {}).map_err(CaseError::failed)?;
        let s = r.summary().map_err(CaseError::failed)?;
        rows.push((factor, s.g_prime, s.g_double_prime, s.steps + s.extra_steps));
    }
    let (_, g1, g2, _) = rows[0];
    let scale = g1.hypot(g2);
    let error = |r: &(f64, f64, f64, u64)| (r.1 - g1).hypot(r.2 - g2) / scale;
    let mut out = Outcome::new();
    out.measure("error_at_published_step", error(&rows[1]), |e| e < 0.01, "below one per cent of |G|");
    out.measure(
        "error_at_4_times",
        error(&rows[2]),
        |e| e < 0.01,
        "below one per cent of |G| at the physical mode's own step",
    );
    out.measure("error_at_8_times", error(&rows[3]), |e| e < 0.1, "below ten per cent of |G| at eight times the step");
    out.info("g_prime", g1);
    out.info("g_double_prime", g2);
    out.table(Table {
        title: "Modulus of one sample against the step".into(),
        columns: ["step / published", "G′ [Pa]", "G″ [Pa]", "error", "steps"].map(String::from).to_vec(),
        rows: rows
            .iter()
            .map(|r| {
                vec![
                    format!("{}", r.0),
                    format!("{:.2}", r.1),
                    format!("{:.2}", r.2),
                    format!("{:.1e}", error(r)),
                    r.3.to_string(),
                ]
            })
            .collect(),
    });
    out.curve(Curve {
        title: "Error of the modulus against the step".into(),
        x_label: "step / published step [-]".into(),
        y_label: "error of G [-]".into(),
        log_x: true,
        log_y: true,
        series: vec![("error".into(), rows[1..].iter().map(|r| [r.0, error(r)]).collect())],
    });
    Ok(out)
}

/// Scatter against sample size.
pub const SIZE: Case = Case {
    id: "granular/sample-size",
    about: "Scatter of G′ over seeds against the number of grains: how many grain-steps one per cent of the mean costs.",
    params: &[
        Param::number("amplitude", 0.2, "1", "strain amplitude"),
        Param::number("mu", 1.0, "1", "Coulomb coefficient"),
        Param::flag("links", true, "cross-links the sample"),
        Param::count("grains", 40, "number of grains of the smallest sample"),
        Param::count("doublings", 1, "larger samples, each of twice the grains"),
        Param::count("seeds", 4, "samples of each size"),
    ],
    run: size,
};

fn size(p: &Params) -> Result<Outcome, CaseError> {
    let seeds = p.count_in("seeds", 2, 1000)? as u32;
    let doublings = p.count_in("doublings", 0, 12)?;
    let mut rows = Vec::new();
    for k in 0..=doublings {
        let mut s = short(Mode::Physical, p, seeds)?;
        s.model.grains <<= k;
        // The particles keep their size in grains.
        s.model.width *= f64::from(1u32 << k).sqrt();
        s.model.height = s.model.width;
        s.preparation.cut =
            granular::preparation::Cut::Voronoi { points: (s.model.grains / 30).max(2), edge_fuzziness: 0.0 };
        let e = run_ensemble(&s, |_| {}).map_err(CaseError::failed)?;
        let steps = e.runs.iter().map(|r| r.steps + r.extra_steps).max().unwrap_or(0);
        rows.push((s.model.grains, e, steps));
    }
    let relative = |e: &Ensemble| e.g_prime.sd / e.g_prime.mean;
    let mut out = Outcome::new();
    for (n, e, _) in &rows {
        out.info(&format!("g_prime_{n}"), e.g_prime.mean);
        out.measure(&format!("scatter_{n}"), relative(e), |v| v < 1.0, "standard deviation below the mean");
        out.measure(&format!("failed_{n}"), e.failed.len() as f64, |v| v == 0.0, "every seed runs to the end");
    }
    out.table(Table {
        title: "Cost of one per cent".into(),
        columns: ["grains", "G′ [Pa]", "sd over seeds [Pa]", "seeds for 1 %", "grain-steps for 1 %"]
            .map(String::from)
            .to_vec(),
        rows: rows
            .iter()
            .map(|(n, e, steps)| {
                let needed = (relative(e) / 0.01).powi(2).max(1.0);
                vec![
                    n.to_string(),
                    format!("{:.1}", e.g_prime.mean),
                    format!("{:.1}", e.g_prime.sd),
                    format!("{needed:.0}"),
                    format!("{:.1e}", needed * *n as f64 * *steps as f64),
                ]
            })
            .collect(),
    });
    Ok(out)
}

/// Effect of the faults.
pub const FAULTS: Case = Case {
    id: "granular/faults",
    about: "G′ and G″ with each known fault of the original switched into the physical mode by itself, beside the compat mode.",
    params: &[
        Param::number("amplitude", 0.2, "1", "strain amplitude"),
        Param::number("mu", 0.1, "1", "Coulomb coefficient"),
        Param::flag("links", false, "cross-links the sample"),
        Param::count("grains", 60, "number of grains"),
        Param::count("seeds", 1, "samples of each variant"),
    ],
    run: faults,
};

fn faults(p: &Params) -> Result<Outcome, CaseError> {
    let seeds = p.count_in("seeds", 1, 1000)? as u32;
    let base = short(Mode::Physical, p, seeds)?;
    let rules = Rules::default();
    let with = |rules: Rules| MicrogelSettings { rules, ..base.clone() };
    let variants = [
        ("physical", base.clone()),
        ("F1: drift doubled", MicrogelSettings { drift: Some(Drift::Double), ..base.clone() }),
        ("F2: spring reset at the Coulomb limit", with(Rules { slip: SlipRule::Reset, ..rules })),
        ("F6, F7, F18: plates that capture", MicrogelSettings { plates: Some(Plates::Band), ..base.clone() }),
        ("plates of fixed membership", MicrogelSettings { plates: Some(Plates::Fixed), ..base.clone() }),
        ("F14: dashpots may pull", with(Rules { viscous_attraction: true, ..rules })),
        ("F20: lever of the contact speed", with(Rules { lever: Lever::Radius, ..rules })),
        ("F21: spins damped to zero", with(Rules { damp_to_flow_spin: false, ..rules })),
        ("compat: all faults", MicrogelSettings { mode: Mode::Compat, ..base.clone() }),
    ];
    let mut out = Outcome::new();
    let mut rows = Vec::new();
    for (name, s) in variants {
        let e = run_ensemble(&s, |_| {}).map_err(CaseError::failed)?;
        let of = |f: fn(&granular::experiment::Moduli) -> f64| e.estimate(|s| f(&s.segments[0].moduli[0]));
        let (b1, b2) = (of(|m| m.bulk.g_prime), of(|m| m.bulk.g_double_prime));
        let (o1, o2) = (of(|m| m.overall.g_prime), of(|m| m.overall.g_double_prime));
        rows.push(vec![
            name.to_owned(),
            format!("{:.1}", b1.mean),
            format!("{:.1}", b2.mean),
            format!("{:.1}", o1.mean),
            format!("{:.1}", o2.mean),
        ]);
        if name == "physical" || name.starts_with("compat") {
            let mode = name.split(':').next().unwrap_or(name);
            out.info(&format!("{mode}_g_prime"), e.g_prime.mean);
            out.info(&format!("{mode}_g_double_prime"), e.g_double_prime.mean);
            // F16: what the published tensor leaves out.
            let share = o1.mean.hypot(o2.mean) / b1.mean.hypot(b2.mean);
            out.measure(
                &format!("{mode}_overall_over_bulk"),
                share,
                |v| v > 0.4 && v < 1.05,
                "F16: the overall tensor misses contacts across edges and with plates",
            );
        }
    }
    out.table(Table {
        title: "Moduli with each fault by itself [Pa]".into(),
        columns: ["variant", "G′ bulk", "G″ bulk", "G′ overall", "G″ overall"].map(String::from).to_vec(),
        rows,
    });
    Ok(out)
}
