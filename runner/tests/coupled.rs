//! Strands and bulk liquid together: no liquid is lost, momentum balances, the bytes are the same every time.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use runner::run::{Ending, RunOptions, RunOutcome, Silent, execute};

fn scene_text(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/coupled").join(name);
    std::fs::read_to_string(path).unwrap()
}

fn execute_text(text: &str, set: &[&str], threads: usize, options: &RunOptions) -> RunOutcome {
    let set: Vec<String> = set.iter().map(ToString::to_string).collect();
    let loaded = runner::scene::load_str(text, Path::new("scene.ron"), &set)
        .unwrap_or_else(|error| panic!("{}", error.lines().join("\n")));
    let job = runner::prepare::job(loaded, threads).unwrap_or_else(|error| panic!("{error}"));
    execute(job, options, &mut Silent, &AtomicBool::new(false)).unwrap_or_else(|error| panic!("{error}"))
}

struct Finished {
    series: BTreeMap<String, Vec<f64>>,
}

fn run(text: &str, set: &[&str]) -> Finished {
    let folder = tempfile::tempdir().unwrap();
    let options = RunOptions { out: folder.path().join("run"), ..RunOptions::default() };
    let set: Vec<&str> = set.iter().copied().chain(["output.frames=Never"]).collect();
    let outcome = execute_text(text, &set, 1, &options);
    assert_eq!(outcome.ending, Ending::Completed, "{:?}", outcome.summary);
    let table = std::fs::read_to_string(outcome.folder.join("series.csv")).unwrap();
    let mut lines = table.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut series: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for line in lines {
        for (name, value) in names.iter().zip(line.split(',')) {
            if let Ok(value) = value.parse() {
                series.entry((*name).to_owned()).or_default().push(value);
            }
        }
    }
    assert!(series.values().flatten().all(|x| x.is_finite()));
    Finished { series }
}

impl Finished {
    fn column(&self, name: &str) -> &[f64] {
        self.series.get(name).unwrap_or_else(|| panic!("no column {name}: {:?}", self.series.keys()))
    }

    fn last(&self, name: &str) -> f64 {
        *self.column(name).last().unwrap()
    }

    fn most(&self, name: &str) -> f64 {
        self.column(name).iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }
}

/// Books of a run: liquid on strands, in bulk, in drops and gone adds up; the momentum of the strands is what acted on them.
fn balanced(run: &Finished) {
    assert!(run.most("total_liquid_mass_defect") < 1e-12, "{:e}", run.most("total_liquid_mass_defect"));
    assert!(run.most("liquid_mass_defect").abs() < 1e-12);
    // in the first steps strands hardly move, and the last digit of their stiffness shows beside so little momentum (5e-8)
    assert!(run.last("momentum_defect") < 1e-8, "{:e}", run.last("momentum_defect"));
    assert!(run.most("momentum_defect") < 1e-7, "{:e}", run.most("momentum_defect"));
    // where no solid touches the liquid its momentum, too, is that of all that is booked
    if let Some(defect) = run.series.get("liquid_momentum_defect") {
        let most = defect.iter().copied().fold(0.0, f64::max);
        assert!(most < 1e-8, "{most:e}");
    }
}

/// A strand dipped into mud and drawn out takes a film with it, and the mud lacks just that.
#[test]
fn a_strand_drawn_out_of_mud_takes_a_film_along() {
    let run = run(&scene_text("dip-and-pull.ron"), &[]);
    balanced(&run);
    let (first, last) = (run.column("liquid_mass")[0], run.last("liquid_mass"));
    let on_strand = run.last("film_mass") + run.last("reservoir_mass");
    assert!(on_strand > 0.0);
    assert!(((first - last) / on_strand - 1.0).abs() < 1e-9, "{:e} {:e}", first - last, on_strand);
    // no more than the film of this liquid on the wetted length
    let typical = 1220.0 * std::f64::consts::PI * 5e-4 * (5e-4 + 2.0 * 3e-4) * 0.01;
    assert!(on_strand < typical, "{on_strand:e} {typical:e}");
    assert!(run.most("submerged_vertices") >= 3.0);
}

