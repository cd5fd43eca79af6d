//! `viscose run SCENE`: one scene from start to summary.

use std::path::{Path, PathBuf};

use clap::Args;
use miette::{IntoDiagnostic, WrapErr};
use runner::run::{Ending, RunOptions, RunOutcome};

use super::Exit;
use crate::out::{say, tell};
use crate::{progress, stop};

/// Arguments of `viscose run`.
#[derive(Args)]
pub struct Run {
    /// Scene file (RON).
    pub scene: PathBuf,
    /// Folder for the results [default: `out/NAME` for NAME.ron].
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Override a field of the scene, such as `strands[0].radius=0.004`.
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub set: Vec<String>,
    /// Threads to use [default: all cores]. Results do not depend on it.
    #[arg(long)]
    pub threads: Option<usize>,
    /// Go on from the newest usable checkpoint in the folder.
    #[arg(long)]
    pub resume: bool,
    /// Branch: start from this checkpoint of another run; needs --out.
    #[arg(long, value_name = "CHECKPOINT", requires = "out", conflicts_with = "resume")]
    pub resume_from: Option<PathBuf>,
    /// Replace a former run in the folder.
    #[arg(long, conflicts_with = "resume")]
    pub force: bool,
    /// Stop with a checkpoint at this simulated time [s].
    #[arg(long, value_name = "SECONDS")]
    pub until: Option<f64>,
    /// Stop with a checkpoint after this much wall-clock time [s].
    #[arg(long, value_name = "SECONDS")]
    pub wall_limit: Option<f64>,
    /// Solve every so many steps' contact problem again with an independent solver and record the difference.
    #[arg(long, value_name = "STEPS")]
    pub cross_check: Option<u64>,
    /// Write the page with plots and pictures when the run has ended.
    #[arg(long)]
    pub report: bool,
    /// Print progress as JSON lines on standard output.
    #[arg(long)]
    pub json_progress: bool,
    /// Stop with a checkpoint when standard input ends: a batch that is killed takes its runs with it.
    #[arg(long, hide = true)]
    pub stop_with_input: bool,
}

/// The default folder of a scene's results: `out/NAME` for `NAME.ron`.
pub fn default_out(scene: &Path) -> PathBuf {
    PathBuf::from("out").join(scene.file_stem().unwrap_or_default())
}

/// Sets the number of worker threads of the process.
pub fn set_threads(threads: Option<usize>) -> miette::Result<()> {
    if let Some(threads) = threads {
        if threads == 0 {
            return Err(miette::miette!("--threads 0: expected 1 or more"));
        }
        rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().into_diagnostic()?;
    }
    Ok(())
}

impl Run {
    /// Runs the scene.
    pub fn run(self) -> miette::Result<Exit> {
        set_threads(self.threads)?;
        let mut set = self.set;
        set.extend(self.cross_check.map(|every| format!("cross_check={every}")));
        let loaded = runner::scene::load(&self.scene, &set)?;
        for overlap in runner::overlap::at_start(&loaded.scene)? {
            tell!("warning: {overlap}");
        }
        let title = loaded.scene.title.clone();
        let job = runner::prepare::job(loaded, rayon::current_num_threads())?;
        let options = RunOptions {
            out: self.out.unwrap_or_else(|| default_out(&self.scene)),
            resume: self.resume,
            resume_from: self.resume_from,
            force: self.force,
            until: self.until,
            wall_limit: self.wall_limit,
        };
        let outcome = {
            let mut observer = progress::observer(self.json_progress, &title);
            let stop = stop::arm();
            if self.stop_with_input {
                stop::when_input_ends();
            }
            runner::run::execute(job, &options, observer.as_mut(), stop)?
        };
        let page = if self.report { Some(page(&outcome)?) } else { None };
        Ok(tell(&outcome, page.as_deref(), self.json_progress))
    }
}

/// Writes the page of a run that has ended, whichever way.
fn page(outcome: &RunOutcome) -> miette::Result<PathBuf> {
    let page = outcome.folder.join("report.html");
    runner::report::write(std::slice::from_ref(&outcome.folder), &page)?;
    Ok(page)
}

/// Says how a run ended, in a few lines.
fn tell(outcome: &RunOutcome, page: Option<&Path>, json: bool) -> Exit {
    let figure = |name: &str| outcome.summary.get(name).map(ToString::to_string).unwrap_or_default();
    let folder = outcome.folder.display();
    match &outcome.ending {
        Ending::Completed => {
            if !json {
                let shown = match page {
                    Some(page) => format!("open {}", page.display()),
                    None => format!("`viscose report {folder}` shows them"),
                };
                say!(
                    "done: {} steps ({} rejected) in {:.1} s; results in {folder}, {shown}",
                    figure("steps"),
                    figure("rejected_steps"),
                    outcome.summary.get("seconds").and_then(serde_json::Value::as_f64).unwrap_or(0.0),
                );
            }
            Exit::Done
        }
        Ending::Stopped(why) => {
            tell!("stopped at t = {} s ({why}); add --resume to the same command to go on", figure("time"));
            Exit::Done
        }
        Ending::Failed(failure) => {
            tell!("the run failed at t = {} s: {}", failure.time, failure.rejection);
            if outcome.summary.get("rejected_steps").and_then(serde_json::Value::as_u64).unwrap_or(0) > 1 {
                tell!("  the step was halved down to {:.3e} s without success", failure.dt);
            }
            if let Some(path) = &outcome.saved {
                tell!("  the last good state is saved in {}", path.display());
            }
            Exit::Failed
        }
    }
}

/// Reads a JSON file.
pub fn read_json(path: &Path) -> miette::Result<serde_json::Value> {
    let text = std::fs::read_to_string(path).into_diagnostic().wrap_err_with(|| path.display().to_string())?;
    serde_json::from_str(&text).into_diagnostic().wrap_err_with(|| path.display().to_string())
}
