//! Scenes of soft grains from the file to the record.

use runner::prepare;
use runner::run::{Ending, RunOptions, RunOutcome, Silent, execute};
use runner::scene::{load, load_str};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// A sample that is prepared hastily and sheared so far that its copies pass each other.
const SHORT: &str = "Scene(units: Si, seed: 5, output: (frames: Count(5), checkpoint: Count(7)), microgel: (
    grains: 40, preparation: (relaxation: 0.05), step_factor: 1, record_every: 10,
    experiment: Oscillation(amplitude: 0.8, relative_frequency: 0.2, pre_periods: 0.5, periods: 2, post_periods: 0.5),
))";

fn run(text: &str, set: &[&str], options: RunOptions) -> RunOutcome {
    let set: Vec<String> = set.iter().map(|order| (*order).to_owned()).collect();
    let loaded = load_str(text, "short.ron", &set).unwrap_or_else(|error| panic!("{error}"));
    let job = prepare::job(loaded, 1).unwrap();
    execute(job, &options, &mut Silent, &AtomicBool::new(false)).unwrap()
}

fn into(folder: &Path) -> RunOptions {
    RunOptions { out: folder.to_owned(), ..RunOptions::default() }
}

fn json(path: &Path) -> serde_json::Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

fn files(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut all = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            all.extend(files(&path));
        } else {
            all.push((path.clone(), fs::read(&path).unwrap()));
        }
    }
    all.sort();
    all
}

/// What must not depend on threads or interruptions: everything but clock figures.
fn results(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let keep = |path: &Path| {
        let name = path.file_name().unwrap().to_string_lossy();
        path.parent().unwrap().ends_with("frames") || ["series.csv", "microgel.csv", "rheology.json"].contains(&&*name)
    };
    files(folder)
        .into_iter()
        .filter(|(path, _)| keep(path))
        .map(|(path, bytes)| (path.strip_prefix(folder).unwrap().to_owned(), bytes))
        .collect()
}

#[test]
fn a_short_run_leaves_the_table_the_moduli_and_frames() {
    let folder = tempfile::tempdir().unwrap();
    let outcome = run(SHORT, &[], into(folder.path()));
    assert_eq!(outcome.ending, Ending::Completed);
    let steps = outcome.summary["steps"].as_u64().unwrap();
    assert!(steps >= 20, "{steps} steps of ten");

    let table = fs::read_to_string(folder.path().join("microgel.csv")).unwrap();
    let mut lines = table.lines();
    assert_eq!(lines.next().unwrap().split(',').count(), 42);
    let rows: Vec<Vec<f64>> = lines.map(|line| line.split(',').map(|word| word.parse().unwrap()).collect()).collect();
    assert!(rows.len() > 20 && rows.iter().all(|row| row.len() == 42));
    for (k, row) in rows.iter().enumerate() {
        assert_eq!(row[0], 10.0 * k as f64, "every tenth step is there");
        // overall = Love–Weber + internal torque + centrifugal, entry by entry
        for e in 0..4 {
            let scale = (0..4).map(|e| row[6 + e].abs()).fold(1e-9, f64::max);
            assert!((row[38 + e] - row[6 + e] - row[30 + e] - row[34 + e]).abs() < 1e-9 * scale);
        }
        assert_eq!(row[5], -row[39]);
    }
    let largest = rows.iter().map(|row| row[2]).fold(0.0, f64::max);
    assert!((largest - 0.8).abs() < 0.02, "the strain reaches its amplitude: {largest}");

    let rheology = json(&folder.path().join("rheology.json"));
    let moduli = &rheology["moduli"][0];
    assert_eq!(moduli["amplitude"], 0.8);
    assert_eq!(moduli["bulk"]["g_prime"]["mean"], outcome.summary["g_prime"]);
    assert!(outcome.summary["g_prime"].as_f64().unwrap().is_finite());
    assert_eq!(rheology["samples"][0]["segments"][0]["moduli"][0]["bulk"]["per_period"].as_array().unwrap().len(), 2);
    assert_eq!(outcome.summary["mass_defect"], 0.0);
    assert!(outcome.summary["stress_identity_defect"].as_f64().unwrap() < 1e-9);

    let frames = runner::record::frame_files::list(&folder.path().join("frames")).unwrap();
    assert_eq!(frames.len(), 6);
    let last = runner::record::frame_files::load(frames.last().unwrap()).unwrap();
    let names: Vec<&str> = last.pieces.iter().map(|piece| piece.name.as_str()).collect();
    for name in ["grains", "contacts", "links", "box"] {
        assert!(names.contains(&name), "{names:?}");
    }
}

