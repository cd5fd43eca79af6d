//! The public friction-contact problems: every file, every solver, performance profile.

use crate::case::{Case, CaseError, Curve, Outcome, Param, Params, Table};
use contact::job::read_problem;
use contact::{ContactSettings, Scaling, SolverChoice, solve};
use std::path::PathBuf;
use std::time::Instant;

/// All files solved by the automatic choice; table and profile.
pub const CASE: Case = Case {
    id: "contact/public-problems",
    about: "Public friction-contact problems (test data of the Siconos library): all solved to the tolerance by the automatic choice; time and residual per solver",
    params: &[
        Param::text(
            "data",
            "",
            "folder of the files; empty: VISCOSE_CONTACT_DATA, else ../shared/reference/contact beside the project",
        ),
        Param::number("tolerance", 1e-8, "1", "relative residual, unit step"),
        Param::count("repeats", 3, "repeats of each solve, the fastest counts"),
        Param::text("match", "", "only files whose name contains this"),
    ],
    run,
};

/// Best times of the reference library at 1e-8 [ms] (Siconos 4.4.0, idle two-core machine), by the beginning of the file name.
const REFERENCE: [(&str, f64); 17] = [
    ("FrictionContact3D_1c", 0.005),
    ("FrictionContact3D_RR_1c", 0.0062),
    ("Rover11035", 0.0074),
    ("Rover4396", 0.0102),
    ("FC3D_Example1.dat", 0.0077),
    ("FC3D_Example1_SBM", 0.0069),
    ("Rover1039", 0.0539),
    ("Confeti-ex13", 0.01),
    ("Rover1040", 0.0826),
    ("Rover4609", 0.0524),
    ("NESpheres_10_1", 0.0488),
    ("OneObject-i1028", 7.47),
    ("OneObject-i100000", 6.14),
    ("BoxesStack1", 59.4),
    ("Confeti-ex03", 2.74),
    ("Capsules-i101", 164.0),
    ("Capsules-i100-889", 269.0),
];

fn folder(p: &Params) -> Result<PathBuf, CaseError> {
    let given = p.text("data")?;
    if !given.is_empty() {
        return Ok(PathBuf::from(given));
    }
    Ok(std::env::var_os("VISCOSE_CONTACT_DATA").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/reference/contact"),
        PathBuf::from,
    ))
}

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let tolerance = p.number_in("tolerance", 1e-13, 0.1)?;
    let repeats = p.count_in("repeats", 1, 10_000)?;
    let only = p.text("match")?;
    let folder = folder(p)?;
    let mut out = Outcome::new();
    let mut files: Vec<PathBuf> = match std::fs::read_dir(&folder) {
        Ok(entries) => entries
            .flatten()
            .map(|e| e.path())
            .filter(|f| f.extension().is_some_and(|e| e == "dat") && f.to_string_lossy().contains(only))
            .collect(),
        Err(_) => Vec::new(),
    };
    files.sort();
    if files.is_empty() {
        out.skip("no contact problem files: set VISCOSE_CONTACT_DATA or --set data=FOLDER");
        return Ok(out);
    }
    let mut rows = Vec::new();
    let mut times: Vec<[f64; 4]> = Vec::new();
    let (mut unsolved, mut only_auto, mut slower) = (0, 0, 0);
    for file in &files {
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let problem = read_problem(file).map_err(CaseError::failed)?;
        let mut row_times = [f64::INFINITY; 4];
        for (i, solver) in SolverChoice::ALL.into_iter().enumerate() {
            let settings = ContactSettings {
                solver,
                tolerance,
                scaling: Scaling::UnitStep,
                max_sweeps: 2000,
                max_admm_iterations: 2000,
                ..ContactSettings::default()
            };
            let mut best = f64::INFINITY;
            let mut last = None;
            for _ in 0..repeats {
                let begin = Instant::now();
                last = Some(solve(&problem, None, &settings));
                best = best.min(begin.elapsed().as_secs_f64());
            }
            let Some(s) = last else { continue };
            let ok = s.report.status().is_converged();
            if ok {
                row_times[i] = best;
            }
            let reference = REFERENCE.iter().find(|(n, _)| name.starts_with(n)).map(|(_, t)| *t);
            if solver == SolverChoice::Auto {
                unsolved += usize::from(!ok);
                slower += usize::from(reference.is_some_and(|t| 1e3 * best > t.max(0.05)));
            }
            rows.push(vec![
                name.clone(),
                problem.len().to_string(),
                solver.name().into(),
                s.report.status().to_string(),
                format!("{:.1e}", s.report.solve.residual),
                s.report.solve.iterations.to_string(),
                format!("{:.4}", 1e3 * best),
                reference.map_or_else(String::new, |t| format!("{t}")),
            ]);
        }
        only_auto += usize::from(row_times[1..].iter().all(|t| t.is_infinite()));
        times.push(row_times);
    }
    out.compare_absolute("unsolved", unsolved as f64, 0.0, 0.0);
    out.compare_absolute("solved_by_no_single_method", only_auto as f64, 0.0, 0.0);
    out.info("slower_than_reference_library", slower as f64);
    out.info("files", files.len() as f64);
    // Dolan–Moré: share of problems solved within a factor of the fastest solver
    let mut series = Vec::new();
    for (i, solver) in SolverChoice::ALL.into_iter().enumerate() {
        let mut ratios: Vec<f64> = times
            .iter()
            .filter(|t| t[i].is_finite())
            .map(|t| t[i] / t.iter().copied().fold(f64::INFINITY, f64::min))
            .collect();
        ratios.sort_by(f64::total_cmp);
        let points =
            ratios.iter().enumerate().map(|(k, r)| [*r, (k + 1) as f64 / times.len() as f64]).collect::<Vec<_>>();
        series.push((solver.name().to_string(), points));
    }
    out.table(Table {
        title: "Public problems".into(),
        columns: [
            "file",
            "contacts",
            "solver",
            "status",
            "residual",
            "iterations",
            "time [ms]",
            "reference library, best [ms]",
        ]
        .map(String::from)
        .to_vec(),
        rows,
    });
    out.curve(Curve {
        title: "Performance profile".into(),
        x_label: "time over that of the fastest solver [1]".into(),
        y_label: "share of problems solved [1]".into(),
        log_x: true,
        log_y: false,
        series,
    });
    Ok(out)
}
