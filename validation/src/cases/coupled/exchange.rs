//! Liquid that changes hands between strands and bulk.

use std::f64::consts::PI;

use constitutive::Liquid;

use super::{largest, last, whole};
use crate::case::{Case, CaseError, Outcome, Param, Params};

/// A strand wetted and withdrawn.
pub const WETTING_MASS: Case = Case {
    id: "coupled/wetting-mass",
    about: "A strand is dipped and withdrawn: what is on it and dripped from it is what the bulk lacks, to 1e-12",
    params: &[Param::text("liquid", "drilling-mud", "preset of the liquid")],
    run: wetting_mass,
};

/// The same, with how much there is.
pub const DIP_AND_PULL: Case = Case {
    id: "coupled/dip-and-pull",
    about: "A strand is dipped and pulled out: the film it takes along is no more than films of this liquid are high, and no less \
            than a tenth of that",
    params: &[Param::text("liquid", "acrylic-paint", "preset of the liquid")],
    run: dip_and_pull,
};

const RADIUS: f64 = 4e-4;
/// Length under the surface at the deepest [m].
const WETTED: f64 = 0.015;

fn scene(liquid: &str) -> String {
    format!(
        "Scene(
            units: Si, time: (end: 0.16, step: Fixed(2e-3)), gravity: [0, -9.81, 0],
            materials: {{ \"string\": Fibre(density: 1300, young_modulus: 1e8, poisson_ratio: 0.45, viscosity: 1e4), \"liquid\": Liquid(preset: \"{liquid}\") }},
            strands: [(material: \"string\", radius: {RADIUS:e}, shape: Straight(from: [0, 0.065, 0], to: [0, 0.035, 0], vertices: 16),
                       clamp: [First(2)], motion: [
                           Translate(by: [0, -0.025, 0], during: (0, 0.06), ease: Smooth),
                           Translate(by: [0, 0.025, 0], during: (0.08, 0.14), ease: Smooth)])],
            solids: [(name: \"pot\", shape: Box(center: [0, 0.05, 0], half_size: [0.015, 0.05, 0.015]), inverted: true)],
            liquid: (cell: 5e-3, particles_per_cell: 8, tanks: [(material: \"liquid\", shape: Box(center: [0, 0.0125, 0], half_size: [0.015, 0.0125, 0.015]))]),
            disable: [StrandContact],
            output: (frames: Never, checkpoint: Never),
        )"
    )
}

fn wetting_mass(p: &Params) -> Result<Outcome, CaseError> {
    let liquid = p.text("liquid")?;
    Liquid::preset(liquid).map_err(CaseError::failed)?;
    let run = whole(&scene(liquid), "wetting-mass.ron")?;
    let mut out = Outcome::new();
    let defect = largest(&run, "total_liquid_mass_defect")?;
    out.measure(
        "mass_defect",
        defect,
        |x| x <= 1e-12,
        "liquid in bulk, on the strand and fallen adds up at every step",
    );
    let bulk = run.series.column("liquid_mass")?;
    let lost = bulk[0] - bulk[bulk.len() - 1];
    let held = last(&run, "film_mass")? + last(&run, "reservoir_mass")?;
    out.info("on_strand", held);
    out.measure("difference", (lost - held).abs() / bulk[0], |x| x <= 1e-12, "the bulk lacks what is on the strand");
    out.measure("taken", held, |x| x > 0.0, "the strand takes some along");
    Ok(out)
}

fn dip_and_pull(p: &Params) -> Result<Outcome, CaseError> {
    let name = p.text("liquid")?;
    let liquid = Liquid::preset(name).map_err(CaseError::failed)?;
    let run = whole(&scene(name), "dip-and-pull.ron")?;
    let mut out = Outcome::new();
    let area = PI * liquid.film_height * (liquid.film_height + 2.0 * RADIUS);
    let full = liquid.density * area * WETTED;
    let held = last(&run, "film_mass")? + last(&run, "reservoir_mass")? + last(&run, "dripped_mass")?;
    out.info("full", full);
    let why = "of the film of this liquid's height on the wetted length, between a tenth and all";
    out.measure("share", held / full, |x| x > 0.1 && x < 1.0, why);
    out.measure(
        "momentum_defect",
        largest(&run, "momentum_defect")?,
        |x| x <= 1e-8,
        "the strand's momentum is accounted for",
    );
    Ok(out)
}