/// The modulus of the record is that of the library, run by itself.
#[test]
fn the_runner_changes_nothing_about_the_physics() {
    let folder = tempfile::tempdir().unwrap();
    let outcome = run(SHORT, &["microgel.record_every=7"], into(folder.path()));
    let scene = load_str(SHORT, "short.ron", &[]).unwrap().scene;
    let settings = runner::microgel::settings(&scene, scene.microgel.as_ref().unwrap()).unwrap();
    let mut alone = granular::experiment::Rheometer::new(&settings).unwrap();
    alone.run(|_| {}).unwrap();
    assert_eq!(outcome.summary["g_prime"], alone.summary().unwrap().g_prime);
    assert_eq!(outcome.summary["g_double_prime"], alone.summary().unwrap().g_double_prime);
}

#[test]
fn a_run_cut_in_the_middle_of_a_sheared_box_ends_in_the_same_bytes() {
    let (whole, cut) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let ensemble = ["microgel.seeds=2"];
    let outcome = run(SHORT, &ensemble, into(whole.path()));
    let (end, mut stops) = (outcome.summary["end"].as_f64().unwrap(), 0);
    for share in [0.1, 0.53, 0.71] {
        let resume = stops > 0;
        let options = RunOptions { resume, until: Some(share * end), ..into(cut.path()) };
        let stopped = run(SHORT, &ensemble, options);
        assert!(matches!(stopped.ending, Ending::Stopped(_)));
        stops += 1;
    }
    let table = runner::record::folder::RunFolder::at(cut.path()).series();
    let strain: f64 =
        fs::read_to_string(table).unwrap().lines().last().unwrap().split(',').nth(8).unwrap().parse().unwrap();
    assert!(strain.abs() > 0.01, "the box was sheared when the run was cut: {strain}");
    assert_eq!(run(SHORT, &ensemble, RunOptions { resume: true, ..into(cut.path()) }).ending, Ending::Completed);
    assert_eq!(results(whole.path()), results(cut.path()));
}

#[test]
fn an_ensemble_gives_the_same_bytes_for_any_number_of_threads() {
    let folders = [1, 2, 3].map(|threads| {
        let folder = tempfile::tempdir().unwrap();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let outcome = pool.install(|| run(SHORT, &["microgel.seeds=3"], into(folder.path())));
        assert_eq!(outcome.ending, Ending::Completed);
        assert!(outcome.summary["g_prime_sd"].as_f64().unwrap() > 0.0);
        folder
    });
    let first = results(folders[0].path());
    let rheology = json(&folders[0].path().join("rheology.json"));
    assert_eq!(rheology["moduli"][0]["bulk"]["g_prime"]["count"], 3);
    let seeds: Vec<u64> = (0..3).map(|k| rheology["samples"][k]["seed"].as_u64().unwrap()).collect();
    assert_eq!(seeds, [5, 6, 7]);
    for other in &folders[1..] {
        assert_eq!(first, results(other.path()));
    }
}

