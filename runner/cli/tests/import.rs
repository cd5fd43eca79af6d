//! `viscose import`: exit codes, and where the scene goes.

mod common;

use std::fs;

use common::{code_and_errors, repository, run, viscose};

#[test]
fn an_imported_scene_is_written_checked_and_not_overwritten() {
    let dir = tempfile::tempdir().unwrap();
    let source = repository().join("runner/tests/data/import/strand.xml");
    let out = dir.path().join("strand.ron");
    let args = ["import", source.to_str().unwrap(), "--out", out.to_str().unwrap()];
    let output = run(&args);
    assert_eq!(output.status.code(), Some(0), "{}", code_and_errors(&output).1);
    let told = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(told.contains("strand.xml:12  StrandParameters/collisionMultiplier"), "{told}");
    assert_eq!(run(&["check", out.to_str().unwrap()]).status.code(), Some(0));
    let (code, errors) = code_and_errors(&run(&args));
    assert_eq!(code, Some(2));
    assert!(errors.contains("--force"), "{errors}");
    let mut forced = args.to_vec();
    forced.push("--force");
    assert_eq!(run(&forced).status.code(), Some(0));
    // without --out it is named after the file, in the working folder; `-` prints it
    let written = viscose().args(["import", source.to_str().unwrap(), "--out", "-"]).output().unwrap();
    assert_eq!(String::from_utf8_lossy(&written.stdout), fs::read_to_string(&out).unwrap());
    let here =
        viscose().current_dir(dir.path().join("")).args(["import", source.to_str().unwrap(), "--force"]).output();
    assert_eq!(here.unwrap().status.code(), Some(0));
}

#[test]
fn missing_files_end_with_code_one_and_bad_input_with_two() {
    let dir = tempfile::tempdir().unwrap();
    let data = repository().join("runner/tests/data/import");
    let out = dir.path().join("missing.ron");
    let output = run(&["import", data.join("missing.xml").to_str().unwrap(), "--out", out.to_str().unwrap()]);
    let (code, errors) = code_and_errors(&output);
    assert_eq!(code, Some(1), "{errors}");
    assert!(out.exists() && errors.contains("missing files"), "{errors}");
    let broken = dir.path().join("broken.xml");
    fs::write(&broken, "<scene><duration time=\"x\"/></scene>").unwrap();
    let (code, errors) = code_and_errors(&run(&["import", broken.to_str().unwrap()]));
    assert_eq!(code, Some(2), "{errors}");
    assert!(errors.contains("broken.xml:1") && errors.contains("finite number"), "{errors}");
    assert_eq!(run(&["import", "no-such-file.xml"]).status.code(), Some(2));
    assert_eq!(run(&["import"]).status.code(), Some(2));
}

#[test]
fn a_short_run_of_an_imported_scene_ends_well() {
    let dir = tempfile::tempdir().unwrap();
    let source = repository().join("runner/tests/data/import/strand.xml");
    let scene = dir.path().join("strand.ron");
    assert_eq!(run(&["import", source.to_str().unwrap(), "--out", scene.to_str().unwrap()]).status.code(), Some(0));
    let out = dir.path().join("out");
    let output =
        run(&["run", scene.to_str().unwrap(), "--out", out.to_str().unwrap(), "--until", "0.02", "--threads", "1"]);
    assert_eq!(output.status.code(), Some(0), "{}", code_and_errors(&output).1);
}
