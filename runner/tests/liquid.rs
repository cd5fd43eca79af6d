//! Scenes of bulk liquid from the file to the record.

use runner::prepare;
use runner::run::{Ending, RunOptions, RunOutcome, Silent, execute};
use runner::scene::{load, load_str};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

fn run(text: &str, set: &[&str], options: RunOptions) -> RunOutcome {
    let set: Vec<String> = set.iter().map(|order| (*order).to_owned()).collect();
    let loaded = load_str(text, "liquid.ron", &set).unwrap_or_else(|error| panic!("{}", error.lines().join("\n")));
    let job = prepare::job(loaded, 1).unwrap_or_else(|error| panic!("{error}"));
    execute(job, &options, &mut Silent, &AtomicBool::new(false)).unwrap()
}

fn into(folder: &Path) -> RunOptions {
    RunOptions { out: folder.to_owned(), ..RunOptions::default() }
}

fn scene(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/liquid").join(name);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut all = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { all.extend(files(&path)) } else { all.push(path) }
    }
    all.sort();
    all
}

/// What must not depend on threads or interruptions: the series and the frames.
fn results(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    files(folder)
        .into_iter()
        .filter(|path| path.ends_with("series.csv") || path.parent().unwrap().ends_with("frames"))
        .map(|path| (path.strip_prefix(folder).unwrap().to_owned(), fs::read(&path).unwrap()))
        .collect()
}

/// The columns of a series; the limiter is left out.
fn series(folder: &Path) -> BTreeMap<String, Vec<f64>> {
    let text = fs::read_to_string(folder.join("series.csv")).unwrap();
    let mut lines = text.lines();
    let header: Vec<String> = lines.next().unwrap().split(',').map(str::to_owned).collect();
    let mut columns: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for line in lines {
        for (name, value) in header.iter().zip(line.split(',')).filter(|(name, _)| *name != "limiter") {
            columns.entry(name.clone()).or_default().push(value.parse().unwrap());
        }
    }
    columns
}

fn last(columns: &BTreeMap<String, Vec<f64>>, name: &str) -> f64 {
    *columns.get(name).unwrap_or_else(|| panic!("no column {name}")).last().unwrap()
}

/// A block of cream in the plane that slumps, a little of it flowing in and out.
const SLUMP_2D: &str = "Scene(units: Cgs, seed: 3, time: (end: 0.06, step: Adaptive(max: 2e-3)), gravity: [0, -981, 0],
    materials: { \"cream\": Liquid(preset: \"shaving-cream\"), \"water\": Liquid(preset: \"water\") },
    liquid: (cell: 0.25, particles_per_cell: 9, dimensions: Two, domain: (low: [-5, -1, 0], high: [5, 5, 1]),
        tanks: [(material: \"cream\", shape: Box(center: [0, 1, 0], half_size: [1, 1, 1]), velocity: [10, 0, 0])],
        sources: [(material: \"water\", shape: Sphere(center: [0, 3, 0], radius: 0.4), velocity: [0, -30, 0],
            motion: [Oscillate(amplitude: [0.3, 0, 0], frequency: 10)])],
        drains: [(shape: Box(center: [2, 0, 0], half_size: [0.7, 1, 1]))],
    ),
    solids: [(shape: HalfSpace(point: [0, 0, 0], normal: Y)),
             (shape: Box(center: [-1.6, 0.5, 0], half_size: [0.2, 0.5, 1]), motion: [Glide(velocity: [10, 0, 0])], liquid_friction: 0.5)],
    output: (frames: Count(4), checkpoint: Every(0.01), slices: [()], probes: [Point(name: \"middle\", at: [0, 0.5, 0])]))";

/// A drop of cream in space that falls on a pad.
const DROP_3D: &str = "Scene(units: Cgs, time: (end: 0.03, step: Adaptive(max: 1e-3)), gravity: [0, -981, 0],
    materials: { \"cream\": Liquid(preset: \"shaving-cream\") },
    liquid: (cell: 0.25, particles_per_cell: 8,
        tanks: [(material: \"cream\", shape: Sphere(center: [0, 0.6, 0], radius: 0.5), velocity: [0, -60, 0], spin: [0, 0, 20])]),
    solids: [(shape: HalfSpace(point: [0, 0, 0], normal: Y))],
    output: (frames: Count(3), checkpoint: Every(0.005), slices: [(name: \"x\", normal: X, at: 0.1)]))";

#[test]
fn a_liquid_runs_from_the_file_to_the_record_in_the_plane_and_in_space() {
    for (text, dimensions) in [(SLUMP_2D, 2), (DROP_3D, 3)] {
        let folder = tempfile::tempdir().unwrap();
        let outcome = run(text, &[], into(folder.path()));
        assert_eq!(outcome.ending, Ending::Completed, "{:?}", outcome.ending);
        let columns = series(folder.path());
        assert!(columns.values().flatten().all(|x| x.is_finite()));
        for name in ["liquid_mass_defect", "liquid_volume_defect"] {
            let worst = columns[name].iter().fold(0.0f64, |m, x| m.max(x.abs()));
            assert!(worst < 1e-13, "{name} {worst:e}");
            assert!(outcome.summary[name].as_f64().unwrap() < 1e-13);
        }
        let worst = columns["liquid_transfer_defect"].iter().fold(0.0f64, |m, x| m.max(x.abs()));
        assert!(worst < 1e-13, "transfers keep momentum: {worst:e}");
        assert_eq!(outcome.summary["dimensions"], dimensions);
        assert!(last(&columns, "liquid_particles") > 50.0);
        let frames = runner::record::frame_files::list(&folder.path().join("frames")).unwrap();
        let frame = runner::record::frame_files::load(frames.last().unwrap()).unwrap();
        let particles = frame.pieces.iter().find(|piece| piece.name == "particles").unwrap();
        for field in ["id", "radius", "velocity", "volume_ratio", "shear_stress", "yielded", "torn", "plastic_history"]
        {
            assert!(particles.point_field(field).is_some(), "{field}");
        }
        assert!(frame.pieces.iter().any(|piece| piece.name.starts_with("slice")));
        assert!(frame.pieces.iter().any(|piece| piece.name == "solids"));
    }
}

#[test]
fn a_liquid_gives_the_same_bytes_for_any_number_of_threads() {
    for text in [SLUMP_2D, DROP_3D] {
        let folders = [1, 2, 4].map(|threads| {
            let folder = tempfile::tempdir().unwrap();
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let outcome = pool.install(|| run(text, &[], into(folder.path())));
            assert_eq!(outcome.ending, Ending::Completed);
            folder
        });
        let first = results(folders[0].path());
        assert!(first.len() > 5);
        for other in &folders[1..] {
            assert!(first == results(other.path()), "other bytes with other threads");
        }
    }
}

#[test]
fn a_liquid_cut_short_and_resumed_ends_in_the_same_bytes() {
    for text in [SLUMP_2D, DROP_3D] {
        let (whole, cut) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let outcome = run(text, &[], into(whole.path()));
        let end = outcome.summary["end"].as_f64().unwrap();
        for (k, share) in [0.15, 0.55, 0.8].into_iter().enumerate() {
            let stopped = run(text, &[], RunOptions { resume: k > 0, until: Some(share * end), ..into(cut.path()) });
            assert!(matches!(stopped.ending, Ending::Stopped(_)));
        }
        let resumed = run(text, &[], RunOptions { resume: true, ..into(cut.path()) });
        assert_eq!(resumed.ending, Ending::Completed);
        assert!(results(whole.path()) == results(cut.path()), "other bytes after a resume");
    }
}
