//! `viscose import FILE.xml`: a scene of the C++ reference code as a scene of ours.

use std::path::{Path, PathBuf};

use clap::Args;
use miette::{IntoDiagnostic, WrapErr};
use runner::import::{ImportOptions, import};

use super::Exit;
use crate::out::{say, say_on, tell};

/// Arguments of `viscose import`.
#[derive(Args)]
pub struct Import {
    /// Scene of the C++ reference code (XML).
    pub file: PathBuf,
    /// Where the scene goes; `-` prints it [default: `NAME.ron` in this folder, for NAME.xml].
    #[arg(long, value_name = "SCENE.ron")]
    pub out: Option<PathBuf>,
    /// Replace a scene that is there already.
    #[arg(long)]
    pub force: bool,
    /// Folder in which files that the scene names are looked for first.
    #[arg(long, value_name = "DIR")]
    pub assets: Vec<PathBuf>,
    /// As the original computes it, for comparison: scripts replayed step by step, film laws as printed, its flow map.
    #[arg(long)]
    pub parity: bool,
}

impl Import {
    /// Imports the scene; exit code 1 where it is written but a file that it needs is missing.
    pub fn run(self) -> miette::Result<Exit> {
        let out =
            self.out.unwrap_or_else(|| Path::new(self.file.file_name().unwrap_or_default()).with_extension("ron"));
        let prints = out.as_os_str() == "-";
        if !prints && out.exists() && !self.force {
            return Err(miette::miette!(
                help = "give another name with --out, or replace it with --force",
                "{} is there already",
                out.display()
            ));
        }
        let folder = if prints { PathBuf::new() } else { out.parent().map(Path::to_owned).unwrap_or_default() };
        let imported = import(&self.file, &folder, &ImportOptions { assets: self.assets, parity: self.parity })?;
        if prints {
            say_on!("{}", imported.text);
            tell!("{}", imported.notes.text().trim_end());
        } else {
            std::fs::write(&out, &imported.text).into_diagnostic().wrap_err_with(|| out.display().to_string())?;
            say_on!("{}", imported.notes.text());
            say!("{}: {}", out.display(), imported.notes.counts());
        }
        if imported.notes.any_missing() {
            tell!("the scene does not load before the missing files are there");
            return Ok(Exit::Failed);
        }
        Ok(Exit::Done)
    }
}
