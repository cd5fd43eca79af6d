//! From a loaded scene to a job: the system built, the clocks set, the size known.

use std::fmt;

use crate::microgel::{self, MicrogelSystem};
use crate::plan::{NotThereYet, Plan};
use crate::record::clock::Clock;
use crate::record::provenance::{self, Provenance};
use crate::record::recorder::RecordSettings;
use crate::run::Job;
use crate::scene::expand::{StrandGeometry, expand};
use crate::scene::microgel::Microgel;
use crate::scene::output::{Clock as SceneClock, Format};
use crate::scene::time::StepControl as SceneStep;
use crate::scene::{LoadedScene, Problem, Scene, SceneError};
use crate::stepper::StepControl;
use crate::system::System;
use crate::world::liquid::estimate::{LiquidEstimate, estimate as liquid_estimate};
use crate::world::{BuildError, World};

/// Why a sound scene cannot be run.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum PrepareError {
    /// It needs what is not built yet.
    #[error(transparent)]
    #[diagnostic(transparent)]
    NotThereYet(#[from] NotThereYet),
    /// Its strands cannot be made.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Scene(#[from] SceneError),
    /// A part of its world cannot be built.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Build(#[from] BuildError),
    /// Its yarns cannot be made.
    #[error("yarn: {0}")]
    Yarn(#[from] crate::yarn::SettingsError),
    /// Its sample of grains cannot be made.
    #[error("the sample of grains cannot be made: {0}")]
    Grains(#[from] granular::GranularError),
}

impl From<Problem> for PrepareError {
    fn from(problem: Problem) -> PrepareError {
        PrepareError::Scene(SceneError::new("", vec![problem]))
    }
}

/// Makes a scene ready to run with `threads` threads.
///
/// # Errors
/// When the scene needs something that is missing, or a part of it cannot be built.
pub fn job(loaded: LoadedScene, threads: usize) -> Result<Job, PrepareError> {
    let LoadedScene { scene, text, name, files, hash, .. } = loaded;
    let plan = Plan::for_scene(&scene)?;
    let (version, commit) = provenance::version();
    let provenance = Provenance {
        version,
        commit,
        title: scene.title.clone(),
        scene_file: name,
        included_files: files.iter().skip(1).map(|path| path.display().to_string()).collect(),
        scene_hash: hash.clone(),
        overrides: Vec::new(),
        seed: scene.seed,
        threads,
        cpu: provenance::cpu_name(),
        platform: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
        branched_from: None,
    };
    let system: Box<dyn System> = match (&scene.microgel, &scene.yarn) {
        (_, Some(yarns)) => crate::yarn::system(&scene, yarns)?,
        (Some(grains), None) => {
            Box::new(MicrogelSystem::new(&microgel::settings(&scene, grains)?, grains.record_every)?)
        }
        (None, None) => Box::new(World::build(&scene, &plan, &expand(&scene)?)?),
    };
    Ok(Job {
        system,
        end: end(&scene),
        control: step_control(&scene),
        record: record_settings(&scene),
        scene_text: text,
        scene_hash: hash_number(&hash),
        provenance,
    })
}

fn hash_number(hash: &str) -> u64 {
    u64::from_str_radix(hash.get(..16).unwrap_or(hash), 16)
        .unwrap_or_else(|_| hash.bytes().fold(0, |sum, byte| sum.rotate_left(8) ^ u64::from(byte)))
}

/// When a scene ends [s].
fn end(scene: &Scene) -> f64 {
    microgel::schedule_of(scene).map_or(scene.time.end, |schedule| schedule.end)
}

/// Step control of a scene.
#[must_use]
pub fn step_control(scene: &Scene) -> StepControl {
    if scene.microgel.is_some() {
        return StepControl::Own;
    }
    match &scene.time.step {
        SceneStep::Fixed(step) => StepControl::Fixed(*step),
        SceneStep::Adaptive(adaptive) => {
            StepControl::Adaptive { max: adaptive.max, min: adaptive.min.unwrap_or(adaptive.max * 1e-6), safety: 1.0 }
        }
    }
}

/// Output clocks of a scene.
#[must_use]
pub fn record_settings(scene: &Scene) -> RecordSettings {
    let output = &scene.output;
    let clock = |clock: &SceneClock| match clock {
        SceneClock::Every(interval) => Clock::Every(*interval),
        SceneClock::Steps(steps) => Clock::Steps(*steps),
        SceneClock::At(times) => Clock::At(times.clone()),
        SceneClock::Count(count) => Clock::Every(end(scene) / *count as f64),
        SceneClock::Never => Clock::Never,
    };
    let series_every = match &output.series {
        SceneClock::Steps(steps) => *steps,
        _ => 1,
    };
    RecordSettings {
        frames: clock(&output.frames),
        vtk: output.formats.contains(&Format::Vtk),
        ply: output.formats.contains(&Format::Ply),
        checkpoints: clock(&output.checkpoint),
        keep: output.keep,
        series_every,
    }
}

/// What a run will need.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Strands.
    pub strands: usize,
    /// Vertices of all strands.
    pub vertices: usize,
    /// Yarns.
    pub yarns: usize,
    /// Grains of one sample.
    pub grains: usize,
    /// Samples of grains.
    pub samples: usize,
    /// Bulk liquid.
    pub liquid: Option<LiquidEstimate>,
    /// Memory while running [bytes].
    pub memory: f64,
    /// Frames, where the clock tells before the run.
    pub frames: Option<u64>,
    /// Disk for frames and checkpoints [bytes], where it can be told.
    pub disk: Option<f64>,
    /// Steps at the largest step, at least.
    pub steps: f64,
}

/// What a run of this scene will need, without building its world.
///
/// # Errors
/// When the scene needs something that is missing, or its strands cannot be made.
pub fn estimate(scene: &Scene) -> Result<Estimate, PrepareError> {
    Plan::for_scene(scene)?;
    if let Some(grains) = &scene.microgel {
        return Ok(estimate_grains(scene, grains, &microgel::Schedule::new(&microgel::settings(scene, grains)?)));
    }
    if let Some(section) = &scene.yarn {
        return estimate_yarns(scene, section);
    }
    let strands = expand(scene)?;
    let vertices: usize = strands.iter().map(|strand: &StrandGeometry| strand.positions.len()).sum();
    let record = record_settings(scene);
    let frames = record.frames.count(scene.time.end);
    // per vertex and frame: positions and about fifteen numbers of fields in VTK, six in PLY
    let per_vertex = if record.vtk { 150.0 } else { 0.0 } + if record.ply { 60.0 } else { 0.0 };
    let liquid = liquid_estimate(scene);
    let [vtk, ply, saved] = liquid.map_or([0.0; 3], |liquid| liquid.stored);
    let in_frame = if record.vtk { vtk } else { 0.0 } + if record.ply { ply } else { 0.0 };
    let frame_bytes = vertices as f64 * per_vertex + in_frame;
    let checkpoint_bytes = (vertices as f64 * 250.0 + saved) * record.keep as f64;
    let step = match step_control(scene) {
        StepControl::Fixed(step) => step,
        StepControl::Adaptive { max, .. } => max,
        StepControl::Own => scene.time.end,
    };
    Ok(Estimate {
        strands: strands.len(),
        vertices,
        yarns: 0,
        grains: 0,
        samples: 0,
        liquid,
        memory: vertices as f64 * crate::scene::expand::BYTES_PER_VERTEX + liquid.map_or(0.0, |liquid| liquid.memory),
        frames,
        disk: frames.map(|frames| frames as f64 * frame_bytes + checkpoint_bytes),
        steps: scene.time.end / step,
    })
}

fn estimate_yarns(scene: &Scene, section: &crate::scene::yarn::Yarns) -> Result<Estimate, PrepareError> {
    let settings = crate::yarn::settings(scene, section)?;
    let sizes = crate::yarn::group_sizes(&settings);
    let (yarns, vertices) = sizes.iter().fold((0.0, 0.0), |sum, size| (sum.0 + size.0, sum.1 + size.1));
    let record = record_settings(scene);
    let frames = record.frames.count(scene.time.end);
    // per vertex and frame: fourteen numbers of eight bytes, and the connectivity
    let per_vertex = if record.vtk { 140.0 } else { 0.0 } + if record.ply { 125.0 } else { 0.0 };
    let numbers = if settings.dimension == 2 { 17.0 } else { 34.0 };
    let checkpoint_bytes = vertices * 8.0 * numbers * record.keep as f64;
    let step = match step_control(scene) {
        StepControl::Fixed(step) => step,
        StepControl::Adaptive { max, .. } => max,
        StepControl::Own => scene.time.end,
    };
    Ok(Estimate {
        strands: 0,
        vertices: vertices as usize,
        yarns: yarns as usize,
        grains: 0,
        samples: 0,
        liquid: None,
        memory: vertices * crate::yarn::BYTES_PER_VERTEX,
        frames,
        disk: frames.map(|frames| frames as f64 * vertices * per_vertex + checkpoint_bytes),
        steps: scene.time.end / step,
    })
}

fn estimate_grains(scene: &Scene, grains: &Microgel, schedule: &microgel::Schedule) -> Estimate {
    let record = record_settings(scene);
    let frames = record.frames.count(schedule.end);
    let (count, samples) = (grains.grains as f64, f64::from(grains.seeds));
    let measured = (schedule.steps - schedule.prepared) as f64;
    let rows = measured / grains.record_every as f64;
    // a grain has about twenty numbers of its own and three contacts with ten
    let per_grain = if record.vtk { 500.0 } else { 0.0 } + if record.ply { 250.0 } else { 0.0 };
    let memory = microgel::memory(count, samples, measured, rows);
    // the table has 42 columns of about twenty characters
    let tables = rows * 42.0 * 20.0;
    Estimate {
        strands: 0,
        vertices: 0,
        yarns: 0,
        grains: grains.grains,
        samples: grains.seeds as usize,
        liquid: None,
        memory,
        frames,
        disk: frames.map(|frames| frames as f64 * count * per_grain + memory * record.keep as f64 + tables),
        steps: schedule.steps as f64,
    }
}

impl fmt::Display for Estimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        use crate::scene::expand::show_bytes;
        if self.samples > 0 {
            write!(f, "{} grains, {} sample{}", self.grains, self.samples, if self.samples == 1 { "" } else { "s" })?;
        } else if self.yarns > 0 {
            write!(f, "{} yarns, about {} vertices", self.yarns, self.vertices)?;
        } else if self.strands > 0 || self.liquid.is_none() {
            write!(f, "{} strands, {} vertices", self.strands, self.vertices)?;
        }
        if let Some(liquid) = &self.liquid {
            let also = if self.strands > 0 { ", " } else { "" };
            write!(f, "{also}about {:.0} particles in {:.0} cells", liquid.particles, liquid.cells)?;
            if liquid.particles > liquid.at_start {
                write!(f, " ({:.0} at the start)", liquid.at_start)?;
            }
        }
        let least = if self.samples > 0 { "" } else { "at least " };
        write!(f, "; {least}{:.0} steps; memory about {}", self.steps, show_bytes(self.memory))?;
        match (self.frames, self.disk) {
            (Some(frames), Some(disk)) => write!(f, "; {frames} frames, disk about {}", show_bytes(disk)),
            _ => Ok(()),
        }
    }
}
