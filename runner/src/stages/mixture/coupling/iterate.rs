//! Outer iteration of strands and liquid (spec 08), and the books of what they exchanged.
//!
//! Drag is found from the velocity that the liquid would have without it, `û = u_start + dt · pull`; `pull` is everything else
//! that acts on the liquid: gravity, pressure and stress. Before the liquid is solved `pull` is that of the last step. Where the
//! stress answers to drag (a strand that hangs in a liquid below its yield stress) one solve lags behind by a step. An outer
//! iteration solves the liquid with the impulses, takes `û = u_end + w_f r` from what it really did, finds the impulses anew and
//! pushes the liquid by their change. Its fixed point is the implicit exchange at the velocities of the end of the step, whatever
//! the recoil `w_f` is taken for; the recoil only sets how fast it converges. Momentum is exchanged exactly in every iteration.

use nalgebra::Vector3;

use super::drag::{exchange, faces, spread};
use super::{Both, press};
use crate::stages::Step;
use crate::stages::mixture::{liquid, rods::solve};
use crate::system::Rejection;
use crate::world::World;
use crate::world::liquid::coupling::FaceNumbers;
use crate::world::submersion::Submersion;

/// The change of the impulses is halved when it grows from one iteration to the next, at most so often.
const LEAST_SHARE: f64 = 1.0 / 16.0;

/// Repeats the exchange of momentum until strands and liquid agree, or as often as the scene allows.
pub fn iterate(world: &mut World, step: Step) -> Result<(), Rejection> {
    let (mut share, mut last) = (1.0, f64::INFINITY);
    let allowed = world.submersion.as_ref().map_or(1, |submersion| submersion.outer.iterations);
    for iteration in 1..allowed {
        let Some(mut both) = Both::of(world) else { return Ok(()) };
        if both.submersion.wet.is_empty() || !both.submersion.drags || both.submersion.drag_in_faces {
            return Ok(());
        }
        let before = both.submersion.drag_impulse.clone();
        both.strands.stepper.velocities_into(both.rods, &mut both.submersion.previous);
        let change = exchange_again(&mut both, step.dt)?;
        both.submersion.outer_change = change;
        if change <= both.submersion.outer.tolerance {
            // they agree: the impulses that the liquid has taken stand
            both.submersion.drag_impulse = before;
            return press(world, step);
        }
        if change > last {
            share = f64::max(0.5 * share, LEAST_SHARE);
        }
        last = change;
        let Both { rods, flow, submersion, .. } = &mut both;
        let mut pushed = FaceNumbers::<3>::zeros(flow.grid.blocks.node_count());
        for v in &submersion.wet {
            let old = before[*v];
            submersion.drag_impulse[*v] = old + (submersion.drag_impulse[*v] - old) * share;
        }
        let Submersion { wet, drag_impulse, .. } = &**submersion;
        spread(&flow.grid, &rods.position, wet, |k| before[wet[k]] - drag_impulse[wet[k]], &mut pushed);
        flow.shear.push(&flow.grid, pushed.slices());
        submersion.outer_iterations = iteration + 1;
        liquid::solve_again(world, step)?;
        super::release_films(world)?;
        press(world, step)?;
    }
    Ok(())
}

