//! Hard scenes of yarns.

use runner::run::Ending;
use serde_json::Value;

use super::{OVERRIDE, SceneRun};
use crate::case::{Case, CaseError, Outcome, Params};

macro_rules! scene {
    ($name:literal) => {
        include_str!(concat!("../../../scenes/hard/", $name, ".ron"))
    };
}

/// The cases.
pub fn cases() -> Vec<Case> {
    let case = |id, about, run| Case { id, about, params: OVERRIDE, run };
    vec![
        case("hard/yarn-crushed", "plates close on a bundle to a fiftieth of its height", crushed),
        case("hard/yarn-dense", "yarns four times denser than the grid, under ten times gravity", dense),
        case("hard/yarn-frictionless", "no friction, no shear modulus, neither, in one collision", frictionless),
        case("hard/yarn-leaves", "a yarn that flies out of the box stops the run with its name", leaves),
        case("hard/yarn-long-step", "a step twenty times too large is divided, or refused, with its reason", long_step),
        case("hard/yarn-massless", "forces on nodes without mass are recorded as lost", massless),
        case("hard/yarn-obstacles", "small, fast, crossing solids, and one that a yarn starts in", obstacles),
        case("hard/yarn-sagging", "a sagging yarn keeps its length; with the printed frame it does not", sagging),
        case("hard/yarn-stiff", "a stretch modulus of 10⁶ Pa at the step of the motion", stiff),
        case("hard/yarn-two-vertices", "yarns of one segment: free, and held at one end", two_vertices),
    ]
}

fn finite(out: &mut Outcome, run: &SceneRun) {
    let finite = f64::from(u8::from(run.series.all_finite()));
    out.measure("finite", finite, |x| x == 1.0, "every recorded number is finite");
}

fn kept(out: &mut Outcome, run: &SceneRun, part: f64) {
    out.compare_absolute("momentum_defect", run.figure("momentum_defect"), 0.0, part);
}

fn judged(run: &SceneRun) -> Outcome {
    let mut out = begun(run);
    kept(&mut out, run, 1e-8);
    out
}

fn begun(run: &SceneRun) -> Outcome {
    let mut out = Outcome::new();
    out.measure("completed", run.completed(), |x| x == 1.0, "the run comes to its end");
    finite(&mut out, run);
    out.info("steps", run.figure("steps"));
    out.info("yarn_steps", run.figure("yarn_steps"));
    out
}

fn largest(run: &SceneRun, column: &str) -> Result<f64, CaseError> {
    Ok(run.series.column(column)?.iter().copied().fold(f64::NEG_INFINITY, f64::max))
}

fn crushed(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("yarn-crushed"), "yarn-crushed.ron", params)?;
    let mut out = judged(&run);
    out.measure("flattened", run.figure("flattened"), |n| n > 0.0, "sections at the smallest stretch are counted");
    out.info("largest_pressure", largest(&run, "largest_pressure")?);
    Ok(out)
}

fn dense(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("yarn-dense"), "yarn-dense.ron", params)?;
    let mut out = judged(&run);
    let growth = run.series.largest_growth("total_energy")?;
    out.measure("energy_growth", growth, |x| x <= 1e-3, "energy grows by no more than 1e-3 of its largest in a step");
    Ok(out)
}

fn frictionless(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("yarn-frictionless"), "yarn-frictionless.ron", params)?;
    Ok(judged(&run))
}

fn leaves(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("yarn-leaves"), "yarn-leaves.ron", params)?;
    let mut out = Outcome::new();
    finite(&mut out, &run);
    let named = match &run.ending {
        Ending::Failed(failure) => {
            let text = failure.rejection.to_string();
            text.contains("yarn 0, vertex") && text.contains("outside the domain")
        }
        _ => false,
    };
    out.measure("named", f64::from(u8::from(named)), |x| x == 1.0, "the run stops and names the yarn and the vertex");
    let time = run.figure("time");
    out.measure("time", time, |t| (0.009..0.013).contains(&t), "it stops when the yarn reaches the top, after 10.3 ms");
    Ok(out)
}

fn long_step(params: &Params) -> Result<Outcome, CaseError> {
    let text = scene!("yarn-long-step");
    let run = SceneRun::hard(text, "yarn-long-step.ron", params)?;
    let mut out = judged(&run);
    let (steps, divided) = (run.figure("steps"), run.figure("divided_steps"));
    out.compare_absolute("undivided", steps - divided, 0.0, 0.0);
    let parts = run.figure("yarn_steps") / steps;
    out.measure("parts", parts, |n| n >= 20.0, "each step is divided into at least twenty");
    let refused = SceneRun::of(text, "yarn-long-step.ron", &["yarn.oversized=Refuse".to_owned()])?;
    out.measure(
        "refused",
        refused.figure("rejected_steps"),
        |n| n >= 4.0,
        "where steps may not be divided they are refused, until the step control has halved them far enough",
    );
    out.measure("completed_when_refused", refused.completed(), |x| x == 1.0, "and the run comes to its end");
    Ok(out)
}

