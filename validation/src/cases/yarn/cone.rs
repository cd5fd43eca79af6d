//! Sliding states lie on the friction cone asked for.

use constitutive::yarn::{YarnForm, YarnFrame};
use yarn::YarnMaterial;

use super::setup::{build, material, plane};
use crate::case::{Case, CaseError, Outcome, Param, Params, Table};

/// Friction cone.
pub const CASE: Case = Case {
    id: "yarn/cone",
    about: "Colliding yarns: every sliding quadrature point has τ₁₂/τ₂₂ equal to the friction coefficient; the printed rule misses it.",
    params: &[
        Param::number("friction", 0.05, "1", "Coulomb coefficient of the yarns"),
        Param::number("shear_modulus", 500.0, "Pa", "shear modulus"),
        Param::count("steps", 400, "steps of 8e-5 s, or of the stable step where that is shorter"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    super::setup::alone(|| experiment(p))
}

fn experiment(p: &Params) -> Result<Outcome, CaseError> {
    let asked = p.number_in("friction", 1e-3, 10.0)?;
    let shear_modulus = p.positive("shear_modulus")?;
    let steps = p.count_in("steps", 50, 100_000)?;
    let mut out = Outcome::new();
    let mut rows = Vec::new();
    let sweep: Vec<f64> = [0.05, 0.1, 0.2, 0.5, 1.0].into_iter().filter(|f| *f != asked).collect();
    for friction in std::iter::once(asked).chain(sweep) {
        let given = YarnMaterial { shear_modulus, ..material(friction) };
        let seen = collision(given, steps)?;
        if friction == asked {
            out.compare_absolute("deviation", seen.deviation, 0.0, 1e-12);
            out.compare_absolute("outside_cone", seen.outside, 0.0, 1e-12);
            out.info("largest_ratio_error", seen.ratio);
            out.measure("sliding_states", seen.count as f64, |n| n >= 10.0, "the collision must make states slide");
        }
        rows.push(vec![format!("{friction}"), format!("{:.1e}", seen.ratio), seen.count.to_string()]);
    }
    // What the printed bound |r₁₂| = c_f (1 − r₂₂) gives at ten per cent compression.
    let printed = YarnMaterial { shear_modulus, ..material(asked) }.law(1e-3, YarnForm::Printed);
    let state = nalgebra::Matrix2::new(1.0, 1.0, 0.0, 0.9);
    let frame = printed.return_map(&state).frame;
    let effective = shear_modulus * frame.shear[0] * frame.section[0] / printed.pressure(&frame);
    out.info("printed_rule_coefficient", effective);
    out.table(Table {
        title: "Largest relative deviation of τ₁₂/τ₂₂ from the coefficient on sliding states under pressure".to_owned(),
        columns: ["friction", "deviation", "sliding states"].map(str::to_owned).to_vec(),
        rows,
    });
    Ok(out)
}

/// What a collision shows.
struct Collision {
    /// Largest deviation of sliding states from the cone, over the contact moduli.
    deviation: f64,
    /// Largest excess of any state outside the cone, over the contact moduli.
    outside: f64,
    /// Largest relative deviation of τ₁₂/τ₂₂ from the coefficient on sliding states under pressure.
    ratio: f64,
    /// Sliding states seen.
    count: usize,
}

fn collision(material: YarnMaterial, steps: usize) -> Result<Collision, CaseError> {
    let yarns = yarn::scenes::two_yarns(false).yarns;
    let mut settings = plane(material, yarns);
    settings.min_section = 1e-3;
    let mut system = build(&settings)?;
    let law = system.model().materials[0].law;
    let (mut worst, mut outside, mut ratio, mut count) = (0.0f64, 0.0f64, 0.0f64, 0);
    for _ in 0..steps {
        let before = system.state().slip.clone();
        // Undivided, so that what slid in a step is judged at its end.
        let dt = system.tightest_limit().map_or(8e-5, |limit| limit.seconds.min(8e-5));
        system.advance(dt).map_err(CaseError::failed)?;
        for (i, slip) in system.state().slip.iter().enumerate() {
            let frame = YarnFrame::new(&system.state().deformation[i]);
            let pressure = law.pressure(&frame);
            let excess = (law.shear_modulus * (frame.shear[0] * frame.section[0]).abs() - law.friction * pressure)
                / (law.mu + law.lambda);
            outside = outside.max(excess);
            if *slip > before[i] {
                worst = worst.max(excess.abs());
                count += 1;
                if pressure > 1e-2 * law.mu {
                    ratio = ratio.max((excess * (law.mu + law.lambda) / (law.friction * pressure)).abs());
                }
            }
        }
    }
    Ok(Collision { deviation: worst, outside: outside.max(0.0), ratio, count })
}
