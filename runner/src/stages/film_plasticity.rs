//! Stage 11, film plasticity: the strain of films is stretched by their flow and relaxes.

use super::Step;
use super::mixture::film::rejection;
use crate::system::Rejection;
use crate::world::World;

/// Stretches and relaxes the elastic strain of every film.
pub fn run(world: &mut World, step: Step) -> Result<(), Rejection> {
    let World { state, film: Some(film), .. } = world else { return Ok(()) };
    let Some(films) = &mut state.film else { return Ok(()) };
    let (solver, view) = film.parts(&state.rods);
    solver.relax(&mut films.state, view, step.dt).map_err(|error| rejection("film_plasticity", &error))?;
    Ok(())
}
