use constitutive::viscometer::Viscometer;
use constitutive::{FlowMap, LawSettings};

use super::liquid_choice::preset;
use crate::case::{Case, CaseError, Curve, Outcome, Param, Params};

pub const CASE: Case = Case {
    id: "liquid/relaxation",
    about: "Stress relaxing at rest follows the closed form whatever the number of steps: to round-off with the trace \
            frozen, to the change of trace with the determinant kept.",
    params: &[
        Param::text("material", "shaving-cream", "preset with a shear modulus"),
        Param::number("strain", 0.2, "1", "sudden shear strain"),
        Param::number("time", 1.0, "s", "time of relaxation"),
        Param::count("steps", 1000, "steps of the fine run"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let liquid = preset(p, "material")?;
    let (strain, time) = (p.number_in("strain", 1e-6, 10.0)?, p.positive("time")?);
    let steps = p.count_in("steps", 2, 1_000_000)?;
    if liquid.shear_modulus == 0.0 {
        return Err(p.reject("material", "a liquid with a shear modulus"));
    }
    let settings = |flow_map| LawSettings { flow_map, ..LawSettings::default() };
    let law = liquid.law(settings(FlowMap::Exact)).map_err(CaseError::failed)?;
    let start = Viscometer::new(&law).relaxation(strain, time, 1).map_err(CaseError::failed)?;
    let trial = start[0].stress_norm * 2f64.sqrt();
    // trace of the strain after the sudden shear, frozen as the closed form has it: tr b = 3 + γ²
    let mu_hat = law.shear_modulus * (3.0 + strain * strain) / 3.0;
    let dt = time / steps as f64;
    let frozen = |map: FlowMap| (0..steps).fold(trial, |s, _| law.flow.return_map(map, s, s, mu_hat, dt).stress);
    let closed = law.flow.return_map(FlowMap::Exact, trial, trial, mu_hat, time).stress;
    let mut out = Outcome::new();
    out.compare("frozen_trace", frozen(FlowMap::Exact), closed, 1e-10);
    out.compare("frozen_trace_forced", frozen(FlowMap::Forced), closed, 1e-10);
    let course = Viscometer::new(&law).relaxation(strain, time, steps).map_err(CaseError::failed)?;
    let end = course[steps].stress_norm * 2f64.sqrt();
    let once = start[1].stress_norm * 2f64.sqrt();
    // shrinking trace slows the flow: the bound follows from λ's derivative by the modulus over its whole change
    let bound = law.flow.return_map(FlowMap::Exact, trial, trial, law.shear_modulus, time).stress;
    let spread = (bound - closed).abs() / closed;
    out.compare("determinant_kept", end, closed, 1e-3f64.max(1.01 * spread));
    out.compare("determinant_kept_one_step", once, closed, 1e-12);
    let implicit = liquid.law(settings(FlowMap::Implicit)).map_err(CaseError::failed)?;
    let coarse = Viscometer::new(&implicit).relaxation(strain, time, steps).map_err(CaseError::failed)?;
    out.info("implicit_error", coarse[steps].stress_norm * 2f64.sqrt() / closed - 1.0);
    out.curve(Curve {
        title: format!("Relaxation of {}", p.text("material")?),
        x_label: "time [s]".to_owned(),
        y_label: "s/sqrt 2 [Pa]".to_owned(),
        log_x: true,
        log_y: false,
        series: [("exact", &course), ("implicit", &coarse)]
            .map(|(name, samples)| {
                (name.to_owned(), samples.iter().skip(1).map(|s| [s.time, s.stress_norm]).collect::<Vec<_>>())
            })
            .to_vec(),
    });
    Ok(out)
}
