//! `viscose check SCENE`: is this scene sound, and what will it need?

use std::path::PathBuf;

use clap::Args;

use super::Exit;
use crate::out::{say, tell};

/// Arguments of `viscose check`.
#[derive(Args)]
pub struct Check {
    /// Scene files (RON).
    #[arg(required = true)]
    pub scenes: Vec<PathBuf>,
    /// Override a field of the scene, such as `time.end=2`.
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub set: Vec<String>,
}

impl Check {
    /// Checks every scene; all are looked at even when one is bad.
    pub fn run(self) -> miette::Result<Exit> {
        let mut exit = Exit::Done;
        for path in &self.scenes {
            let verdict = runner::scene::load(path, &self.set).map_err(miette::Report::from).and_then(|loaded| {
                let estimate = runner::prepare::estimate(&loaded.scene).map_err(miette::Report::from)?;
                Ok((estimate, runner::overlap::at_start(&loaded.scene).map_err(miette::Report::from)?))
            });
            match verdict {
                Ok((estimate, overlaps)) => {
                    say!("{}: sound; {estimate}", path.display());
                    overlaps.iter().for_each(|overlap| tell!("{}: warning: {overlap}", path.display()));
                }
                Err(report) => {
                    tell!("{report:?}");
                    exit = Exit::BadInput;
                }
            }
        }
        Ok(exit)
    }
}
