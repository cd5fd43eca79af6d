//! Contact in scenes: what touches holds, what is fast does not pass through, and the bytes are the same every time.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use runner::run::{Ending, RunOptions, RunOutcome, Silent, execute};

fn scene_path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes").join(name)
}

fn run_text(text: &str, set: &[&str], options: &RunOptions) -> RunOutcome {
    let set: Vec<String> = set.iter().map(ToString::to_string).collect();
    let loaded = runner::scene::load_str(text, Path::new("scene.ron"), &set)
        .unwrap_or_else(|error| panic!("{}", error.lines().join("\n")));
    let job = runner::prepare::job(loaded, 1).unwrap_or_else(|error| panic!("{error}"));
    execute(job, options, &mut Silent, &AtomicBool::new(false)).unwrap_or_else(|error| panic!("{error}"))
}

/// A finished run in a folder of its own.
struct Finished {
    outcome: RunOutcome,
    series: BTreeMap<String, Vec<f64>>,
    _folder: tempfile::TempDir,
}

fn run(text: &str, set: &[&str]) -> Finished {
    let folder = tempfile::tempdir().unwrap();
    let options = RunOptions { out: folder.path().join("run"), ..RunOptions::default() };
    let outcome = run_text(text, set, &options);
    let series = series(&outcome.folder.join("series.csv"));
    Finished { outcome, series, _folder: folder }
}

fn scene(name: &str, set: &[&str]) -> Finished {
    run(&std::fs::read_to_string(scene_path(name)).unwrap(), set)
}

fn series(path: &Path) -> BTreeMap<String, Vec<f64>> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut columns: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for line in lines {
        for (name, value) in names.iter().zip(line.split(',')) {
            if let Ok(value) = value.parse() {
                columns.entry((*name).to_owned()).or_default().push(value);
            }
        }
    }
    columns
}

impl Finished {
    fn column(&self, name: &str) -> &[f64] {
        self.series.get(name).unwrap_or_else(|| panic!("no column {name}: {:?}", self.series.keys()))
    }

    fn most(&self, name: &str) -> f64 {
        self.column(name).iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }

    fn completed(&self) {
        assert_eq!(self.outcome.ending, Ending::Completed, "{:?}", self.outcome.summary);
        assert!(self.series.values().flatten().all(|x| x.is_finite()));
    }
}

/// Two strands pulled against each other hold: the one pulled up stays below the one pulled down.
#[test]
fn crossed_strands_do_not_pass_through() {
    let run = scene("contact/crossed-strands.ron", &["output.frames=Count(2)", "cross_check=40"]);
    run.completed();
    assert!(run.most("contacts") >= 1.0);
    assert_eq!(run.most("contact_warnings"), 0.0);
    let (lower, upper) = (run.column("lower_y"), run.column("upper_y"));
    let nearest = lower.iter().zip(upper).map(|(a, b)| b - a).fold(f64::INFINITY, f64::min);
    // the strands pass each other between vertices, where a bent strand sags by a little
    assert!(nearest > 0.8e-3, "axes come as near as {nearest} m, radii sum to 1e-3");
    assert!(run.most("worst_penetration") < 5e-6, "{}", run.most("worst_penetration"));
    // as long as the strands hardly move, the round-off of their elastic forces (EA eps = 2e-15 N) is all there is to see
    assert!(run.most("momentum_defect") < 1e-7, "{}", run.most("momentum_defect"));
    assert!(run.column("momentum_defect").last().unwrap() < &1e-10, "{:?}", run.column("momentum_defect").last());
    assert!(run.most("cross_check_difference") < 1e-6, "{}", run.most("cross_check_difference"));
    let told = &run.outcome.summary["cross_check"];
    assert!(told["problems"].as_u64().unwrap() >= 4 && told["undecided"] == 0, "{told}");
}

/// At a hundred radii per step neither a wall nor a strand is passed.
#[test]
fn fast_strands_do_not_tunnel() {
    let run = scene("hard/fast-strand.ron", &["output.frames=Never"]);
    run.completed();
    assert!(run.most("at_wall_x") < 0.0, "{}", run.most("at_wall_x"));
    // the middle of the flying strand never gets ahead of the strand it hits by more than touching allows
    let ahead = run.column("at_strand_x").iter().zip(run.column("hit_x")).map(|(a, b)| a - b);
    let most = ahead.fold(f64::NEG_INFINITY, f64::max);
    assert!(most < 0.0, "{most}");
    assert!(run.most("worst_penetration") < 5e-5, "{}", run.most("worst_penetration"));
}

