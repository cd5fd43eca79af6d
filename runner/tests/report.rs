//! The report page of a whole, a truncated and a failed run.

mod synthetic;

use std::fs;
use std::path::PathBuf;

use runner::report::{self, Grade};

/// Every tag that needs an end has one, in order.
fn assert_well_formed(html: &str) {
    let mut open: Vec<&str> = Vec::new();
    for tag in html.split('<').skip(1) {
        let inner = tag.split('>').next().unwrap();
        let name = inner.trim_start_matches('/').split([' ', '/']).next().unwrap();
        if inner.starts_with('!') || inner.ends_with('/') || ["meta", "img", "br"].contains(&name) {
            continue;
        }
        if inner.starts_with('/') {
            assert_eq!(open.pop(), Some(name), "near {}", &tag[..tag.len().min(80)]);
        } else {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "{open:?}");
}

#[test]
fn a_whole_run_gets_a_page_that_needs_nothing_else() {
    let dir = tempfile::tempdir().unwrap();
    let run = dir.path().join("wisp");
    synthetic::run_folder(&run, 12, false);
    // VISCOSE_KEEP_REPORT=FILE keeps the page for a look.
    let out = std::env::var_os("VISCOSE_KEEP_REPORT").map_or_else(|| dir.path().join("report.html"), PathBuf::from);
    let verdicts = report::write(std::slice::from_ref(&run), &out).unwrap();
    assert_eq!(verdicts[0].grade, Grade::Good, "{:?}", verdicts[0]);
    let html = fs::read_to_string(&out).unwrap();
    assert_well_formed(&html);
    assert!(
        !html.contains("http://") && !html.contains("https://") && !html.contains("src=\"/"),
        "the page must not need a network"
    );
    assert!(html.contains("Swinging wisp &lt;test&gt;"));
    assert_eq!(html.matches("data:image/png").count(), 8);
    assert_eq!(html.matches("data:image/gif").count(), 1);
    for title in [
        "Energy",
        "Momentum",
        "Step size and what limits it",
        "Iterations",
        "Residuals and defects",
        "Cost of a step",
        "Where the time went",
    ] {
        assert!(html.contains(title), "{title}");
    }
    assert!(html.contains("rods: motion 96 %"), "limiter shares");
    let text: String = html.split("base64,").map(|part| part.split_once('"').map_or(part, |p| p.1)).collect();
    assert!(!text.contains("NaN") && !text.contains("inf "), "a number that is not one");
    let again = dir.path().join("again.html");
    report::write(&[run], &again).unwrap();
    assert_eq!(html, fs::read_to_string(again).unwrap(), "the same folder gives the same page");
}

#[test]
fn ply_frames_serve_as_well() {
    let dir = tempfile::tempdir().unwrap();
    synthetic::run_folder(dir.path(), 3, true);
    let out = dir.path().join("report.html");
    report::write(&[dir.path().to_owned()], &out).unwrap();
    assert_eq!(fs::read_to_string(&out).unwrap().matches("data:image/png").count(), 6);
}

#[test]
fn a_truncated_run_says_so() {
    let dir = tempfile::tempdir().unwrap();
    synthetic::run_folder(dir.path(), 3, false);
    for file in ["summary.json", "timings.csv"] {
        fs::remove_file(dir.path().join(file)).unwrap();
    }
    let series = fs::read(dir.path().join("series.csv")).unwrap();
    fs::write(dir.path().join("series.csv"), &series[..series.len() / 2]).unwrap();
    let frame = dir.path().join("frames/strands_000003.vtp");
    let bytes = fs::read(&frame).unwrap();
    fs::write(&frame, &bytes[..bytes.len() / 2]).unwrap();
    let out = dir.path().join("report.html");
    let verdict = report::write(&[dir.path().to_owned()], &out).unwrap().remove(0);
    assert_eq!(verdict.grade, Grade::Doubtful);
    assert!(verdict.headline.starts_with("Unfinished: 0.4"), "{}", verdict.headline);
    let all: String = verdict.findings.iter().map(|f| f.1.as_str()).collect::<Vec<_>>().join("; ");
    for needle in
        ["summary.json is missing", "timings.csv is missing", "series.csv: 1 line cut short", "strands_000003.vtp"]
    {
        assert!(all.contains(needle), "{needle}: {all}");
    }
    let html = fs::read_to_string(&out).unwrap();
    assert_well_formed(&html);
    assert!(html.contains("data:image/png"));
}

#[test]
fn a_bad_run_looks_bad() {
    let dir = tempfile::tempdir().unwrap();
    synthetic::run_folder(dir.path(), 1, false);
    let summary = r#"{"status":"failed","time":0.5,"end":1.0,"steps":500,"rejected_steps":90,"mass_defect":0.02,"failure":{"message":"stage `mixture`: the solve did not converge at strand 3, vertex 7"}}"#;
    fs::write(dir.path().join("summary.json"), summary).unwrap();
    let series = fs::read_to_string(dir.path().join("series.csv")).unwrap()
        + "1001,1.001,0.001,retry,7,99,NaN,inf,0,0,0,0,0,0,0,0,0\n";
    fs::write(dir.path().join("series.csv"), series).unwrap();
    let out = dir.path().join("report.html");
    let verdict = report::write(&[dir.path().to_owned()], &out).unwrap().remove(0);
    assert_eq!(verdict.grade, Grade::Bad);
    assert_eq!(verdict.headline, "Failed at 0.5 s after 500 steps");
    let of = |needle: &str| {
        verdict.findings.iter().find(|f| f.1.contains(needle)).unwrap_or_else(|| panic!("{needle}: {verdict:?}")).0
    };
    assert_eq!(of("strand 3, vertex 7"), Grade::Bad);
    assert_eq!(of("mass defect"), Grade::Bad);
    assert_eq!(of("kinetic_energy is not finite in 1 of 1002 rows"), Grade::Bad);
    assert_eq!(of("90 of 590 tried steps rejected (15.25 %)"), Grade::Doubtful);
    assert_well_formed(&fs::read_to_string(&out).unwrap());
}

#[test]
fn many_runs_share_a_page_with_an_overview() {
    let dir = tempfile::tempdir().unwrap();
    let runs: Vec<PathBuf> = (0..3).map(|k| dir.path().join(format!("run{k}"))).collect();
    runs.iter().for_each(|run| synthetic::run_folder(run, 1, false));
    fs::remove_dir_all(runs[1].join("frames")).unwrap();
    let out = dir.path().join("report.html");
    assert_eq!(report::write(&runs, &out).unwrap().len(), 3);
    let html = fs::read_to_string(&out).unwrap();
    assert_well_formed(&html);
    assert!(html.contains("class=\"overview\"") && html.contains("id=\"run2\"") && html.contains("No frames to show"));
}

#[test]
fn a_folder_without_a_run_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let error = report::write(&[dir.path().to_owned()], &dir.path().join("report.html")).unwrap_err();
    assert!(error.to_string().contains("holds no run"));
}
