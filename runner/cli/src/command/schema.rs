//! `viscose schema`: the reference of every scene field, generated from the code.

use clap::Args;

use super::Exit;
use crate::out::{say, say_on};

/// Arguments of `viscose schema`.
#[derive(Args)]
pub struct Schema {
    /// Print a JSON Schema instead of the Markdown page.
    #[arg(long)]
    pub json: bool,
}

impl Schema {
    /// Prints the reference.
    pub fn run(self) -> miette::Result<Exit> {
        if self.json {
            say!("{:#}", runner::scene::reference::json_schema());
        } else {
            say_on!("{}", runner::scene::reference::markdown());
        }
        Ok(Exit::Done)
    }
}
