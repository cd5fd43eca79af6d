//! Solves many members of every family and prints failures, iterations and time.
//!
//! `cargo run --release -p contact --example families -- FIRST LAST [solver]`
use contact::families::Family;
use contact::{ContactSettings, Scaling, SolverChoice, solve};
use std::time::Instant;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize, d: u64| args.get(i).and_then(|a| a.parse().ok()).unwrap_or(d);
    let (first, last) = (number(0, 0), number(1, 20));
    let solver = args.get(2).and_then(|n| SolverChoice::from_name(n)).unwrap_or_default();
    let only = args.get(3).cloned();
    for family in Family::ALL {
        if only.as_ref().is_some_and(|o| o != family.name()) {
            continue;
        }
        let (mut count, mut failed, mut newton, mut time, mut slowest, mut contacts) =
            (0, Vec::new(), 0, 0.0, 0.0_f64, 0);
        for seed in first..last {
            let p = family.member(seed);
            for scaling in [Scaling::UnitStep, Scaling::PerContact] {
                let settings = ContactSettings { solver, scaling, ..ContactSettings::default() };
                let t = Instant::now();
                let s = solve(&p, None, &settings);
                let e = t.elapsed().as_secs_f64();
                count += 1;
                time += e;
                slowest = slowest.max(e);
                contacts += p.len();
                newton += s.report.solve.iterations;
                if !s.report.status().is_converged() {
                    failed.push(format!(
                        "{seed}:{}c:{:.0e}:{}:{:.0}ms",
                        p.len(),
                        s.report.solve.residual,
                        s.report.status(),
                        e * 1e3
                    ));
                }
            }
        }
        println!(
            "{:11} {count:4} problems, {:5.1} contacts, {:7.1} iterations, mean {:8.3} ms, slowest {:9.2} ms, failed {} {:?}",
            family.name(),
            contacts as f64 / count as f64,
            newton as f64 / count as f64,
            1e3 * time / count as f64,
            1e3 * slowest,
            failed.len(),
            failed
        );
    }
}
