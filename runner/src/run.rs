//! One run from its first step to its summary, or from a checkpoint on.
//!
//! ```text
//! open folder ─► (load checkpoint) ─► loop: step ─► row ─► frame? ─► checkpoint? ─► summary.json
//!                                      └─ stop asked, wall limit, failure ─► checkpoint, summary, out
//! ```

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde_json::{Map, Value, json};

use crate::record::checkpoint::{self, Saved};
use crate::record::folder::{RunFolder, write_atomically};
use crate::record::provenance::{Provenance, cpu_seconds, resident_memory};
use crate::record::recorder::{Position, RecordError, RecordSettings, Recorder, io_error};
use crate::stepper::{Accepted, Failure, StepControl, Stepper};
use crate::system::{Rejection, System};

/// A scene made ready: what to step, for how long, and what to write.
pub struct Job {
    /// The system in its initial state.
    pub system: Box<dyn System>,
    /// End of the scene [s].
    pub end: f64,
    /// Step control.
    pub control: StepControl,
    /// Output clocks and formats.
    pub record: RecordSettings,
    /// Text of the scene as run.
    pub scene_text: String,
    /// Hash of everything that decides the result.
    pub scene_hash: u64,
    /// Who runs what.
    pub provenance: Provenance,
}

/// How a run is to be carried out.
#[derive(Clone, Debug, Default)]
pub struct RunOptions {
    /// Folder for the results.
    pub out: PathBuf,
    /// Go on from the newest usable checkpoint in the folder.
    pub resume: bool,
    /// Start from this checkpoint of another run (a branch).
    pub resume_from: Option<PathBuf>,
    /// Overwrite a former run.
    pub force: bool,
    /// Stop, with a checkpoint, at this simulated time [s].
    pub until: Option<f64>,
    /// Stop, with a checkpoint, after this many wall-clock seconds.
    pub wall_limit: Option<f64>,
}

/// What is shown while a run goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Simulated time [s].
    pub time: f64,
    /// End of the scene [s].
    pub end: f64,
    /// Accepted steps.
    pub step: u64,
    /// Last step [s].
    pub dt: f64,
    /// What limited it.
    pub limiter: &'static str,
    /// Solver iterations of the last step.
    pub iterations: usize,
    /// Rejected steps so far.
    pub rejected: u64,
    /// Wall-clock seconds so far.
    pub seconds: f64,
}

/// Watches a run.
pub trait Observer: Send {
    /// After every accepted step.
    fn progress(&mut self, progress: &Progress);
    /// Something a person should know.
    fn note(&mut self, text: &str);
}

/// An observer that says nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Silent;

