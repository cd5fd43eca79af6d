//! Hard scenes of films and of strands in liquid (spec 12, cases 15 to 19).

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
        case("hard/dense-bundle", "water thrown across strands packed to the limit", dense_bundle),
        case("hard/film-front", "a steep bulge of film runs over a dry strand", film_front),
        case("hard/film-stick-slip", "a film sticks exactly until its wall yields", film_stick_slip),
        case("hard/heavy-film", "a film of 390 times the mass of its strand", heavy_film),
        case("hard/surface-crossing", "a strand goes through the surface again and again", surface_crossing),
        case("hard/vanishing-film", "films of no height beside films of some", vanishing_film),
    ]
}

/// Conditions that all share: it ends, with finite numbers, and no liquid is lost.
fn judged(run: &SceneRun, defect: &str) -> Result<Outcome, CaseError> {
    let mut out = Outcome::new();
    out.measure("completed", run.completed(), |x| x == 1.0, "the run comes to its end");
    let finite = f64::from(u8::from(run.series.all_finite()));
    out.measure("finite", finite, |x| x == 1.0, "every recorded number is finite");
    let lost = most(run, defect)?;
    out.measure("liquid_mass_defect", lost, |x| x <= 1e-12, "no liquid is lost or made");
    out.info("rejected_steps", run.figure("rejected_steps"));
    Ok(out)
}

fn most(run: &SceneRun, column: &str) -> Result<f64, CaseError> {
    Ok(run.series.column(column)?.iter().fold(0.0, |most: f64, x| most.max(x.abs())))
}

fn dense_bundle(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("dense-bundle"), "dense-bundle.ron", params)?;
    let mut out = judged(&run, "total_liquid_mass_defect")?;
    let slip = run.series.column("slip_mean")?;
    let thrown = 0.2;
    out.measure(
        "solid_fraction",
        most(&run, "solid_fraction_max")?,
        |x| x > 0.88,
        "strands fill cells to the packing limit",
    );
    let rise = slip.windows(2).skip(1).map(|w| (w[1] - w[0]) / thrown).fold(0.0, f64::max);
    out.measure("slip_rises", rise, |x| x <= 1e-3, "both move ever more alike: the slip does not rise");
    out.measure("slip", slip[slip.len() - 1] / thrown, |x| x <= 1e-2, "at the end they move as one");
    out.measure("fastest", most(&run, "liquid_max_speed")? / thrown, |x| x <= 2.0, "nothing flies off");
    out.measure(
        "momentum_defect",
        most(&run, "momentum_defect")?,
        |x| x <= 1e-8,
        "momentum of the strands is accounted for",
    );
    Ok(out)
}

fn film_front(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("film-front"), "film-front.ron", params)?;
    let mut out = judged(&run, "liquid_mass_defect")?;
    let wet = run.series.column("film_wet_edges")?;
    out.measure("wet_edges", wet[wet.len() - 1], |x| x > 6.0, "the film spreads over dry edges");
    Ok(out)
}

fn film_stick_slip(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("film-stick-slip"), "film-stick-slip.ron", params)?;
    let mut out = judged(&run, "liquid_mass_defect")?;
    let (wet, stuck) = (run.series.column("film_wet_edges")?, run.series.column("film_stuck_edges")?);
    let speed = run.series.column("film_speed_max")?;
    let held = (1..wet.len()).filter(|&k| stuck[k] == wet[k]).map(|k| speed[k]).fold(0.0, f64::max);
    out.measure("speed_while_stuck", held, |x| x == 0.0, "while every edge sticks nothing moves at all");
    let sticks = (1..wet.len()).filter(|&k| stuck[k] == wet[k]).count() as f64;
    out.measure("stuck_steps", sticks, |x| x >= 5.0, "the wall holds at first");
    out.measure("speed", most(&run, "film_speed_max")?, |x| x > 1e-3, "and yields later");
    Ok(out)
}

fn heavy_film(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("heavy-film"), "heavy-film.ron", params)?;
    let mut out = judged(&run, "liquid_mass_defect")?;
    let (film, strand) = (most(&run, "film_mass")?, most(&run, "strand_mass")?);
    out.measure("mass_ratio", film / strand, |x| x > 300.0, "the film weighs hundreds of times the strand");
    let defect = most(&run, "momentum_defect")?;
    out.measure("momentum_defect", defect, |x| x <= 1e-8, "momentum is accounted for");
    Ok(out)
}

fn surface_crossing(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("surface-crossing"), "surface-crossing.ron", params)?;
    let mut out = judged(&run, "total_liquid_mass_defect")?;
    let (height, radius, length) = (5e-4, 4e-4, 0.02);
    let full = 1000.0 * std::f64::consts::PI * height * (height + 2.0 * radius) * length;
    let held = most(&run, "film_mass")?;
    out.measure("share", held / full, |x| x <= 1.0 + 1e-9, "the strand never holds more than its full film");
    Ok(out)
}

fn vanishing_film(params: &Params) -> Result<Outcome, CaseError> {
    let run = SceneRun::hard(scene!("vanishing-film"), "vanishing-film.ron", params)?;
    let mut out = judged(&run, "liquid_mass_defect")?;
    out.measure("speed", most(&run, "film_speed_max")?, |x| x <= 9.81 * 0.1, "no film is faster than free fall");
    Ok(out)
}
