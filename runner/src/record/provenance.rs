//! Where a result comes from: version, commit, scene, seed, machine.

use std::sync::OnceLock;

use serde::{Deserialize, Serialize};

/// The content of `provenance.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Version of the program.
    pub version: String,
    /// Git commit it was built from, `unknown` outside a checkout.
    pub commit: String,
    /// Title of the scene.
    pub title: String,
    /// File the scene came from.
    pub scene_file: String,
    /// Files the scene read besides.
    pub included_files: Vec<String>,
    /// Hash of the scene text as run, hexadecimal.
    pub scene_hash: String,
    /// Overrides from the command line.
    pub overrides: Vec<String>,
    /// Seed of everything random.
    pub seed: u64,
    /// Threads used.
    pub threads: usize,
    /// Processor.
    pub cpu: String,
    /// Operating system and architecture.
    pub platform: String,
    /// Checkpoint this run was branched from, if it was.
    pub branched_from: Option<String>,
}

static COMMIT: OnceLock<&'static str> = OnceLock::new();

/// Says which git commit the embedding program was built from; only the first call counts, and it must come before any run.
pub fn declare_commit(commit: &'static str) {
    COMMIT.get_or_init(|| commit);
}

/// Version and commit of this build, `unknown` where the embedding program declared none.
#[must_use]
pub fn version() -> (String, String) {
    (env!("CARGO_PKG_VERSION").to_owned(), COMMIT.get().copied().unwrap_or("unknown").to_owned())
}

/// The processor's own name, or the architecture where the system does not tell.
#[must_use]
pub fn cpu_name() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let named = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':').map(|(_, name)| name));
    named.map_or_else(|| std::env::consts::ARCH.to_owned(), |name| name.trim().to_owned())
}

/// Resident memory of this process in bytes, where the system tells.
#[must_use]
pub fn resident_memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/statm").ok()?;
    let pages: u64 = text.split_whitespace().nth(1)?.parse().ok()?;
    Some(pages * 4096)
}

/// Processor time of this process so far [s], user and system, where the system tells.
#[must_use]
pub fn cpu_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    let after_name = text.rsplit_once(')')?.1;
    let fields: Vec<&str> = after_name.split_whitespace().collect();
    let ticks = fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?;
    Some(ticks / 100.0)
}
