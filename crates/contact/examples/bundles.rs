//! Squeezed and rubbed bundles of hairs: what solving costs.
//!
//! `bundles STRANDS [TOLERANCE] [SOLVER] [SQUEEZE]`: contacts, states, processor seconds and residual of one cold solve. A number as
//! SOLVER means accelerated Gauss–Seidel with so many differences.
use contact::families::squeezed_bundle;
use contact::law::ContactState;
use contact::local::LocalMethod;
use contact::solvers::gauss_seidel::GaussSeidel;
use contact::solvers::solve_with;
use contact::{ContactSettings, SolverChoice, solve};

fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/schedstat").unwrap_or_default();
    stat.split_whitespace().next().and_then(|ns| ns.parse::<f64>().ok()).unwrap_or(0.0) * 1e-9
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize, d: f64| args.get(i).and_then(|a| a.parse().ok()).unwrap_or(d);
    let begin = cpu_seconds();
    let problem = squeezed_bundle(number(0, 64.0) as usize, 4e-3, number(3, 0.02), 0.3);
    println!(
        "{} contacts, {} blocks, assembled in {:.2} s",
        problem.len(),
        problem.delassus.block_count(),
        cpu_seconds() - begin
    );
    let settings = ContactSettings {
        tolerance: number(1, 1e-6),
        solver: args.get(2).and_then(|s| SolverChoice::from_name(s)).unwrap_or_default(),
        max_sweeps: 2000,
        max_newton_iterations: 100,
        max_admm_iterations: 2000,
        ..ContactSettings::default()
    };
    let begin = cpu_seconds();
    let window: Option<usize> = args.get(2).and_then(|s| s.parse().ok());
    let s = match window {
        Some(window) => {
            let sweeps = GaussSeidel { window, ..GaussSeidel::new(settings.max_sweeps, LocalMethod::default()) };
            solve_with(&problem, None, &settings, &sweeps)
        }
        None => solve(&problem, None, &settings),
    };
    let count = |state| s.states.iter().filter(|x| **x == state).count();
    println!(
        "{:?} open, {:?} stick, {:?} slip; {} residual {:.1e} in {:.2} s",
        count(ContactState::Open),
        count(ContactState::Stick),
        count(ContactState::Slip),
        s.report.status(),
        s.report.solve.residual,
        cpu_seconds() - begin
    );
    for stage in &s.report.stages {
        println!("{stage:?}");
    }
}
