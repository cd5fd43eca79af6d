//! The same scene gives the same bytes: for any number of threads, and across being killed and resumed.

mod common;

use std::fs;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use common::{WISP, assert_same_bytes, code_and_errors, run, scene, viscose};

fn run_with(scene: &Path, out: &Path, more: &[&str]) {
    let mut args = vec!["run", scene.to_str().unwrap(), "--out", out.to_str().unwrap()];
    args.extend(more);
    let output = run(&args);
    let (code, errors) = code_and_errors(&output);
    assert_eq!(code, Some(0), "{errors}");
}

#[test]
fn one_two_and_four_threads_write_the_same_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let file = scene(dir.path(), "wisp.ron", WISP);
    let outs = ["1", "2", "4"].map(|threads| {
        let out = dir.path().join(threads);
        run_with(&file, &out, &["--threads", threads]);
        out
    });
    assert_same_bytes(&outs[0], &outs[1]);
    assert_same_bytes(&outs[0], &outs[2]);
}

fn spawn(scene: &Path, out: &Path, resume: bool) -> Child {
    let mut command = viscose();
    command.arg("run").arg(scene).arg("--out").arg(out).args(["--threads", "2"]);
    if resume {
        command.arg("--resume");
    }
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the program starts")
}

/// Waits until the run has at least so many files among its checkpoints, or has ended; true if it is still going.
fn wait_for_checkpoints(child: &mut Child, out: &Path, checkpoints: usize) -> bool {
    let limit = Instant::now() + Duration::from_secs(60);
    loop {
        if child.try_wait().expect("the child can be asked").is_some() {
            return false;
        }
        let written = fs::read_dir(out.join("checkpoints")).map_or(0, |entries| entries.count());
        if written >= checkpoints {
            return true;
        }
        assert!(Instant::now() < limit, "the run makes no progress");
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_run_killed_at_random_moments_and_resumed_writes_the_same_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let file = scene(dir.path(), "wisp.ron", WISP);
    let whole = dir.path().join("whole");
    run_with(&file, &whole, &[]);
    let killed = dir.path().join("killed");
    // moments differ from run to run on purpose: whatever the moment, the bytes must be the same
    let mut kills = 0;
    for round in 0..5 {
        let mut child = spawn(&file, &killed, round > 0);
        if wait_for_checkpoints(&mut child, &killed, 1) {
            std::thread::sleep(Duration::from_millis(3 * round));
            child.kill().expect("the child can be killed");
            kills += 1;
        }
        child.wait().expect("the child ends");
    }
    assert!(kills > 0, "the run was too short to be killed");
    run_with(&file, &killed, &["--resume"]);
    assert_same_bytes(&whole, &killed);
}

#[test]
fn a_truncated_newest_checkpoint_is_refused_and_the_previous_one_used() {
    let dir = tempfile::tempdir().unwrap();
    let file = scene(dir.path(), "wisp.ron", WISP);
    let (whole, cut) = (dir.path().join("whole"), dir.path().join("cut"));
    run_with(&file, &whole, &[]);
    run_with(&file, &cut, &["--until", "0.05"]);
    let newest = fs::read_dir(cut.join("checkpoints")).unwrap().map(|e| e.unwrap().path()).max().unwrap();
    let bytes = fs::read(&newest).unwrap();
    fs::write(&newest, &bytes[..bytes.len() / 2]).unwrap();
    let output = run(&["run", file.to_str().unwrap(), "--out", cut.to_str().unwrap(), "--resume"]);
    let (code, errors) = code_and_errors(&output);
    assert_eq!(code, Some(0), "{errors}");
    assert!(errors.contains("damaged"), "{errors}");
    assert_same_bytes(&whole, &cut);
}

#[test]
fn a_branch_starts_where_its_checkpoint_was_and_goes_its_own_way() {
    let dir = tempfile::tempdir().unwrap();
    let file = scene(dir.path(), "wisp.ron", WISP);
    let (trunk, branch) = (dir.path().join("trunk"), dir.path().join("branch"));
    run_with(&file, &trunk, &["--until", "0.05"]);
    let newest = fs::read_dir(trunk.join("checkpoints")).unwrap().map(|e| e.unwrap().path()).max().unwrap();
    let from = newest.to_str().unwrap();
    run_with(&file, &branch, &["--resume-from", from, "--set", "gravity=[0,0,0]"]);
    let series = fs::read_to_string(branch.join("series.csv")).unwrap();
    let first = series.lines().nth(1).unwrap();
    assert!(first.starts_with("51,"), "{first}");
    let summary = fs::read_to_string(branch.join("summary.json")).unwrap();
    assert!(summary.contains("\"completed\""));
    assert!(fs::read_to_string(branch.join("provenance.json")).unwrap().contains("branched_from"));
}

/// A batch that is killed takes its runs with it, and the same command goes on with them to the same bytes.
#[cfg(unix)]
#[test]
fn a_killed_batch_goes_on_with_the_same_command() {
    let dir = tempfile::tempdir().unwrap();
    let scenes = dir.path().join("scenes");
    fs::create_dir(&scenes).unwrap();
    for (name, seed) in [("one.ron", 11), ("two.ron", 12), ("three.ron", 13)] {
        scene(&scenes, name, &WISP.replace("seed: 11", &format!("seed: {seed}")));
    }
    let batch = |out: &Path| {
        let mut command = viscose();
        command.arg("batch").arg(&scenes).args(["-j", "2", "--no-report", "--out"]).arg(out);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        command
    };
    let (whole, killed) = (dir.path().join("whole"), dir.path().join("killed"));
    assert!(batch(&whole).status().unwrap().success());
    let mut child = batch(&killed).spawn().unwrap();
    if wait_for_checkpoints(&mut child, &killed.join("one"), 2) {
        child.kill().unwrap();
    }
    child.wait().unwrap();
    assert!(batch(&killed).status().unwrap().success());
    for name in ["one", "two", "three"] {
        assert_same_bytes(&whole.join(name), &killed.join(name));
    }
    let table = fs::read_to_string(killed.join("results.csv")).unwrap();
    assert_eq!(table.matches(",completed,").count(), 3, "{table}");
}
