//! The room that strands take from the liquid (spec 6.1, 6.2, 6.9).

use nalgebra::Vector3;
use particle_grid::NONE;

use super::Both;
use crate::system::Rejection;
use crate::world::World;
use crate::world::submersion::DENSEST;
use crate::world::submersion::volume::{add_rates, add_shares};

/// Share of every cell that strands take, for stage 4.
pub fn crowd(world: &mut World) -> Result<(), Rejection> {
    let Some(both) = Both::of(world) else { return Ok(()) };
    let Both { rods, flow, submersion, .. } = both;
    submersion.densest = 0.0;
    if !submersion.crowds {
        return Ok(());
    }
    let (blocks, fraction) = (&flow.grid.blocks, &mut flow.coupling.solid_fraction);
    fraction.clear();
    fraction.resize(blocks.node_count(), 0.0);
    add_shares(blocks, &rods.position, &submersion.volume, fraction);
    for share in fraction.iter_mut() {
        submersion.densest = submersion.densest.max(*share);
        *share = share.min(DENSEST);
    }
    Ok(())
}

/// `(1/ε_f) Dε_f/Dt` of every cell, from the strands' velocities of step 4 and the liquid's of step 9.
pub fn crowding_rate(world: &mut World) -> Result<(), Rejection> {
    let Some(both) = Both::of(world) else { return Ok(()) };
    let Both { rods, strands, flow, submersion, .. } = both;
    if !submersion.crowds {
        return Ok(());
    }
    strands.stepper.velocities_into(rods, &mut submersion.vectors);
    let grid = &flow.grid;
    let coupling = &mut flow.coupling;
    let rate = &mut coupling.fraction_rate;
    rate.clear();
    rate.resize(grid.blocks.node_count(), 0.0);
    // the liquid's velocity at the centre of a cell: the mean of its faces that hold liquid
    let center = |node: usize| {
        Vector3::from_fn(|a, _| {
            let face = &grid.face[a];
            let next = grid.blocks.along(node, a, 1);
            let (mut sum, mut count) = (0.0, 0.0);
            for at in [node, next as usize] {
                if at != NONE as usize && face.mass[at] > grid.mass_floor {
                    sum += face.velocity[at];
                    count += 1.0;
                }
            }
            if count > 0.0 { sum / count } else { 0.0 }
        })
    };
    add_rates(&grid.blocks, &rods.position, &submersion.vectors, &submersion.volume, center, rate);
    for (rate, share) in rate.iter_mut().zip(&coupling.solid_fraction) {
        *rate /= 1.0 - share;
    }
    Ok(())
}
