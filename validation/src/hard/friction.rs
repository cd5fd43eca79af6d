//! Hard scenes of friction: what flies fast, what grazes, what leans with a coefficient above one.

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
        case("hard/fast-strand", "no tunnelling at a hundred radii a step", fast_strand),
        case("hard/grazing", "touching without force: the apex of both cones", grazing),
        case("hard/high-friction", "leaning rods with a friction of 1.5", high_friction),
    ]
}

fn judged(run: &SceneRun) -> Result<Outcome, CaseError> {
    let mut out = Outcome::new();
    out.measure("completed", run.completed(), |x| x == 1.0, "the run comes to its end");
    let finite = f64::from(u8::from(run.series.all_finite()));
    out.measure("finite", finite, |x| x == 1.0, "every recorded number is finite");
    out.info("rejected_steps", run.figure("rejected_steps"));
    out.info("most_contacts", most(run, "contacts")?);
    Ok(out)
}

fn most(run: &SceneRun, column: &str) -> Result<f64, CaseError> {
    Ok(run.series.column(column)?.iter().copied().fold(f64::NEG_INFINITY, f64::max))
}

fn solved(out: &mut Outcome, run: &SceneRun) -> Result<(), CaseError> {
    out.measure("warnings", most(run, "contact_warnings")?, |x| x == 0.0, "every contact problem met its tolerance");
    Ok(())
}

fn overlap(out: &mut Outcome, run: &SceneRun, radius: f64, part: f64) -> Result<(), CaseError> {
    let worst = most(run, "worst_penetration")? / radius;
    out.measure("overlap", worst, |x| x <= part, &format!("no overlap above {part} of the radius"));
    Ok(())
}

/// Largest change of a column over the run.
fn change(run: &SceneRun, column: &str) -> Result<f64, CaseError> {
    let values = run.series.column(column)?;
    let first = values.first().copied().unwrap_or(f64::NAN);
    Ok(values.iter().map(|x| (x - first).abs()).fold(0.0, f64::max))
}

fn fast_strand(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("fast-strand"), "fast-strand.ron", params)?;
    let mut out = judged(&run)?;
    let beyond = most(&run, "at_wall_x")?;
    out.measure("beyond_wall", beyond, |x| x < 0.0, "the strand at the wall stays on its side");
    let (own, hit) = (run.series.column("at_strand_x")?, run.series.column("hit_x")?);
    let ahead = own.iter().zip(hit).map(|(a, b)| a - b).fold(f64::NEG_INFINITY, f64::max);
    out.measure("ahead", ahead, |x| x < 0.0, "the other never gets ahead of the strand it hits");
    Ok(out)
}

fn grazing(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("grazing"), "grazing.ron", params)?;
    let mut out = judged(&run)?;
    solved(&mut out, &run)?;
    out.measure("speed", change(&run, "middle_vx")? / 0.25, |x| x <= 1e-12, "the speed stays to 1e-12");
    out.measure("height", change(&run, "middle_y")? / 1e-3, |x| x <= 1e-12, "and the height");
    Ok(out)
}

fn high_friction(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("high-friction"), "high-friction.ron", params)?;
    let mut out = judged(&run)?;
    let growth = run.series.largest_growth("total_energy")?;
    out.measure("energy_growth", growth, |x| x <= 1e-6, "the energy never grows by more than 1e-6 of its largest");
    overlap(&mut out, &run, 1e-3, 0.01)?;
    out.info("warnings", most(&run, "contact_warnings")?);
    Ok(out)
}