#[test]
fn every_experiment_and_box_can_be_named_in_a_scene() {
    let experiments = [
        "AmplitudeSweep(amplitudes: [0.5, 0.6], base: (relative_frequency: 0.2, pre_periods: 0, periods: 1, post_periods: 0))",
        "FrequencySweep(relative_frequencies: [0.2, 0.25], base: (amplitude: 0.5, pre_periods: 0, periods: 1, post_periods: 0))",
        "Oscillation(amplitude: 0.5, relative_frequency: 0.1, pre_periods: 0, periods: 1, post_periods: 0, overtones: [(amplitude: 0.1, relative_frequency: 0.2)])",
        "SteadyShear(relative_rate: 0.1, strain: 0.3)",
        "StartUp(relative_rate: -0.1, strain: 0.3)",
        "StepStrain(strain: 0.1, rise: 2, hold: 2)",
        "Creep(stress: 50, duration: 3, recovery: 2)",
        "Compression(strain: 0.05, relative_rate: 0.02, hold: 1)",
    ];
    for experiment in experiments {
        let folder = tempfile::tempdir().unwrap();
        let outcome =
            run(SHORT, &[&format!("microgel.experiment={experiment}"), "output.frames=Never"], into(folder.path()));
        assert_eq!(outcome.ending, Ending::Completed, "{experiment}");
        assert!(outcome.summary["gates_missed"].is_array(), "{experiment}");
    }
    let samples = [
        vec!["microgel.mode=Compat"],
        vec!["microgel.edges=Walls"],
        vec!["microgel.plates=Fixed", "microgel.law=Plateau()"],
        vec!["microgel.shape=Spheres", "microgel.packing=0.9", "microgel.law=Hertz()"],
        vec!["microgel.law=Table(compression: [0, 0.5, 0.9], force: [0, 0.6, 2])"],
        vec!["microgel.preparation.cut=Lines(count: 2, avoid_horizontal: 20)", "microgel.tension=Saturating(0.3)"],
        vec!["microgel.preparation.links=false", "microgel.friction=0"],
    ];
    for mut sample in samples {
        sample.push("output.frames=Count(1)");
        let folder = tempfile::tempdir().unwrap();
        let outcome = run(SHORT, &sample, into(folder.path()));
        assert_eq!(outcome.ending, Ending::Completed, "{sample:?}");
        assert!(outcome.summary["g_prime"].as_f64().unwrap().is_finite(), "{sample:?}");
    }
}

/// All scenes of the folder load, plan and start; their runs are for the night.
#[test]
fn the_scenes_of_the_folder_are_sound() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/microgel");
    let mut count = 0;
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let loaded = load(&path, &[]).unwrap_or_else(|error| panic!("{error}"));
        let plan = runner::plan::Plan::for_scene(&loaded.scene).unwrap().to_string();
        assert!(plan.contains("segment 1"), "{plan}");
        let estimate = prepare::estimate(&loaded.scene).unwrap();
        assert!(estimate.grains >= 2 && estimate.steps > 1000.0 && estimate.memory < 1e9, "{estimate}");
        let mut job = prepare::job(loaded, 1).unwrap();
        for _ in 0..3 {
            let dt = job.system.step_limits()[0].seconds;
            job.system.advance(0.0, dt).unwrap();
        }
        count += 1;
    }
    assert!(count >= 6);
}

#[test]
fn a_refused_step_ends_the_run_and_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let outcome = run(
        SHORT,
        &["microgel.rules=(guard: Refuse)", "microgel.step_factor=200", "microgel.experiment.relative_frequency=0.001"],
        into(folder.path()),
    );
    let Ending::Failed(failure) = &outcome.ending else { panic!("{:?}", outcome.ending) };
    assert!(failure.rejection.to_string().contains("stable step"), "{}", failure.rejection);
    assert_eq!(outcome.summary["status"], "failed");
}