/// Below the angle of friction a rod stays to round-off; above it slides with g (sin − ν cos).
#[test]
fn a_rod_on_an_incline_sticks_and_slides() {
    let still = scene("contact/incline.ron", &[]);
    still.completed();
    let start = still.column("middle_x")[0];
    let moved = still.column("middle_x").iter().map(|x| (x - start).abs()).fold(0.0, f64::max);
    assert!(moved < 1e-12, "moved by {moved} m");
    assert_eq!(*still.column("slipping").last().unwrap(), 0.0);

    let sliding = scene("contact/incline.ron", &["strands[0].friction=0.2", "solids[0].friction=0.2"]);
    sliding.completed();
    let angle = 20.0_f64.to_radians();
    let expected = 9.81 * (angle.sin() - 0.2 * angle.cos());
    let (v, t) = (sliding.column("middle_vx").last().unwrap(), sliding.column("time").last().unwrap());
    assert!((v / t / expected - 1.0).abs() < 1e-6, "{} instead of {expected}", v / t);
    // exact friction does not lift what slides
    assert!(sliding.most("middle_y") < 1e-3 + 1e-9, "{}", sliding.most("middle_y"));
    assert!(sliding.most("momentum_defect") < 1e-9, "{}", sliding.most("momentum_defect"));
    // the plane carries the weight: the normal force is the mass times the normal part of gravity
    let weight = sliding.column("strand_mass").last().unwrap() * 9.81 * angle.cos();
    let carried = -sliding.column("plane_force_y").last().unwrap();
    assert!((carried / weight - 1.0).abs() < 1e-6, "{carried} {weight}");
}

/// A rubbed bundle gives the same bytes on one and two threads, and across a stop and resume.
#[test]
fn the_same_bytes_for_any_threads_and_across_a_resume() {
    let text = std::fs::read_to_string(scene_path("contact/crossed-strands.ron")).unwrap();
    let quick = ["output.frames=Never", "output.checkpoint=Steps(5)", "time.end=0.2"];
    let bytes = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let run = run(&text, &quick);
            run.completed();
            assert!(run.most("contacts") > 0.0, "{}", run.most("contacts"));
            std::fs::read(run.outcome.folder.join("series.csv")).unwrap()
        })
    };
    let whole = bytes(1);
    assert!(whole == bytes(2), "two threads give other bytes than one");
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    let first = RunOptions { out: out.clone(), until: Some(0.105), ..RunOptions::default() };
    assert!(matches!(run_text(&text, &quick, &first).ending, Ending::Stopped(_)));
    let rest = RunOptions { out: out.clone(), resume: true, ..RunOptions::default() };
    assert_eq!(run_text(&text, &quick, &rest).ending, Ending::Completed);
    assert!(whole == std::fs::read(out.join("series.csv")).unwrap(), "a resumed run gives other bytes");
}

/// What nothing touches costs nothing: no columns, no memory; a component switched off is absent.
#[test]
fn contact_is_absent_where_nothing_can_touch() {
    let text = std::fs::read_to_string(scene_path("contact/crossed-strands.ron")).unwrap();
    let off = text.replace("contact: (tolerance: 1e-8),", "disable: [StrandContact],");
    let run = run(&off, &["output.frames=Never", "time.end=0.005"]);
    assert!(!run.series.contains_key("contacts"));
}

/// The bundle with a dozen hairs, the cylinder nearer by what that makes it thinner.
fn small_bundle() -> String {
    let text = std::fs::read_to_string(scene_path("contact/bundle.ron")).unwrap();
    text.replace("count: 64", "count: 12").replace("0.0037", "0.0034")
}

/// An unsolvable tolerance counts as a warning or refuses the step, as the scene says, and leaves the problem behind.
#[test]
fn an_unsolved_problem_is_told_and_kept() {
    let text = small_bundle();
    let hopeless =
        ["contact.solver=GaussSeidel", "contact.max_iterations=1", "contact.tolerance=1e-13", "time.end=0.012"];
    let set: Vec<&str> = hopeless.iter().copied().chain(["output.frames=Never"]).collect();
    let on = run(&text, &set);
    on.completed();
    assert!(on.most("contact_warnings") > 0.0);
    let kept = ::contact::job::read_problem(&on.outcome.folder.join("unsolved-contact.ron")).unwrap();
    assert!(kept.len() > 1);
    let mut set = set;
    set.push("contact.on_failure=Reject");
    let out = run(&text, &set);
    assert!(matches!(out.outcome.ending, Ending::Failed(_)), "{:?}", out.outcome.ending);
    assert!(out.outcome.folder.join("unsolved-contact.ron").exists());
}