impl Observer for Silent {
    fn progress(&mut self, _: &Progress) {}
    fn note(&mut self, _: &str) {}
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Ending {
    /// The scene's end was reached.
    Completed,
    /// Stopped on request, by `--until` or by the wall limit; can be resumed.
    Stopped(&'static str),
    /// A step could not be taken.
    Failed(Failure),
}

/// The outcome of a run.
#[derive(Clone, Debug)]
pub struct RunOutcome {
    /// How it ended.
    pub ending: Ending,
    /// Folder with the results.
    pub folder: PathBuf,
    /// Checkpoint or saved state written last.
    pub saved: Option<PathBuf>,
    /// The content of `summary.json`.
    pub summary: Map<String, Value>,
}

/// Why a run could not be started or recorded.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum RunError {
    /// The folder is taken.
    #[error("{folder} already holds a run")]
    #[diagnostic(help("use --resume to go on with it, --force to replace it, or --out to write elsewhere"))]
    Occupied {
        /// The folder.
        folder: PathBuf,
    },
    /// Another process is writing there.
    #[error("another process is running in {folder}")]
    #[diagnostic(help("wait for it to end or stop it, or use --out to write elsewhere"))]
    InUse {
        /// The folder.
        folder: PathBuf,
    },
    /// Nothing there to resume.
    #[error("{folder} holds no run to resume")]
    #[diagnostic(help("leave --resume out to start a new run there"))]
    NothingToResume {
        /// The folder.
        folder: PathBuf,
    },
    /// The record could not be written or read.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The checkpoint is of another kind of system.
    #[error("the checkpoint holds a `{found}` system, the scene is a `{wanted}` system")]
    OtherKind {
        /// Kind in the checkpoint.
        found: String,
        /// Kind of the scene.
        wanted: &'static str,
    },
}

/// How long a run waits for another process to leave its folder: one that was asked to stop finishes its step first.
const PATIENCE: Duration = Duration::from_secs(5);

/// Carries out a run.
///
/// # Errors
/// When it could not be started or recorded. A run whose physics failed is an [`Ending::Failed`], not an error.
pub fn execute(
    job: Job,
    options: &RunOptions,
    observer: &mut dyn Observer,
    stop: &AtomicBool,
) -> Result<RunOutcome, RunError> {
    // A small system spends longer handing its work to other threads than doing it.
    if job.system.is_small()
        && let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads(1).build()
    {
        return pool.install(|| carry_out(job, options, observer, stop));
    }
    // From a thread outside the pool every parallel loop would be handed over and waited for: a sixth of the time of ten thousand particles.
    rayon::scope(|_| carry_out(job, options, observer, stop))
}

fn carry_out(
    mut job: Job,
    options: &RunOptions,
    observer: &mut dyn Observer,
    stop: &AtomicBool,
) -> Result<RunOutcome, RunError> {
    let folder = RunFolder::at(&options.out);
    let mut stepper = Stepper::new(job.control, job.end);
    let start = Instant::now();
    let mut seconds_before = 0.0;
    let mut position = Position { frames: 0, checkpoints: 0, series_bytes: 0, timings_bytes: 0 };
    let mut from_start = true;

    if options.resume && !folder.root().exists() {
        return Err(RunError::NothingToResume { folder: folder.root().to_owned() });
    }
    let taken = folder.take(PATIENCE).map_err(io_error(folder.root().to_owned()))?;
    let Some(_taken) = taken else { return Err(RunError::InUse { folder: folder.root().to_owned() }) };
    // A run may have been killed before it wrote anything, or while it began again: then there is the folder, and nothing in it.
    let begun = folder.holds_a_run() || folder.is_bare();
    if options.resume && options.resume_from.is_none() && begun {
        if checkpoint::list(&folder.checkpoints()).is_empty() {
            observer.note("no checkpoint was written yet: starting again from the beginning");
            folder.clear().map_err(io_error(folder.root().to_owned()))?;
        } else {
            let (path, saved, refused) =
                checkpoint::newest_usable(&folder.checkpoints(), job.scene_hash).map_err(RecordError::from)?;
            for reason in refused {
                observer.note(&format!("refused: {reason}"));
            }
            observer.note(&format!("resuming at {} s from {}", saved.stepper.time, path.display()));
            position.series_bytes = saved.series_bytes;
            position.timings_bytes = saved.timings_bytes;
            adopt(&mut job, &mut stepper, &mut position, &mut seconds_before, saved)?;
            from_start = false;
        }
    } else if options.resume && options.resume_from.is_none() {
        return Err(RunError::NothingToResume { folder: folder.root().to_owned() });
    } else if folder.holds_a_run() {
        if !options.force {
            return Err(RunError::Occupied { folder: folder.root().to_owned() });
        }
        folder.clear().map_err(io_error(folder.root().to_owned()))?;
    }
    if let Some(path) = &options.resume_from {
        let saved = checkpoint::read(path, None).map_err(RecordError::from)?;
        observer.note(&format!("branching at {} s from {}", saved.stepper.time, path.display()));
        adopt(&mut job, &mut stepper, &mut position, &mut seconds_before, saved)?;
        job.provenance.branched_from = Some(path.display().to_string());
        seconds_before = 0.0;
        from_start = false;
    }

    folder.create().map_err(io_error(folder.root().to_owned()))?;
    write_atomically(&folder.scene(), job.scene_text.as_bytes()).map_err(io_error(folder.scene()))?;
    write_json(&folder, folder.provenance(), &json!(job.provenance))?;
    let Job { mut system, record, scene_hash, .. } = job;
    let mut recorder = Recorder::open(folder.clone(), record, scene_hash, system.as_ref(), position)?;
    if from_start {
        recorder.row(&stepper.state, None, system.as_ref(), 0.0)?;
        recorder.frame_if_due(&stepper.state, system.as_ref())?;
    }

    let mut saved_state = None;
    let mut refusals = Refusals::default();
    let until = options.until.unwrap_or(f64::INFINITY);
    let ending = loop {
        if stepper.done() || system.finished() {
            break Ending::Completed;
        }
        if stop.load(Ordering::Relaxed) {
            break Ending::Stopped("stop requested");
        }
        if stepper.state.time >= until * (1.0 - 1e-12) {
            break Ending::Stopped("--until reached");
        }
        if options.wall_limit.is_some_and(|limit| start.elapsed().as_secs_f64() >= limit) {
            break Ending::Stopped("wall limit reached");
        }
        let step_start = Instant::now();
        match stepper.advance(system.as_mut(), recorder.next_time()) {
            Err(failure) => break Ending::Failed(failure),
            Ok(accepted) => {
                refusals.count(&accepted, stepper.state.time);
                recorder.row(&stepper.state, Some(&accepted), system.as_ref(), step_start.elapsed().as_secs_f64())?;
                recorder.frame_if_due(&stepper.state, system.as_ref())?;
                if recorder.checkpoint_due(&stepper.state) {
                    let seconds = seconds_before + start.elapsed().as_secs_f64();
                    saved_state = Some(recorder.checkpoint(&stepper.state, system.as_ref(), seconds)?);
                }
                observer.progress(&Progress {
                    time: stepper.state.time,
                    end: stepper.end(),
                    step: stepper.state.step,
                    dt: accepted.dt,
                    limiter: accepted.limiter,
                    iterations: system.iterations(),
                    rejected: stepper.state.rejected,
                    seconds: start.elapsed().as_secs_f64(),
                });
            }
        }
    };

    refusals.tell(observer);
    let seconds = seconds_before + start.elapsed().as_secs_f64();
    if stepper.state.step > 0 || matches!(ending, Ending::Failed(_)) {
        // where a run ends, another may begin: to resume, to extend it, or to look at what failed, be it the very first step
        saved_state = Some(recorder.checkpoint(&stepper.state, system.as_ref(), seconds)?);
    }
    recorder.finish()?;
    for (name, content) in system.final_files() {
        let path = folder.root().join(name);
        write_atomically(&path, &content).map_err(io_error(path.clone()))?;
    }
    let mut summary = summarise(&ending, &stepper, &recorder, seconds, system.as_ref());
    if let Ending::Failed(failure) = &ending {
        let mut problem = json!({
            "stage": failure.rejection.stage,
            "time": failure.time,
            "dt": failure.dt,
            "message": failure.rejection.to_string(),
        });
        if let Some(path) = &saved_state {
            problem["saved_state"] = json!(path.display().to_string());
        }
        if let Some((name, content)) = system.failing_problem() {
            let path = folder.root().join(name);
            write_atomically(&path, &content).map_err(io_error(path.clone()))?;
            problem["replay"] = json!(path.display().to_string());
        }
        summary.insert("failure".into(), problem);
    }
    write_json(&folder, folder.summary(), &Value::Object(summary.clone()))?;
    Ok(RunOutcome { ending, folder: folder.root().to_owned(), saved: saved_state, summary })
}

/// Why steps were refused and repeated with half the size: how often each stage gave each reason, and its last words.
#[derive(Default)]
struct Refusals(BTreeMap<(&'static str, String), (u64, f64, Rejection)>);

impl Refusals {
    fn count(&mut self, accepted: &Accepted, time: f64) {
        let Some(last) = &accepted.refused else { return };
        let entry = self.0.entry((last.stage, last.reason.to_string())).or_insert_with(|| (0, time, last.clone()));
        *entry = (entry.0 + u64::from(accepted.rejections), time, last.clone());
    }

    fn tell(&self, observer: &mut dyn Observer) {
        for (count, time, last) in self.0.values() {
            observer
                .note(&format!("{count} steps repeated with half their size; the last, before {time:.6} s: {last}"));
        }
    }
}

fn adopt(
    job: &mut Job,
    stepper: &mut Stepper,
    position: &mut Position,
    seconds: &mut f64,
    saved: Saved,
) -> Result<(), RunError> {
    if saved.kind != job.system.kind() {
        return Err(RunError::OtherKind { found: saved.kind, wanted: job.system.kind() });
    }
    job.system.load(&saved.system).map_err(RecordError::from)?;
    stepper.state = saved.stepper;
    position.frames = saved.frames;
    position.checkpoints = saved.checkpoints;
    *seconds = saved.seconds;
    Ok(())
}

fn summarise(
    ending: &Ending,
    stepper: &Stepper,
    recorder: &Recorder,
    seconds: f64,
    system: &dyn System,
) -> Map<String, Value> {
    let mut summary = Map::new();
    let (status, why) = match ending {
        Ending::Completed => ("completed", None),
        Ending::Stopped(why) => ("stopped", Some(*why)),
        Ending::Failed(_) => ("failed", None),
    };
    summary.insert("status".into(), json!(status));
    if let Some(why) = why {
        summary.insert("stopped_because".into(), json!(why));
    }
    summary.insert("system".into(), json!(system.kind()));
    summary.insert("time".into(), json!(stepper.state.time));
    summary.insert("end".into(), json!(stepper.end()));
    summary.insert("steps".into(), json!(stepper.state.step));
    summary.insert("rejected_steps".into(), json!(stepper.state.rejected));
    summary.insert("frames".into(), json!(recorder.frames));
    summary.insert("seconds".into(), json!(seconds));
    if let Some(cpu) = cpu_seconds() {
        summary.insert("cpu_seconds".into(), json!(cpu));
    }
    if let Some(bytes) = resident_memory() {
        summary.insert("memory_bytes".into(), json!(bytes));
    }
    summary.extend(system.summary());
    summary
}

fn write_json(folder: &RunFolder, path: PathBuf, value: &Value) -> Result<(), RunError> {
    let mut text = serde_json::to_string_pretty(value).unwrap_or_else(|_| value.to_string());
    text.push('\n');
    let shown = folder.root().join(path.file_name().unwrap_or_default());
    write_atomically(&path, text.as_bytes()).map_err(io_error(shown))?;
    Ok(())
}
