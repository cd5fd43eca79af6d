//! The project's own hyperstatic families, every solver on each.

use crate::case::{Case, CaseError, Curve, Outcome, Param, Params, Table};
use contact::families::Family;
use contact::{ContactSettings, SolverChoice, solve};
use std::time::Instant;

/// Solved, failed and seconds per family and solver.
pub const CASE: Case = Case {
    id: "contact/families",
    about: "Towers, box walls, masonry arches, chains, sphere and capsule piles, single bodies, vehicles, random systems: every solver, residual against seconds",
    params: &[
        Param::count("members", 3, "members of each family"),
        Param::count("seed", 0, "first seed"),
        Param::number("tolerance", 1e-8, "1", "relative residual asked for"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let members = p.count_in("members", 1, 10_000)?;
    let seed = p.count("seed")? as u64;
    let tolerance = p.number_in("tolerance", 1e-13, 0.1)?;
    let mut out = Outcome::new();
    let mut rows = Vec::new();
    let mut series: Vec<(String, Vec<[f64; 2]>)> =
        SolverChoice::ALL.iter().map(|s| (s.name().into(), Vec::new())).collect();
    let (mut solved, mut total, mut worst) = (0usize, 0usize, 0.0_f64);
    for family in Family::ALL {
        for (index, solver) in SolverChoice::ALL.into_iter().enumerate() {
            let (mut ok, mut seconds, mut residual, mut contacts) = (0, 0.0, 0.0_f64, 0);
            for m in 0..members as u64 {
                let problem = family.member(seed + m);
                let settings = ContactSettings {
                    solver,
                    tolerance,
                    max_sweeps: 1000,
                    max_admm_iterations: 1000,
                    ..ContactSettings::default()
                };
                let begin = Instant::now();
                let s = solve(&problem, None, &settings);
                let t = begin.elapsed().as_secs_f64();
                seconds += t;
                contacts += problem.len();
                residual = residual.max(s.report.solve.residual);
                ok += usize::from(s.report.status().is_converged());
                series[index].1.push([t, s.report.solve.residual.max(1e-17)]);
            }
            if solver == SolverChoice::Auto {
                solved += ok;
                total += members;
                worst = worst.max(residual);
            }
            rows.push(vec![
                family.name().into(),
                solver.name().into(),
                format!("{:.0}", contacts as f64 / members as f64),
                format!("{ok}/{members}"),
                format!("{residual:.1e}"),
                format!("{:.3}", 1e3 * seconds / members as f64),
            ]);
        }
    }
    out.measure(
        "solved_share",
        solved as f64 / total as f64,
        |v| v >= 0.97,
        "the automatic choice solves at least 97 %",
    );
    out.info("worst_residual", worst);
    out.table(Table {
        title: "Families".into(),
        columns: ["family", "solver", "contacts", "solved", "worst residual", "mean time [ms]"]
            .map(String::from)
            .to_vec(),
        rows,
    });
    out.curve(Curve {
        title: "Residual against seconds".into(),
        x_label: "seconds [s]".into(),
        y_label: "relative residual [1]".into(),
        log_x: true,
        log_y: true,
        series,
    });
    Ok(out)
}
