//! Random systems solved twice: by the production solver and by cone programmes.

use crate::case::{Case, CaseError, Outcome, Param, Params, Table};
use contact::cross_check::{OracleSettings, certify, cross_check};
use contact::families::{Random, random_system};
use contact::{ContactSettings, solve};

/// Velocities of solver and oracle agree.
pub const CASE: Case = Case {
    id: "contact/cross-check",
    about: "Random systems (rank deficient, cohesion, ν up to 1.5) solved by the production solver and by cone programmes (Clarabel) with the outer fixed point",
    params: &[
        Param::count("systems", 40, "number of random systems"),
        Param::count("contacts", 24, "most contacts of a system"),
        Param::number("nu", 1.5, "1", "largest friction coefficient"),
        Param::number("cohesion", 0.2, "N s", "largest cohesive bound, half of the contacts"),
        Param::count("seed", 1, "seed"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let systems = p.count_in("systems", 4, 100_000)?;
    let most = p.count_in("contacts", 2, 400)?;
    let nu = p.number_in("nu", 0.0, 3.0)?;
    let cohesion = p.number_in("cohesion", 0.0, 100.0)?;
    let mut random = Random::new(p.count("seed")? as u64);
    let settings = ContactSettings { tolerance: 1e-10, ..ContactSettings::default() };
    let mut found = Vec::new();
    let mut rows = Vec::new();
    let (mut unsolved, mut cycled, mut second) = (0, 0, 0);
    for i in 0..systems {
        let n = random.index(2, most + 1);
        let dofs = random.index(3, 6 * n);
        let problem = random_system(&mut random, n, dofs, (0.0, nu.max(1e-12)), cohesion);
        let ours = solve(&problem, None, &settings);
        unsolved += usize::from(!ours.report.status().is_converged());
        let oracle = cross_check(&problem, &OracleSettings::default()).map_err(CaseError::failed)?;
        let difference = |b: &[[f64; 3]]| {
            let (mut d, mut s) = (0.0, 0.0);
            for (x, y) in ours.velocities.iter().zip(b) {
                for c in 0..3 {
                    d += (x[c] - y[c]).powi(2);
                    s += x[c].powi(2).max(y[c].powi(2));
                }
            }
            (d / f64::max(s, 1e-300)).sqrt()
        };
        let mut e = difference(&oracle.velocities);
        if e > 1e-5 || !oracle.status.is_converged() {
            // either the fixed point cycled, or the law has another solution: the cone solver is asked to confirm ours
            let confirmed =
                certify(&problem, &ours.velocities, &OracleSettings::default()).map_err(CaseError::failed)?;
            let c = difference(&confirmed.velocities);
            let why = if !oracle.status.is_converged() {
                cycled += 1;
                "the oracle's fixed point did not settle"
            } else if oracle.residual < 1e-5 {
                second += 1;
                "both are solutions of the law"
            } else {
                "the oracle is inexact"
            };
            rows.push(vec![
                i.to_string(),
                n.to_string(),
                dofs.to_string(),
                format!("{e:.1e}"),
                format!("{:.1e}", ours.report.solve.residual),
                format!("{:.1e}", oracle.residual),
                format!("{c:.1e}"),
                why.into(),
            ]);
            e = e.min(c);
        }
        found.push(e);
    }
    found.sort_by(f64::total_cmp);
    let quantile = |q: f64| found[((found.len() - 1) as f64 * q).round() as usize];
    let mut out = Outcome::new();
    out.compare_absolute("unsolved", unsolved as f64, 0.0, 0.0);
    out.measure(
        "median",
        quantile(0.5),
        |v| v <= 5e-7,
        "median difference of velocities, limited by the cone solver's accuracy",
    );
    out.measure("95_percent", quantile(0.95), |v| v <= 1e-5, "95 % within 1e-5");
    out.measure("worst", quantile(1.0), |v| v <= 1e-4, "worst within 1e-4, counting confirmed second solutions");
    out.info("oracle_not_settled", f64::from(cycled));
    out.info("second_solutions", f64::from(second));
    out.table(Table {
        title: "Disagreements above 1e-5 explained".into(),
        columns: [
            "system",
            "contacts",
            "dofs",
            "difference",
            "our residual",
            "oracle residual",
            "difference when certified",
            "why",
        ]
        .map(String::from)
        .to_vec(),
        rows,
    });
    Ok(out)
}
