//! `viscose contact FILE`: solves one saved contact problem.

use std::path::{Path, PathBuf};

use clap::Args;
use contact::job::{self, JobReport, Repeats};
use contact::{ContactSettings, Scaling, SolverChoice};
use miette::IntoDiagnostic;

use super::Exit;
use crate::out::say;

/// Arguments of `viscose contact`.
#[derive(Args)]
pub struct Contact {
    /// The problem: RON where the name ends in `.ron`, else the text format of the public collections.
    pub file: PathBuf,
    /// `auto`, `gauss-seidel`, `newton` or `admm`.
    #[arg(long, default_value = "auto")]
    pub solver: String,
    /// Natural-map residual to reach, relative.
    #[arg(long = "tol", value_name = "TOLERANCE", default_value_t = 1e-8)]
    pub tolerance: f64,
    /// `unit-step` (as the public collections are judged) or `per-contact` (as scenes are) [default: by the file's format].
    #[arg(long)]
    pub scaling: Option<String>,
    /// Solve the problem so often and tell the median time [default: for a fiftieth of a second, at least once].
    #[arg(long, value_name = "TIMES")]
    pub repeat: Option<usize>,
    /// Print one JSON object.
    #[arg(long)]
    pub json: bool,
    /// Write impulses and velocities here, as JSON.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Threads to use [default: all cores]. Results do not depend on it.
    #[arg(long)]
    pub threads: Option<usize>,
}

impl Contact {
    /// Solves the problem.
    pub fn run(self) -> miette::Result<Exit> {
        super::run::set_threads(self.threads)?;
        let solver = SolverChoice::from_name(&self.solver).ok_or_else(|| {
            let names: Vec<String> = SolverChoice::ALL.iter().map(|s| s.name().replace('_', "-")).collect();
            miette::miette!("--solver {}: expected one of {}", self.solver, names.join(", "))
        })?;
        if !(self.tolerance > 0.0 && self.tolerance < 1.0) {
            return Err(miette::miette!("--tol {}: expected a number between 0 and 1", self.tolerance));
        }
        let scaling = match self.scaling.as_deref() {
            None => job::default_scaling(&self.file),
            Some("unit-step") => Scaling::UnitStep,
            Some("per-contact") => Scaling::PerContact,
            Some(other) => return Err(miette::miette!("--scaling {other}: expected unit-step or per-contact")),
        };
        let settings = ContactSettings { solver, tolerance: self.tolerance, scaling, ..ContactSettings::default() };
        let repeats = self.repeat.map_or(Repeats::Automatic, Repeats::Times);
        let report = job::solve_file(&self.file, &settings, repeats, self.out.as_deref()).into_diagnostic()?;
        tell(&report, self.json)?;
        Ok(if report.converged { Exit::Done } else { Exit::Failed })
    }
}

/// Solves a dumped problem with every solver in turn.
pub fn replay(file: &Path) -> miette::Result<Exit> {
    let problem = job::read_problem(file).into_diagnostic()?;
    let name = file.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let mut solved = false;
    for solver in SolverChoice::ALL {
        let settings = ContactSettings { solver, scaling: job::default_scaling(file), ..ContactSettings::default() };
        let answer = job::solve_problem(&problem, &name, &settings, Repeats::Times(1));
        tell(&answer.report, false)?;
        solved |= answer.report.converged;
    }
    Ok(if solved { Exit::Done } else { Exit::Failed })
}

fn tell(report: &JobReport, json: bool) -> miette::Result<()> {
    if json {
        say!("{}", serde_json::to_string(report).into_diagnostic()?);
        return Ok(());
    }
    say!(
        "{}: {} contacts, {}: {} after {} iterations, residual {:.2e} (asked {:.1e}), {:.6} s{}",
        report.file,
        report.contacts,
        report.solver,
        format!("{:?}", report.status).to_lowercase(),
        report.iterations,
        report.residual,
        report.tolerance,
        report.seconds,
        if report.solves > 1 {
            format!(" (median of {}, the first {:.6} s)", report.solves, report.first_seconds)
        } else {
            String::new()
        }
    );
    for stage in &report.stages {
        say!(
            "  {:12} {} groups, {} iterations, {} converged",
            stage.method.name(),
            stage.groups,
            stage.iterations,
            stage.converged
        );
    }
    Ok(())
}
