//! The whole job of `viscose contact FILE`: read, solve, report, write the answer.

use crate::problem::{ContactProblem, ProblemError, Scaling, residual, ron, text};
use crate::report::StageReport;
use crate::settings::ContactSettings;
use crate::solvers::{Solution, solve};
use numerics::Status;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::Instant;

/// What is printed after a solve (`--json` prints it as one object).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JobReport {
    /// File name without its folder.
    pub file: String,
    /// Number of contacts.
    pub contacts: usize,
    /// 2 or 3.
    pub dimension: usize,
    /// Solver asked for.
    pub solver: String,
    /// How it ended, by name.
    pub status: Status,
    /// Whether the tolerance was met.
    pub converged: bool,
    /// Iterations of all methods over all groups.
    pub iterations: usize,
    /// Relative natural-map residual, recomputed from the answer.
    pub residual: f64,
    /// Tolerance asked for.
    pub tolerance: f64,
    /// Scaling of the residual.
    pub scaling: Scaling,
    /// Seconds of a solve, reading excluded: the median over [`JobReport::solves`].
    pub seconds: f64,
    /// Seconds of the first solve, when nothing is in the processor's caches yet.
    pub first_seconds: f64,
    /// How often the problem was solved, every time from the start and with the same answer.
    pub solves: usize,
    /// Groups of contacts that do not feel each other.
    pub groups: usize,
    /// Largest `|M − Mᵀ|` relative to the largest entry.
    pub asymmetry: f64,
    /// What each method did.
    pub stages: Vec<StageReport>,
}

/// How often a problem is solved to find out how long that takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Repeats {
    /// So often; at least once.
    Times(usize),
    /// Until a fiftieth of a second has passed: the first solve of a small problem times page faults and cold caches.
    Automatic,
}

/// Seconds that [`Repeats::Automatic`] spends, and the most solves that it does.
const ENOUGH: (f64, usize) = (0.02, 1000);

impl Repeats {
    fn is_enough(self, times: &[f64]) -> bool {
        match self {
            Repeats::Times(n) => times.len() >= n.max(1),
            Repeats::Automatic => times.len() >= ENOUGH.1 || times.iter().sum::<f64>() >= ENOUGH.0,
        }
    }
}

/// The answer as written to `--out`: numbers per contact, normal first, then tangents (one in plane problems).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JobAnswer {
    /// The report.
    pub report: JobReport,
    /// Impulses [N s].
    pub impulses: Vec<Vec<f64>>,
    /// Relative velocities `M r + q` [m/s].
    pub velocities: Vec<Vec<f64>>,
}

/// Reads a problem: RON where the name ends in `.ron`, the text format of the public collections otherwise.
///
/// # Errors
/// If the file cannot be read or does not follow its format.
pub fn read_problem(file: &Path) -> Result<ContactProblem, ProblemError> {
    let content = std::fs::read_to_string(file).map_err(|e| ProblemError::Io(format!("{}: {e}", file.display())))?;
    if is_ron(file) { ron::read(&content) } else { text::read(&content) }
}

/// Writes a problem in the format its name asks for.
///
/// # Errors
/// If the file cannot be written.
pub fn write_problem(problem: &ContactProblem, file: &Path) -> Result<(), ProblemError> {
    let content = if is_ron(file) { ron::write(problem)? } else { text::write(problem) };
    std::fs::write(file, content).map_err(|e| ProblemError::Io(format!("{}: {e}", file.display())))
}

fn is_ron(file: &Path) -> bool {
    file.extension().is_some_and(|e| e.eq_ignore_ascii_case("ron"))
}

/// The scaling by which a file is judged unless the user says otherwise: the public collections use the unit step,
/// problems dumped by scenes the scaled one.
#[must_use]
pub fn default_scaling(file: &Path) -> Scaling {
    if is_ron(file) { Scaling::PerContact } else { Scaling::UnitStep }
}

/// Reads `file`, solves it and, where `out` is given, writes the answer there as JSON.
///
/// # Errors
/// If a file cannot be read or written; a solve that misses its tolerance is not an error but a status.
pub fn solve_file(
    file: &Path,
    settings: &ContactSettings,
    repeats: Repeats,
    out: Option<&Path>,
) -> Result<JobReport, ProblemError> {
    let problem = read_problem(file)?;
    let name = file.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let answer = solve_problem(&problem, &name, settings, repeats);
    if let Some(out) = out {
        let json = serde_json::to_string_pretty(&answer).map_err(|e| ProblemError::Format(e.to_string()))?;
        std::fs::write(out, json + "\n").map_err(|e| ProblemError::Io(format!("{}: {e}", out.display())))?;
    }
    Ok(answer.report)
}

/// Solves a problem and puts the answer into file form; the residual is recomputed from the impulses that are returned.
#[must_use]
pub fn solve_problem(problem: &ContactProblem, name: &str, settings: &ContactSettings, repeats: Repeats) -> JobAnswer {
    let mut times = Vec::new();
    let Solution { impulses, velocities, report, .. } = loop {
        let begin = Instant::now();
        let solution = solve(problem, None, settings);
        times.push(begin.elapsed().as_secs_f64());
        if repeats.is_enough(&times) {
            break solution;
        }
    };
    let (first_seconds, solves) = (times[0], times.len());
    times.sort_by(f64::total_cmp);
    let seconds = times[solves / 2];
    let shifted: Vec<_> =
        (0..problem.len()).map(|k| [impulses[k][0] + problem.cohesion_of(k), impulses[k][1], impulses[k][2]]).collect();
    let q = problem.shifted_velocity();
    let checked = residual(&problem.delassus, &q, &problem.friction, &shifted, settings.scaling);
    let d = problem.dimension;
    JobAnswer {
        report: JobReport {
            file: name.to_string(),
            contacts: problem.len(),
            dimension: d,
            solver: settings.solver.name().to_string(),
            status: report.status(),
            converged: report.status().is_converged(),
            iterations: report.solve.iterations,
            residual: checked,
            tolerance: settings.tolerance,
            scaling: settings.scaling,
            seconds,
            first_seconds,
            solves,
            groups: report.groups,
            asymmetry: problem.delassus.asymmetry(),
            stages: report.stages,
        },
        impulses: impulses.iter().map(|v| v[..d].to_vec()).collect(),
        velocities: velocities.iter().map(|v| v[..d].to_vec()).collect(),
    }
}
