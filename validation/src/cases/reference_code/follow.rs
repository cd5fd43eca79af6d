//! Imports a scene of the C++ code, runs it and keeps what the recordings keep.

use runner::import::{ImportOptions, import};
use runner::prepare::PrepareError;
use runner::record::frame::{Frame, Topology};
use runner::stepper::Stepper;
use std::path::Path;
use std::time::Instant;

use crate::case::CaseError;

/// A scene that was followed.
#[derive(Default)]
pub struct Followed {
    /// Times, the start included [s].
    pub times: Vec<f64>,
    /// Positions of the strands' points, strand by strand [m].
    pub strands: Vec<StrandPath>,
    /// Lowest particle [m], mean height [m], number: one row a time; empty without liquid.
    pub liquid: Vec<[f64; 3]>,
    /// Steps that were accepted and rejected.
    pub steps: [u64; 2],
    /// Processor seconds of the steps alone.
    pub cpu: f64,
}

/// The points of a strand over time [m].
#[derive(Default)]
pub struct StrandPath {
    /// Last vertex.
    pub tip: Vec<[f64; 3]>,
    /// Vertex in the middle.
    pub mid: Vec<[f64; 3]>,
    /// First vertex.
    pub root: Vec<[f64; 3]>,
    /// Length at the start.
    pub length: f64,
}

/// How a scene is followed.
#[derive(Clone, Copy)]
pub struct How {
    /// As the original computes it.
    pub parity: bool,
    /// Steps per step of the original.
    pub refine: usize,
    /// When to stop [s].
    pub until: f64,
    /// Most steps.
    pub steps: u64,
    /// Whether positions are kept.
    pub keep: bool,
}

/// Why a scene was not followed.
pub enum Refusal {
    /// This version cannot run it, or a file is missing: the case is skipped.
    Skip(String),
    /// Something went wrong.
    Error(CaseError),
}

impl From<CaseError> for Refusal {
    fn from(error: CaseError) -> Refusal {
        Refusal::Error(error)
    }
}

/// Imports and runs a scene on one thread.
///
/// # Errors
/// See [`Refusal`].
pub fn follow(xml: &Path, how: How) -> Result<Followed, Refusal> {
    let options = ImportOptions { parity: how.parity, ..ImportOptions::default() };
    let imported = import(xml, Path::new(""), &options).map_err(|error| CaseError::Failed(error.lines().join("; ")))?;
    if imported.notes.any_missing() {
        return Err(Refusal::Skip(format!("{} names files that are not there", xml.display())));
    }
    let step = {
        let loaded = runner::scene::load_str(&imported.text, xml, &[]).map_err(CaseError::failed)?;
        match loaded.scene.time.step {
            runner::scene::time::StepControl::Fixed(step) => step,
            runner::scene::time::StepControl::Adaptive(adaptive) => adaptive.max,
        }
    };
    #[allow(clippy::cast_precision_loss)]
    let set = format!("time.step=Fixed({:e})", step / how.refine as f64);
    let overrides = if how.refine == 1 { Vec::new() } else { vec![set] };
    let loaded = runner::scene::load_str(&imported.text, xml, &overrides).map_err(CaseError::failed)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(CaseError::failed)?;
    pool.install(|| run(loaded, how))
}

fn run(loaded: runner::scene::LoadedScene, how: How) -> Result<Followed, Refusal> {
    let mut job = match runner::prepare::job(loaded, 1) {
        Ok(job) => job,
        Err(PrepareError::NotThereYet(why)) => return Err(Refusal::Skip(why.to_string())),
        Err(error) => return Err(CaseError::failed(error).into()),
    };
    let end = job.end.min(how.until);
    let mut stepper = Stepper::new(job.control, end);
    let mut followed = Followed::default();
    if how.keep {
        followed.keep(&job.system.frame(0, 0.0), 0.0);
    }
    let mut kept = 0.0;
    let clock = Clock::start();
    while !stepper.done() && stepper.state.step < how.steps {
        stepper
            .advance(job.system.as_mut(), end)
            .map_err(|failure| CaseError::Failed(format!("at {} s: {}", failure.time, failure.rejection)))?;
        if how.keep {
            let before = clock.seconds();
            let time = stepper.state.time;
            followed.keep(&job.system.frame(stepper.state.step, time), time);
            kept += clock.seconds() - before;
        }
    }
    followed.cpu = clock.seconds() - kept;
    followed.steps = [stepper.state.step, stepper.state.rejected];
    Ok(followed)
}

/// Processor time of this thread; the wall clock where the system does not tell.
struct Clock {
    wall: Instant,
    cpu: Option<f64>,
}

impl Clock {
    fn start() -> Clock {
        Clock { wall: Instant::now(), cpu: thread_seconds() }
    }

    fn seconds(&self) -> f64 {
        match (self.cpu, thread_seconds()) {
            (Some(before), Some(now)) => now - before,
            _ => self.wall.elapsed().as_secs_f64(),
        }
    }
}

/// Seconds that this thread has run.
fn thread_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split_whitespace().next()?.parse::<f64>().ok()? * 1e-9)
}

impl Followed {
    fn keep(&mut self, frame: &Frame, time: f64) {
        self.times.push(time);
        for piece in &frame.pieces {
            match &piece.topology {
                Topology::Polylines { offsets } if piece.name == "strands" => {
                    self.strands.resize_with(offsets.len() - 1, StrandPath::default);
                    for (path, range) in self.strands.iter_mut().zip(offsets.windows(2)) {
                        let points = &piece.positions[range[0] as usize..range[1] as usize];
                        if path.length == 0.0 {
                            path.length = points.windows(2).map(|pair| distance(&pair[0], &pair[1])).sum();
                        }
                        path.root.push(points[0]);
                        path.mid.push(points[points.len() / 2]);
                        path.tip.push(points[points.len() - 1]);
                    }
                }
                Topology::Points if matches!(piece.name.as_str(), "particles" | "liquid") => {
                    let heights = || piece.positions.iter().map(|x| x[1]);
                    #[allow(clippy::cast_precision_loss)]
                    let count = piece.positions.len() as f64;
                    let lowest = heights().fold(f64::INFINITY, f64::min);
                    self.liquid.push([lowest, heights().sum::<f64>() / count.max(1.0), count]);
                }
                _ => {}
            }
        }
    }

    /// A value at a time, linear between steps.
    #[must_use]
    pub fn at(&self, values: &[[f64; 3]], time: f64) -> [f64; 3] {
        let next = self.times.partition_point(|t| *t < time).clamp(1, self.times.len().max(2) - 1);
        let (Some(a), Some(b)) = (values.get(next - 1), values.get(next)) else {
            return values.last().copied().unwrap_or([f64::NAN; 3]);
        };
        let w = ((time - self.times[next - 1]) / (self.times[next] - self.times[next - 1])).clamp(0.0, 1.0);
        [0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * w)
    }
}

/// Distance of two points.
#[must_use]
pub fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}
