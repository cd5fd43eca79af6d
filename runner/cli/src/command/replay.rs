//! `viscose replay FILE`: tries again what a run could not do, without touching its folder.
//!
//! A dumped contact problem is given to every solver; from a checkpoint (the state a failed run saved) the next steps are taken
//! again and told one by one, with other settings if wanted.

use std::path::{Path, PathBuf};

use clap::Args;
use miette::IntoDiagnostic;
use runner::record::checkpoint;
use runner::run::RunError;
use runner::stepper::Stepper;

use super::Exit;
use crate::out::say;

/// Arguments of `viscose replay`.
#[derive(Args)]
pub struct Replay {
    /// A checkpoint of a run (`checkpoints/*.vck`), `unsolved-contact.ron`, or any file that `viscose contact` reads.
    pub file: PathBuf,
    /// Scene of the checkpoint [default: `scene.ron` of its run].
    #[arg(long)]
    pub scene: Option<PathBuf>,
    /// Override a field of the scene, to see whether the step goes through with it.
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub set: Vec<String>,
    /// Steps to take from a checkpoint.
    #[arg(long, default_value_t = 1)]
    pub steps: u64,
}

impl Replay {
    /// Solves or steps again.
    pub fn run(self) -> miette::Result<Exit> {
        if self.file.extension().is_some_and(|extension| extension == "vck") {
            return self.steps_again();
        }
        super::contact::replay(&self.file)
    }

    fn steps_again(&self) -> miette::Result<Exit> {
        let saved = checkpoint::read(&self.file, None).into_diagnostic()?;
        let loaded = runner::scene::load(&self.scene_file()?, &self.set)?;
        let mut job = runner::prepare::job(loaded, rayon::current_num_threads())?;
        if saved.kind != job.system.kind() {
            return Err(RunError::OtherKind { found: saved.kind, wanted: job.system.kind() }.into());
        }
        job.system.load(&saved.system).into_diagnostic()?;
        let mut stepper = Stepper::new(job.control, job.end);
        stepper.state = saved.stepper;
        say!("{}: step {}, t = {} s", self.file.display(), stepper.state.step, stepper.state.time);
        for _ in 0..self.steps {
            if stepper.done() {
                say!("the end of the scene is reached");
                break;
            }
            match stepper.advance(job.system.as_mut(), f64::INFINITY) {
                Ok(step) => {
                    say!(
                        "step {}: dt = {:.4e} s ({}), t = {} s, {} iterations, {} rejections",
                        stepper.state.step,
                        step.dt,
                        step.limiter,
                        stepper.state.time,
                        job.system.iterations(),
                        step.rejections
                    );
                    for (stage, seconds) in job.system.stage_seconds() {
                        say!("  {stage:18} {seconds:.6} s");
                    }
                }
                Err(failure) => {
                    say!("refused down to dt = {:.4e} s: {}", failure.dt, failure.rejection);
                    return Ok(Exit::Failed);
                }
            }
        }
        Ok(Exit::Done)
    }

    fn scene_file(&self) -> miette::Result<PathBuf> {
        if let Some(scene) = &self.scene {
            return Ok(scene.clone());
        }
        let beside = self.file.parent().and_then(Path::parent).map(|run| run.join("scene.ron")).filter(|f| f.exists());
        beside.ok_or_else(|| {
            miette::miette!(
                help = "name it with --scene FILE",
                "no scene.ron beside {}: a checkpoint alone does not say what scene it is of",
                self.file.display()
            )
        })
    }
}
