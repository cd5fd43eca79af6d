//! The algorithm: twelve stages and the drive before them, in order, each in a file named for it.
//!
//! A stage gets its file when it is built. The table has all of them, so that a plan can say what a scene would need; a
//! scene that needs one without a file is refused by `check`.

pub mod advect;
pub mod deformation;
pub mod drive;
pub mod exchange;
pub mod film_plasticity;
pub mod grid_to_particles;
pub mod liquid_plasticity;
pub mod mixture;
pub mod particles_to_grid;
pub mod recovery;
pub mod resample;
pub mod tearing;
pub mod weights;

use crate::plan::Components;
use crate::system::Rejection;
use crate::world::World;

/// One step to take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Time at its start [s].
    pub time: f64,
    /// Its length [s].
    pub dt: f64,
}

/// Whether a scene needs a stage, and why.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Need {
    /// Whether it runs.
    pub active: bool,
    /// Why, or why not.
    pub reason: &'static str,
}

/// The work of a stage.
pub type StageFunction = fn(&mut World, Step) -> Result<(), Rejection>;

/// A stage of the algorithm (Fei et al. 2019, supplemental S12, with the drive as stage 0).
#[derive(Debug)]
pub struct Stage {
    /// Place in the order.
    pub number: usize,
    /// Name, also of its file.
    pub name: &'static str,
    /// What it does.
    pub what: &'static str,
    /// Whether a scene needs it.
    pub need: fn(&Components) -> Need,
    /// Its work; absent as long as it is not built.
    pub run: Option<StageFunction>,
}

const fn need(active: bool, yes: &'static str, no: &'static str) -> Need {
    Need { active, reason: if active { yes } else { no } }
}

/// The algorithm.
pub static STAGES: [Stage; 13] = [
    Stage {
        number: 0,
        name: "drive",
        what: "scripts, sources and terminators to the end of the step",
        need: |c| need(c.scripted, "something is held or moves by script", "nothing moves by script"),
        run: Some(drive::run),
    },
    Stage {
        number: 1,
        name: "exchange",
        what: "liquid captured, absorbed and dripped between strands and bulk",
        need: |c| match (c.film && c.liquid, c.film && c.dripping) {
            (true, _) => need(true, "strands with film meet liquid", ""),
            (false, drips) => need(drips, "films drip", "no film that drips or meets liquid"),
        },
        run: Some(exchange::run),
    },
    Stage {
        number: 2,
        name: "resample",
        what: "particles split, merged, relaxed",
        need: |c| need(c.resampling, "liquid", "no liquid, or switched off"),
        run: Some(resample::run),
    },
    Stage {
        number: 3,
        name: "particles_to_grid",
        what: "particles to faces and cells",
        need: |c| need(c.liquid, "liquid", "no liquid"),
        run: Some(particles_to_grid::run),
    },
    Stage {
        number: 4,
        name: "weights",
        what: "face weights, solid fractions, drag coefficients",
        need: |c| need(c.liquid, "liquid", "no liquid"),
        run: Some(weights::run),
    },
    Stage {
        number: 5,
        name: "tearing",
        what: "liquid stretched beyond its tearing strain is marked",
        need: |c| need(c.tearing, "liquid that can tear", "no liquid that can tear"),
        run: Some(tearing::run),
    },
    Stage {
        number: 6,
        name: "mixture",
        what: "velocities of strands, films and liquid; pressure; contact impulses",
        need: |c| need(c.strands || c.liquid, "something moves", "nothing moves"),
        run: Some(mixture::run),
    },
    Stage {
        number: 7,
        name: "grid_to_particles",
        what: "velocities back to particles",
        need: |c| need(c.liquid, "liquid", "no liquid"),
        run: Some(grid_to_particles::run),
    },
    Stage {
        number: 8,
        name: "deformation",
        what: "volume ratio and elastic strain of particles",
        need: |c| need(c.liquid, "liquid", "no liquid"),
        run: Some(deformation::run),
    },
    Stage {
        number: 9,
        name: "advect",
        what: "positions of strands and particles",
        need: |c| need(c.strands || c.liquid, "something moves", "nothing moves"),
        run: Some(advect::run),
    },
    Stage {
        number: 10,
        name: "liquid_plasticity",
        what: "plastic flow of the liquid",
        need: |c| need(c.liquid_flow, "liquid that bears shear and yields", "no liquid that bears shear and yields"),
        run: Some(liquid_plasticity::run),
    },
    Stage {
        number: 11,
        name: "film_plasticity",
        what: "plastic flow of films",
        need: |c| need(c.film_shear, "films that bear shear", "no film that bears shear"),
        run: Some(film_plasticity::run),
    },
    Stage {
        number: 12,
        name: "recovery",
        what: "torn liquid heals",
        need: |c| need(c.recovery, "liquid that heals", "no liquid that heals"),
        run: Some(recovery::run),
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_in_order() {
        for (place, stage) in STAGES.iter().enumerate() {
            assert_eq!(place, stage.number, "{}", stage.name);
        }
    }

    #[test]
    fn a_dry_strand_scene_runs_the_mixture_and_advection_alone() {
        let dry = Components { strands: true, ..Components::default() };
        let active: Vec<&str> = STAGES.iter().filter(|s| (s.need)(&dry).active).map(|s| s.name).collect();
        assert_eq!(active, ["mixture", "advect"]);
    }
}
