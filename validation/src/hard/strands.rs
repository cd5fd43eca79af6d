//! Hard scenes of strands.

use std::f64::consts::PI;

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
        case("hard/curl-release", "a hair held straight leaves its unstable equilibrium and curls", curl_release),
        case("hard/edge-contrast", "edges of 1:1000 in one strand bend like even ones", edge_contrast),
        case("hard/folded-rod", "a rod folded back on itself springs open", folded_rod),
        case("hard/mixed-sizes", "strands batched together end with the bits they have alone", mixed_sizes),
        case("hard/nothing", "an empty scene ends at once", nothing),
        case("hard/rest", "nothing moves in 100 000 steps without load", rest),
        case("hard/shaken-root", "a root shaken at 10⁴ m/s² goes exactly where it should", shaken_root),
        case("hard/softest-rod", "Young's modulus 10³ Pa", softest_rod),
        case("hard/step-change", "a step that changes all the time adds no energy", step_change),
        case("hard/stiff-hair", "stretching 10⁷ times stiffer than bending", stiff_hair),
        case("hard/stiffest-rod", "Young's modulus 10¹² Pa", stiffest_rod),
        case("hard/two-hundred-turns", "torque stays proportional over two hundred turns", two_hundred_turns),
        case("hard/two-vertices", "strands of one edge: free, pendulum, held", two_vertices),
    ]
}

fn judged(run: &SceneRun) -> Outcome {
    let mut out = Outcome::new();
    out.measure("completed", run.completed(), |x| x == 1.0, "the run comes to its end");
    let finite = f64::from(u8::from(run.series.all_finite()));
    out.measure("finite", finite, |x| x == 1.0, "every recorded number is finite");
    out.info("steps", run.figure("steps"));
    out.info("rejected_steps", run.figure("rejected_steps"));
    out
}

fn energy_never_grows(out: &mut Outcome, run: &SceneRun, part: f64) -> Result<(), CaseError> {
    let growth = run.series.largest_growth("total_energy")?;
    let why = format!("the energy never grows by more than {part:e} of its largest value in a step");
    out.measure("energy_growth", growth, |x| x <= part, &why);
    Ok(())
}

fn newton_below(out: &mut Outcome, run: &SceneRun, most: f64) -> Result<(), CaseError> {
    let worst = run.series.column("rod_iterations")?.iter().copied().fold(0.0, f64::max);
    out.measure("newton_iterations", worst, |x| x <= most, &format!("at most {most} Newton iterations in any step"));
    Ok(())
}

fn converged(out: &mut Outcome, run: &SceneRun) -> Result<(), CaseError> {
    let worst = run.series.column("rod_residual")?.iter().copied().fold(0.0, f64::max);
    out.measure("residual", worst, |x| x <= 1.0, "every accepted step met the tolerance (residual over tolerance)");
    Ok(())
}

fn probe(run: &SceneRun, name: &str) -> Result<Vec<[f64; 3]>, CaseError> {
    run.series.vector(name)
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2) + (a[2] - b[2]).powi(2)).sqrt()
}

fn last<T: Copy>(values: &[T]) -> Result<T, CaseError> {
    values.last().copied().ok_or_else(|| CaseError::Failed("the series is empty".to_owned()))
}

fn curl_release(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("curl-release"), "curl-release.ron", params)?;
    let mut out = judged(&run);
    converged(&mut out, &run)?;
    energy_never_grows(&mut out, &run, 1e-8)?;
    let reach = distance(&last(&probe(&run, "tip")?)?, &[0.0; 3]) / 0.06;
    out.measure("reach", reach, |x| x <= 2.0 / 3.0, "the tip came nearer to the root by a third of the length");
    Ok(out)
}

fn edge_contrast(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("edge-contrast"), "edge-contrast.ron", params)?;
    let mut out = judged(&run);
    newton_below(&mut out, &run, 15.0)?;
    let (mut uneven, even) = (last(&probe(&run, "uneven")?)?, last(&probe(&run, "even")?)?);
    uneven[2] = even[2]; // they hang side by side
    let difference = distance(&uneven, &even) / 0.04;
    out.measure("tip_difference", difference, |x| x <= 0.01, "the tips agree within 1 % of the length");
    Ok(out)
}

fn folded_rod(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("folded-rod"), "folded-rod.ron", params)?;
    let mut out = judged(&run);
    energy_never_grows(&mut out, &run, 1e-6)?;
    let (root, tip) = (probe(&run, "root")?, probe(&run, "tip")?);
    let (start, end) = (distance(&root[0], &tip[0]), distance(&last(&root)?, &last(&tip)?));
    out.measure("opening", end / start, |x| x > 1.0, "the ends are farther apart at the end than at the start");
    Ok(out)
}

