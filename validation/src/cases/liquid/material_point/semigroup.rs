use constitutive::presets::LIQUID_NAMES;
use constitutive::{FlowMap, LawSettings, Liquid};

use crate::case::{Case, CaseError, Outcome, Param, Params};

pub const CASE: Case = Case {
    id: "liquid/semigroup",
    about: "Two steps of relaxation equal one of their sum, for random states of the eight published materials.",
    params: &[
        Param::count("states", 10_000, "random states per material"),
        Param::count("seed", 1, "seed of the states"),
    ],
    run,
};

/// Uniform numbers in `[0, 1)` from a counter-based mix.
pub(super) fn uniform(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let states = p.count_in("states", 1, 10_000_000)?;
    let mut seed = p.count("seed")? as u64;
    let mut out = Outcome::new();
    for map in [FlowMap::Exact, FlowMap::Forced] {
        let mut worst = 0.0f64;
        for name in &LIQUID_NAMES[..8] {
            let liquid = Liquid::preset(name).map_err(CaseError::failed)?;
            let flow = liquid.law(LawSettings::default()).map_err(CaseError::failed)?.flow;
            // Newtonian liquids get a modulus for the purpose
            let modulus = if liquid.shear_modulus > 0.0 { liquid.shear_modulus } else { 10.0 };
            for _ in 0..states {
                let scale = flow.yield_norm() + flow.consistency();
                let trial = flow.yield_norm() + scale * 10f64.powf(4.0 * uniform(&mut seed) - 3.0);
                let mu_hat = modulus * (1.0 + uniform(&mut seed));
                let dt = 10f64.powf(4.0 * uniform(&mut seed) - 5.0);
                let part = 0.01 + 0.98 * uniform(&mut seed);
                let whole = flow.return_map(map, trial, trial, mu_hat, dt).stress;
                let first = flow.return_map(map, trial, trial, mu_hat, part * dt).stress;
                let both = flow.return_map(map, first, first, mu_hat, (1.0 - part) * dt).stress;
                worst = worst.max((whole - both).abs() / trial);
            }
        }
        out.measure(
            &format!("{}_defect", map.name()),
            worst,
            |e| e < 1e-11,
            "map(h1) then map(h2) equals map(h1 + h2) to 1e-11 of the trial stress",
        );
    }
    Ok(out)
}