/// Checkpoints of another recipe are refused.
#[test]
fn the_recipe_cannot_be_changed_on_the_way() {
    let scene = |set: &[String]| prepare::job(load_str(SHORT, "short.ron", set).unwrap(), 1).unwrap().system;
    let saved = scene(&[]).save().unwrap();
    assert!(scene(&[]).load(&saved).is_ok());
    let error = scene(&["microgel.friction=0.5".to_owned()]).load(&saved).unwrap_err();
    assert!(error.to_string().contains("recipe"), "{error}");
}

#[test]
fn the_report_shows_moduli_loops_and_a_comparison() {
    let folder = tempfile::tempdir().unwrap();
    let (sweep, other) = (folder.path().join("sweep"), folder.path().join("other"));
    let experiment = "microgel.experiment=AmplitudeSweep(amplitudes: [0.5, 0.6], base: (relative_frequency: 0.2, pre_periods: 0, periods: 1, post_periods: 0))";
    run(SHORT, &[experiment, "microgel.seeds=2", "output.frames=Count(2)"], into(&sweep));
    run(SHORT, &["microgel.seeds=2", "microgel.packing=1.2", "output.frames=Count(2)"], into(&other));
    // VISCOSE_KEEP_REPORT=FILE keeps the page for a look.
    let out = std::env::var_os("VISCOSE_KEEP_REPORT").map_or_else(|| folder.path().join("report.html"), PathBuf::from);
    runner::report::write(&[sweep, other], &out).unwrap();
    let page = fs::read_to_string(&out).unwrap();
    for text in ["Moduli against amplitude", "Lissajous figure", "Comparison of samples", "G″", "data:image/gif"] {
        assert!(page.contains(text), "{text}");
    }
    assert!(![">NaN", " NaN", "NaN "].iter().any(|text| page.contains(text)));
}

/// A contact that sticks is red, one that slips green, a link blue, and none hides behind the grains.
#[test]
fn pictures_show_contacts_on_top_of_the_grains_in_their_colours() {
    use runner::picture::{PictureOptions, still};
    use runner::record::frame::{Field, Frame, Piece, Topology};
    let line = |y: f64, state: i64| Piece {
        name: if state == 3 { "links" } else { "contacts" }.to_owned(),
        topology: Topology::Segments(vec![[0, 1]]),
        positions: vec![[0.2e-3, y, 0.0], [0.8e-3, y, 0.0]],
        point_fields: Vec::new(),
        cell_fields: vec![Field::integer("state", vec![state]), Field::integer("chain", vec![1])],
    };
    let grains = Piece {
        name: "grains".to_owned(),
        topology: Topology::Points,
        positions: vec![[0.3e-3, 0.5e-3, 0.0], [0.7e-3, 0.5e-3, 0.0]],
        point_fields: vec![Field::scalar("radius", vec![0.3e-3; 2]), Field::integer("particle", vec![0, 0])],
        cell_fields: Vec::new(),
    };
    let lines = [line(0.35e-3, 1), line(0.5e-3, 2), line(0.65e-3, 3)];
    let frame = Frame { time: 0.0, step: 0, pieces: [grains].into_iter().chain(lines).collect() };
    let picture = still(&frame, &PictureOptions { width: 200, height: 160, ..PictureOptions::default() });
    let strongest = |channel: usize| {
        let lead = |p: &[u8; 3]| {
            let others = (0..3).filter(|k| *k != channel).map(|k| p[k]).max().unwrap();
            i32::from(p[channel]) - i32::from(others)
        };
        (0..picture.pixels.len())
            .max_by_key(|i| lead(&picture.pixels[*i]))
            .map(|i| (i / picture.width, lead(&picture.pixels[i])))
            .unwrap()
    };
    let (red, green, blue) = (strongest(0), strongest(1), strongest(2));
    assert!(red.1 > 60 && green.1 > 30 && blue.1 > 30, "{red:?} {green:?} {blue:?}");
    assert!(blue.0 < green.0 && green.0 < red.0, "from the top: link, slip, stick");
}
