//! Which stages a scene needs, and why. What is not needed costs nothing: no memory, no time, no column.

use std::fmt;
use std::fmt::Write as _;

use crate::cost::{SWITCHES, StepCost, readable};
use crate::scene::Scene;
use crate::scene::field::Field as _;
use crate::scene::liquid::Liquid;
use crate::scene::presets::LiquidProperties;
use crate::scene::solids::Solid;
use crate::scene::time::Component;
use crate::stages::{STAGES, Stage};
use crate::world::liquid::build::liquid_names;
use constitutive::FlowCurve;

/// What a scene contains, as far as stages depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Components {
    /// There are strands.
    pub strands: bool,
    /// Something moves by script (solids, clamps, sources).
    pub scripted: bool,
    /// Strands may touch each other or solids.
    pub contact: bool,
    /// Strands may touch each other, or one itself.
    pub strand_pairs: bool,
    /// Some strands carry a film.
    pub film: bool,
    /// Some film bears shear stress of its own (its shear modulus is not zero).
    pub film_shear: bool,
    /// Films drip from the ends of strands.
    pub dripping: bool,
    /// There is bulk liquid, or may be.
    pub liquid: bool,
    /// Particles are split, merged and spread.
    pub resampling: bool,
    /// Some liquid bears shear stress, elastic or viscous.
    pub liquid_shear: bool,
    /// Some liquid that bears elastic shear stress yields.
    pub liquid_flow: bool,
    /// Some liquid can tear.
    pub tearing: bool,
    /// Some torn liquid heals.
    pub recovery: bool,
}

impl Components {
    /// What a scene contains.
    #[must_use]
    pub fn of(scene: &Scene) -> Components {
        let on = |component: Component| !scene.is_disabled(&component);
        let strands = !scene.strands.is_empty();
        let single = scene.strands.len() == 1
            && crate::scene::expand::counts(&scene.strands[0].shape).is_some_and(|(count, _)| count == 1);
        let pairs = scene.contact.strand_strand && (!single || strand_may_touch_itself(scene));
        let may_touch = pairs || (scene.contact.strand_solid && !scene.solids.is_empty());
        let moving_solid = |solid: &Solid| !scene.script(&solid.motion).is_empty();
        let scripted_strands = scene.strands.iter().any(|group| !group.clamp.is_empty());
        // strands that may take up liquid have films, dry at first
        let takes_up = strands && scene.liquid.is_some();
        let film = takes_up || scene.strands.iter().any(|group| group.film.is_some());
        let liquids: Vec<_> = liquid_names(scene).iter().filter_map(|name| scene.liquid_material(name)).collect();
        let (shear, flows) = (on(Component::Shear), on(Component::Shear) && on(Component::PlasticFlow));
        let bulk = scene.liquid.as_ref();
        let open = |liquid: &Liquid| !liquid.sources.is_empty() || !liquid.drains.is_empty() || liquid.domain.is_some();
        Components {
            strands,
            scripted: scripted_strands || scene.solids.iter().any(moving_solid) || bulk.is_some_and(open),
            contact: strands && may_touch && on(Component::StrandContact),
            strand_pairs: strands && pairs && on(Component::StrandContact),
            film,
            film_shear: film && on(Component::FilmShear) && film_bears_shear(scene),
            dripping: film && on(Component::Dripping),
            liquid: bulk.is_some(),
            resampling: bulk.is_some() && on(Component::Resampling),
            liquid_shear: bulk.is_some() && shear && liquids.iter().any(bears_shear),
            liquid_flow: bulk.is_some() && flows && liquids.iter().any(|l| l.shear_modulus > 0.0),
            tearing: bulk.is_some() && flows && liquids.iter().any(tears),
            recovery: bulk.is_some() && flows && liquids.iter().any(|l| tears(l) && l.recovery_time.is_some()),
        }
    }
}

fn bears_shear(liquid: &LiquidProperties) -> bool {
    let (FlowCurve::J2 { consistency, .. } | FlowCurve::Rheometer { consistency, .. }) = liquid.flow;
    liquid.shear_modulus > 0.0 || consistency > 0.0
}

fn tears(liquid: &LiquidProperties) -> bool {
    liquid.shear_modulus > 0.0 && liquid.tearing_strain.is_some()
}

/// A lone strand is looked at for contact with itself only when the scene asks for contact in so many words.
fn strand_may_touch_itself(scene: &Scene) -> bool {
    crate::scene::contact::Contact::blank().is_some_and(|blank| scene.contact != blank)
}

/// Whether some film's liquid has elasticity in shear.
fn film_bears_shear(scene: &Scene) -> bool {
    let films = scene.strands.iter().map(|group| group.film.as_ref());
    let mut liquids = films.filter_map(|film| crate::world::film::build::liquid_name(scene, film));
    liquids.any(|name| scene.liquid_material(&name).is_some_and(|liquid| liquid.shear_modulus > 0.0))
}

