//! Steps 2, 3 and 5: films carried along their strands, what that does to the strands, and what drives the films.

use surface_flow::FilmError;

use crate::stages::Step;
use crate::system::{Element, Rejection, RejectionReason};
use crate::world::World;

/// Step 2: volume, momentum and strain of the films go along with their velocity at the start of the step.
pub fn advect(world: &mut World, step: Step) -> Result<(), Rejection> {
    let World { state, film: Some(film), .. } = world else { return Ok(()) };
    let Some(films) = &mut state.film else { return Ok(()) };
    film.look_at(&state.rods);
    film.weigh(&films.state, &state.rods);
    if film.advects {
        film.mass_before.clone_from(&film.mass);
        let (solver, view) = film.parts(&state.rods);
        film.report = solver.advect(&mut films.state, view, step.dt).map_err(|error| rejection("mixture", &error))?;
        film.weigh(&films.state, &state.rods);
    }
    Ok(())
}

/// Step 3: impulses by which film that moves along a moving strand acts on it.
pub fn add_inertia(world: &mut World, step: Step) -> Result<(), Rejection> {
    let World { state, film: Some(film), .. } = world else { return Ok(()) };
    let (Some(films), Some(form)) = (&state.film, film.inertia) else { return Ok(()) };
    film.find_inertia(&films.state, &state.rods, form, step.dt).map_err(|error| rejection("mixture", &error))
}

/// Step 5: gravity and the strands' own acceleration, elastic stress, friction, limits.
///
/// It comes after the contacts: a film on a strand that rests on something feels gravity, one on a falling strand does not.
pub fn drive(world: &mut World, step: Step) -> Result<(), Rejection> {
    let World { state, film: Some(film), strands: Some(strands), gravity, .. } = world else { return Ok(()) };
    let Some(films) = &mut state.film else { return Ok(()) };
    let rods = &state.rods;
    strands.stepper.velocities_into(rods, &mut film.acceleration);
    // the midpoint rule gives the velocity half way
    let share = if strands.stepper.settings.integrator == rods::Integrator::ImplicitMidpoint { 2.0 } else { 1.0 };
    for (a, v) in film.acceleration.iter_mut().zip(&rods.velocity) {
        *a = (*a - v) * (share / step.dt);
    }
    let (solver, view) = film.parts(rods);
    let report =
        solver.drive(&mut films.state, view, *gravity, step.dt).map_err(|error| rejection("mixture", &error))?;
    // wet and stuck edges are those after friction
    let transport = film.report;
    film.report = surface_flow::FilmReport { substeps: transport.substeps, outflow: transport.outflow, ..report };
    Ok(())
}

/// A film error as a rejection that names its strand.
pub fn rejection(stage: &'static str, error: &FilmError) -> Rejection {
    let (reason, element) = match error {
        FilmError::NonFinite { first, .. } => {
            (RejectionReason::NonFinite, Some(Element::StrandVertex { strand: *first, vertex: 0 }))
        }
        _ => (RejectionReason::Infeasible, None),
    };
    Rejection { stage, reason, element, detail: error.to_string() }
}