/// A step warns where its last problem missed the tolerance, and only there: a round before it that missed was on the way.
#[test]
fn a_step_warns_by_its_last_round() {
    let set = [
        "contact.solver=GaussSeidel",
        "contact.max_iterations=20",
        "contact.relinearisations=4",
        "contact.tolerance=1e-3",
        "time.end=0.012",
        "output.frames=Never",
    ];
    let run = run(&small_bundle(), &set);
    run.completed();
    let warnings = run.column("contact_warnings");
    let mut before = 0.0;
    let (mut told, mut fine) = (0, 0);
    for (step, (warned, residual)) in warnings.iter().zip(run.column("contact_residual")).enumerate() {
        let missed = *residual > 1e-3;
        assert_eq!(warned - before, f64::from(u8::from(missed)), "step {step}: residual {residual}");
        before = *warned;
        if run.column("contacts")[step] > 1.0 {
            told += usize::from(missed);
            fine += usize::from(!missed);
        }
    }
    assert!(told > 0 && fine > 0, "{told} {fine}");
}

/// Where contacts are so many that rounds are solved roughly first, the bytes do not depend on threads either.
#[test]
fn rough_rounds_give_the_same_bytes_for_any_threads() {
    let text = std::fs::read_to_string(scene_path("contact/bundle.ron")).unwrap();
    let bytes = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let run = run(&text, &["output.frames=Never", "time.end=0.006"]);
            run.completed();
            assert!(run.most("contacts") >= 200.0, "{}", run.most("contacts"));
            assert_eq!(run.most("contact_warnings"), 0.0);
            std::fs::read(run.outcome.folder.join("series.csv")).unwrap()
        })
    };
    assert!(bytes(1) == bytes(2), "two threads give other bytes than one");
}

/// Strands of a wisp that cross next to their clamps are wedged there: not all of them can be pushed apart. The step takes no more
/// work than one that can be solved (counted, not timed: without giving way it grew for more than ten minutes).
#[test]
fn wedged_strands_give_way() {
    let text = std::fs::read_to_string(scene_path("coupled/dipped-wisp.ron")).unwrap();
    let text = text.replace("arrangement: Even, ", "").replace("count: 8", "count: 50");
    let run = run(&text, &["output.frames=Never", "time.end=0.004", "time.step=Fixed(4e-3)"]);
    run.completed();
    assert!(run.most("contacts") > 20.0 && run.most("contacts") < 1000.0, "{}", run.most("contacts"));
    assert!(run.most("contact_iterations") < 20_000.0, "{}", run.most("contact_iterations"));
}

/// Walls that close in on a strand leave no solution even at rest. The contacts become soft: the run ends with finite numbers, and
/// warns.
#[test]
fn a_strand_between_closing_walls_warns_and_goes_on() {
    let text = r#"Scene(
        units: Si, time: (end: 0.01, step: Fixed(1e-3)),
        materials: { "noodle": Fibre(density: 1200, young_modulus: 1e7, poisson_ratio: 0.4, viscosity: 1e3) },
        strands: [(material: "noodle", radius: 1e-3, shape: Straight(from: [0, 0, -0.01], to: [0, 0, 0.01], vertices: 9), friction: 0.3)],
        solids: [
            (name: "left", shape: HalfSpace(point: [-0.00105, 0, 0], normal: [1, 0, 0]), friction: 0.3, motion: [Translate(by: [0.0002, 0, 0], during: (0, 0.01))]),
            (name: "right", shape: HalfSpace(point: [0.00105, 0, 0], normal: [-1, 0, 0]), friction: 0.3, motion: [Translate(by: [-0.0002, 0, 0], during: (0, 0.01))]),
        ],
    )"#;
    let run = run(text, &["output.frames=Never"]);
    run.completed();
    assert!(run.most("contact_warnings") > 0.0);
    assert!(run.most("kinetic_energy") < 1e-4, "{}", run.most("kinetic_energy"));
}

/// Strands of a wisp at random cross each other, and the message says what to write; evenly arranged ones do not.
#[test]
fn strands_that_overlap_at_the_start_are_told() {
    let told = |set: &[&str]| {
        let set: Vec<String> = set.iter().map(ToString::to_string).collect();
        let loaded = runner::scene::load(scene_path("coupled/dipped-wisp.ron"), &set).unwrap();
        runner::overlap::at_start(&loaded.scene).unwrap()
    };
    let random = told(&["strands[0].shape.count=50", "strands[0].shape.arrangement=Random"]);
    assert_eq!(random.len(), 1);
    let (strands, of, radii) = (random[0].strands, random[0].of, random[0].radii);
    assert!(strands > 1 && of == 50 && radii > 0.1 && radii <= 2.0, "{strands} {of} {radii}");
    let text = random[0].to_string();
    for part in ["strands[0]: ", " of 50 strands overlap", "`arrangement: Even`"] {
        assert!(text.contains(part), "{text}");
    }
    assert_eq!(told(&["strands[0].shape.count=50"]), Vec::new());
}
