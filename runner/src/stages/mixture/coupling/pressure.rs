//! The liquid's pressure on strands (step 17).
//!
//! A strand takes the gradient from the faces that its volume is smeared over, with the same weights (`world/submersion/volume.rs`): the
//! pressure then does the same work on strands and liquid together as their common volume asks for.

use nalgebra::Vector3;

use super::Both;
use crate::stages::Step;
use crate::stages::mixture::rods::solve;
use crate::system::Rejection;
use crate::world::World;
use crate::world::submersion::volume::faces_around;

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
    let mut acts = !both.submersion.wet.is_empty() || !both.submersion.inside_edges.is_empty();
    if both.submersion.presses {
        let Both { rods, flow, memory, .. } = &mut both;
        let (grid, crowd) = (&flow.grid, &flow.coupling.crowd);
        for (v, gradient) in memory.pressure_gradient.iter_mut().enumerate() {
            let before = *gradient;
            *gradient = Vector3::zeros();
            for a in 0..3 {
                faces_around(&grid.blocks, &rods.position[v], a, |node, weight| {
                    let counted = crowd.as_ref().map_or(1.0, |crowd| crowd.counted.0[a][node]);
                    gradient[a] += weight * counted * grid.face[a].pressure_gradient[node];
                });
            }
            acts |= before != *gradient;
        }
        forces(&mut both);
    }
    both.submersion.add_up(Some(both.film));
    if acts {
        let loads = both.submersion.add_to(both.film.loads(both.gravity));
        both.strands.report = solve(both.strands, both.rods, step.dt, &loads)?;
    }
    Ok(())
}
