//! What strands and bulk liquid do to each other in stage 6.
//!
//! ```text
//! meet           before 4   which vertices are in the liquid, and what they see of it
//! drag           after 4    coefficients from the secant law, impulses vertex by vertex: to the strands and from the faces
//! carry_films    8          films inside the liquid join the faces as mass
//! carry_volume   before 8   strands that move carry volume through the faces: the pressure keeps that of both together
//! release_films  13         films inside the liquid move with it
//! press          17         the pressure acts on the strands, which are solved anew
//! iterate        8 to 17    once more with what the liquid really did, where the scene asks for it
//! book           after 17   momentum that was exchanged; what pulled the liquid besides drag
//! hold_films     after 5    films inside the liquid keep that velocity
//! ```
//! Drag is exchanged as impulses (spec 3.4): what a strand gets the faces lose, to round-off. Each impulse follows from the
//! implicit rods with the secant coefficient 𝒟 of the drag law; the recoil of the liquid is taken into the coefficient,
//! `𝒟/(1 + dt 𝒟 w_f)`, `w_f` the velocity that the liquid around a vertex would lose per impulse if all vertices around took
//! theirs, so that dense bundles neither overshoot nor need small steps.

mod drag;
mod films;
mod iterate;
mod pressure;
mod volume;

pub use drag::{drag, meet};
pub use films::{InsideEdge, carry_films, hold_films, release_films};
pub use iterate::{book, iterate};
pub use pressure::press;
pub use volume::{carry_volume, crowd};

use nalgebra::Vector3;
use rods::RodSet;

use crate::world::film::{FilmWorld, Films};
use crate::world::liquid::{Flow, FlowState, LiquidState, LiquidWorld};
use crate::world::submersion::{Submersion, SubmersionState};
use crate::world::{Ledger, StrandWorld, World, WorldState};

/// Both sides of the coupling.
struct Both<'a> {
    rods: &'a RodSet,
    strands: &'a mut StrandWorld,
    films: &'a mut Films,
    film: &'a mut FilmWorld,
    flow: &'a mut Flow<3>,
    fluid: &'a mut FlowState<3>,
    submersion: &'a mut Submersion,
    memory: &'a mut SubmersionState,
    ledger: &'a mut Ledger,
    gravity: Vector3<f64>,
}

impl<'a> Both<'a> {
    /// Strands and liquid, where a scene has both and the liquid has come.
    fn of(world: &'a mut World) -> Option<Both<'a>> {
        let World { state, strands, film, liquid, submersion, gravity, .. } = world;
        let WorldState { rods, film: films, liquid: fluid, submersion: memory, ledger, .. } = state;
        match (strands, films, film, liquid, fluid, submersion, memory) {
            (
                Some(strands),
                Some(films),
                Some(film),
                Some(LiquidWorld::Three(flow)),
                Some(LiquidState::Three(fluid)),
                Some(submersion),
                Some(memory),
            ) if !fluid.particles.is_empty() => {
                Some(Both { rods, strands, films, film, flow, fluid, submersion, memory, ledger, gravity: *gravity })
            }
            _ => None,
        }
    }
}
