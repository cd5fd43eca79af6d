//! Solves many members of every family and prints failures, iterations and processor time.
//!
//! `cargo run --release -p contact --example families -- FIRST LAST [solver] [family | all] [units | one] [times]`: with `units` every member is
//! posed in eight other systems of units, `W` from 1e-10 to 1e10 of what it was and velocities from 1e-3 to 1e3; `times` as many bodies.
use contact::families::{Family, Random};
use contact::{BlockMatrix, ContactProblem, ContactSettings, Scaling, SolverChoice, solve};
use std::time::Instant;

/// Exponents of ten of `W` and of the velocities.
const UNITS: [(i32, i32); 9] = [(0, 0), (-10, 0), (-6, 3), (-3, -3), (3, 0), (6, -3), (6, 3), (10, 0), (10, -3)];

/// The same problem in other units; every third one also has masses that differ by up to a million, contact by contact.
fn in_units(p: &ContactProblem, (w, v): (i32, i32), mixed: bool) -> ContactProblem {
    let mut random = Random::new(p.len() as u64);
    let spread = if mixed { 3.0 } else { 0.0 };
    let d: Vec<f64> = (0..p.len()).map(|_| 10f64.powf(random.uniform(-spread, spread))).collect();
    let (w, v) = (10f64.powi(w), 10f64.powi(v));
    let triplets: Vec<_> =
        p.delassus.iter().map(|(i, j, b)| (i as u32, j as u32, b.map(|x| x * w * d[i] * d[j]))).collect();
    let q = p.free_velocity.iter().zip(&d).map(|(q, d)| q.map(|x| x * v * d)).collect();
    ContactProblem::new(BlockMatrix::from_triplets(p.len(), &triplets), q, p.friction.clone()).expect("finite numbers")
}

/// Processor time of this process so far, all threads [s] (from `/proc`; zero where that does not exist).
fn cpu_seconds() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let spent = tasks.filter_map(|task| {
        let stat = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        stat.split_whitespace().next()?.parse::<f64>().ok()
    });
    spent.sum::<f64>() * 1e-9
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize, d: u64| args.get(i).and_then(|a| a.parse().ok()).unwrap_or(d);
    let (first, last) = (number(0, 0), number(1, 20));
    let solver = args.get(2).and_then(|n| SolverChoice::from_name(n)).unwrap_or_default();
    let only = args.get(3).filter(|name| *name != "all").cloned();
    let units: &[(i32, i32)] = if args.get(4).is_some_and(|u| u == "units") { &UNITS } else { &UNITS[..1] };
    let times = number(5, 1) as usize;
    for family in Family::ALL {
        if only.as_ref().is_some_and(|o| o != family.name()) {
            continue;
        }
        let (mut count, mut failed, mut newton, mut time, mut slowest, mut contacts) =
            (0, Vec::new(), 0, 0.0, 0.0_f64, 0);
        for seed in first..last {
            let member = family.larger_member(seed, times);
            let posed = units.iter().enumerate();
            let ways = posed.flat_map(|(i, u)| [Scaling::UnitStep, Scaling::PerContact].map(|s| (i, *u, s)));
            for (i, unit, scaling) in ways {
                // contacts of very different units make sense only where every contact has its own scale
                let mixed = i % 3 == 2 && scaling == Scaling::PerContact;
                let p = in_units(&member, unit, mixed);
                let settings = ContactSettings { solver, scaling, ..ContactSettings::default() };
                let (t, begin) = (Instant::now(), cpu_seconds());
                let s = solve(&p, None, &settings);
                let spent = cpu_seconds() - begin;
                let e = if spent > 0.0 { spent } else { t.elapsed().as_secs_f64() };
                count += 1;
                time += e;
                slowest = slowest.max(e);
                contacts += p.len();
                newton += s.report.solve.iterations;
                if !s.report.status().is_converged() {
                    failed.push(format!(
                        "{seed}:{unit:?}{scaling:?}:{}c:{:.0e}:{}:{:.0}ms",
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
