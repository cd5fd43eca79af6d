use constitutive::{FlowCurve, FlowMap, ShearFlow};

use crate::case::{Case, CaseError, Outcome, Param, Params};

pub const CASE: Case = Case {
    id: "liquid/return-map",
    about: "Exact return map and its derivatives against quadrature of the flow equation, and against a table of six states.",
    params: &[
        Param::number("trial", 60.0, "Pa", "stress norm before flow"),
        Param::number("modulus", 290.0, "Pa", "effective modulus"),
        Param::number("dt", 1e-3, "s", "step"),
        Param::number("yield_stress", 31.9, "Pa", "uniaxial yield stress of the model"),
        Param::number("consistency", 27.2, "Pa s^n", "consistency of the model"),
        Param::number("index", 0.22, "1", "flow index"),
    ],
    run,
};

/// Excess left after `dt`, by bisection on the time `∫ dΦ/(2μ̂ (Φ/η)^{1/n})` taken numerically in `ln Φ`.
fn excess_by_quadrature(excess: f64, modulus: f64, dt: f64, eta: f64, n: f64) -> f64 {
    let time = |down: f64| {
        // from ln Φ* down by `down`; Simpson on panels fine enough for the exponential
        let m = 1.0 - 1.0 / n;
        let count = ((down * m.abs()).ceil() as usize).clamp(1, 4000) * 40;
        let h = down / count as f64;
        let density = |x: f64| (m * (excess.ln() - x) + eta.ln() / n).exp() / (2.0 * modulus);
        (0..count)
            .map(|i| {
                let x = i as f64 * h;
                h / 6.0 * (density(x) + 4.0 * density(x + 0.5 * h) + density(x + h))
            })
            .sum::<f64>()
    };
    let (mut low, mut high) = (0.0, 1.0);
    while time(high) < dt {
        high *= 2.0;
        if high > 400.0 {
            return 0.0;
        }
    }
    for _ in 0..70 {
        let middle = 0.5 * (low + high);
        if time(middle) < dt {
            low = middle;
        } else {
            high = middle;
        }
    }
    excess * (-0.5 * (low + high)).exp()
}

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let (trial, modulus, dt) = (p.positive("trial")?, p.positive("modulus")?, p.positive("dt")?);
    let (tau, eta) = (p.number_in("yield_stress", 0.0, 1e9)?, p.positive("consistency")?);
    let n = p.number_in("index", 0.05, 5.0)?;
    let law = |yield_stress: f64, consistency: f64, index: f64| {
        ShearFlow::new(&FlowCurve::J2 { yield_stress, consistency, index }).map_err(CaseError::failed)
    };
    let flow = law(tau, eta, n)?;
    let map = |s: f64, m: f64| flow.return_map(FlowMap::Exact, s, s, m, dt);
    let here = map(trial, modulus);
    let reference = |s: f64, m: f64| {
        let excess = s - flow.yield_norm();
        if excess <= 0.0 { s } else { flow.yield_norm() + excess_by_quadrature(excess, m, dt, eta, n) }
    };
    let mut out = Outcome::new();
    out.compare("stress", here.stress, reference(trial, modulus), 1e-9);
    let (ds, dm) = (2e-4 * trial, 2e-4 * modulus);
    let kink = (trial - flow.yield_norm()).abs() < 2.0 * ds || (here.stress == flow.yield_norm() && n > 1.0);
    if !kink {
        let by_trial = (reference(trial + ds, modulus) - reference(trial - ds, modulus)) / (2.0 * ds);
        let by_modulus = (reference(trial, modulus + dm) - reference(trial, modulus - dm)) / (2.0 * dm);
        out.compare_absolute("by_trial", here.by_trial, by_trial, 1e-5);
        out.compare_absolute(
            "by_modulus_scaled",
            here.by_modulus * modulus / trial,
            by_modulus * modulus / trial,
            1e-5,
        );
    }
    // table of the specification, in SI: trial, modulus, step, yield stress, consistency, index, stress
    let mut worst = 0.0f64;
    for (trial, modulus, dt, tau, eta, n, expected) in [
        (60.0, 290.0, 1e-3, 31.9, 27.2, 0.22, 58.560_867_24),
        (60.0, 290.0, 1e-2, 31.9, 27.2, 0.22, 51.813_248_71),
        (10.0, 100.0, 1e-3, 1.6813, 0.649, 0.5173, 3.218_976_764),
        (2.0, 1e3, 1e-4, 0.0, 1.0, 1.0, 1.637_461_506),
        (1.0, 10.0, 1e-3, 0.3, 0.2, 2.0, 0.961_639_968_5),
        (40.0, 400.0, 1e-3, 30.0, 2.8, 0.98, 36.039_157_34),
    ] {
        let stress = law(tau, eta, n)?.return_map(FlowMap::Exact, trial, trial, modulus, dt).stress;
        worst = worst.max((stress / expected - 1.0).abs());
    }
    out.measure("table_error", worst, |e| e < 1e-9, "six tabulated states to 1e-9");
    let extinct = law(0.0, 1.0, 2.0)?;
    let at = |dt| extinct.return_map(FlowMap::Exact, 1.0, 1.0, 1.0, dt).stress;
    out.compare("just_before_extinction", at(0.9999), 1e-8, 1e-7);
    out.compare("after_extinction", at(1.0001), 0.0, 0.0);
    Ok(out)
}
