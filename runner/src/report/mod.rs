//! The page that shows at a glance whether a run is sane: verdict, pictures, plots, tables, in one HTML file without network.
//!
//! ```text
//! DIR/ ─► RunData (what is there, and what is missing) ─► verdict ┐
//!      └► frames ─► stills, animation                             ├─► page.html
//!         series.csv, timings.csv, rheology.json ─► SVG plots ────┘
//! ```
//! Works on unfinished and damaged folders and says what is missing. The same folder gives the same page.

mod base64;
mod data;
mod groups;
mod page;
mod pictures;
mod plot;
mod rheology;
mod verdict;

pub use verdict::{Grade, Verdict};

use std::io;
use std::path::{Path, PathBuf};

use crate::record::folder::write_atomically;
use data::RunData;

/// Why a page could not be written.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum ReportError {
    /// Nothing in the folder is part of a run.
    #[error("{} holds no run", folder.display())]
    #[diagnostic(help("a run's folder has scene.ron, series.csv, frames/ or summary.json"))]
    NotARun {
        /// The folder.
        folder: PathBuf,
    },
    /// The file system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// File concerned.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

/// Writes one page about one run or several to `out`, and returns the verdicts in the same order.
///
/// # Errors
/// When a folder holds no run at all or the page cannot be written. What is missing or damaged within a run is no error: the page says so.
pub fn write(dirs: &[PathBuf], out: &Path) -> Result<Vec<Verdict>, ReportError> {
    let mut sections = Vec::new();
    for dir in dirs {
        let run = RunData::read(dir).map_err(|source| ReportError::Io { path: dir.clone(), source })?;
        if run.is_empty() {
            return Err(ReportError::NotARun { folder: dir.clone() });
        }
        let shown = pictures::of_run(&run, pictures::effort(dirs.len()));
        let verdict = verdict::of_run(&run, &shown);
        sections.push(page::Section { run, shown, verdict });
    }
    let text = page::html(&sections);
    write_atomically(out, text.as_bytes()).map_err(|source| ReportError::Io { path: out.to_owned(), source })?;
    Ok(sections.into_iter().map(|section| section.verdict).collect())
}
