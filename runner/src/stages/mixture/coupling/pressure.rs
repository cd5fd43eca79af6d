//! The liquid's pressure on strands (step 17).

use nalgebra::Vector3;
use particle_grid::{mac_offset, stencil};

use super::Both;
use crate::stages::Step;
use crate::stages::mixture::rods::solve;
use crate::system::Rejection;
use crate::world::World;

/// Force of the remembered pressure gradient on strands and films.
pub(super) fn forces(both: &mut Both<'_>) {
    let Both { rods, film, submersion, memory, .. } = both;
    for strand in 0..rods.strand_count() {
        for v in rods.vertices(strand) {
            let volume = submersion.volume[v] + film.mass[v] / film.density[strand];
            submersion.pressure_force[v] = -memory.pressure_gradient[v] * volume;
        }
    }
}

/// The pressure found in this step acts on the strands; they are solved anew with it and with the impulses of drag.
pub fn press(world: &mut World, step: Step) -> Result<(), Rejection> {
    let Some(mut both) = Both::of(world) else { return Ok(()) };
    let mut acts = !both.submersion.wet.is_empty();
    if both.submersion.presses {
        let Both { rods, flow, memory, .. } = &mut both;
        let grid = &flow.grid;
        for (v, gradient) in memory.pressure_gradient.iter_mut().enumerate() {
            let before = *gradient;
            *gradient = Vector3::zeros();
            for a in 0..3 {
                stencil(&grid.blocks, &rods.position[v], &mac_offset(a), |s| {
                    gradient[a] += s.weight * grid.face[a].pressure_gradient[s.node];
                });
            }
            acts |= before != *gradient;
        }
        forces(&mut both);
    }
    both.submersion.add_up(Some(both.film));
    if !acts {
        return Ok(());
    }
    both.strands.report = {
        let loads = both.submersion.add_to(both.film.loads(both.gravity));
        solve(both.strands, both.rods, step.dt, &loads)?
    };
    let Both { rods, strands, fluid, submersion, memory, ledger, .. } = both;
    let mut dragged = Vector3::zeros();
    if submersion.coefficient_in_loads {
        // the coefficient acted within the rods: what it gave is known only now
        strands.stepper.velocities_into(rods, &mut submersion.vectors);
        for v in &submersion.wet {
            let relative = submersion.pulls_to[*v] - submersion.vectors[*v];
            dragged += relative * (step.dt * submersion.coefficient[*v]);
        }
        fluid.ledger.exchanged(0.0, 0.0, &-dragged);
    } else {
        submersion.drag_impulse.iter().for_each(|r| dragged += r);
    }
    let mut pressed = Vector3::zeros();
    submersion.pressure_force.iter().for_each(|f| pressed += f * step.dt);
    memory.exchanged.drag += dragged;
    memory.exchanged.pressure += pressed;
    ledger.impulse += dragged + pressed;
    ledger.impulse_scale += dragged.norm() + pressed.norm();
    Ok(())
}
