//! The public friction-contact problems, where the data are present (`VISCOSE_CONTACT_DATA`, or beside the project).

use contact::job::{Repeats, read_problem, solve_problem};
use contact::problem::{residual, ron, text};
use contact::{ContactSettings, Scaling, SolverChoice};
use std::path::PathBuf;

fn files() -> Vec<PathBuf> {
    let folder = std::env::var_os("VISCOSE_CONTACT_DATA").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/reference/contact"),
        PathBuf::from,
    );
    let mut files: Vec<PathBuf> = std::fs::read_dir(&folder)
        .map(|d| d.flatten().map(|e| e.path()).filter(|p| p.extension().is_some_and(|e| e == "dat")).collect())
        .unwrap_or_default();
    files.sort();
    if files.is_empty() {
        eprintln!("skipped: no contact problem files in {} (set VISCOSE_CONTACT_DATA)", folder.display());
    }
    files
}

/// Every file is solved to 1e-8 by the automatic choice and by Newton alone; the residual is recomputed from the answer.
#[test]
fn all_files_are_solved() {
    for file in files() {
        let problem = read_problem(&file).unwrap();
        for solver in [SolverChoice::Auto, SolverChoice::Newton] {
            let settings = ContactSettings { solver, scaling: Scaling::UnitStep, ..ContactSettings::default() };
            let answer = solve_problem(&problem, "file", &settings, Repeats::Times(1));
            assert!(answer.report.converged, "{} {solver:?} {:?}", file.display(), answer.report);
            let r: Vec<[f64; 3]> =
                answer.impulses.iter().map(|v| [v[0], v[1], v.get(2).copied().unwrap_or(0.0)]).collect();
            let e = residual(&problem.delassus, &problem.free_velocity, &problem.friction, &r, Scaling::UnitStep);
            assert!(e <= 1e-8, "{} {e}", file.display());
        }
    }
}

/// Both storages of one problem are the same problem, and writing loses nothing.
#[test]
fn formats_round_trip() {
    let files = files();
    let named = |n: &str| files.iter().find(|f| f.ends_with(n)).map(|f| read_problem(f).unwrap());
    if let (Some(a), Some(b)) = (named("FC3D_Example1.dat"), named("FC3D_Example1_SBM.dat")) {
        assert_eq!(a.free_velocity, b.free_velocity);
        for (i, j, block) in a.delassus.iter() {
            let row = b.delassus.row(i);
            let p = row.0.iter().position(|c| *c as usize == j).unwrap();
            assert_eq!(block, &row.1[p]);
        }
    }
    for f in &files {
        let p = read_problem(f).unwrap();
        assert_eq!(text::read(&text::write(&p)).unwrap(), p, "{}", f.display());
        if p.len() < 30 {
            assert_eq!(ron::read(&ron::write(&p).unwrap()).unwrap(), p, "{}", f.display());
        }
    }
}
