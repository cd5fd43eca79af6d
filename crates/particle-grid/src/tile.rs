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

/// Nodes of a tile, per direction from the first to before the last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part<const D: usize> {
    low: [u8; D],
    high: [u8; D],
}

impl<const D: usize> Part<D> {
    /// All nodes.
    pub const WHOLE: Self = Self { low: [0; D], high: [WIDTH as u8; D] };

    /// The nodes that stencils of the cells from `low` to `high` (both included) reach.
    #[must_use]
    pub(crate) fn around(low: &[u8; D], high: &[u8; D]) -> Self {
        Self { low: *low, high: high.map(|h| h + 4) }
    }

    /// [`overlap`] inside the part; rows along x are kept whole.
    #[inline(always)]
    fn clip(&self, axis: usize, (own, at, count): (usize, usize, usize)) -> (usize, usize, usize) {
        let (low, high) = (self.low[axis] as usize, self.high[axis] as usize);
        let (first, last) = (at.max(low), (at + count).min(high));
        if first >= last {
            (0, 0, 0)
        } else if axis == 0 {
            (own, at, count)
        } else {
            (own + first - at, first, last - first)
        }
    }
}

/// What happens to a short row that a block's own nodes share with a tile; its length is known to the compiler.
pub(crate) trait Row {
    /// A row of `N` nodes, from node `own` of the block and node `tile` of the tile.
    fn row<const N: usize>(&mut self, own: usize, tile: usize);
}

/// Calls `work` for the rows that a block's own nodes share with a part of the tile of a neighbour.
///
/// - `offset`: of the neighbour, in blocks
/// - `width`: stride of a row of the tile
#[inline(always)]
pub(crate) fn for_rows<const D: usize>(offset: &[i32; D], width: usize, within: &Part<D>, work: &mut impl Row) {
    let (own, tile, count) = within.clip(0, overlap(offset[0]));
    match count {
        4 => rows::<D, 4>(offset, width, within, own, tile, work),
        2 => rows::<D, 2>(offset, width, within, own, tile, work),
        1 => rows::<D, 1>(offset, width, within, own, tile, work),
        _ => {}
    }
}

#[inline(always)]
fn rows<const D: usize, const N: usize>(
    offset: &[i32; D],
    width: usize,
    within: &Part<D>,
    own_x: usize,
    tile_x: usize,
    work: &mut impl Row,
) {
    let along = |a: usize| if a < D { within.clip(a, overlap(offset[a])) } else { (0, 0, 1) };
    let ((own_y, tile_y, ny), (own_z, tile_z, nz)) = (along(1), along(2));
    for z in 0..nz {
        for y in 0..ny {
            let own = ((own_z + z) * BLOCK + own_y + y) * BLOCK + own_x;
            let tile = ((tile_z + z) * WIDTH + tile_y + y) * width + tile_x;
            work.row::<N>(own, tile);
        }
    }
}

/// Copies nodes of a block into a tile.
struct Copied<'a> {
    from: &'a [f64],
    to: &'a mut [f64],
}

impl Row for Copied<'_> {
    #[inline(always)]
    fn row<const N: usize>(&mut self, own: usize, tile: usize) {
        self.to[tile..tile + N].copy_from_slice(&self.from[own..own + N]);
    }
}

/// Adds nodes of a tile to those of a block.
pub(crate) struct Added<'a, T> {
    /// The tile.
    pub from: &'a [T],
    /// The block.
    pub to: &'a mut [T],
}

impl<T: Copy + std::ops::AddAssign> Row for Added<'_, T> {
    #[inline(always)]
    fn row<const N: usize>(&mut self, own: usize, tile: usize) {
        let (to, from) = (&mut self.to[own..own + N], &self.from[tile..tile + N]);
        for k in 0..N {
            to[k] += from[k];
        }
    }
}

/// Sets a part of a scalar tile with padded rows to zero.
#[inline(always)]
pub fn clear<const D: usize>(part: &Part<D>, tile: &mut [f64]) {
    let range = |a: usize| if a < D { part.low[a] as usize..part.high[a] as usize } else { 0..1 };
    for z in range(2) {
        for y in range(1) {
            tile[(z * WIDTH + y) * ROW..][..ROW].fill(0.0);
        }
    }
}

/// Copies the nodes around a block into a scalar tile with padded rows; inactive nodes read as zero.
///
/// - `within`: the part of the tile that will be read; the rest is left as it is
#[inline(always)]
pub fn load<const D: usize>(grid: &BlockGrid<D>, block: usize, within: &Part<D>, field: &[f64], tile: &mut [f64]) {
    clear(within, tile);
    let per = cells_per_block::<D>();
    for (slot, &neighbour) in grid.neighbours(block).iter().enumerate().take(BlockGrid::<D>::NEIGHBOURS) {
        if neighbour == NONE {
            continue;
        }
        let source = &field[neighbour as usize * per..][..per];
        // Seen from the neighbour, this block's tile lies in the opposite direction.
        let offset = BlockGrid::<D>::slot_offset(slot).map(|o| -o);
        for_rows(&offset, ROW, within, &mut Copied { from: source, to: tile });
    }
}

/// Adds scalar tiles with padded rows, one set per occupied block, into fields that lie one after the other (overwritten), in the order of
/// the neighbour table. Only the part of a tile that the particles of its block reach is read.
///
/// - `tiles`: sets of as many tiles as there are fields, by rank of the occupied block
pub fn sum<const D: usize>(grid: &BlockGrid<D>, tiles: &[f64], fields: usize, out: &mut [f64]) {
    let (per, len, blocks) = (cells_per_block::<D>(), padded_len::<D>(), grid.block_count());
    debug_assert_eq!(out.len(), fields * grid.node_count());
    out.par_chunks_mut(per).with_min_len(8).enumerate().for_each(|(chunk, nodes)| {
        let (field, block) = (chunk / blocks, chunk % blocks);
        nodes.fill(0.0);
        for (slot, &neighbour) in grid.neighbours(block).iter().enumerate().take(BlockGrid::<D>::NEIGHBOURS) {
            if neighbour == NONE || grid.rank(neighbour as usize) == NONE {
                continue;
            }
            let rank = grid.rank(neighbour as usize) as usize;
            let from = &tiles[(rank * fields + field) * len..][..len];
            let offset = BlockGrid::<D>::slot_offset(slot);
            for_rows(&offset, ROW, grid.reached(rank), &mut Added { from, to: nodes });
        }
    });
}
