//! Stage 9: particles move with the flow; those that entered a solid are put back on its surface.

use crate::grid::LiquidGrid;
use crate::particles::Particles;
use crate::solid::{Solid, nearest};
use numerics::tensor::Vector;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What the stage did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AdvectReport {
    /// Particles put back from the inside of a solid.
    pub pushed_out: usize,
    /// Deepest penetration found [m].
    pub deepest: f64,
}

/// Moves the particles over `dt` and keeps them out of the solids (given at the end of the step).
///
/// The grid must still be that of the step: it knows which blocks are near a solid. A displacement out of a solid does not
/// change a velocity.
pub fn advect<const D: usize, S: Solid<D>>(
    particles: &mut Particles<D>,
    grid: &LiquidGrid<D>,
    solids: &[S],
    dt: f64,
) -> AdvectReport {
    let lattice = *grid.lattice();
    let velocity = &particles.velocity;
    particles.position.par_iter_mut().zip(velocity).with_min_len(4096).for_each(|(x, v)| *x += v * dt);
    let mut report = AdvectReport::default();
    if !solids.is_empty() {
        let order = &grid.order;
        let parts = order.split(&mut particles.position);
        report = parts
            .into_par_iter()
            .enumerate()
            .map(|(rank, positions)| {
                let mut found = AdvectReport::default();
                // Blocks away from solids need no look unless a particle can cross more than the margin of the mark.
                let near = grid.near_solid[grid.blocks.occupied()[rank] as usize];
                for (k, x) in positions.iter_mut().enumerate() {
                    let p = order.block_range(rank).start + k;
                    if near || velocity[p].norm_squared() * dt * dt > lattice.dx * lattice.dx {
                        push_out(x, solids, &mut found);
                    }
                }
                found
            })
            .reduce(AdvectReport::default, |a, b| AdvectReport {
                pushed_out: a.pushed_out + b.pushed_out,
                deepest: a.deepest.max(b.deepest),
            });
    }
    if lattice.periods.iter().any(|&p| p > 0) {
        particles.position.par_iter_mut().with_min_len(4096).for_each(|x| lattice.wrap(x));
    }
    report
}

/// Puts a point on the surface of the solid it is in; corners of several solids take a few turns.
fn push_out<const D: usize, S: Solid<D>>(x: &mut Vector<D>, solids: &[S], found: &mut AdvectReport) {
    for turn in 0..4 {
        let Some(wall) = nearest(solids, x) else { return };
        if wall.distance >= 0.0 {
            return;
        }
        if turn == 0 {
            found.pushed_out += 1;
            found.deepest = found.deepest.max(-wall.distance);
        }
        *x -= wall.normal * wall.distance;
    }
}
