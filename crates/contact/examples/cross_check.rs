//! Systems solved by the production solver and by cone programmes.
//!
//! `cross_check [SYSTEMS] [SEED] [MOST_CONTACTS]` makes random ones, `cross_check FILE…` reads saved ones (a scene leaves them with
//! `contact.save_every`). Prints the quantiles of the difference and every system that does not simply agree, with what
//! each answer breaks.

use contact::cross_check::{Comparison, OracleSettings, Verdict, compare};
use contact::families::{Random, random_system};
use contact::{ContactProblem, ContactSettings, solve};
use std::path::Path;
use std::time::Instant;

/// What was found so far.
#[derive(Default)]
struct Tally {
    differences: Vec<f64>,
    verdicts: [usize; 4],
    resting: usize,
    unsolved: usize,
    violation: f64,
    seconds: f64,
}

impl Tally {
    fn add(&mut self, name: &str, problem: &ContactProblem) {
        let begin = Instant::now();
        let ours = solve(problem, None, &ContactSettings { tolerance: 1e-10, ..ContactSettings::default() });
        self.seconds += begin.elapsed().as_secs_f64();
        let solved = ours.report.status().is_converged();
        self.unsolved += usize::from(!solved);
        let found: Comparison = match compare(problem, &ours.impulses, &OracleSettings::default()) {
            Ok(found) => found,
            Err(error) => {
                println!("{name}: {error}");
                return;
            }
        };
        self.resting += usize::from(found.at_rest);
        self.violation = self.violation.max(found.our_violation);
        self.verdicts[found.verdict as usize] += 1;
        if found.verdict != Verdict::Agree || !solved {
            println!("{name}: {} contacts, {}: {found:?}", problem.len(), ours.report.status());
        }
        if matches!(found.verdict, Verdict::Agree | Verdict::Disagree) {
            self.differences.push(found.difference);
        }
    }

    fn print(&mut self, all: f64) {
        self.differences.sort_by(f64::total_cmp);
        let last = self.differences.len().saturating_sub(1);
        for q in [0.25, 0.5, 0.75, 0.9, 0.95, 0.99, 1.0] {
            if let Some(d) = self.differences.get((last as f64 * q).round() as usize) {
                println!("{:3.0} %: {d:.2e}", 100.0 * q);
            }
        }
        let [agree, second, failed, disagree] = self.verdicts;
        println!("agree {agree}, second solution {second}, oracle failed {failed}, disagree {disagree}");
        println!("at rest {}, unsolved {}, our worst violation {:.1e}", self.resting, self.unsolved, self.violation);
        println!("ours {:.2} s, all {all:.2} s", self.seconds);
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let mut tally = Tally::default();
    let begin = Instant::now();
    if arguments.first().is_some_and(|a| Path::new(a).is_file()) {
        for file in &arguments {
            tally.add(file, &contact::job::read_problem(Path::new(file))?);
        }
    } else {
        let argument = |i: usize, default: usize| arguments.get(i).and_then(|a| a.parse().ok()).unwrap_or(default);
        let (systems, seed, most) = (argument(0, 40), argument(1, 1), argument(2, 24));
        let mut random = Random::new(seed as u64);
        for i in 0..systems {
            let n = random.index(2, most + 1);
            let dofs = random.index(3, 6 * n);
            let problem = random_system(&mut random, n, dofs, (0.0, 1.5), 0.2);
            tally.add(&format!("{i} with {dofs} freedoms"), &problem);
        }
    }
    tally.print(begin.elapsed().as_secs_f64());
    Ok(())
}
