//! The subcommands, one file each.

mod batch;
mod check;
mod contact;
mod fit;
mod import;
mod material;
mod plan;
mod replay;
mod report;
mod run;
mod schema;
mod validate;

use std::process::ExitCode;

use clap::Subcommand;

/// What to do.
#[derive(Subcommand)]
pub enum Command {
    /// Run a scene.
    Run(run::Run),
    /// Run many scenes: failures stay isolated, what is done is skipped, what was cut short goes on.
    Batch(batch::Batch),
    /// Check a scene without running it: fields, ranges, files, memory and disk needed.
    Check(check::Check),
    /// Show the stages a scene needs, why, and what they will cost.
    Plan(plan::Plan),
    /// Run validation cases against their references.
    Validate(validate::Validate),
    /// Turn a scene of the C++ reference code (XML) into a scene of ours.
    Import(import::Import),
    /// Solve one saved contact problem.
    Contact(contact::Contact),
    /// Try again what a run could not do: a saved state or a contact problem.
    Replay(replay::Replay),
    /// Write a page with plots and pictures of one or more runs.
    Report(report::Report),
    /// Show a liquid in numbers, with its flow curve.
    Material(material::Material),
    /// Fit yield stress, consistency and index to rheometer data.
    Fit(fit::Fit),
    /// Print the reference of every scene field, as Markdown or as a JSON Schema.
    Schema(schema::Schema),
}

/// How a command ended when its input was sound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// All done.
    Done,
    /// A run or a case failed; its state is saved.
    Failed,
    /// The input cannot be used.
    BadInput,
}

impl Exit {
    /// The process exit code: 0, 1 or 2.
    pub fn code(self) -> ExitCode {
        ExitCode::from(match self {
            Exit::Done => 0,
            Exit::Failed => 1,
            Exit::BadInput => 2,
        })
    }
}

impl Command {
    /// Runs the command. An error is bad input (exit code 2).
    pub fn run(self) -> miette::Result<Exit> {
        match self {
            Command::Run(command) => command.run(),
            Command::Batch(command) => command.run(),
            Command::Check(command) => command.run(),
            Command::Plan(command) => command.run(),
            Command::Validate(command) => command.run(),
            Command::Import(command) => command.run(),
            Command::Contact(command) => command.run(),
            Command::Replay(command) => command.run(),
            Command::Report(command) => command.run(),
            Command::Material(command) => command.run(),
            Command::Fit(command) => command.run(),
            Command::Schema(command) => command.run(),
        }
    }
}