/// A stream on pinned strands: books, drag downwards, and the same bytes for threads and across a resume.
#[test]
fn cream_poured_on_strands_is_accounted_for() {
    let text = scene_text("pour-on-strands.ron");
    let quick = ["time.end=0.04", "output.frames=Count(2)", "output.checkpoint=Every(0.02)"];
    let run = run(&text, &quick[..1]);
    balanced(&run);
    assert!(run.last("submerged_vertices") > 10.0);
    // the mouth of the source holds the liquid as a solid would; a block thrown at the strands is held by nothing
    assert!(!run.series.contains_key("liquid_momentum_defect"));
    let tank = r#"liquid.tanks=[(material: "liquid", shape: Box(center: [0, 0.6, 0], half_size: [0.4, 0.4, 0.4]), velocity: [0, -60, 0])]"#;
    let thrown = self::run(&text, &["time.end=0.04", "liquid.sources=[]", tank]);
    balanced(&thrown);
    assert!(thrown.last("submerged_vertices") > 10.0);
    assert!(thrown.series.contains_key("liquid_momentum_defect"));
    assert!(run.last("drag_impulse_y") < 0.0 && run.last("middle_y") < run.column("middle_y")[0]);
    let bytes = |threads: usize| {
        let folder = tempfile::tempdir().unwrap();
        let options = RunOptions { out: folder.path().join("run"), ..RunOptions::default() };
        execute_text(&text, &quick, threads, &options);
        std::fs::read(folder.path().join("run/series.csv")).unwrap()
    };
    let whole = bytes(1);
    assert!(whole == bytes(2), "two threads give other bytes than one");
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    let first = RunOptions { out: out.clone(), until: Some(0.029), ..RunOptions::default() };
    assert!(matches!(execute_text(&text, &quick, 1, &first).ending, Ending::Stopped(_)));
    let rest = RunOptions { out: out.clone(), resume: true, ..RunOptions::default() };
    assert_eq!(execute_text(&text, &quick, 1, &rest).ending, Ending::Completed);
    assert!(whole == std::fs::read(out.join("series.csv")).unwrap(), "a resumed run gives other bytes");
}

/// A film that runs off the tip of a strand becomes particles that fall; none of it is lost.
#[test]
fn drops_become_particles() {
    let text = r#"Scene(
        units: Cgs, time: (end: 0.1, step: Fixed(1e-3)), gravity: [0, -981, 0],
        materials: { "rubber": Fibre(density: 1.3, young_modulus: 1e9, poisson_ratio: 0.45, viscosity: 1e5), "water": Liquid(preset: "water") },
        strands: [(material: "rubber", radius: 0.05, shape: Straight(from: [0, 1, 0], to: [0, 0, 0], vertices: 11), clamp: [First(2)],
                   film: (height: 0.03))],
        liquid: (cell: 0.25, particles_per_cell: 64, domain: (low: [-1, -1, -1], high: [1, 2, 1])),
        output: (checkpoint: Never),
    )"#;
    let run = run(text, &[]);
    balanced(&run);
    assert_eq!(run.column("liquid_particles")[0], 0.0);
    assert!(run.last("liquid_particles") >= 1.0);
    let fallen = run.last("liquid_mass") + run.last("liquid_drained_mass");
    assert!((fallen / run.last("dripped_mass") - 1.0).abs() < 1e-12);
    assert!(run.last("liquid_center_y") < 0.0);
}

/// Outer iterations: momentum stays in the books, and strands and liquid are iterated until they agree.
#[test]
fn outer_iterations_agree_and_keep_the_books() {
    let text = scene_text("pour-on-strands.ron");
    let many = run(&text, &["time.end=0.03", "solver.coupling.iterations=30", "solver.coupling.tolerance=1e-2"]);
    balanced(&many);
    assert!(many.most("outer_iterations") > 1.0);
    assert!(many.most("outer_change") <= 1e-2, "{:e}", many.most("outer_change"));
}

/// Switched off, drag leaves the strand alone, and capture leaves the liquid.
#[test]
fn coupling_can_be_switched_off() {
    let text = scene_text("dip-and-pull.ron");
    let off = |component: &str| run(&text, &["time.end=0.12", &format!("disable=[{component}]")]);
    assert_eq!(off("Drag").last("drag_impulse_y"), 0.0);
    assert_eq!(off("Capture").most("film_mass"), 0.0);
    assert_eq!(off("VolumeFraction").most("solid_fraction_max"), 0.0);
    // the form of the reference code runs too
    let parity = run(&text, &["time.end=0.12", "parity.drag_in_faces=true", "parity.lose_transverse=true"]);
    assert_ne!(parity.last("drag_impulse_y"), 0.0);
}
