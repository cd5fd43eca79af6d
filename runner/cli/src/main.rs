//! `viscose`: simulates strands, shear-dependent liquids, yarns and microgels from scene files.
//!
//! One file per subcommand. Exit codes: 0 done, 1 the run (or a validation case) failed with its state saved, 2 bad input.

mod command;
mod out;
mod progress;
mod stop;

use std::process::ExitCode;

use clap::Parser;

use command::{Command, Exit};
use out::tell;

/// Simulates strands, shear-dependent liquids, yarns and microgels from scene files.
#[derive(Parser)]
#[command(name = "viscose", version = version(), max_term_width = 110, propagate_version = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

fn version() -> &'static str {
    static VERSION: std::sync::OnceLock<String> = std::sync::OnceLock::new();
    VERSION.get_or_init(|| {
        let (version, commit) = runner::record::provenance::version();
        format!("{version} ({commit})")
    })
}

fn main() -> ExitCode {
    runner::record::provenance::declare_commit(env!("VISCOSE_COMMIT"));
    let cli = Cli::parse(); // wrong usage ends with code 2, as clap does by itself
    match cli.command.run() {
        Ok(exit) => exit.code(),
        Err(report) => {
            tell!("{report:?}");
            Exit::BadInput.code()
        }
    }
}
