//! The room that strands take on the grid (spec 6.1, 6.2): shares of cells and how they change for the liquid.

use mpm::Vector;
use particle_grid::{BlockGrid, CENTRE, stencil};

/// Adds the shares of cells that points of the given volumes [m³] take, smoothed by the kernel.
///
/// - `share`: one number per node [1]
pub fn add_shares(grid: &BlockGrid<3>, positions: &[Vector<3>], volumes: &[f64], share: &mut [f64]) {
    let cell = grid.lattice.dx.powi(3);
    for (x, volume) in positions.iter().zip(volumes) {
        stencil(grid, x, &[CENTRE; 3], |s| share[s.node] += s.weight * volume / cell);
    }
}

/// Adds the rate of the liquid's share of cells, `Dε_f/Dt` following the liquid, as the points move [1/s].
///
/// - `velocities`: of the points [m/s]
/// - `liquid`: velocity of the liquid at the centre of a cell [m/s]
/// - `rate`: one number per node
pub fn add_rates(
    grid: &BlockGrid<3>,
    positions: &[Vector<3>],
    velocities: &[Vector<3>],
    volumes: &[f64],
    liquid: impl Fn(usize) -> Vector<3>,
    rate: &mut [f64],
) {
    let cell = grid.lattice.dx.powi(3);
    for ((x, v), volume) in positions.iter().zip(velocities).zip(volumes) {
        // the gradient of the stencil is by the point, the opposite of that by the cell
        stencil(grid, x, &[CENTRE; 3], |s| rate[s.node] += volume * (liquid(s.node) - v).dot(&s.gradient) / cell);
    }
}