/// Finds the impulses anew from what the liquid did with the last ones; returns the largest change of a velocity, relative to the
/// largest velocity.
fn exchange_again(both: &mut Both<'_>, dt: f64) -> Result<f64, Rejection> {
    let ended = velocities(both);
    for (k, v) in both.submersion.wet.iter().enumerate() {
        let without = ended[k] + both.submersion.drag_impulse[*v] * both.submersion.recoil[*v];
        both.submersion.fluid_velocity[*v] = without;
    }
    let old = both.submersion.drag_impulse.clone();
    both.submersion.drag_impulse.fill(Vector3::zeros());
    both.submersion.add_up(Some(both.film));
    both.strands.report = {
        let loads = both.submersion.add_to(both.film.loads(both.gravity));
        solve(both.strands, both.rods, dt, &loads)?
    };
    exchange(both, dt)?;
    let Submersion { wet, vectors, previous, drag_impulse, recoil, .. } = &*both.submersion;
    let fastest = |list: &[Vector3<f64>]| list.iter().fold(0.0f64, |most, v| most.max(v.norm()));
    let scale = fastest(vectors).max(fastest(&ended));
    let change = |v: &usize| {
        let liquid = (drag_impulse[*v] - old[*v]).norm() * recoil[*v];
        liquid.max((vectors[*v] - previous[*v]).norm())
    };
    let change = wet.iter().map(change).fold(0.0, f64::max);
    Ok(if scale > 0.0 { change / scale } else { 0.0 })
}

/// Velocities of the liquid at the vertices in it, as the faces are now.
fn velocities(both: &Both<'_>) -> Vec<Vector3<f64>> {
    let mut list = Vec::new();
    let grid = &both.flow.grid;
    let one = |v: &usize| {
        Vector3::from_fn(|a, _| {
            faces(grid, &both.rods.position[*v], a, &mut list);
            list.iter().map(|(node, weight)| weight * grid.face[a].velocity[*node]).sum()
        })
    };
    both.submersion.wet.iter().map(one).collect()
}

/// Books what strands and liquid exchanged, and keeps what pulled the liquid for the next step.
pub fn book(world: &mut World, step: Step) -> Result<(), Rejection> {
    let Some(mut both) = Both::of(world) else { return Ok(()) };
    remember(&mut both, step.dt);
    let Both { rods, strands, film, fluid, submersion, memory, ledger, .. } = both;
    let mut dragged = Vector3::zeros();
    if submersion.coefficient_in_loads {
        // the coefficient acted within the rods: what it gave is known only now
        strands.stepper.velocities_into(rods, &mut submersion.vectors);
        for v in &submersion.wet {
            let relative = submersion.pulls_to[*v] - submersion.vectors[*v];
            dragged += relative * (step.dt * submersion.coefficient[*v]);
        }
    } else {
        submersion.drag_impulse.iter().for_each(|r| dragged += r);
    }
    let (mut pressed, mut gained, mut lost) = (Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
    submersion.pressure_force.iter().for_each(|f| pressed += f * step.dt);
    for inside in &submersion.inside_edges {
        let tangent = film.tangent[inside.edge];
        gained += inside.given;
        lost += inside.given - tangent * inside.given.dot(&tangent);
    }
    fluid.ledger.exchanged(0.0, 0.0, &(gained - dragged));
    memory.exchanged.drag += dragged;
    memory.exchanged.pressure += pressed;
    memory.exchanged.transfer -= lost;
    ledger.impulse += dragged + pressed - lost;
    ledger.impulse_scale += dragged.norm() + pressed.norm() + lost.norm();
    Ok(())
}

/// What pulled the liquid at each vertex besides drag, and how fast strands and liquid pass each other.
fn remember(both: &mut Both<'_>, dt: f64) {
    let ended = velocities(both);
    both.strands.stepper.velocities_into(both.rods, &mut both.submersion.vectors);
    let Both { flow, submersion, memory, .. } = both;
    memory.pull.fill(None);
    // where nothing but drag and body forces acts on the liquid there is nothing to remember
    let remembers = !submersion.drag_in_faces && (flow.resists || flow.settings.pressure.enabled);
    let (mut sum, mut most) = (0.0, 0.0f64);
    for (k, v) in submersion.wet.iter().enumerate() {
        let without = ended[k] + submersion.drag_impulse[*v] * submersion.recoil[*v];
        if remembers {
            memory.pull[*v] = Some((without - submersion.start_velocity[*v]) / dt);
        }
        let slip = (submersion.vectors[*v] - ended[k]).norm();
        sum += slip;
        most = most.max(slip);
    }
    submersion.slip = [sum / submersion.wet.len().max(1) as f64, most];
}
