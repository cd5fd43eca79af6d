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

/// Tolerances beside the one asked for, for the curves of error against cost.
const LOOSER: [f64; 2] = [1e-2, 1e-5];

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let members = p.count_in("members", 1, 10_000)?;
    let seed = p.count("seed")? as u64;
    let tolerance = p.number_in("tolerance", 1e-13, 0.1)?;
    let mut out = Outcome::new();
    let mut rows = Vec::new();
    let (mut solved, mut total, mut worst) = (0usize, 0usize, 0.0_f64);
    for family in Family::ALL {
        let problems: Vec<_> = (0..members as u64).map(|m| family.member(seed + m)).collect();
        let contacts: usize = problems.iter().map(contact::ContactProblem::len).sum();
        let mut series = Vec::new();
        for solver in SolverChoice::ALL {
            let mut points = Vec::new();
            for asked in LOOSER.into_iter().filter(|t| *t > tolerance).chain([tolerance]) {
                let (mut ok, mut residual) = (0, 0.0_f64);
                let begin = Instant::now();
                for problem in &problems {
                    let settings = ContactSettings {
                        solver,
                        tolerance: asked,
                        max_sweeps: 1000,
                        max_admm_iterations: 1000,
                        ..ContactSettings::default()
                    };
                    let s = solve(problem, None, &settings);
                    residual = residual.max(s.report.solve.residual);
                    ok += usize::from(s.report.status().is_converged());
                }
                let seconds = begin.elapsed().as_secs_f64() / members as f64;
                points.push([seconds, residual.max(1e-17)]);
                if asked > tolerance {
                    continue;
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
                    format!("{:.3}", 1e3 * seconds),
                ]);
            }
            series.push((solver.name().into(), points));
        }
        out.curve(Curve {
            title: format!("{}: worst residual against seconds", family.name()),
            x_label: "mean seconds [s]".into(),
            y_label: "relative residual [1]".into(),
            log_x: true,
            log_y: true,
            series,
        });
    }
    out.measure("solved_share", solved as f64 / total as f64, |v| v == 1.0, "the automatic choice solves every member");
    out.info("worst_residual", worst);
    out.table(Table {
        title: "Families".into(),
        columns: ["family", "solver", "contacts", "solved", "worst residual", "mean time [ms]"]
            .map(String::from)
            .to_vec(),
        rows,
    });
    Ok(out)
}
