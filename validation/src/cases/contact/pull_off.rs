//! A cohesive contact pulled apart.

use crate::case::{Case, CaseError, Outcome, Param, Params};
use contact::block::IDENTITY;
use contact::{BlockMatrix, ContactProblem, ContactSettings, ContactSettings as Settings, solve};

/// Cohesion holds up to `c_a` and no further; friction sees the shifted impulse.
pub const CASE: Case = Case {
    id: "contact/pull-off",
    about: "Cohesive contact: holds a pull up to c_a, lets go just above; stick limit ν (r_N + c_a) (spec, table of the contact script)",
    params: &[
        Param::number("nu", 0.3, "1", "friction coefficient"),
        Param::number("cohesion", 2.0, "N s", "cohesive impulse bound"),
        Param::number("excess", 0.005, "1", "relative distance of the pulls from the bound"),
    ],
    run,
};

fn answer(fn_: f64, ft: f64, nu: f64, c: f64, settings: &Settings) -> Result<([f64; 3], [f64; 3]), CaseError> {
    let mut p =
        ContactProblem::new(BlockMatrix::from_triplets(1, &[(0, 0, IDENTITY)]), vec![[-fn_, -ft, 0.0]], vec![nu])
            .map_err(CaseError::failed)?;
    p.cohesion = vec![c];
    let s = solve(&p, None, settings);
    Ok((s.impulses[0], s.velocities[0]))
}

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let nu = p.number_in("nu", 0.0, 10.0)?;
    let c = p.positive("cohesion")?;
    let e = p.number_in("excess", 1e-6, 0.5)?;
    let settings = ContactSettings { tolerance: 1e-14, ..ContactSettings::default() };
    let mut out = Outcome::new();
    // (push, tangential push) in units of c: below the bound, just below, just above, pressed
    for (name, push) in [("held", -0.75), ("almost", -(1.0 - e)), ("released", -(1.0 + e)), ("pressed", 0.5)] {
        for ft in [0.05, 0.5] {
            let (r, u) = answer(push * c, ft * c, nu, c, &settings)?;
            let (rn, un) = if push < -1.0 { (-c, -push * c - c) } else { (push * c, 0.0) };
            let limit = nu * (rn + c);
            let rt = limit.min(ft * c);
            let tag = format!("{name}_{}", if ft < 0.1 { "weak" } else { "strong" });
            out.compare_absolute(&format!("{tag}_r_n"), r[0] / c, rn / c, 1e-12);
            out.compare_absolute(&format!("{tag}_r_t"), r[1] / c, rt / c, 1e-12);
            out.compare_absolute(&format!("{tag}_u_n"), u[0] / c, un / c, 1e-12);
            out.compare_absolute(&format!("{tag}_u_t"), u[1] / c, (rt - ft * c) / c, 1e-12);
        }
    }
    Ok(out)
}
