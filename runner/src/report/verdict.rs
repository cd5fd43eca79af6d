//! The line at the top of the page: did the run end well, and are its balances kept?

use serde_json::Value;

use super::data::RunData;
use super::pictures::Shown;

/// How good a run looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Grade {
    /// Nothing to remark.
    Good,
    /// Look closer.
    Doubtful,
    /// Something is wrong.
    Bad,
}

/// What to think of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Verdict {
    /// The worst of the findings.
    pub grade: Grade,
    /// One sentence.
    pub headline: String,
    /// Findings with their own grades, worst first.
    pub findings: Vec<(Grade, String)>,
}

/// Share of rejected steps above which the step control is worth a look.
const REJECTED_SHARE: f64 = 0.05;
/// Relative defects up to here are round-off.
const ROUND_OFF: f64 = 1e-8;
/// Relative defects up to here may be truncation; above, a balance is broken.
const TRUNCATION: f64 = 1e-3;

pub(super) fn of_run(run: &RunData, shown: &Shown) -> Verdict {
    let mut findings = Vec::new();
    let headline = ending(run, &mut findings);
    steps(run, &mut findings);
    defects(run, &mut findings);
    finite(run, shown, &mut findings);
    gates(run, &mut findings);
    findings.extend(run.notes.iter().map(|note| (Grade::Doubtful, note.clone())));
    findings.sort_by_key(|finding| std::cmp::Reverse(finding.0));
    let grade = findings.iter().map(|finding| finding.0).max().unwrap_or(Grade::Good);
    Verdict { grade, headline, findings }
}

fn ending(run: &RunData, findings: &mut Vec<(Grade, String)>) -> String {
    let reached = run.series.column("time").and_then(|t| t.last()).copied();
    let Some(summary) = &run.summary else {
        let checkpoints = run.checkpoints;
        let resume = if checkpoints > 0 {
            format!("; {checkpoints} checkpoint{} to resume from", if checkpoints == 1 { "" } else { "s" })
        } else {
            String::new()
        };
        findings.push((Grade::Doubtful, format!("the run is unfinished or was cut short: no summary{resume}")));
        return reached.map_or("Unfinished".to_owned(), |t| format!("Unfinished: {t} s reached so far"));
    };
    let figure = |name: &str| summary.get(name).and_then(Value::as_f64);
    let (time, end) = (figure("time").or(reached).unwrap_or(f64::NAN), figure("end"));
    let steps = figure("steps").unwrap_or(0.0);
    match summary.get("status").and_then(Value::as_str) {
        Some("failed") => {
            let message =
                summary.get("failure").and_then(|f| f.get("message")?.as_str()).unwrap_or("no reason is recorded");
            findings.push((Grade::Bad, format!("the run failed: {message}")));
            format!("Failed at {time} s after {steps} steps")
        }
        Some("stopped") => {
            let why = summary.get("stopped_because").and_then(Value::as_str).unwrap_or("on request");
            findings.push((Grade::Doubtful, format!("stopped before the end ({why}); it can be resumed")));
            let of = end.map_or(String::new(), |end| format!(" of {end} s"));
            format!("Stopped at {time} s{of} after {steps} steps")
        }
        _ => format!("Completed: {steps} steps to {time} s"),
    }
}

fn steps(run: &RunData, findings: &mut Vec<(Grade, String)>) {
    let figure = |name: &str| run.summary.as_ref()?.get(name)?.as_f64();
    let sum = |name: &str| run.series.column(name).map(|v| v.iter().sum::<f64>());
    let rejected = figure("rejected_steps").or_else(|| sum("rejections"));
    let steps = figure("steps").or_else(|| run.series.column("step")?.last().copied());
    if let (Some(rejected), Some(steps)) = (rejected, steps) {
        let share = rejected / (steps + rejected).max(1.0);
        let grade = if share > REJECTED_SHARE { Grade::Doubtful } else { Grade::Good };
        findings
            .push((grade, format!("{rejected} of {} tried steps rejected ({:.2} %)", steps + rejected, 100.0 * share)));
    }
}

fn defects(run: &RunData, findings: &mut Vec<(Grade, String)>) {
    for (name, value) in run.summary.iter().flatten() {
        let Some(value) = value.as_f64().filter(|_| name.ends_with("defect")) else { continue };
        let (grade, word) = match value.abs() {
            v if v <= ROUND_OFF => (Grade::Good, "round-off"),
            v if v <= TRUNCATION => (Grade::Doubtful, "more than round-off"),
            _ => (Grade::Bad, "the balance is broken"),
        };
        findings.push((grade, format!("{} {value:.1e}: {word}", name.replace('_', " "))));
    }
}

/// Quality gates of a rheometer that are missed or nearly so, and samples that failed.
fn gates(run: &RunData, findings: &mut Vec<(Grade, String)>) {
    let Some(summary) = &run.summary else { return };
    let words = |name: &str| summary.get(name).and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    for (name, grade, word) in
        [("gates_missed", Grade::Bad, "not to be believed"), ("gates_doubtful", Grade::Doubtful, "doubtful")]
    {
        findings.extend(words(name).iter().filter_map(Value::as_str).map(|gate| (grade, format!("{gate}: {word}"))));
    }
    let failed = words("failed_samples").len();
    if failed > 0 {
        findings.push((Grade::Bad, format!("{failed} samples failed and are left out of the means")));
    }
}

fn finite(run: &RunData, shown: &Shown, findings: &mut Vec<(Grade, String)>) {
    for (name, values) in run.series.header.iter().zip(&run.series.columns) {
        if name != "limiter" && values.iter().any(|v| !v.is_finite()) {
            let count = values.iter().filter(|v| !v.is_finite()).count();
            findings.push((Grade::Bad, format!("{name} is not finite in {count} of {} rows", values.len())));
        }
    }
    if shown.left_out > 0 {
        findings.push((Grade::Bad, format!("{} points in the frames are not finite", shown.left_out)));
    }
    if shown.clipped {
        findings.push((
            Grade::Doubtful,
            "the scene grew to more than six times its first size: the pictures do not show all of it".into(),
        ));
    }
    findings.extend(shown.unreadable.iter().map(|what| (Grade::Doubtful, format!("a frame cannot be read: {what}"))));
}
