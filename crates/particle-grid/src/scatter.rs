//! Particles to grid: each particle adds four quantities, affine in space, to the nodes of its stencil.
//!
//! Four quantities share one pass because they share the weights: mass, momentum, volume and force of one face component, or
//! mass and three momenta of a collocated node.

use crate::blocks::{BlockGrid, NONE};
use crate::dispatch::vectorised;
use crate::lanes::Lanes;
use crate::lattice::cells_per_block;
use crate::order::ParticleOrder;
use crate::tile::{Added, WIDTH, for_rows, tile_len};
use numerics::bspline::Weights1;
use numerics::tensor::Vector;
use rayon::prelude::*;

/// What one particle adds: `weight × (value + Σ_a gradient[a] (x_node − x_particle)_a)`.
#[derive(Clone, Copy, Debug)]
pub struct Contribution<const D: usize> {
    /// The four quantities at the particle.
    pub value: Lanes,
    /// Their gradients, per metre, one entry per direction.
    pub gradient: [Lanes; D],
}

/// The private tiles of a scatter, kept between calls.
#[derive(Clone, Debug, Default)]
pub struct ScatterScratch {
    tiles: Vec<Lanes>,
}

impl ScatterScratch {
    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.tiles.capacity() * size_of::<Lanes>()
    }
}

/// Adds up what all particles give to the nodes of one staggered field; `out` (one entry per node) is overwritten.
///
/// - `positions`: particles in sorted order [m]
/// - `offset`: where the nodes sit in their cells [cells]
/// - `smear`: for quantities spread over the room of a particle, [`numerics::bspline::smear_of`] its width [cells]; else zero
/// - `contribution(p)`: what particle `p` of the sorted order adds
///
/// Sums are taken particle by particle inside a block and block by block in the order of the neighbour table: the bits do not
/// depend on the thread count.
#[expect(
    clippy::too_many_arguments,
    reason = "grid, order, places, kernel, quantities and memory are all separate things"
)]
pub fn scatter<const D: usize>(
    grid: &BlockGrid<D>,
    order: &ParticleOrder<D>,
    positions: &[Vector<D>],
    offset: &[f64; D],
    smear: f64,
    contribution: impl Fn(usize) -> Contribution<D> + Sync,
    scratch: &mut ScatterScratch,
    out: &mut [Lanes],
) {
    let per = cells_per_block::<D>();
    let len = tile_len::<D>();
    debug_assert_eq!(out.len(), grid.node_count());
    scratch.tiles.resize(grid.occupied().len() * len, Lanes::ZERO);
    let lattice = grid.lattice;
    let inverse_dx = 1.0 / lattice.dx;
    scratch.tiles.par_chunks_mut(len).enumerate().for_each(|(rank, tile)| {
        vectorised(
            #[inline(always)]
            || {
                tile.fill(Lanes::ZERO);
                let low = lattice.block_low(&order.blocks()[rank]);
                // Rounding may put a particle on the low side of its block; it belongs to it all the same.
                let range = order.block_range(rank);
                for p in range {
                    let x = &positions[p];
                    let c = contribution(p);
                    let axis: [Weights1; D] = std::array::from_fn(|a| {
                        Weights1::new((x[a] * inverse_dx - low[a]).max(0.0), offset[a]).smeared(smear)
                    });
                    add(tile, &axis, &c, lattice.dx);
                }
            },
        );
    });
    let tiles = &scratch.tiles;
    out.par_chunks_mut(per).enumerate().for_each(|(block, nodes)| {
        nodes.fill(Lanes::ZERO);
        for (slot, &neighbour) in grid.neighbours(block).iter().enumerate().take(BlockGrid::<D>::NEIGHBOURS) {
            if neighbour == NONE || grid.rank(neighbour as usize) == NONE {
                continue;
            }
            let rank = grid.rank(neighbour as usize) as usize;
            let from = &tiles[rank * len..][..len];
            let offset = BlockGrid::<D>::slot_offset(slot);
            for_rows(&offset, WIDTH, grid.reached(rank), &mut Added { from, to: nodes });
        }
    });
}

/// Adds one particle to a tile.
#[inline(always)]
fn add<const D: usize>(tile: &mut [Lanes], axis: &[Weights1; D], c: &Contribution<D>, dx: f64) {
    // Tile node 0 is node −1 of the block. The clamp never acts on a sorted particle; it keeps a misuse inside the tile.
    let base: [usize; D] = std::array::from_fn(|a| (axis[a].base + 1).clamp(0, 4) as usize);
    let along_x: [Lanes; 3] = std::array::from_fn(|i| c.value + c.gradient[0] * (axis[0].distance[i] * dx));
    let (ny, nz) = (if D > 1 { 3 } else { 1 }, if D > 2 { 3 } else { 1 });
    for k in 0..nz {
        let (wz, gz, z) = if D > 2 {
            (axis[2].weight[k], c.gradient[2] * (axis[2].distance[k] * dx), base[2] + k)
        } else {
            (1.0, Lanes::ZERO, 0)
        };
        for j in 0..ny {
            let (wy, gy, y) = if D > 1 {
                (axis[1].weight[j], c.gradient[1] * (axis[1].distance[j] * dx), base[1] + j)
            } else {
                (1.0, Lanes::ZERO, 0)
            };
            let w = wz * wy;
            let side = if D > 2 { gy + gz } else { gy };
            let start = (z * if D > 1 { WIDTH } else { 1 } + y) * WIDTH + base[0];
            let row = &mut tile[start..start + 3];
            for i in 0..3 {
                row[i] += (along_x[i] + side) * (w * axis[0].weight[i]);
            }
        }
    }
}
