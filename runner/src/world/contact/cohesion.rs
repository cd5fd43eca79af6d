//! What cohesion knows of a scene: the liquids of the films, and what is wet in the present step.

use ::contact::cohesion::{CohesionSettings, TangentialFlow};

use crate::plan::Components;
use crate::scene::Scene;
use crate::scene::presets::LiquidProperties;
use crate::scene::time::Component;
use crate::world::film::FilmWorld;

/// Cohesion of a scene; absent where nothing is wet or the scene switches it off.
pub struct CohesionWorld {
    /// Of each liquid: tension and flow, contact angle.
    pub liquids: Vec<(CohesionSettings, f64)>,
    /// Place in `liquids` of each strand's film.
    pub liquid_of: Vec<u32>,
    /// Capillary, viscous and plastic pull act.
    pub pulls: bool,
    /// The liquid between wet strands resists sliding.
    pub flow_friction: bool,
}

/// The liquid at one contact of the present step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wetness {
    /// A bridge joins the two sides.
    pub bridged: bool,
    /// Largest pull against parting: capillary, viscous and plastic [N].
    pub against_parting: f64,
    /// Pull towards each other: capillary less what the liquid resists [N].
    pub towards: f64,
    /// Whether the sides draw near in this step; decided when the bridge is first seen in it.
    pub draws_near: Option<bool>,
    /// Resistance to sliding, for a step of one second.
    pub flow: Option<TangentialFlow>,
}

impl Wetness {
    /// Decides, unless it is decided, whether the sides draw near: with normal velocity `free` without impulses [m/s] and what
    /// an impulse changes it by, `mobility` \[1/kg\], in a step of `tau` seconds.
    pub fn decide(&mut self, free: f64, mobility: f64, tau: f64) -> bool {
        *self.draws_near.get_or_insert(free - mobility * tau * self.towards < 0.0)
    }

    /// What the bridge pulls with at most in a step of `tau` seconds [N s], once it is known whether the sides draw near.
    #[must_use]
    pub fn bound(&self, tau: f64) -> f64 {
        tau * if self.draws_near == Some(true) { self.towards } else { self.against_parting }
    }
}

impl CohesionWorld {
    /// Cohesion as a scene asks for it.
    #[must_use]
    pub fn build(scene: &Scene, components: &Components, film: Option<&FilmWorld>) -> Option<CohesionWorld> {
        let film = film?;
        let pulls = !scene.is_disabled(&Component::Cohesion);
        let flow_friction = scene.contact.wet_friction && !scene.is_disabled(&Component::Friction);
        (components.contact && (pulls || flow_friction)).then(|| CohesionWorld {
            liquids: film.liquids.iter().map(of_liquid).collect(),
            liquid_of: film.liquid_of.clone(),
            pulls,
            flow_friction,
        })
    }
}

fn of_liquid(liquid: &LiquidProperties) -> (CohesionSettings, f64) {
    // the printed law takes √(2/3) of the yield stress; in the rheometer's reading the shear yield stress stands there
    let (yield_stress, consistency, flow_index) = liquid.flow.boundary();
    let settings = CohesionSettings {
        surface_tension: liquid.surface_tension,
        consistency,
        flow_index,
        yield_stress: yield_stress / (2.0_f64 / 3.0).sqrt(),
    };
    (settings, liquid.contact_angle)
}
