//! `viscose report DIR…`: a page with plots and pictures, or one picture.

use std::path::{Path, PathBuf};

use clap::Args;
use miette::{IntoDiagnostic, WrapErr};
use runner::picture::{self, PictureOptions};
use runner::record::folder::RunFolder;
use runner::record::frame_files;

use super::Exit;
use crate::out::say;

/// Arguments of `viscose report`.
#[derive(Args)]
pub struct Report {
    /// Folders of runs.
    #[arg(required = true)]
    pub runs: Vec<PathBuf>,
    /// Page to write [default: report.html in the run's folder, or in the working directory for several runs].
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Write one frame of the first run as a PNG picture instead of a page.
    #[arg(long, value_name = "FILE")]
    pub picture: Option<PathBuf>,
    /// Which frame the picture shows [default: the last].
    #[arg(long, requires = "picture")]
    pub frame: Option<u64>,
}

impl Report {
    /// Writes the page or the picture.
    pub fn run(self) -> miette::Result<Exit> {
        if let Some(file) = &self.picture {
            still(&self.runs[0], self.frame, file)?;
            say!("{}", file.display());
            return Ok(Exit::Done);
        }
        let out = self.out.unwrap_or_else(|| match self.runs.as_slice() {
            [single] => single.join("report.html"),
            _ => PathBuf::from("report.html"),
        });
        runner::report::write(&self.runs, &out)?;
        say!("{}", out.display());
        Ok(Exit::Done)
    }
}

fn still(run: &Path, index: Option<u64>, file: &Path) -> miette::Result<()> {
    let folder = RunFolder::at(run).frames();
    let frames = frame_files::list(&folder).into_diagnostic().wrap_err_with(|| folder.display().to_string())?;
    let chosen = match index {
        Some(index) => frames.iter().find(|frame| frame.index == index),
        None => frames.last(),
    };
    let Some(chosen) = chosen else {
        return Err(miette::miette!("{} has {} frames, and not the one asked for", folder.display(), frames.len()));
    };
    let frame = frame_files::load(chosen).into_diagnostic()?;
    let image = picture::still(&frame, &PictureOptions::default());
    let png = image.png().into_diagnostic()?;
    runner::record::folder::write_atomically(file, &png).into_diagnostic()
}
