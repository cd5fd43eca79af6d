//! Random systems solved by the production solver and by cone programmes: `cross_check [SYSTEMS] [SEED] [MOST_CONTACTS]`.
//!
//! Prints the quantiles of the difference and every system that differs by more than 1e-5, with what each answer breaks.

use contact::cross_check::{OracleSettings, certify, cross_check};
use contact::families::{Random, random_system};
use contact::problem::worst_violation;
use contact::{ContactSettings, solve};

fn main() {
    let argument = |i: usize, default: usize| std::env::args().nth(i).and_then(|a| a.parse().ok()).unwrap_or(default);
    let (systems, seed, most) = (argument(1, 40), argument(2, 1), argument(3, 24));
    let mut random = Random::new(seed as u64);
    let mut found = Vec::new();
    let (mut ours_s, mut oracle_s) = (0.0, 0.0);
    for i in 0..systems {
        let n = random.index(2, most + 1);
        let dofs = random.index(3, 6 * n);
        let p = random_system(&mut random, n, dofs, (0.0, 1.5), 0.2);
        let t = std::time::Instant::now();
        let ours = solve(&p, None, &ContactSettings { tolerance: 1e-10, ..ContactSettings::default() });
        ours_s += t.elapsed().as_secs_f64();
        let t = std::time::Instant::now();
        let Ok(oracle) = cross_check(&p, &OracleSettings::default()) else { continue };
        oracle_s += t.elapsed().as_secs_f64();
        let d = difference(&ours.velocities, &oracle.velocities);
        let converged = ours.report.status().is_converged();
        if d > 1e-5 || !converged || !oracle.status.is_converged() {
            let back = certify(&p, &ours.velocities, &OracleSettings::default());
            let (bd, bs) = back.map_or((f64::NAN, "refused".into()), |b| {
                (difference(&ours.velocities, &b.velocities), b.status.to_string())
            });
            let largest = ours.impulses.iter().flatten().fold(0.0_f64, |m, v| m.max(v.abs()));
            println!(
                "{i}: |u|/|q| {:.1e} n {n} dofs {dofs} d {d:.1e} | ours {} res {:.1e} viol {:.1e} largest r {largest:.1e} | oracle {} res {:.1e} viol {:.1e} outer {} shift {:.1e} | back {bd:.1e} {bs} | {:?}",
                size(&ours.velocities) / size(&p.shifted_velocity()), ours.report.status(), ours.report.solve.residual, worst_violation(&p, &ours.impulses),
                oracle.status, oracle.residual, worst_violation(&p, &oracle.impulses), oracle.outer_iterations, oracle.shift_change,
                ours.report.stages.iter().map(|s| (s.method.name(), s.iterations)).collect::<Vec<_>>()
            );
        }
        found.push(d);
    }
    found.sort_by(f64::total_cmp);
    for q in [0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 1.0] {
        println!("{:3.0} %: {:.2e}", 100.0 * q, found[((found.len() - 1) as f64 * q).round() as usize]);
    }
    println!("ours {ours_s:.2} s, oracle {oracle_s:.2} s");
}

fn size(u: &[[f64; 3]]) -> f64 {
    u.iter().flatten().map(|v| v * v).sum::<f64>().sqrt()
}

fn difference(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let (mut d, mut s) = (0.0, 0.0);
    for (x, y) in a.iter().zip(b) {
        for c in 0..3 {
            d += (x[c] - y[c]).powi(2);
            s += x[c].powi(2).max(y[c].powi(2));
        }
    }
    (d / f64::max(s, 1e-300)).sqrt()
}
