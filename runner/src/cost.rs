//! What a step of a scene will cost, stage by stage and switch by switch, before it is run.
//!
//! Every part of a step has a price per vertex of the strands and per particle of the liquid, measured on one core with the
//! scenes of `scenes/coupled` (how to take them again: the page on strands in liquid). The price of a solve depends on how many iterations it takes, so
//! an estimate is good to a factor of two or so; what parts cost beside each other is told better than the whole.

use crate::plan::Components;
use crate::scene::time::Component;

/// A part of a step.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Stage of the table in which it runs.
    pub stage: usize,
    /// Switch that takes it out, if there is one.
    pub switch: Option<SwitchIndex>,
    /// Nanoseconds per vertex of the strands.
    pub vertex: f64,
    /// Nanoseconds per particle.
    pub particle: f64,
    /// Whether a scene has it, its switch being on.
    pub has: fn(&Components) -> bool,
}

/// Place of a component in [`SWITCHES`].
pub type SwitchIndex = usize;

/// The components that can be switched off, in the order of the documentation.
pub const SWITCHES: [Component; 17] = [
    Component::Advection,
    Component::Pressure,
    Component::Resampling,
    Component::Shear,
    Component::PlasticFlow,
    Component::Compressibility,
    Component::StrandContact,
    Component::Cohesion,
    Component::Friction,
    Component::FilmAdvection,
    Component::FilmShear,
    Component::FilmPlasticFlow,
    Component::FlowInertia,
    Component::Capture,
    Component::Drag,
    Component::Dripping,
    Component::VolumeFraction,
];

const fn part(
    stage: usize,
    switch: Option<SwitchIndex>,
    vertex: f64,
    particle: f64,
    has: fn(&Components) -> bool,
) -> Part {
    Part { stage, switch, vertex, particle, has }
}

/// The parts of a step.
pub const PARTS: [Part; 26] = [
    part(1, Some(13), 700.0, 60.0, |c| c.film && c.liquid),
    part(1, Some(15), 20.0, 0.0, |c| c.dripping),
    part(2, Some(2), 0.0, 60.0, |c| c.resampling),
    part(3, None, 0.0, 350.0, |c| c.liquid),
    part(3, Some(3), 0.0, 450.0, |c| c.liquid_shear),
    part(4, None, 0.0, 30.0, |c| c.liquid),
    part(4, Some(16), 300.0, 0.0, |c| c.strands && c.liquid),
    part(5, Some(4), 0.0, 80.0, |c| c.tearing),
    part(6, None, 600.0, 0.0, |c| c.strands),
    part(6, Some(6), 2700.0, 0.0, |c| c.contact),
    part(6, Some(7), 300.0, 0.0, |c| c.contact && c.film),
    part(6, Some(8), 100.0, 0.0, |c| c.contact),
    part(6, Some(9), 300.0, 0.0, |c| c.film),
    part(6, Some(10), 200.0, 0.0, |c| c.film_shear),
    part(6, None, 200.0, 0.0, |c| c.film),
    part(6, Some(12), 100.0, 0.0, |c| c.film),
    part(6, Some(14), 1800.0, 0.0, |c| c.strands && c.liquid),
    part(6, Some(16), 300.0, 0.0, |c| c.strands && c.liquid),
    part(6, Some(3), 0.0, 5000.0, |c| c.liquid_shear),
    part(6, Some(1), 0.0, 150.0, |c| c.liquid),
    part(7, None, 0.0, 150.0, |c| c.liquid),
    part(8, None, 0.0, 90.0, |c| c.liquid),
    part(9, Some(0), 0.0, 25.0, |c| c.liquid),
    part(10, Some(4), 0.0, 110.0, |c| c.liquid_flow),
    part(11, Some(11), 100.0, 0.0, |c| c.film_shear),
    part(12, Some(4), 0.0, 260.0, |c| c.recovery),
];

/// Seconds of a step on one core.
#[derive(Clone, Debug, PartialEq)]
pub struct StepCost {
    /// By stage.
    pub stages: [f64; 13],
    /// By switch, in the order of [`SWITCHES`]: what switching it off would save.
    pub switches: [f64; 17],
}

impl StepCost {
    /// The cost of a step with so many vertices and particles; `off` are the components that are switched off.
    #[must_use]
    pub fn of(components: &Components, off: &[Component], vertices: f64, particles: f64) -> StepCost {
        let mut cost = StepCost { stages: [0.0; 13], switches: [0.0; 17] };
        for part in PARTS.iter().filter(|part| (part.has)(components)) {
            let seconds = 1e-9 * (part.vertex * vertices + part.particle * particles);
            match part.switch {
                Some(switch) if off.contains(&SWITCHES[switch]) => continue,
                Some(switch) => cost.switches[switch] += seconds,
                None => {}
            }
            cost.stages[part.stage] += seconds;
        }
        cost
    }

    /// Of the whole step [s].
    #[must_use]
    pub fn total(&self) -> f64 {
        self.stages.iter().sum()
    }
}

/// Seconds in a unit that suits them.
#[must_use]
pub fn readable(seconds: f64) -> String {
    match seconds {
        s if s >= 1.0 => format!("{s:.1} s"),
        s if s >= 1e-3 => format!("{:.1} ms", s * 1e3),
        s => format!("{:.1} µs", s * 1e6),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dry_scene_pays_for_strands_alone_and_a_liquid_scene_for_liquid_alone() {
        let dry = Components { strands: true, ..Components::default() };
        let cost = StepCost::of(&dry, &[], 1000.0, 1e6);
        assert!(cost.stages[6] > 0.0);
        assert_eq!(cost.total(), cost.stages[6]);
        let wet = Components { liquid: true, liquid_shear: true, ..Components::default() };
        assert_eq!(StepCost::of(&wet, &[], 1e6, 1000.0), StepCost::of(&wet, &[], 0.0, 1000.0));
        assert!(
            StepCost::of(&wet, &[Component::Shear], 0.0, 1000.0).total()
                < 0.3 * StepCost::of(&wet, &[], 0.0, 1000.0).total()
        );
    }
}
