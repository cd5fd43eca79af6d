//! Runs a scene in a folder of its own and hands over what it recorded.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use runner::record::frame_files;
use runner::run::{Ending, RunOptions, Silent};
use serde_json::{Map, Value};

use crate::case::{CaseError, Params};

/// A scene that was run.
pub struct SceneRun {
    /// How it ended.
    pub ending: Ending,
    /// The content of `summary.json`.
    pub summary: Map<String, Value>,
    /// The content of `series.csv`.
    pub series: Series,
    folder: tempfile::TempDir,
}

/// The columns of a series; the limiter is left out.
pub struct Series {
    columns: BTreeMap<String, Vec<f64>>,
}

impl SceneRun {
    /// Runs a scene given as text; `name` is for messages.
    ///
    /// # Errors
    /// When the scene is refused or the record cannot be written. A run that failed is no error here.
    pub fn of(text: &str, name: &str, overrides: &[String]) -> Result<SceneRun, CaseError> {
        let folder = tempfile::tempdir().map_err(CaseError::failed)?;
        let loaded = runner::scene::load_str(text, name, overrides).map_err(CaseError::failed)?;
        let job = runner::prepare::job(loaded, rayon::current_num_threads()).map_err(CaseError::failed)?;
        let options = RunOptions { out: folder.path().join("run"), ..RunOptions::default() };
        let outcome =
            runner::run::execute(job, &options, &mut Silent, &AtomicBool::new(false)).map_err(CaseError::failed)?;
        let series = Series::read(&outcome.folder.join("series.csv"))?;
        Ok(SceneRun { ending: outcome.ending, summary: outcome.summary, series, folder })
    }

    /// Runs a hard scene with the override of its case.
    ///
    /// # Errors
    /// As [`SceneRun::of`].
    pub fn hard(text: &str, name: &str, params: &Params) -> Result<SceneRun, CaseError> {
        let set = params.text("set")?;
        let overrides: Vec<String> = if set.is_empty() { Vec::new() } else { vec![set.to_owned()] };
        SceneRun::of(text, name, &overrides)
    }

    /// One if the run came to its end.
    #[must_use]
    pub fn completed(&self) -> f64 {
        f64::from(u8::from(self.ending == Ending::Completed))
    }

    /// A figure of the summary.
    #[must_use]
    pub fn figure(&self, name: &str) -> f64 {
        self.summary.get(name).and_then(Value::as_f64).unwrap_or(f64::NAN)
    }

    /// Times and positions of a piece in every frame, in order.
    ///
    /// # Errors
    /// When a frame cannot be read.
    pub fn frames(&self, piece: &str) -> Result<Vec<(f64, Vec<[f64; 3]>)>, CaseError> {
        let folder: PathBuf = self.folder.path().join("run/frames");
        let mut found = Vec::new();
        for files in frame_files::list(&folder).map_err(CaseError::failed)? {
            let frame = frame_files::load(&files).map_err(CaseError::failed)?;
            let time = frame.time;
            found.extend(frame.pieces.into_iter().filter(|p| p.name == piece).map(|p| (time, p.positions)));
        }
        Ok(found)
    }
}

impl Series {
    fn read(path: &std::path::Path) -> Result<Series, CaseError> {
        let text = std::fs::read_to_string(path).map_err(CaseError::failed)?;
        let mut lines = text.lines();
        let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
        let mut columns: BTreeMap<String, Vec<f64>> =
            header.iter().filter(|name| **name != "limiter").map(|name| ((*name).to_owned(), Vec::new())).collect();
        for line in lines {
            for (name, value) in header.iter().zip(line.split(',')) {
                if let Some(column) = columns.get_mut(*name) {
                    column.push(value.parse().map_err(CaseError::failed)?);
                }
            }
        }
        Ok(Series { columns })
    }

    /// A column.
    ///
    /// # Errors
    /// When there is none of that name.
    pub fn column(&self, name: &str) -> Result<&[f64], CaseError> {
        self.columns
            .get(name)
            .map(Vec::as_slice)
            .ok_or_else(|| CaseError::Failed(format!("the series has no column `{name}`")))
    }

    /// The three columns of a vector, row by row.
    ///
    /// # Errors
    /// When one is missing.
    pub fn vector(&self, name: &str) -> Result<Vec<[f64; 3]>, CaseError> {
        let (x, y, z) = (
            self.column(&format!("{name}_x"))?,
            self.column(&format!("{name}_y"))?,
            self.column(&format!("{name}_z"))?,
        );
        Ok(x.iter().zip(y).zip(z).map(|((x, y), z)| [*x, *y, *z]).collect())
    }

    /// Whether every value is finite.
    #[must_use]
    pub fn all_finite(&self) -> bool {
        self.columns.values().flatten().all(|value| value.is_finite())
    }

    /// Largest growth of a column from one row to the next, relative to its largest magnitude.
    ///
    /// # Errors
    /// When there is no such column.
    pub fn largest_growth(&self, name: &str) -> Result<f64, CaseError> {
        let column = self.column(name)?;
        let scale = column.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let growth = column.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
        Ok(if scale > 0.0 { growth / scale } else { 0.0 })
    }
}
