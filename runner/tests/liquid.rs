//! Scenes of bulk liquid from the file to the record.

use runner::plan::Plan;
use runner::prepare;
use runner::run::{Ending, RunOptions, RunOutcome, Silent, execute};
use runner::scene::{load, load_str};
use runner::system::{Element, System as _};
use runner::world::World;
use runner::world::liquid::{LiquidState, LiquidWorld};
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

/// The world of a scene without strands.
fn world(text: &str, set: &[&str]) -> World {
    let set: Vec<String> = set.iter().map(|order| (*order).to_owned()).collect();
    let scene = load_str(text, "liquid.ron", &set).unwrap_or_else(|error| panic!("{}", error.lines().join("\n"))).scene;
    let plan = Plan::for_scene(&scene).unwrap();
    World::build(&scene, &plan, &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// The stages of the runner do what the library's own stepper does, to the bit.
#[test]
fn the_runner_changes_nothing_about_the_physics() {
    let text = "Scene(units: Cgs, time: (end: 1, step: Fixed(1e-3)), gravity: [0, -981, 0],
        materials: { \"sauce\": Liquid(preset: \"oyster-sauce\") },
        liquid: (cell: 0.5, particles_per_cell: 8,
            tanks: [(material: \"sauce\", shape: Sphere(center: [0, 0, 0], radius: 1.2), velocity: [30, -10, 0], spin: [0, 3, 8])]))";
    let mut world = world(text, &[]);
    let (Some(LiquidState::Three(state)), Some(LiquidWorld::Three(flow))) = (&world.state.liquid, &world.liquid) else {
        panic!("the liquid is not there");
    };
    let (mut particles, materials, settings) = (state.particles.clone(), flow.materials.clone(), flow.settings);
    let (body, lattice) = (flow.body, *flow.grid.lattice());
    let mut alone = mpm::LiquidStepper::new(lattice);
    let none: [mpm::NoSolid; 0] = [];
    let dt = 1e-3;
    for step in 0..10 {
        world.advance(f64::from(step) * dt, dt).unwrap();
        alone
            .advance(&mut particles, &materials, &none, &none, &body, dt, u64::try_from(step).unwrap(), &settings)
            .unwrap();
    }
    let Some(LiquidState::Three(state)) = &world.state.liquid else { panic!("the liquid went away") };
    assert!(state.particles == particles, "the runner and the library part ways");
    assert!(state.steps == 10);
}

/// Until liquid flows in nothing is allocated, no stage does anything, and no step is limited.
#[test]
fn liquid_lies_dormant_until_it_flows() {
    let text = "Scene(units: Cgs, time: (end: 0.05, step: Adaptive(max: 1e-2)), gravity: [0, -981, 0],
        materials: { \"cream\": Liquid(preset: \"shaving-cream\") },
        liquid: (cell: 0.5, particles_per_cell: 8,
            sources: [(material: \"cream\", shape: Sphere(center: [0, 0, 0], radius: 1), velocity: [0, -10, 0], during: (0.03, 1))]))";
    let mut world = world(text, &[]);
    assert!(world.step_limits().iter().all(|limit| limit.seconds > 1e-2), "the source alone looks ahead");
    world.advance(0.0, 1e-2).unwrap();
    let (Some(state), Some(LiquidWorld::Three(flow))) = (&world.state.liquid, &world.liquid) else { panic!() };
    assert!(state.is_empty() && flow.grid.blocks.block_count() == 0 && flow.grid.bytes() == 0);
    let folder = tempfile::tempdir().unwrap();
    let outcome = run(text, &[], into(folder.path()));
    assert_eq!(outcome.ending, Ending::Completed);
    let columns = series(folder.path());
    assert_eq!(columns["liquid_particles"][1], 0.0);
    assert!(last(&columns, "liquid_particles") > 100.0);
    assert!(last(&columns, "liquid_mass_defect").abs() < 1e-13);
}

/// Every part can be switched off by the scene: the plan says so, and the run goes on without it.
#[test]
fn parts_of_the_liquid_can_be_switched_off() {
    let off = [
        ("Advection", None),
        ("Pressure", Some("pressure_iterations")),
        ("Resampling", Some("liquid_split")),
        ("Shear", Some("shear_iterations")),
        ("PlasticFlow", None),
        ("Compressibility", None),
    ];
    for (name, column) in off {
        let set = format!("disable=[{name}]");
        let scene = load_str(DROP_3D, "drop.ron", std::slice::from_ref(&set)).unwrap().scene;
        let plan = Plan::for_scene(&scene).unwrap();
        assert!(plan.to_string().contains(&format!("off: {name}")), "{plan}");
        let runs = |stage: &str| plan.active().any(|active| active.name == stage);
        assert_eq!(runs("resample"), name != "Resampling");
        assert_eq!(runs("liquid_plasticity"), !["Shear", "PlasticFlow"].contains(&name));
        assert_eq!(runs("tearing"), !["Shear", "PlasticFlow"].contains(&name));
        let folder = tempfile::tempdir().unwrap();
        let outcome = run(DROP_3D, &[&set, "time.end=0.01", "output.frames=Never"], into(folder.path()));
        assert_eq!(outcome.ending, Ending::Completed, "{name}");
        let columns = series(folder.path());
        if let Some(column) = column {
            assert!(!columns.contains_key(column), "{name} leaves the column {column}");
        }
        match name {
            "Advection" => assert_eq!(columns["liquid_low_y"][0], last(&columns, "liquid_low_y")),
            "Compressibility" => assert_eq!(last(&columns, "liquid_max_volume_ratio"), 1.0),
            "PlasticFlow" => assert_eq!(last(&columns, "liquid_yielded"), 0.0),
            _ => {}
        }
    }
}

/// All scenes of the folder load, plan, are estimated, and take their first steps; two small ones run whole.
#[test]
fn the_scenes_of_the_folder_are_sound() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/liquid");
    let mut count = 0;
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let loaded = load(&path, &[]).unwrap_or_else(|error| panic!("{error}"));
        let estimate = prepare::estimate(&loaded.scene).unwrap();
        let expected = estimate.liquid.unwrap();
        let mut job = prepare::job(loaded, 1).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let (mut time, mut dt) = (0.0, 1e-3);
        for _ in 0..2 {
            dt = job.system.step_limits().iter().map(|limit| limit.seconds).fold(dt, f64::min);
            job.system.advance(time, dt).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            time += dt;
        }
        let particles = job.system.summary()["particles"].as_f64().unwrap();
        if expected.at_start > 0.0 {
            let ratio = expected.at_start / particles;
            assert!((0.8..1.25).contains(&ratio), "{}: {expected:?}, there are {particles}", path.display());
        } else {
            assert!(expected.particles > particles, "{}: {expected:?}, there are {particles}", path.display());
        }
        assert!(estimate.memory > 0.0 && estimate.to_string().contains("particles"), "{estimate}");
        count += 1;
    }
    assert!(count >= 15, "{count} scenes");
}

/// A step that deforms the liquid too much is refused by stage and particle, halved, and the run says so.
#[test]
fn a_step_that_is_far_too_long_is_refused_by_name() {
    let text = "Scene(units: Si, time: (end: 1, step: Fixed(0.05)),
        materials: { \"cream\": Liquid(preset: \"shaving-cream\") },
        liquid: (cell: 5e-3, particles_per_cell: 4, dimensions: Two,
            tanks: [(material: \"cream\", shape: Box(center: [0, 0.05, 0], half_size: [0.02, 0.04, 1]), spin: [0, 0, 300])]))";
    let mut world = world(text, &[]);
    let rejection = (0..5).find_map(|step| world.advance(0.05 * f64::from(step), 0.05).err()).expect("a refusal");
    assert!(matches!(rejection.element, Some(Element::Particle(_))), "{rejection}");
    assert!(rejection.to_string().contains("particle"), "{rejection}");
}