fn massless(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("yarn-massless"), "yarn-massless.ron", params)?;
    let mut out = judged(&run);
    out.info("lost_momentum", largest(&run, "lost_momentum")?);
    out.info("massless_nodes", largest(&run, "massless_nodes")?);
    Ok(out)
}

fn obstacles(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("yarn-obstacles"), "yarn-obstacles.ron", params)?;
    let mut out = judged(&run);
    let warned = |words: &str| {
        let list = run.summary.get("warnings").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
        f64::from(u8::from(list.iter().filter_map(Value::as_str).any(|line| line.contains(words))))
    };
    out.measure("warned_of_small", warned("obstacle 3 is 1.02 cells wide"), |x| x == 1.0, "the small solid is named");
    out.measure(
        "warned_of_inside",
        warned("starts inside obstacle 4"),
        |x| x == 1.0,
        "the solid it starts in is named",
    );
    let fastest = run.series.column("dt")?[1..].iter().copied().fold(f64::INFINITY, f64::min);
    let most = 0.3 / 64.0 / 50.0;
    out.measure("smallest_step", fastest, |dt| dt <= most * 1.001, "steps are no longer than 0.3 cells at 50 m/s");
    out.info("largest_depth", run.figure("largest_solid_depth"));
    Ok(out)
}

fn sagging(params: &Params) -> Result<Outcome, CaseError> {
    let text = scene!("yarn-sagging");
    let run = SceneRun::hard(text, "yarn-sagging.ron", params)?;
    let mut out = judged(&run);
    let strain = largest(&run, "largest_stretch")?;
    out.measure("strain", strain, |e| e < 0.02, "the yarn keeps its length within 2 %");
    let printed = SceneRun::of(text, "yarn-sagging.ron", &["yarn.compat=true".to_owned()])?;
    let frames = printed.frames("yarns")?;
    let length =
        |points: &[[f64; 3]]| -> f64 { points.windows(2).map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1])).sum() };
    let longer = match (frames.first(), frames.last()) {
        (Some((_, start)), Some((_, end))) => length(end) / length(start) - 1.0,
        _ => f64::NAN,
    };
    let wrong = printed.completed() == 0.0 || longer > 0.05;
    out.measure(
        "printed_fails",
        f64::from(u8::from(wrong)),
        |x| x == 1.0,
        "the printed frame lets it stretch or fails",
    );
    out.info("printed_strain", longer);
    Ok(out)
}

fn stiff(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("yarn-stiff"), "yarn-stiff.ron", params)?;
    let mut out = begun(&run);
    // An implicit step balances momentum as well as it is solved.
    kept(&mut out, &run, 1e-7);
    let strain = largest(&run, "largest_stretch")?;
    out.measure("strain", strain, |e| e < 2e-4, "strains stay below 2e-4");
    // Explicit steps: 0.7 of 2/ω with ω² = 4 k/((1 − s₃) ρ l²).
    let explicit = 0.7 * (0.5f64 * 1.0 / 1e6).sqrt() * 0.5 / 64.0;
    let mean = run.figure("time") / run.figure("yarn_steps");
    out.measure("step_gain", mean / explicit, |x| x >= 10.0, "the mean step is at least ten times the explicit one");
    out.info("newton_per_step", run.figure("newton_iterations") / run.figure("yarn_steps"));
    Ok(out)
}

fn two_vertices(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("yarn-two-vertices"), "yarn-two-vertices.ron", params)?;
    let mut out = judged(&run);
    let (free, held) = (run.series.vector("free")?, run.series.vector("held")?);
    let dt = 5e-5;
    let mut off = 0.0f64;
    for (n, x) in free.iter().enumerate() {
        let n = n as f64;
        off = off.max((x[1] - 0.5 * n * dt + 9.8 * dt * dt * n * (n + 1.0) / 2.0).abs()).max((x[0] - 0.0078125).abs());
    }
    out.compare_absolute("free_fall", off, 0.0, 1e-12);
    let moved = held.iter().map(|x| (x[0] - 0.3).hypot(x[1])).fold(0.0, f64::max);
    out.compare_absolute("held_end", moved, 0.0, 1e-14);
    Ok(out)
}