/// A stage in the plan of a scene.
#[derive(Clone, Debug)]
pub struct PlannedStage {
    /// The stage.
    pub stage: &'static Stage,
    /// Why it is in the plan, or why not.
    pub reason: &'static str,
    /// Whether it runs.
    pub active: bool,
}

/// The stages of one scene, in order.
#[derive(Clone, Debug)]
pub struct Plan {
    /// All stages of the table, active or not.
    pub stages: Vec<PlannedStage>,
    /// What the scene contains.
    pub components: Components,
    /// Components that the scene switches off.
    pub switched_off: Vec<Component>,
    /// What happens in a scene of soft grains or of yarns, which have none of the stages.
    pub program: Vec<String>,
}

/// A scene that asks for something this version cannot do.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
#[error("this scene needs {what}, which this version does not have yet (stage {number} `{stage}`)")]
#[diagnostic(help("{help}"))]
pub struct NotThereYet {
    what: &'static str,
    number: usize,
    stage: &'static str,
    help: &'static str,
}

impl Plan {
    /// The plan of a scene.
    ///
    /// # Errors
    /// When the scene needs a stage that is not built yet: nothing pretends.
    pub fn for_scene(scene: &Scene) -> Result<Plan, NotThereYet> {
        let components = Components::of(scene);
        if scene.microgel.is_some() {
            let program = crate::microgel::schedule_of(scene).map_or(Vec::new(), |schedule| schedule.lines);
            return Ok(Plan { stages: Vec::new(), components, switched_off: Vec::new(), program });
        }
        if scene.yarn.is_some() {
            let program = crate::yarn::program(scene);
            return Ok(Plan { stages: Vec::new(), components, switched_off: Vec::new(), program });
        }
        let missing = |what, number: usize, help| NotThereYet { what, number, stage: STAGES[number].name, help };
        let planar = |liquid: &Liquid| liquid.dimensions == crate::scene::liquid::Dimensions::Two;
        if components.strands && scene.liquid.as_ref().is_some_and(planar) {
            return Err(missing(
                "strands in a liquid of two dimensions",
                6,
                "leave `dimensions: Two` out, or the strands",
            ));
        }
        let stages = STAGES
            .iter()
            .map(|stage| {
                let need = (stage.need)(&components);
                PlannedStage { stage, reason: need.reason, active: need.active }
            })
            .collect();
        Ok(Plan { stages, components, switched_off: scene.disable.clone(), program: Vec::new() })
    }

    /// The plan with what each stage costs and what each switch would save, for so many vertices and particles.
    #[must_use]
    pub fn with_cost(&self, vertices: f64, particles: f64) -> String {
        if self.stages.is_empty() {
            return self.to_string();
        }
        let cost = StepCost::of(&self.components, &self.switched_off, vertices, particles);
        let mut text = String::new();
        for planned in &self.stages {
            let (mark, seconds) = if planned.active {
                ("runs", readable(cost.stages[planned.stage.number]))
            } else {
                ("-", String::new())
            };
            let (number, name, reason) = (planned.stage.number, planned.stage.name, planned.reason);
            let _ = writeln!(text, "{number:>2} {name:18} {mark:5} {seconds:>9}  {reason}");
        }
        let _ = writeln!(text, "   a step: about {} on one core", readable(cost.total()));
        let mut saved: Vec<(f64, &Component)> =
            cost.switches.iter().copied().zip(&SWITCHES).filter(|(seconds, _)| *seconds > 0.0).collect();
        saved.sort_by(|a, b| b.0.total_cmp(&a.0));
        for (seconds, component) in saved {
            let share = 100.0 * seconds / cost.total();
            let name = format!("{component:?}");
            let _ = writeln!(text, "   on: {name:17} {:>9} {share:>3.0} %", readable(seconds));
        }
        for component in &self.switched_off {
            let _ = writeln!(text, "   off: {component:?}");
        }
        text
    }

    /// The stages that run, in order.
    pub fn active(&self) -> impl Iterator<Item = &'static Stage> {
        self.stages.iter().filter(|planned| planned.active).map(|planned| planned.stage)
    }
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (number, line) in self.program.iter().enumerate() {
            writeln!(f, "{:>2} {line}", number + 1)?;
        }
        for planned in &self.stages {
            let mark = if planned.active { "runs" } else { "-" };
            writeln!(f, "{:>2} {:18} {mark:5} {}", planned.stage.number, planned.stage.name, planned.reason)?;
        }
        for component in &self.switched_off {
            writeln!(f, "   off: {component:?}")?;
        }
        Ok(())
    }
}
