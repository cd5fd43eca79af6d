//! Writes a run as it happens: rows, frames on their clock, checkpoints on their own.

use std::io;
use std::path::PathBuf;

use super::checkpoint::{self, CheckpointError, Saved};
use super::clock::Clock;
use super::folder::RunFolder;
use super::provenance::resident_memory;
use super::series::{CsvTable, push_number};
use super::{ply, vtk};
use crate::stepper::{Accepted, StepperState};
use crate::system::{StateError, System};

/// What a scene asks to be written, and when.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordSettings {
    /// When frames are due.
    pub frames: Clock,
    /// Write VTK files.
    pub vtk: bool,
    /// Write PLY files.
    pub ply: bool,
    /// When checkpoints are due.
    pub checkpoints: Clock,
    /// How many checkpoints stay.
    pub keep: usize,
    /// A row of the series every so many steps.
    pub series_every: u64,
}

/// Why something could not be recorded.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file system refused.
    #[error("{path}: {source}")]
    Io {
        /// File concerned.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A checkpoint could not be written or used.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// The state could not be turned into bytes or back.
    #[error(transparent)]
    State(#[from] StateError),
}

/// The open files of a run.
#[derive(Debug)]
pub struct Recorder {
    folder: RunFolder,
    settings: RecordSettings,
    scene_hash: u64,
    series: CsvTable,
    timings: CsvTable,
    /// Frame ticks taken so far.
    pub frames: u64,
    /// Checkpoint ticks taken so far.
    pub checkpoints: u64,
    stages: Vec<&'static str>,
    values: Vec<f64>,
    line: String,
}

/// Where the files of a run stand when it goes on from a checkpoint.
#[derive(Clone, Copy, Debug)]
pub struct Position {
    /// Frame ticks taken.
    pub frames: u64,
    /// Checkpoint ticks taken.
    pub checkpoints: u64,
    /// Length of `series.csv`; zero starts a new file.
    pub series_bytes: u64,
    /// Length of `timings.csv`; zero starts a new file.
    pub timings_bytes: u64,
}

impl Recorder {
    /// Opens the files of a run, new ones or where a checkpoint left them.
    ///
    /// # Errors
    /// When a file cannot be opened.
    pub fn open(
        folder: RunFolder,
        settings: RecordSettings,
        scene_hash: u64,
        system: &dyn System,
        position: Position,
    ) -> Result<Recorder, RecordError> {
        let stages: Vec<&'static str> = system.stage_seconds().iter().map(|(name, _)| *name).collect();
        let series = if position.series_bytes > 0 {
            CsvTable::reopen(&folder.series(), position.series_bytes)
        } else {
            let own = ["step", "time", "dt", "limiter", "rejections", "iterations"].map(String::from);
            let header: Vec<String> =
                own.into_iter().chain(system.columns().into_iter().map(|column| column.name)).collect();
            CsvTable::create(&folder.series(), &header)
        };
        let series = series.map_err(io_error(folder.series()))?;
        let timings = if position.timings_bytes > 0 {
            CsvTable::reopen(&folder.timings(), position.timings_bytes)
        } else {
            let mut header: Vec<String> = vec!["step".into(), "seconds".into(), "memory_bytes".into()];
            header.extend(stages.iter().map(|name| format!("{name}_seconds")));
            CsvTable::create(&folder.timings(), &header)
        };
        let timings = timings.map_err(io_error(folder.timings()))?;
        let Position { frames, checkpoints, .. } = position;
        let (values, line) = (Vec::new(), String::new());
        Ok(Recorder { folder, settings, scene_hash, series, timings, frames, checkpoints, stages, values, line })
    }

    /// The moment at which the next frame or checkpoint is due [s].
    #[must_use]
    pub fn next_time(&self) -> f64 {
        let frame = self.settings.frames.next_time(self.frames);
        // a step is cut short for a frame, never for a checkpoint: those must not change the physics
        frame.max(0.0)
    }

    /// Appends the row of an accepted step (or of the start) and its clock figures.
    ///
    /// # Errors
    /// When the files cannot be written.
    pub fn row(
        &mut self,
        state: &StepperState,
        accepted: Option<&Accepted>,
        system: &dyn System,
        seconds: f64,
    ) -> Result<(), RecordError> {
        if !state.step.is_multiple_of(self.settings.series_every.max(1)) {
            return Ok(());
        }
        use std::fmt::Write as _;
        self.values.clear();
        system.row(&mut self.values);
        let line = &mut self.line;
        line.clear();
        let (dt, limiter, rejections) = accepted.map_or((0.0, "start", 0), |a| (a.dt, a.limiter, a.rejections));
        let _ = write!(line, "{},", state.step);
        push_number(line, state.time);
        line.push(',');
        push_number(line, dt);
        let _ = write!(line, ",{limiter},{rejections},{}", system.iterations());
        for value in &self.values {
            line.push(',');
            push_number(line, *value);
        }
        self.series.line(line).map_err(io_error(self.folder.series()))?;
        line.clear();
        let _ = write!(line, "{},{seconds:.6},{}", state.step, resident_memory().unwrap_or(0));
        let spent = system.stage_seconds();
        for name in &self.stages {
            let seconds = spent.iter().find(|(stage, _)| stage == name).map_or(0.0, |(_, seconds)| *seconds);
            let _ = write!(line, ",{seconds:.9}");
        }
        self.timings.line(line).map_err(io_error(self.folder.timings()))
    }

    /// Writes a frame if one is due. Returns whether it did.
    ///
    /// # Errors
    /// When the files cannot be written.
    pub fn frame_if_due(&mut self, state: &StepperState, system: &dyn System) -> Result<bool, RecordError> {
        if !self.settings.frames.due(self.frames, state.time, state.step) {
            return Ok(false);
        }
        let index = self.settings.frames.ticks_after(self.frames, state.time, state.step) - 1;
        let frame = system.frame(state.step, state.time);
        let folder = self.folder.frames();
        if self.settings.vtk {
            vtk::write_frame(&folder, index, &frame).map_err(io_error(folder.clone()))?;
        }
        if self.settings.ply {
            ply::write_frame(&folder, index, &frame).map_err(io_error(folder.clone()))?;
        }
        self.frames = index + 1;
        self.series.flush().and_then(|()| self.timings.flush()).map_err(io_error(self.folder.series()))?;
        Ok(true)
    }

    /// Whether a checkpoint is due.
    #[must_use]
    pub fn checkpoint_due(&self, state: &StepperState) -> bool {
        // the tick at time zero would only save the scene itself
        state.step > 0 && self.settings.checkpoints.due(self.checkpoints.max(1), state.time, state.step)
    }

    /// Writes a checkpoint now and prunes old ones.
    ///
    /// # Errors
    /// When the state cannot be saved.
    pub fn checkpoint(
        &mut self,
        state: &StepperState,
        system: &dyn System,
        seconds: f64,
    ) -> Result<PathBuf, RecordError> {
        self.series.sync().map_err(io_error(self.folder.series()))?;
        self.timings.sync().map_err(io_error(self.folder.timings()))?;
        let ticks = self.settings.checkpoints.ticks_after(self.checkpoints.max(1), state.time, state.step);
        self.checkpoints = ticks;
        let saved = Saved {
            kind: system.kind().to_owned(),
            stepper: state.clone(),
            frames: self.frames,
            checkpoints: ticks,
            series_bytes: self.series.length(),
            timings_bytes: self.timings.length(),
            seconds,
            system: system.save()?,
        };
        let path = checkpoint::path_of(&self.folder.checkpoints(), state.step);
        checkpoint::write(&path, self.scene_hash, &saved)?;
        checkpoint::prune(&self.folder.checkpoints(), self.settings.keep);
        Ok(path)
    }

    /// Completes the files.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn finish(&mut self) -> Result<(), RecordError> {
        self.series.sync().map_err(io_error(self.folder.series()))?;
        self.timings.sync().map_err(io_error(self.folder.timings()))
    }
}

pub(crate) fn io_error(path: PathBuf) -> impl FnOnce(io::Error) -> RecordError {
    move |source| RecordError::Io { path, source }
}
