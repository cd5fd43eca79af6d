//! Solves every contact problem file of a folder with every solver and prints residual and the median of the processor times.
//!
//! `cargo run --release -p contact --example public_problems -- FOLDER [filter]`
use contact::{ContactSettings, Scaling, SolverChoice, problem::text, solve};
use std::time::Instant;

/// Processor time of this thread so far [s] (from `/proc`, so only where that exists): other work on the machine does not count.
fn cpu_seconds() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    stat.split_whitespace().next()?.parse::<f64>().ok().map(|ns| ns * 1e-9)
}

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
            // groups of solves, long enough for the clock of the processor; the median of the groups counts
            let clock = |since: Instant| cpu_seconds().unwrap_or_else(|| since.elapsed().as_secs_f64());
            let since = Instant::now();
            let begin = clock(since);
            let mut s = Some(solve(&problem, None, &settings));
            let once = (clock(since) - begin).max(1e-7);
            let group = ((2e-3 / once) as usize).clamp(1, 1000);
            let mut times: Vec<f64> = Vec::new();
            for _ in 0..if once > 0.2 { 1 } else { 15 } {
                let begin = clock(since);
                for _ in 0..group {
                    s = Some(solve(&problem, None, &settings));
                }
                times.push((clock(since) - begin) / group as f64);
            }
            times.sort_by(f64::total_cmp);
            let best = times[times.len() / 2];
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
