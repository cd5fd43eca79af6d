//! A block with its halo as one small array: the private workspace of a transfer or of a matrix-free operator.
//!
//! A stencil of a particle in a block reaches one node below the block and two above it, so a tile is seven nodes wide. An
//! operator loads a tile per field, works on it, writes a tile of results, and [`sum`] adds the tiles into fields.

use crate::blocks::{BlockGrid, NONE};
use crate::lattice::{BLOCK, cells_per_block};
use rayon::prelude::*;

/// Nodes of a tile per direction: one below the block, four in it, two above.
pub const WIDTH: usize = BLOCK + 3;
/// Stride of a row of a scalar tile; one entry of padding lets four entries be read at any node.
pub const ROW: usize = 8;

/// Number of nodes of a tile.
pub(crate) const fn tile_len<const D: usize>() -> usize {
    WIDTH.pow(D as u32)
}

/// Number of entries of a scalar tile with padded rows.
#[must_use]
pub const fn padded_len<const D: usize>() -> usize {
    ROW * WIDTH.pow(D as u32 - 1)
}

/// The overlap of a block's own nodes with the tile of the neighbour in direction `offset`, along one axis:
/// first own node, first tile node, count.
const fn overlap(offset: i32) -> (usize, usize, usize) {
    match offset {
        -1 => (0, 5, 2),
        0 => (0, 1, 4),
        _ => (3, 0, 1),
    }
}

/// Calls `row(own node, tile node, count)` for the rows that a block's own nodes share with the tile of a neighbour.
#[inline(always)]
pub(crate) fn for_rows<const D: usize>(offset: &[i32; D], width: usize, mut row: impl FnMut(usize, usize, usize)) {
    let part: [(usize, usize, usize); D] = std::array::from_fn(|a| overlap(offset[a]));
    let (ny, nz) = (if D > 1 { part[1].2 } else { 1 }, if D > 2 { part[2].2 } else { 1 });
    for z in 0..nz {
        for y in 0..ny {
            let mut own = 0;
            let mut tile = 0;
            if D > 2 {
                own = part[2].0 + z;
                tile = part[2].1 + z;
            }
            if D > 1 {
                own = own * BLOCK + part[1].0 + y;
                tile = tile * WIDTH + part[1].1 + y;
            }
            row(own * BLOCK + part[0].0, tile * width + part[0].1, part[0].2);
        }
    }
}

/// Copies the nodes around a block into a scalar tile with padded rows; inactive nodes read as zero.
#[inline(always)]
pub fn load<const D: usize>(grid: &BlockGrid<D>, block: usize, field: &[f64], tile: &mut [f64]) {
    tile.fill(0.0);
    let per = cells_per_block::<D>();
    for (slot, &neighbour) in grid.neighbours(block).iter().enumerate().take(BlockGrid::<D>::NEIGHBOURS) {
        if neighbour == NONE {
            continue;
        }
        let source = &field[neighbour as usize * per..][..per];
        // Seen from the neighbour, this block's tile lies in the opposite direction.
        let offset = BlockGrid::<D>::slot_offset(slot).map(|o| -o);
        for_rows(&offset, ROW, |own, at, count| tile[at..at + count].copy_from_slice(&source[own..own + count]));
    }
}

/// Adds scalar tiles with padded rows, one set per occupied block, into a field (overwritten), in the order of the neighbour table.
///
/// - `tiles`: sets of `stride` numbers, by rank of the occupied block
/// - `at`: where the tile of this field begins inside a set
pub fn sum<const D: usize>(grid: &BlockGrid<D>, tiles: &[f64], stride: usize, at: usize, out: &mut [f64]) {
    let per = cells_per_block::<D>();
    out.par_chunks_mut(per).with_min_len(8).enumerate().for_each(|(block, nodes)| {
        nodes.fill(0.0);
        for (slot, &neighbour) in grid.neighbours(block).iter().enumerate().take(BlockGrid::<D>::NEIGHBOURS) {
            if neighbour == NONE || grid.rank(neighbour as usize) == NONE {
                continue;
            }
            let tile = &tiles[grid.rank(neighbour as usize) as usize * stride + at..][..padded_len::<D>()];
            for_rows(&BlockGrid::<D>::slot_offset(slot), ROW, |own, from, count| {
                for k in 0..count {
                    nodes[own + k] += tile[from + k];
                }
            });
        }
    });
}
