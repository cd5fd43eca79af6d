//! `viscose report DIR…`: a page with plots and pictures.

use std::path::PathBuf;

use clap::Args;

use super::Exit;

/// Arguments of `viscose report`.
#[derive(Args)]
pub struct Report {
    /// Folders of runs.
    #[arg(required = true)]
    pub runs: Vec<PathBuf>,
    /// Page to write [default: report.html in the run's folder, or in the working directory for several runs].
    #[arg(long)]
    pub out: Option<PathBuf>,
}

impl Report {
    /// Writes the page.
    pub fn run(self) -> miette::Result<Exit> {
        let out = self.out.unwrap_or_else(|| match self.runs.as_slice() {
            [single] => single.join("report.html"),
            _ => PathBuf::from("report.html"),
        });
        runner::report::write(&self.runs, &out)?;
        println!("{}", out.display());
        Ok(Exit::Done)
    }
}
