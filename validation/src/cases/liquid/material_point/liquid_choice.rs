//! Reading a liquid from the parameters of a case: a preset by name, or rheometer numbers.

use constitutive::{DeterminantPolicy, FlowCurve, FlowMap, HerschelBulkley, LawSettings, Liquid};

use crate::case::{CaseError, Params};

/// A liquid under test.
pub struct Choice {
    pub law: HerschelBulkley,
    pub curve: FlowCurve,
    /// Whether the shear modulus is the default of a thousand times the stress.
    pub stiff: bool,
}

/// Settings from `map` and `determinant`.
pub fn settings(p: &Params) -> Result<LawSettings, CaseError> {
    let flow_map = match p.text("map")? {
        "exact" => FlowMap::Exact,
        "implicit" => FlowMap::Implicit,
        "forced" => FlowMap::Forced,
        _ => return Err(p.reject("map", "exact, implicit or forced")),
    };
    let determinant = match p.text("determinant")? {
        "exact" => DeterminantPolicy::Exact,
        "trace" => DeterminantPolicy::Trace,
        _ => return Err(p.reject("determinant", "exact or trace")),
    };
    Ok(LawSettings { flow_map, determinant, ..LawSettings::default() })
}

/// The preset of a parameter.
pub fn preset(p: &Params, name: &str) -> Result<Liquid, CaseError> {
    Liquid::preset(p.text(name)?).map_err(|_| {
        p.reject(name, &format!("the name of a liquid: {}", constitutive::presets::LIQUID_NAMES.join(", ")))
    })
}

/// The liquid of `material`, or of `tau_s`, `k`, `n` where that is `none`; `mu` overrides the shear modulus where positive,
/// and is a thousand times the stress at `rate` for a liquid given by numbers.
pub fn choose(p: &Params, rate: f64) -> Result<Choice, CaseError> {
    let settings = settings(p)?;
    let mu = p.number("mu")?;
    if mu < 0.0 {
        return Err(p.reject("mu", "a number of at least 0 (0: default)"));
    }
    if p.text("material")? != "none" {
        let mut liquid = preset(p, "material")?;
        if mu > 0.0 {
            liquid.shear_modulus = mu;
        }
        let law = liquid.law(settings).map_err(CaseError::failed)?;
        return Ok(Choice { law, curve: liquid.flow, stiff: false });
    }
    let curve = FlowCurve::Rheometer {
        yield_stress: p.number_in("tau_s", 0.0, 1e9)?,
        consistency: p.number_in("k", 0.0, 1e9)?,
        index: p.number_in("n", 0.02, 5.0)?,
    };
    let stress = curve.shear_stress(rate);
    if stress <= 0.0 {
        return Err(p.reject("k", "above 0 where tau_s is 0"));
    }
    let modulus = if mu > 0.0 { mu } else { 1000.0 * stress };
    let law = HerschelBulkley::new(1e6, modulus, &curve, settings).map_err(CaseError::failed)?;
    Ok(Choice { law, curve, stiff: mu == 0.0 })
}
