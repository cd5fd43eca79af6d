//! Random systems solved by the production solver and by cone programmes: `cross_check [SYSTEMS] [SEED] [MOST_CONTACTS]`.
//!
//! Prints the quantiles of the difference and every system that does not simply agree, with what each answer breaks.

use contact::cross_check::{OracleSettings, Verdict, compare};
use contact::families::{Random, random_system};
use contact::{ContactSettings, solve};
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let argument = |i: usize, default: usize| std::env::args().nth(i).and_then(|a| a.parse().ok()).unwrap_or(default);
    let (systems, seed, most) = (argument(1, 40), argument(2, 1), argument(3, 24));
    let mut random = Random::new(seed as u64);
    let mut found = Vec::new();
    let (mut seconds, mut resting, mut unsolved, mut violation) = (0.0, 0, 0, 0.0_f64);
    let mut verdicts = [0usize; 4];
    let begin = Instant::now();
    for i in 0..systems {
        let n = random.index(2, most + 1);
        let dofs = random.index(3, 6 * n);
        let p = random_system(&mut random, n, dofs, (0.0, 1.5), 0.2);
        let t = Instant::now();
        let ours = solve(&p, None, &ContactSettings { tolerance: 1e-10, ..ContactSettings::default() });
        seconds += t.elapsed().as_secs_f64();
        let c = compare(&p, &ours.impulses, &OracleSettings::default())?;
        let solved = ours.report.status().is_converged();
        unsolved += usize::from(!solved);
        resting += usize::from(c.at_rest);
        violation = violation.max(c.our_violation);
        verdicts[c.verdict as usize] += 1;
        if c.verdict != Verdict::Agree || !solved {
            println!("{i}: {n} contacts, {dofs} freedoms, {}: {c:?}", ours.report.status());
        }
        if matches!(c.verdict, Verdict::Agree | Verdict::Disagree) {
            found.push(c.difference);
        }
    }
    found.sort_by(f64::total_cmp);
    for q in [0.25, 0.5, 0.75, 0.9, 0.95, 0.99, 1.0] {
        println!("{:3.0} %: {:.2e}", 100.0 * q, found[((found.len() - 1) as f64 * q).round() as usize]);
    }
    println!(
        "agree {}, second solution {}, oracle failed {}, disagree {}; at rest {resting}, unsolved {unsolved}, our worst violation {violation:.1e}",
        verdicts[0], verdicts[1], verdicts[2], verdicts[3]
    );
    println!("ours {seconds:.2} s, all {:.2} s", begin.elapsed().as_secs_f64());
    Ok(())
}
