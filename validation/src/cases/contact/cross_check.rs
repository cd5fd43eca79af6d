//! Random systems solved twice: by the production solver and by cone programmes.

use crate::case::{Case, CaseError, Outcome, Param, Params, Table};
use contact::cross_check::{OracleSettings, Verdict, compare};
use contact::families::{Random, random_system};
use contact::{ContactSettings, solve};

/// Velocities of solver and oracle agree.
pub const CASE: Case = Case {
    id: "contact/cross-check",
    about: "Random systems with a solution (rank deficient, cohesion, ν up to 1.5) solved by the production solver and by cone programmes (Clarabel) with the outer fixed point; where velocities differ both must keep the law contact by contact",
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
    let (mut unsolved, mut resting, mut second, mut failed, mut disagree) = (0, 0, 0, 0, 0);
    let mut violation = 0.0_f64;
    for i in 0..systems {
        let n = random.index(2, most + 1);
        let dofs = random.index(3, 6 * n);
        let problem = random_system(&mut random, n, dofs, (0.0, nu.max(1e-12)), cohesion);
        let ours = solve(&problem, None, &settings);
        unsolved += usize::from(!ours.report.status().is_converged());
        let c = compare(&problem, &ours.impulses, &OracleSettings::default()).map_err(CaseError::failed)?;
        violation = violation.max(c.our_violation);
        resting += usize::from(c.at_rest);
        let why = match c.verdict {
            Verdict::Agree => "",
            Verdict::SecondSolution => {
                second += 1;
                "two solutions of the law: each keeps it contact by contact, and the cone programme confirms ours"
            }
            Verdict::OracleFailed => {
                failed += 1;
                "the oracle found no solution, ours keeps the law"
            }
            Verdict::Disagree => {
                disagree += 1;
                "disagreement"
            }
        };
        // what is compared: all but the systems that have two solutions and those where the oracle has none
        if matches!(c.verdict, Verdict::Agree | Verdict::Disagree) {
            found.push(c.difference);
        }
        if c.verdict != Verdict::Agree {
            rows.push(vec![
                i.to_string(),
                n.to_string(),
                dofs.to_string(),
                format!("{:.1e}", c.difference),
                format!("{:.1e}", c.our_violation),
                format!("{:.1e}", c.oracle_violation),
                format!("{:.1e}", c.confirmation),
                c.oracle_status.to_string(),
                why.into(),
            ]);
        }
    }
    found.sort_by(f64::total_cmp);
    let quantile =
        |q: f64| found.get((found.len().saturating_sub(1) as f64 * q).round() as usize).copied().unwrap_or(f64::NAN);
    let mut out = Outcome::new();
    out.compare_absolute("unsolved", f64::from(unsolved as u32), 0.0, 0.0);
    out.measure("median", quantile(0.5), |v| v <= 1e-7, "median relative difference of velocities");
    out.measure("95_percent", quantile(0.95), |v| v <= 1e-5, "95 % within 1e-5");
    out.measure("worst", quantile(1.0), |v| v <= 1e-4, "worst within 1e-4");
    out.compare_absolute("disagreements_unexplained", f64::from(disagree), 0.0, 0.0);
    out.measure(
        "our_violation",
        violation,
        |v| v <= 1e-7,
        "approach, cone, complementarity and slip of every contact, in velocity units relative to the free velocities",
    );
    out.measure(
        "share_compared",
        found.len() as f64 / systems as f64,
        |v| v >= 0.9,
        "systems with one solution that both found: at least nine tenths",
    );
    out.info("second_solutions", f64::from(second));
    out.info("oracle_without_solution", f64::from(failed));
    out.info("at_rest", f64::from(resting as u32));
    out.table(Table {
        title: "Systems that do not simply agree".into(),
        columns: [
            "system",
            "contacts",
            "dofs",
            "difference",
            "our violation",
            "oracle's violation",
            "ours confirmed to",
            "oracle",
            "why",
        ]
        .map(String::from)
        .to_vec(),
        rows,
    });
    Ok(out)
}
