//! Which sorted particles lie near a point: a walk over the cells around it.

use crate::grid::LiquidGrid;
use numerics::tensor::Vector;
use particle_grid::{NONE, cells_per_block};

/// Calls `visit` for every sorted particle whose cell touches the cube of half-width `radius` (at most one cell) around `x`,
/// in a fixed order. The caller tests the distance.
#[inline]
pub fn for_near<const D: usize>(grid: &LiquidGrid<D>, x: &Vector<D>, radius: f64, mut visit: impl FnMut(usize)) {
    let lattice = grid.lattice();
    let cells = lattice.to_cells(x);
    let reach = (radius / lattice.dx).min(1.0);
    let low: [i32; D] = std::array::from_fn(|a| (cells[a] - reach).floor() as i32);
    let count: [i32; D] = std::array::from_fn(|a| (cells[a] + reach).floor() as i32 - low[a] + 1);
    let total: i32 = count.iter().product();
    let per = cells_per_block::<D>();
    for k in 0..total {
        let mut rest = k;
        let cell: [i32; D] = std::array::from_fn(|a| {
            let i = rest % count[a];
            rest /= count[a];
            low[a] + i
        });
        let node = grid.blocks.node(&cell);
        if node == NONE {
            continue;
        }
        let rank = grid.blocks.rank(node as usize / per);
        if rank != NONE {
            for p in grid.order.cell_range(rank as usize, node as usize % per) {
                visit(p);
            }
        }
    }
}

/// Number of particles in the cell of a node.
#[inline]
#[must_use]
pub fn occupancy<const D: usize>(grid: &LiquidGrid<D>, node: u32) -> usize {
    if node == NONE {
        return 0;
    }
    let per = cells_per_block::<D>();
    let rank = grid.blocks.rank(node as usize / per);
    if rank == NONE { 0 } else { grid.order.cell_range(rank as usize, node as usize % per).len() }
}

/// Marks the nodes whose cell and all `3^D − 1` cells around it hold at least `least` particles.
pub fn interior_cells<const D: usize>(grid: &LiquidGrid<D>, least: usize) -> Vec<bool> {
    let n = grid.blocks.node_count();
    // Full along one direction after the other: the same as full in the whole neighbourhood.
    let mut full: Vec<bool> = (0..n).map(|i| occupancy(grid, i as u32) >= least).collect();
    for a in 0..D {
        full = (0..n)
            .map(|i| {
                full[i]
                    && [-1, 1].into_iter().all(|s| {
                        let o = grid.blocks.along(i, a, s);
                        o != NONE && full[o as usize]
                    })
            })
            .collect();
    }
    full
}
