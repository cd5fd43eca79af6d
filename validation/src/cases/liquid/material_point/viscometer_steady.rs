use constitutive::viscometer::{TensorReference, Viscometer};

use super::liquid_choice::choose;
use crate::case::{Case, CaseError, Outcome, Param, Params, Table};

pub const CASE: Case = Case {
    id: "liquid/viscometer-steady",
    about: "Steady simple shear of one material point against the steady state of the tensor equation and, for a stiff \
            shear modulus, the Herschel-Bulkley curve.",
    params: &[
        Param::text("material", "none", "preset name, with its own shear modulus; none: the numbers below"),
        Param::number("tau_s", 18.417524, "Pa", "yield stress in simple shear"),
        Param::number("k", 17.821384, "Pa s^n", "consistency in simple shear"),
        Param::number("n", 0.22, "1", "flow index"),
        Param::number("mu", 0.0, "Pa", "shear modulus; 0: 1000 times the stress, or the material's own"),
        Param::number("rate", 10.0, "1/s", "shear rate"),
        Param::number("step", 0.0, "s", "time step; 0: a four-hundredth of the memory of the liquid"),
        Param::text("map", "implicit", "flow map: exact, implicit or forced"),
        Param::text("determinant", "exact", "determinant policy: exact or trace"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let rate = p.number_in("rate", 1e-6, 1e6)?;
    let choice = choose(p, rate)?;
    let law = &choice.law;
    let meter = Viscometer::new(law);
    let elastic = law.is_shear_elastic();
    let mut step = p.number("step")?;
    if step < 0.0 {
        return Err(p.reject("step", "a number of at least 0"));
    }
    let given = step > 0.0;
    if !given {
        // resolve the slower of build-up and forgetting, but at most a strain of 1/500 a step
        step = if elastic { (meter.memory_strain(rate) / 400.0).min(2e-3) / rate } else { 1.0 / rate };
    }
    let formula = choice.curve.shear_stress(rate);
    let mut out = Outcome::new();
    let fine = meter.steady_shear(rate, step).map_err(CaseError::failed)?;
    let (shear, norm, residual) = TensorReference::new(law).steady(rate).map_err(CaseError::failed)?;
    out.measure("steady", f64::from(u8::from(fine.steady)), |x| x == 1.0, "the stress stopped changing");
    // a step asked for is a question about its error: only the small step is held to the tolerance
    let tolerance = if given { 1.0 } else { 1e-3 };
    out.compare("shear_stress", fine.stress_norm, norm, tolerance);
    out.compare("sigma_xy", fine.shear_stress, shear, tolerance);
    if elastic {
        out.measure("reference_residual", residual, |r| r < 1e-6, "steady state of the tensor equation to 1e-6");
        out.info("normal_difference", fine.normal_difference);
    }
    if choice.stiff || !elastic {
        out.compare("flow_curve", fine.stress_norm, formula, tolerance);
    } else {
        out.info("flow_curve_stiff_limit", formula);
    }
    out.info("step", step);
    if elastic {
        let mut rows = Vec::new();
        for factor in [64.0, 16.0, 4.0, 1.0] {
            let dt = factor * step;
            let coarse = if factor == 1.0 { Ok(fine) } else { meter.steady_shear(rate, dt) };
            if let Ok(s) = coarse {
                rows.push(vec![
                    format!("{dt:.3e}"),
                    format!("{:.6}", s.stress_norm),
                    format!("{:.3e}", s.stress_norm / norm - 1.0),
                ]);
            }
        }
        out.table(Table {
            title: format!("Error against step, {} map", law.settings.flow_map.name()),
            columns: ["step [s]", "s/sqrt 2 [Pa]", "relative error"].map(String::from).to_vec(),
            rows,
        });
    }
    Ok(out)
}
