//! Exit codes and messages: 0 done, 1 failed with the state saved, 2 bad input.

mod common;

use std::fs;

use common::{WISP, code_and_errors, run, scene, viscose};

#[test]
fn misspelt_fields_end_with_code_two_and_the_nearest_name() {
    let dir = tempfile::tempdir().unwrap();
    let file = scene(dir.path(), "bad.ron", &WISP.replace("radius: 0.005", "raduis: 0.005"));
    for command in ["check", "run", "plan"] {
        let (code, errors) = code_and_errors(&run(&[command, file.to_str().unwrap()]));
        assert_eq!(code, Some(2), "{command}: {errors}");
        assert!(errors.contains("radius") && errors.contains("bad.ron"), "{command}: {errors}");
    }
}

#[test]
fn a_missing_scene_and_wrong_usage_end_with_code_two() {
    assert_eq!(run(&["run", "no-such-scene.ron"]).status.code(), Some(2));
    assert_eq!(run(&["run"]).status.code(), Some(2));
    assert_eq!(run(&["dance"]).status.code(), Some(2));
}

#[test]
fn a_folder_that_holds_a_run_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let file = scene(dir.path(), "wisp.ron", WISP);
    let out = dir.path().join("out");
    let args = ["run", file.to_str().unwrap(), "--out", out.to_str().unwrap(), "--set", "time.end=0.003"];
    assert_eq!(run(&args).status.code(), Some(0));
    let (code, errors) = code_and_errors(&run(&args));
    assert_eq!(code, Some(2));
    assert!(errors.contains("--resume") && errors.contains("--force"), "{errors}");
    let mut forced = args.to_vec();
    forced.push("--force");
    assert_eq!(run(&forced).status.code(), Some(0));
}

#[test]
fn an_impossible_step_ends_with_code_one_and_names_stage_time_strand_and_vertex() {
    let dir = tempfile::tempdir().unwrap();
    let file = scene(dir.path(), "wisp.ron", WISP);
    let out = dir.path().join("out");
    // one Newton iteration under a million times the earth's gravity: no step that halving reaches is small enough
    let sets = ["solver.rods.max_iterations=1", "gravity=[0, -1e9, 0]"];
    let output =
        run(&["run", file.to_str().unwrap(), "--out", out.to_str().unwrap(), "--set", sets[0], "--set", sets[1]]);
    let (code, errors) = code_and_errors(&output);
    assert_eq!(code, Some(1), "{errors}");
    assert!(errors.contains("stage `mixture`") && errors.contains("strand") && errors.contains("vertex"), "{errors}");
    let summary = fs::read_to_string(out.join("summary.json")).unwrap();
    assert!(summary.contains("\"failed\"") && summary.contains("\"failure\""), "{summary}");
}

#[test]
fn a_checkpoint_of_another_scene_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let file = scene(dir.path(), "wisp.ron", WISP);
    let out = dir.path().join("out");
    let out = out.to_str().unwrap();
    assert_eq!(run(&["run", file.to_str().unwrap(), "--out", out, "--until", "0.02"]).status.code(), Some(0));
    let other = run(&["run", file.to_str().unwrap(), "--out", out, "--resume", "--set", "seed=12"]);
    let (code, errors) = code_and_errors(&other);
    assert_eq!(code, Some(2), "{errors}");
    assert!(errors.contains("another scene"), "{errors}");
}

#[test]
fn a_saved_state_can_be_replayed_as_it_failed_and_with_other_settings() {
    let dir = tempfile::tempdir().unwrap();
    let file = scene(dir.path(), "wisp.ron", WISP);
    let out = dir.path().join("out");
    let args = ["run", file.to_str().unwrap(), "--out", out.to_str().unwrap(), "--until", "0.01"];
    assert_eq!(run(&args).status.code(), Some(0));
    let mut checkpoints: Vec<_> =
        fs::read_dir(out.join("checkpoints")).unwrap().map(|entry| entry.unwrap().path()).collect();
    checkpoints.sort();
    let last = checkpoints.last().unwrap().to_str().unwrap().to_owned();
    let again = run(&["replay", &last, "--steps", "2"]);
    let text = String::from_utf8_lossy(&again.stdout).into_owned();
    assert_eq!(again.status.code(), Some(0), "{text}");
    assert!(text.contains("step 11: dt = 1.0000e-3 s (fixed)") && text.contains("mixture"), "{text}");
    let sets = ["--set", "solver.rods.max_iterations=1", "--set", "gravity=[0, -1e9, 0]"];
    let failing = run(&[&["replay", &last], &sets[..]].concat());
    assert_eq!(failing.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&failing.stdout).contains("refused down to dt"), "{failing:?}");
    fs::remove_file(out.join("scene.ron")).unwrap();
    let (code, errors) = code_and_errors(&run(&["replay", &last]));
    assert_eq!(code, Some(2));
    assert!(errors.contains("--scene"), "{errors}");
}

/// A reader that leaves early (`viscose … | head`) changes nothing: not the exit code, not the run.
#[test]
fn a_reader_that_leaves_does_not_end_the_program() {
    let gone = || {
        let (reader, writer) = std::io::pipe().expect("a pipe");
        drop(reader);
        writer
    };
    let dir = tempfile::tempdir().unwrap();
    let bad = scene(dir.path(), "bad.ron", &WISP.replace("radius: 0.005", "raduis: 0.005"));
    let status = viscose().args(["check", bad.to_str().unwrap()]).stdout(gone()).stderr(gone()).status().unwrap();
    assert_eq!(status.code(), Some(2));
    let file = scene(dir.path(), "wisp.ron", WISP);
    let out = dir.path().join("out");
    let args = ["run", file.to_str().unwrap(), "--out", out.to_str().unwrap(), "--set", "time.end=0.003"];
    let status = viscose().args(args).arg("--json-progress").stdout(gone()).stderr(gone()).status().unwrap();
    assert_eq!(status.code(), Some(0));
    assert!(fs::read_to_string(out.join("summary.json")).unwrap().contains("\"completed\""));
    let status = viscose().args(["material", "watr"]).stdout(gone()).stderr(gone()).status().unwrap();
    assert_eq!(status.code(), Some(2));
}

#[test]
fn a_misspelt_material_is_answered_with_the_nearest_name() {
    let (code, errors) = code_and_errors(&run(&["material", "shaving-creme"]));
    assert_eq!(code, Some(2));
    assert!(errors.contains("did you mean `shaving-cream`"), "{errors}");
}