fn mixed_sizes(params: &Params) -> Result<Outcome, CaseError> {
    let text = scene!("mixed-sizes");
    let together = SceneRun::hard(text, "mixed-sizes.ron", params)?;
    let mut out = judged(&together);
    let whole = together.frames("strands")?;
    let (_, positions) = whole.last().ok_or_else(|| CaseError::Failed("no frames".to_owned()))?;
    // each line of the scene that starts a strand group is kept alone
    let groups: Vec<&str> = text.lines().filter(|line| line.trim_start().starts_with("(material:")).collect();
    let mut first = 0;
    let mut different = 0;
    for kept in &groups {
        let alone: String = text
            .lines()
            .filter(|line| !groups.contains(line) || line == kept)
            .map(|line| format!("{line}\n"))
            .collect();
        let run = SceneRun::of(&alone, "mixed-sizes-alone.ron", &[])?;
        let frames = run.frames("strands")?;
        let (_, own) = frames.last().ok_or_else(|| CaseError::Failed("no frames".to_owned()))?;
        let batched = &positions[first..first + own.len()];
        let same = own.iter().flatten().zip(batched.iter().flatten()).all(|(a, b)| a.to_bits() == b.to_bits());
        different += usize::from(!same);
        first += own.len();
    }
    out.measure("strands", groups.len() as f64, |x| x >= 6.0, "all strands of the scene were compared");
    out.measure("different", different as f64, |x| x == 0.0, "every strand ends with the same bits as alone");
    Ok(out)
}

fn nothing(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("nothing"), "nothing.ron", params)?;
    Ok(judged(&run))
}

fn rest(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("rest"), "rest.ron", params)?;
    let mut out = judged(&run);
    out.measure("all_steps", run.figure("steps"), |x| x >= 1e5, "a hundred thousand steps were taken");
    let length = 3.0 * (2.0 * PI * 0.01_f64).hypot(0.01);
    let frames = run.frames("strands")?;
    let moved = match (frames.first(), frames.last()) {
        (Some((_, start)), Some((_, end))) => start.iter().zip(end).map(|(a, b)| distance(a, b)).fold(0.0, f64::max),
        _ => f64::NAN,
    };
    out.measure("moved", moved / length, |x| x <= 1e-12, "no vertex moved by more than 1e-12 of the length");
    let mass = run.figure("strand_mass");
    let momentum = |name: &str, scale: f64| -> Result<f64, CaseError> {
        Ok(run.series.vector(name)?.iter().map(|p| distance(p, &[0.0; 3])).fold(0.0, f64::max) / scale)
    };
    let linear = momentum("momentum", mass * length)?;
    out.measure("momentum", linear, |x| x <= 1e-12, "momentum stays below 1e-12 of mass times length per second");
    let angular = momentum("angular_momentum", mass * length * length)?;
    out.measure("angular_momentum", angular, |x| x <= 1e-12, "and angular momentum likewise");
    Ok(out)
}

fn shaken_root(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("shaken-root"), "shaken-root.ron", params)?;
    let mut out = judged(&run);
    let (time, root) = (run.series.column("time")?, probe(&run, "root")?);
    let wanted = |t: f64| 0.02533 * ((2.0 * PI * 100.0 * t + PI / 2.0).sin() - 1.0);
    let off = time.iter().zip(&root).map(|(t, x)| distance(x, &[wanted(*t), 0.0, 0.0])).fold(0.0, f64::max);
    out.measure("root_error", off, |x| x <= 1e-12, "the root is where the script says to 1e-12 m");
    let length = |points: &[[f64; 3]]| points.windows(2).map(|pair| distance(&pair[0], &pair[1])).sum::<f64>();
    let change = run.frames("strands")?.iter().map(|(_, x)| (length(x) / 0.05 - 1.0).abs()).fold(0.0, f64::max);
    out.measure("length_change", change, |x| x <= 0.01, "the length never changes by more than 1 %");
    Ok(out)
}

fn softest_rod(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("softest-rod"), "softest-rod.ron", params)?;
    let mut out = judged(&run);
    converged(&mut out, &run)?;
    energy_never_grows(&mut out, &run, 1e-8)?;
    for decade in 4..=11 {
        let set = format!("materials.rod.young_modulus=1e{decade}");
        let run = SceneRun::of(scene!("softest-rod"), "softest-rod.ron", &[set])?;
        let growth = run.series.largest_growth("total_energy")?;
        let name = format!("energy_growth_1e{decade}");
        out.measure(&name, growth, |x| x <= 1e-8 && run.completed() == 1.0, "likewise for every decade of stiffness");
    }
    Ok(out)
}

