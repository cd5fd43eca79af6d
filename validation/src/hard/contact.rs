//! Hard scenes of contact (spec 12, rows 27, 28 and 30; `friction` has 28 and 29 too). Rows 31 to 33 concern one bridge and are tests of `contact::cohesion`.

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
        case("hard/held-contact", "contacts that no impulse can move are dropped", held_contact),
        case("hard/jammed", "a rod wedged with friction above one", jammed),
        case("hard/redundant-contacts", "parallel rods in a pile: redundant contacts, unique velocities", redundant),
    ]
}

fn judged(run: &SceneRun) -> Outcome {
    let mut out = Outcome::new();
    out.measure("completed", run.completed(), |x| x == 1.0, "the run comes to its end");
    let finite = f64::from(u8::from(run.series.all_finite()));
    out.measure("finite", finite, |x| x == 1.0, "every recorded number is finite");
    out
}

fn most(run: &SceneRun, name: &str) -> Result<f64, CaseError> {
    Ok(run.series.column(name)?.iter().copied().fold(f64::NEG_INFINITY, f64::max))
}

fn solved(out: &mut Outcome, run: &SceneRun) -> Result<(), CaseError> {
    out.measure("contacts", most(run, "contacts")?, |x| x >= 1.0, "something touches");
    out.measure("warnings", most(run, "contact_warnings")?, |x| x == 0.0, "every contact problem was solved");
    Ok(())
}

fn redundant(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("redundant-contacts"), "redundant-contacts.ron", params)?;
    let mut out = judged(&run);
    solved(&mut out, &run)?;
    let mut farthest = 0.0_f64;
    for probe in ["left", "right", "top"] {
        let path = run.series.vector(probe)?;
        for x in &path {
            let moved: f64 = x.iter().zip(&path[0]).map(|(a, b)| (a - b) * (a - b)).sum();
            farthest = farthest.max(moved.sqrt());
        }
    }
    out.measure("moved_by_radius", farthest / 1e-3, |x| x <= 0.01, "friction holds the pile");
    let weight = run.series.column("strand_mass")?[0] * 9.81;
    let carried = -run.series.column("plane_force_y")?.last().copied().unwrap_or(f64::NAN);
    out.compare("carried_by_weight", carried / weight, 1.0, 0.01);
    Ok(out)
}

fn jammed(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("jammed"), "jammed.ron", params)?;
    let mut out = judged(&run);
    out.measure("contacts", most(&run, "contacts")?, |x| x >= 1.0, "something touches");
    // Work of the clamp, by its force and its scripted velocity: down and to the side, then up and back. Implicit steps and
    // friction take energy, so no step may gain more than the clamp put in. (The wedged rod stores a hundred times the
    // kinetic energy of the drive and gives it back when it comes free: a limit on the speed would not tell the two apart.)
    let force = run.series.vector("clamp0_force")?;
    let (time, energy) = (run.series.column("time")?, run.series.column("total_energy")?);
    let (mut gained, mut put_in, mut largest) = (0.0_f64, 0.0, energy[0].abs());
    for i in 1..energy.len() {
        let half = 0.5 * (time[i] + time[i - 1]);
        let velocity = if half < 0.03 { [0.0005, -0.0012] } else { [-0.0005, 0.0024] }.map(|by| by / 0.03);
        let work = (force[i][0] * velocity[0] + force[i][1] * velocity[1]) * (time[i] - time[i - 1]);
        gained = gained.max(energy[i] - energy[i - 1] - work);
        put_in += work;
        largest = largest.max(energy[i].abs());
    }
    out.measure("energy_gain", gained / largest, |x| x <= 1e-9, "no step gains more energy than the clamp puts in");
    out.measure("work", put_in / largest, |x| x > 0.1, "the clamp does work: the ledger is not empty");
    // the drive moves at 0.08 m/s at most
    let mass = run.series.column("strand_mass")?[0];
    out.info("kinetic_energy", most(&run, "kinetic_energy")? / (0.5 * mass * 0.08 * 0.08));
    out.info("warnings", most(&run, "contact_warnings")?);
    Ok(out)
}

fn held_contact(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("held-contact"), "held-contact.ron", params)?;
    let mut out = judged(&run);
    solved(&mut out, &run)?;
    let tip = run.series.column("tip_y")?;
    let lowest = tip.iter().copied().fold(f64::INFINITY, f64::min);
    out.measure("lowest", lowest, |x| x > 0.001, "the free end rests on the held rod, above the plane");
    Ok(out)
}
