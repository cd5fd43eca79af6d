//! Notes the git commit at build time, for the provenance of results. Here and not in `runner`, so that a commit rebuilds only
//! the program.

use std::process::Command;

fn main() {
    let output = Command::new("git").args(["rev-parse", "--short=12", "HEAD"]).output();
    let commit = output.ok().filter(|out| out.status.success()).and_then(|out| String::from_utf8(out.stdout).ok());
    println!("cargo:rustc-env=VISCOSE_COMMIT={}", commit.as_deref().map_or("unknown", str::trim));
    for path in ["../../.git/HEAD", "../../.git/refs/heads"] {
        if std::path::Path::new(path).exists() {
            println!("cargo:rerun-if-changed={path}");
        }
    }
}