fn step_change(params: &Params) -> Result<Outcome, CaseError> {
    let text = scene!("step-change");
    let run = SceneRun::hard(text, "step-change.ron", params)?;
    let mut out = judged(&run);
    energy_never_grows(&mut out, &run, 1e-8)?;
    let off = run
        .frames("strands")?
        .iter()
        .enumerate()
        .map(|(k, (time, _))| (time - (k as f64 * 0.00737).min(0.5)).abs())
        .fold(0.0, f64::max);
    out.measure("frame_time_error", off, |x| x <= 1e-14, "frames stand exactly at their times");
    let plain = SceneRun::of(text, "step-change.ron", &["output.frames=Never".to_owned()])?;
    let tips = (last(&probe(&run, "tip")?)?, last(&probe(&plain, "tip")?)?);
    let difference = distance(&tips.0, &tips.1) / 0.05;
    out.measure(
        "tip_difference",
        difference,
        |x| x <= 0.02,
        "the tip agrees with an even run within 2 % of the length",
    );
    Ok(out)
}

fn stiff_hair(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("stiff-hair"), "stiff-hair.ron", params)?;
    let mut out = judged(&run);
    newton_below(&mut out, &run, 14.0)?;
    energy_never_grows(&mut out, &run, 1e-8)?;
    Ok(out)
}

fn stiffest_rod(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("stiffest-rod"), "stiffest-rod.ron", params)?;
    let mut out = judged(&run);
    converged(&mut out, &run)?;
    energy_never_grows(&mut out, &run, 1e-8)?;
    let tip = probe(&run, "tip")?;
    let farthest = tip.iter().map(|x| distance(x, &tip[0])).fold(0.0, f64::max);
    out.measure("tip_motion", farthest, |x| x <= 5e-8, "the tip stays within 5e-8 m of its start");
    Ok(out)
}

fn two_hundred_turns(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("two-hundred-turns"), "two-hundred-turns.ron", params)?;
    let mut out = judged(&run);
    // clamp 1 turns the tip about x; the rod between the effective clamps has 49 of its 50 edges
    let torque = run.series.column("clamp1_torque_x")?;
    let shear = 1e7 / (2.0 * 1.3);
    let (a, edges) = (5e-4_f64, 49.0);
    let expected = shear * 0.5 * PI * a.powi(4) * (200.0 * 2.0 * PI) / (edges * 0.01);
    out.compare("torque", last(torque)?, expected, 0.01);
    let jump = torque.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max) / expected;
    out.measure("torque_jump", jump, |x| x <= 0.05, "no jump above 5 % of the final torque");
    let off = run.frames("strands")?.iter().flat_map(|(_, x)| x.clone()).map(|x| x[1].hypot(x[2])).fold(0.0, f64::max);
    out.measure("off_line", off, |x| x <= 1e-6, "no vertex leaves the line by more than 1e-6 m");
    Ok(out)
}

fn two_vertices(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("two-vertices"), "two-vertices.ron", params)?;
    let mut out = judged(&run);
    let frames = run.frames("strands")?;
    let (mut fall, mut stretch, mut held) = (0.0_f64, 0.0_f64, 0.0_f64);
    for (t, x) in &frames {
        // the implicit midpoint rule follows a parabola exactly
        let center = [0.5 * (x[0][0] + x[1][0]), 0.5 * (x[0][1] + x[1][1]), 0.5 * (x[0][2] + x[1][2])];
        fall = fall.max(distance(&center, &[0.05, t - 0.5 * 9.81 * t * t, 0.0]));
        stretch = stretch.max((distance(&x[2], &x[3]) / 0.1 - 1.0).abs());
        held = held.max(distance(&x[4], &[0.0, 0.0, 2.0]) + distance(&x[5], &[0.1, 0.0, 2.0]));
    }
    out.measure("free_fall_error", fall, |x| x <= 1e-10, "the free strand's centre follows the parabola to 1e-10 m");
    // the midpoint rule balances forces on the chord of a step, which is shorter by (ω dt)²/8 = 4e-5 at the fastest
    out.measure("pendulum_stretch", stretch, |x| x <= 5e-5, "the pendulum keeps its length within (ω dt)²/8");
    out.measure("held_motion", held, |x| x == 0.0, "the held strand does not move");
    Ok(out)
}
