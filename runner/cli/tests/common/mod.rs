//! What the tests of the program share: running it, and comparing what two runs left behind.
#![allow(dead_code)] // each test file uses its own part

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The program under test.
pub fn viscose() -> Command {
    Command::new(env!("CARGO_BIN_EXE_viscose"))
}

/// Runs the program and returns what it said.
pub fn run(args: &[&str]) -> Output {
    viscose().args(args).output().expect("the program starts")
}

/// Exit code and standard error of a finished process.
pub fn code_and_errors(output: &Output) -> (Option<i32>, String) {
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

/// A scene file in a folder of its own.
pub fn scene(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, text).expect("the scene is written");
    path
}

/// The repository's root.
pub fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().expect("the repository exists")
}

/// Every file that must not depend on the clock or the machine: the series and all frames.
pub fn physics_files(run: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    files.insert("series.csv".to_owned(), fs::read(run.join("series.csv")).expect("a series"));
    for entry in fs::read_dir(run.join("frames")).expect("a frames folder") {
        let path = entry.expect("an entry").path();
        files.insert(path.file_name().unwrap().to_string_lossy().into_owned(), fs::read(&path).expect("a frame"));
    }
    files
}

/// Panics with the name of the first file that differs.
pub fn assert_same_bytes(one: &Path, other: &Path) {
    let (a, b) = (physics_files(one), physics_files(other));
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>(), "different files");
    for (name, bytes) in &a {
        assert!(bytes == &b[name], "{name} differs between {} and {}", one.display(), other.display());
    }
}

/// A swaying wisp of strands with two vertex counts: short to run, with everything that can go wrong in parallel.
pub const WISP: &str = r#"Scene(
    title: "A wisp that sways",
    units: Cgs,
    seed: 11,
    time: (end: 0.1, step: Fixed(0.001)),
    materials: { "hair": Fibre(preset: "hair") },
    strands: [
        (material: "hair", radius: 0.005, clamp: [First(2)],
         shape: Wisp(count: 9, root: [0, 0, 0], direction: [1, 0, 0], length: 4, disc: 0.5, vertices: 17,
                     spread: (radius: 0.1, length: 0.2))),
        (material: "hair", radius: 0.004, clamp: [First(2)],
         shape: Wisp(count: 6, root: [0, 2, 0], direction: [0, 0, 1], length: 3, disc: 0.3, vertices: 24,
                     curl: (radius: 0.2, pitch: 1.0))),
    ],
    output: (frames: Every(0.01), formats: [Vtk, Ply], checkpoint: Every(0.005)),
)
"#;
