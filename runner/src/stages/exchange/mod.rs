//! Stage 1, exchange: liquid that changes hands between strands and what is around them.
//!
//! ```text
//! drip     ── reservoirs at the ends of strands let drops fall: particles where there may be bulk liquid, else the ledger
//! surface  ── how deep every vertex is below the surface, from the particles around it
//! capture  ── a vertex that leaves the liquid takes a film with it
//! absorb   ── a vertex in the liquid gives its film back, one near the surface what is too much
//! ```
//!
//! Every transfer keeps mass and rest volume to round-off; momentum goes along with the mass, and what a strand cannot take up
//! along itself it gets as an impulse.

mod absorb;
mod capture;
mod drip;
mod surface;

use nalgebra::Vector3;

use super::Step;
use crate::system::Rejection;
use crate::world::film::{Exchanged, FilmWorld, Films};
use crate::world::liquid::{Flow, FlowState, LiquidState, LiquidWorld};
use crate::world::submersion::{Submersion, SubmersionState};
use crate::world::{Ledger, World, WorldState};
use rods::RodSet;

/// What an exchange with bulk liquid sees and changes.
struct Hands<'a> {
    rods: &'a RodSet,
    films: &'a mut Films,
    film: &'a mut FilmWorld,
    flow: &'a Flow<3>,
    fluid: &'a mut FlowState<3>,
    submersion: &'a mut Submersion,
    memory: &'a mut SubmersionState,
    ledger: &'a mut Ledger,
}

/// Drops fall; vertices that leave the liquid take a film with them, those in it give theirs back.
pub fn run(world: &mut World, step: Step) -> Result<(), Rejection> {
    if let Some(film) = &mut world.film {
        film.exchanged = Exchanged::default();
        film.look_at(&world.state.rods);
    }
    let World { state, film, liquid, submersion, solids, .. } = world;
    let WorldState { rods, film: films, liquid: fluid, submersion: memory, ledger, .. } = state;
    match (film, films, liquid, fluid, submersion, memory) {
        (
            Some(film),
            Some(films),
            Some(LiquidWorld::Three(flow)),
            Some(LiquidState::Three(fluid)),
            Some(submersion),
            Some(memory),
        ) => {
            submersion.begin();
            let mut hands = Hands { rods, films, film, flow, fluid, submersion, memory, ledger };
            if hands.film.drips {
                drip::to_particles(&mut hands);
            }
            if hands.fluid.particles.is_empty() {
                hands.submersion.level.fill(f64::INFINITY);
                hands.memory.inside.fill(false);
                return Ok(());
            }
            surface::find(&mut hands, solids, step);
            capture::run(&mut hands);
            absorb::run(&mut hands);
        }
        _ => drip::to_ledger(world),
    }
    Ok(())
}

impl Hands<'_> {
    /// Material of the particles that a strand's film is made of; none where there are none of it.
    fn material(&self, strand: usize) -> Option<u16> {
        self.submersion.material[self.film.liquid_of[strand] as usize]
    }

    /// Cross-section of the film that a vertex takes along when it leaves the liquid [m²].
    fn typical_area(&self, strand: usize, vertex: usize) -> f64 {
        let height = self.film.liquids[self.film.liquid_of[strand] as usize].film_height;
        let [a, b] = self.rods.radius[vertex];
        surface_flow::film_area(height, a + b)
    }

    /// Half the adjacent edges [m].
    fn vertex_length(&self, strand: usize, i: usize) -> f64 {
        let edges = &self.film.edge_length[self.films.state.edges(strand)];
        let before = if i > 0 { edges[i - 1] } else { 0.0 };
        0.5 * (before + edges.get(i).copied().unwrap_or(0.0))
    }

    /// Velocity of the film over the ground at a vertex [m/s].
    fn film_velocity(&self, strand: usize, i: usize) -> Vector3<f64> {
        let edges = self.films.state.edges(strand);
        let (first, last) = (edges.start, edges.len() - 1);
        let along = |j: usize| self.film.tangent[first + j] * self.films.state.velocity[first + j];
        let v = self.films.state.vertices(strand).start + i;
        self.rods.velocity[v] + (along(i.saturating_sub(1).min(last)) + along(i.min(last))) * 0.5
    }

    /// Books liquid of mass `mass` [kg] that joined a vertex (left it, where negative) with its momentum there.
    fn joined(&mut self, vertex: usize, mass: f64) {
        let momentum = self.rods.velocity[vertex] * mass;
        self.ledger.impulse += momentum;
        self.ledger.impulse_scale += momentum.norm();
        self.memory.exchanged.transfer += momentum;
    }
}
