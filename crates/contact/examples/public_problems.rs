//! Solves every contact problem file of a folder with every solver and prints residual and time.
//!
//! `cargo run --release -p contact --example public_problems -- FOLDER [filter]`
use contact::{ContactSettings, Scaling, SolverChoice, problem::text, solve};
use std::time::Instant;

fn main() {
    let mut args = std::env::args().skip(1);
    let folder = args.next().or_else(|| std::env::var("VISCOSE_CONTACT_DATA").ok()).unwrap_or_default();
    let filter = args.next().unwrap_or_default();
    let Ok(entries) = std::fs::read_dir(&folder) else {
        println!("no folder `{folder}`");
        return;
    };
    let mut files: Vec<_> =
        entries.flatten().map(|e| e.path()).filter(|p| p.extension().is_some_and(|e| e == "dat")).collect();
    files.sort();
    for f in files {
        let name = f.file_name().unwrap_or_default().to_string_lossy().to_string();
        if !name.contains(&filter) {
            continue;
        }
        let problem = match std::fs::read_to_string(&f)
            .map_err(|e| e.to_string())
            .and_then(|t| text::read(&t).map_err(|e| e.to_string()))
        {
            Ok(p) => p,
            Err(e) => {
                println!("{name}: {e}");
                continue;
            }
        };
        for solver in SolverChoice::ALL {
            let settings = ContactSettings {
                solver,
                scaling: Scaling::UnitStep,
                max_sweeps: 20_000,
                ..ContactSettings::default()
            };
            let mut best = f64::INFINITY;
            let mut s = None;
            let begin = Instant::now();
            let mut repeats = 0;
            while repeats < 3 || (begin.elapsed().as_secs_f64() < 0.05 && repeats < 2000) {
                let t = Instant::now();
                s = Some(solve(&problem, None, &settings));
                best = best.min(t.elapsed().as_secs_f64());
                repeats += 1;
                if best > 0.5 {
                    break;
                }
            }
            if let Some(s) = s {
                let stages: Vec<String> = s
                    .report
                    .stages
                    .iter()
                    .map(|g| format!("{}:{}/{}g/{}ok", g.method.name(), g.iterations, g.groups, g.converged))
                    .collect();
                println!(
                    "{:32} {:4} {:13} {:14} {:9.2e} {:10.4} ms  {}",
                    name,
                    problem.len(),
                    solver.name(),
                    s.report.solve.status.name(),
                    s.report.solve.residual,
                    best * 1e3,
                    stages.join(" ")
                );
            }
        }
    }
}
