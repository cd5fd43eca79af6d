//! Scenes of yarns from the file to the record.

use runner::prepare;
use runner::record::frame::{FieldValues, Topology};
use runner::record::frame_files;
use runner::run::{Ending, RunOptions, RunOutcome, Silent, execute};
use runner::scene::{load, load_str};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// A small version of the note's scene.
const PLANE: &str = "Scene(units: Si, time: (end: 0.02, step: Adaptive(max: 1e-3)), gravity: [0, -9.8, 0],
    materials: { \"wool\": Yarn(friction: 0.3) },
    solids: [(name: \"disc\", shape: Sphere(center: [0.5, 0.45, 0], radius: 0.05), motion: [Translate(by: [0.02, 0, 0], during: (0, 0.02))])],
    yarn: (dimensions: Two, cell: 0.015625,
        groups: [(name: \"pair\", material: \"wool\", shape: Lines(from: [0.4, 0.52, 0], to: [0.6, 0.52, 0], count: 2, step: [0, 0.016, 0]), velocity: [0, -1, 0], last: [])],
        attractor: (path: Orbit(center: [0.5, 0.6, 0], radius_x: 0.2, radius_y: 0.1, rate: 40), strength: Constant(20)),
        pins: [(at: Vertex(yarn: 1, vertex: First))],
    ),
    output: (frames: Count(4), checkpoint: Count(5), probes: [Yarn(name: \"tip\", yarn: 0, vertex: First)]),
)";

/// A block large enough to be shared out among threads.
const BLOCK: &str = "Scene(units: Si, time: (end: 0.0008, step: Adaptive(max: 2e-4)), gravity: [0, -9.8, 0],
    materials: { \"wool\": Yarn(friction: 0.3) },
    solids: [(name: \"ball\", shape: Sphere(center: [0.1, -0.03, 0.1], radius: 0.05))],
    yarn: (cell: 0.015625, groups: [
        (material: \"wool\", shape: Lines(from: [0, 0.02, 0], to: [0.5, 0.02, 0], count: 30, step: [0, 0, 0.016]), velocity: [0, -1, 0]),
        (material: \"wool\", shape: Lines(from: [0, 0.036, 0], to: [0, 0.036, 0.5], count: 30, step: [0.016, 0, 0]), velocity: [0, -2, 0]),
    ]),
    output: (frames: Count(2)),
)";

fn run(text: &str, set: &[&str], options: RunOptions) -> RunOutcome {
    let set: Vec<String> = set.iter().map(|order| (*order).to_owned()).collect();
    let loaded = load_str(text, "short.ron", &set).unwrap_or_else(|error| panic!("{error}"));
    let job = prepare::job(loaded, 1).unwrap();
    execute(job, &options, &mut Silent, &AtomicBool::new(false)).unwrap()
}

fn into(folder: &Path) -> RunOptions {
    RunOptions { out: folder.to_owned(), ..RunOptions::default() }
}

/// What must not depend on threads or interruptions: series and frames.
fn results(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = vec![(PathBuf::from("series.csv"), fs::read(folder.join("series.csv")).unwrap())];
    for entry in fs::read_dir(folder.join("frames")).unwrap() {
        let path = entry.unwrap().path();
        found.push((path.file_name().unwrap().into(), fs::read(&path).unwrap()));
    }
    found.sort();
    found
}

#[test]
fn a_short_run_leaves_its_columns_and_frames() {
    let folder = tempfile::tempdir().unwrap();
    let outcome = run(PLANE, &["output.formats=[Vtk, Ply]"], into(folder.path()));
    assert_eq!(outcome.ending, Ending::Completed);
    assert!(outcome.summary["momentum_defect"].as_f64().unwrap() < 1e-12, "{:?}", outcome.summary);
    assert_eq!(outcome.summary["yarns"], 2);
    let series = fs::read_to_string(folder.path().join("series.csv")).unwrap();
    let header: Vec<&str> = series.lines().next().unwrap().split(',').collect();
    let forces = ["disc", "pin0", "pair_last"].map(|name| format!("{name}_force_x"));
    let wanted =
        ["mass", "limiter", "kinetic_energy", "stretch_energy", "shear_energy", "contact_energy", "bending_energy"];
    let more =
        ["momentum_y", "angular_momentum_z", "momentum_defect", "mean_slip", "largest_pressure", "tip_x", "tip_vy"];
    for name in wanted.iter().chain(&more).copied().chain(forces.iter().map(String::as_str)) {
        assert!(header.contains(&name), "{name} is not in {header:?}");
    }
    assert!(series.lines().all(|line| line.split(',').count() == header.len()));
    assert!(series.contains(",yarn: stretch and bending waves,") || series.contains(",yarn: contact and shear waves,"));

    let frames = frame_files::list(&folder.path().join("frames")).unwrap();
    assert_eq!(frames.len(), 5);
    let last = frame_files::load(frames.last().unwrap()).unwrap();
    let yarns = last.pieces.iter().find(|piece| piece.name == "yarns").unwrap();
    let Topology::Polylines { offsets } = &yarns.topology else { panic!("{:?}", yarns.topology) };
    assert_eq!(offsets.len(), 3);
    for name in ["radius", "velocity", "tension", "pressure", "slip", "segment_pressure", "segment_slip"] {
        assert_eq!(yarns.point_field(name).unwrap().count(), yarns.positions.len(), "{name}");
    }
    let FieldValues::F64(pressure) = &yarns.point_field("segment_pressure").unwrap().values else { panic!() };
    assert!(pressure.iter().any(|p| *p > 0.0) && pressure[offsets[1] as usize - 1] == 0.0);
    assert!(last.pieces.iter().any(|piece| piece.name == "solids" && piece.cell_count() > 20));
    let ply = fs::read_dir(folder.path().join("frames")).unwrap();
    assert!(ply.filter(|file| file.as_ref().unwrap().path().extension().is_some_and(|e| e == "ply")).count() >= 5);
}

/// The last positions of the record are those of the library, run by itself with the recorded steps.
#[test]
fn the_runner_changes_nothing_about_the_physics() {
    let folder = tempfile::tempdir().unwrap();
    run(PLANE, &[], into(folder.path()));
    let scene = load_str(PLANE, "short.ron", &[]).unwrap().scene;
    let settings = runner::yarn::settings(&scene, scene.yarn.as_ref().unwrap()).unwrap();
    let mut alone = yarn::YarnSystem::<2>::build(&settings, Path::new("")).unwrap();
    let series = fs::read_to_string(folder.path().join("series.csv")).unwrap();
    let mut time = 0.0;
    for line in series.lines().skip(2) {
        let words: Vec<&str> = line.split(',').collect();
        alone.set_time(time);
        alone.advance(words[2].parse().unwrap()).unwrap();
        time = words[1].parse().unwrap();
    }
    let frames = frame_files::list(&folder.path().join("frames")).unwrap();
    let last = frame_files::load(frames.last().unwrap()).unwrap();
    let yarns = last.pieces.iter().find(|piece| piece.name == "yarns").unwrap();
    for (x, y) in alone.state().position.iter().zip(&yarns.positions) {
        assert!((x[0] - y[0]).abs() < 1e-12 && (x[1] - y[1]).abs() < 1e-12, "{x} {y:?}");
    }
}

#[test]
fn a_run_cut_twice_ends_in_the_same_bytes() {
    for set in [&[][..], &["yarn.integrator=Implicit(tolerance: 1e-6)"][..]] {
        let (whole, cut) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        assert_eq!(run(PLANE, set, into(whole.path())).ending, Ending::Completed);
        for (resume, until) in [(false, 0.0043), (true, 0.0131)] {
            let stopped = run(PLANE, set, RunOptions { resume, until: Some(until), ..into(cut.path()) });
            assert!(matches!(stopped.ending, Ending::Stopped(_)), "{:?}", stopped.ending);
        }
        let end = run(PLANE, set, RunOptions { resume: true, ..into(cut.path()) });
        assert_eq!(end.ending, Ending::Completed);
        assert_eq!(results(whole.path()), results(cut.path()));
    }
}

#[test]
fn the_same_bytes_for_any_number_of_threads() {
    let folders = [1, 2, 4].map(|threads| {
        let folder = tempfile::tempdir().unwrap();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let outcome = pool.install(|| run(BLOCK, &[], into(folder.path())));
        assert_eq!(outcome.ending, Ending::Completed);
        assert!(outcome.summary["vertices"].as_u64().unwrap() > 3000);
        folder
    });
    let first = results(folders[0].path());
    for other in &folders[1..] {
        assert!(first == results(other.path()));
    }
}

#[test]
fn every_shape_wall_path_and_law_can_be_named_in_a_scene() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("lines.csv"), "x,y,z\n0,0,0\n0.01,0,0\n0.02,0,0\n\n0,0.1,0\n0.01,0.1,0\n").unwrap();
    let shapes = [
        "Line(from: [0, 0, 0], to: [0.1, 0, 0])",
        "Circle(center: [0, 0, 0], radius: 0.05, axis: X)",
        "Circle(center: [0, 0, 0], radius: 0.05, angle: 90)",
        "Helix(from: [0, 0, 0], to: [0, 0.1, 0], radius: 0.03, turns: 2)",
        "Weave(center: [0, 0, 0], warp_count: 3, weft_count: 2, spacing: 0.03, amplitude: 0.008)",
        "Knit(center: [0, 0, 0], rows: 2, loops: 2, width: 0.1, height: 0.06, depth: 0.03)",
        "HairBall(center: [0, 0, 0], radius: 0.05, count: 3, length: 0.1, curl: 0.05)",
        "CutPile(low: [0, 0, 0], high: [0.1, 0.1, 0.1], count: 4, length: 0.05)",
        "Polyline(points: [[0, 0, 0], [0.01, 0, 0]], rest_lengths: [0.009])",
        "File(file: \"lines.csv\")",
    ];
    let base = "Scene(units: Si, time: (end: 1e-4, step: Adaptive(max: 1e-4)), materials: { \"wool\": Yarn() },
        yarn: (cell: 0.015625, groups: [(material: \"wool\", shape: Line(from: [0, 0, 0], to: [0.1, 0, 0]))]), output: (frames: Never))";
    let try_with = |set: &[String]| {
        let loaded =
            load_str(base, folder.path().join("base.ron"), set).unwrap_or_else(|error| panic!("{set:?}: {error}"));
        let estimate = prepare::estimate(&loaded.scene).unwrap();
        let job = prepare::job(loaded, 1).unwrap();
        let out = tempfile::tempdir().unwrap();
        let outcome = execute(job, &into(out.path()), &mut Silent, &AtomicBool::new(false)).unwrap();
        assert_eq!(outcome.ending, Ending::Completed, "{set:?}");
        let vertices = outcome.summary["vertices"].as_f64().unwrap();
        assert_eq!(estimate.yarns as u64, outcome.summary["yarns"].as_u64().unwrap(), "{set:?}");
        let off = (estimate.vertices as f64 / vertices - 1.0).abs();
        assert!(off < 0.03, "{set:?}: {} vertices estimated, {vertices} made", estimate.vertices);
    };
    for shape in shapes {
        try_with(&[format!("yarn.groups[0].shape={shape}")]);
    }
    for more in [
        "yarn.domain=(low: [-1, -1, -1], high: [1, 1, 1], walls: Friction(0.3), left: Open, right: Slip, bottom: Stick, top: Separate, back: Slip, front: Open)",
        "yarn.attractor=(path: Fixed([0, 1, 0]), strength: Constant(-3))",
        "yarn.attractor=(path: Points(points: [(time: 0, at: [0, 1, 0]), (time: 1, at: [1, 1, 0])], smooth: true), strength: Keys([(time: 0, strength: 1), (time: 1, strength: 2)]))",
        "yarn.attractor=(path: Line(from: [0, 1, 0], velocity: [1, 0, 0]), strength: Constant(3), softening: 0.1)",
        "yarn.pins=[(at: Point([0, 0, 0]), half_size: [0.03, 0.1, 0.1], motion: [Glide(velocity: [0, 0.1, 0])])]",
        "yarn.drives=[(yarn: 0, vertex: 3, motion: [Glide(velocity: [0, 0.1, 0])])]",
        "yarn.groups[0].first=[Glide(velocity: [0, 0.1, 0])]",
        "yarn.integrator=Implicit(tolerance: 1e-3)",
        "yarn.plastic=false",
        "materials.wool=Yarn(bending: Spring(0.05), friction: 0, section_friction: 0.5, width: 0.01)",
        "materials.wool=Yarn(bending: Flexible)",
    ] {
        try_with(&[more.to_owned()]);
    }
}

/// The note's law is there, and is another one.
#[test]
fn compat_follows_the_printed_note() {
    let end = |set: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        let set = [&["yarn.groups[0].last=None"], set].concat();
        assert_eq!(run(PLANE, &set, into(folder.path())).ending, Ending::Completed);
        let frames = frame_files::list(&folder.path().join("frames")).unwrap();
        frame_files::load(frames.last().unwrap())
            .unwrap()
            .pieces
            .iter()
            .find(|piece| piece.name == "yarns")
            .unwrap()
            .positions[5]
    };
    let (own, printed) = (end(&[]), end(&["yarn.compat=true"]));
    assert!((own[0] - printed[0]).hypot(own[1] - printed[1]) > 1e-6);
}

/// All scenes of the folder load, plan, are sized rightly and start; their runs are for the night.
#[test]
fn the_scenes_of_the_folder_are_sound() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/yarn");
    let mut count = 0;
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let loaded = load(&path, &[]).unwrap_or_else(|error| panic!("{error}"));
        let plan = runner::plan::Plan::for_scene(&loaded.scene).unwrap().to_string();
        assert!(plan.contains("friction cone"), "{plan}");
        let estimate = prepare::estimate(&loaded.scene).unwrap();
        assert!(estimate.yarns >= 2 && estimate.memory < 1e9, "{estimate}");
        let mut job = prepare::job(loaded, 1).unwrap();
        let mut time = 0.0;
        for _ in 0..3 {
            let limits = job.system.step_limits();
            let dt = limits.iter().map(|limit| limit.seconds).fold(1e-3, f64::min);
            job.system.snapshot();
            job.system.advance(time, dt).unwrap();
            time += dt;
        }
        let mut row = Vec::new();
        job.system.row(&mut row);
        assert_eq!(row.len(), job.system.columns().len());
        assert!(row.iter().all(|x| x.is_finite()), "{}: {row:?}", path.display());
        count += 1;
    }
    assert!(count >= 6);
}

/// Yarns in the plane are seen at right angles, with the solids behind them; in space they are drawn as tubes.
#[test]
fn pictures_show_yarns_and_solids() {
    use runner::picture::{PictureOptions, still};
    for (text, set) in [(PLANE, "yarn.motion=0.3"), (BLOCK, "yarn.motion=0.2")] {
        let loaded = load_str(text, "picture.ron", &[set.to_owned()]).unwrap();
        let job = prepare::job(loaded, 1).unwrap();
        let frame = job.system.frame(0, 0.0);
        let picture = still(&frame, &PictureOptions { width: 240, height: 160, ..PictureOptions::default() });
        let background = picture.pixels[0];
        let differs = |p: &[u8; 3]| p.iter().zip(&background).any(|(a, b)| a.abs_diff(*b) > 24);
        let drawn = picture.pixels.iter().filter(|p| differs(p)).count() as f64 / picture.pixels.len() as f64;
        assert!(drawn > 0.03, "{drawn}");
        let grey = |p: &&[u8; 3]| differs(p) && p.iter().max().unwrap() - p.iter().min().unwrap() < 16;
        assert!(picture.pixels.iter().filter(grey).count() > 50, "a solid is seen");
        if let Some(folder) = std::env::var_os("VISCOSE_KEEP_PICTURES") {
            let path = PathBuf::from(folder).join(format!("{}.png", set.replace('=', "-")));
            fs::write(path, picture.png().unwrap()).unwrap();
        }
    }
}

#[test]
fn checkpoints_of_other_yarns_are_refused() {
    let system = |set: &[String]| prepare::job(load_str(PLANE, "short.ron", set).unwrap(), 1).unwrap().system;
    let saved = system(&[]).save().unwrap();
    assert!(system(&[]).load(&saved).is_ok());
    let longer = ["yarn.groups[0].segment_length=0.01".to_owned()];
    assert!(system(&longer).load(&saved).is_err());
}

#[test]
fn the_report_shows_a_run_of_yarns() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    run(PLANE, &[], into(&out));
    let page = folder.path().join("report.html");
    let verdicts = runner::report::write(&[out], &page).unwrap();
    assert_eq!(verdicts[0].grade, runner::report::Grade::Good, "{verdicts:?}");
    let text = fs::read_to_string(&page).unwrap();
    assert!(text.contains("stretch_energy") && text.contains("disc_force_x"));
}
