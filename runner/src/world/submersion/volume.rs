//! The room that strands take on the grid (spec 6.1, 6.2): shares of cells and faces, and the volume that they carry through faces.
//!
//! A point's volume is smeared over cells by the quadratic kernel, and over faces by its integral across a cell: linear along the
//! normal, quadratic across it. The difference between the faces of a cell is then the gradient of the kernel at its centre, to
//! round-off. What flows through the faces is what changes the shares of the cells, and strands that move as one with the liquid
//! around them disturb no volume, however steep their share.

use mpm::Vector;
use numerics::bspline;
use particle_grid::{BlockGrid, CENTRE, NONE, stencil};

/// Adds the shares of cells that points of the given volumes [m³] take, smoothed by the kernel.
///
/// - `share`: one number per node [1]
pub fn add_shares(grid: &BlockGrid<3>, positions: &[Vector<3>], volumes: &[f64], share: &mut [f64]) {
    let cell = grid.lattice.dx.powi(3);
    for (x, volume) in positions.iter().zip(volumes) {
        stencil(grid, x, &[CENTRE; 3], |s| share[s.node] += s.weight * volume / cell);
    }
}

/// Calls `visit` with the active faces normal to `axis` over which a point is smeared, and their weights: they add up to one.
pub fn faces_around(grid: &BlockGrid<3>, x: &Vector<3>, axis: usize, mut visit: impl FnMut(usize, f64)) {
    let at = grid.lattice.to_cells(x);
    let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
    // three nodes see a point across the normal, two along it
    let low = at.map(|x| x.floor() as i32);
    let across = |a: usize, k: i32| bspline::value(at[a] - (f64::from(low[a] + k) + CENTRE));
    let ahead = at[axis] - f64::from(low[axis]);
    for k in -1..=1 {
        for j in -1..=1 {
            let beside = across(b, j) * across(c, k);
            for (i, along) in [1.0 - ahead, ahead].into_iter().enumerate() {
                let mut face = low;
                face[axis] += i as i32;
                face[b] += j;
                face[c] += k;
                let node = grid.node(&face);
                if node != NONE {
                    visit(node as usize, along * beside);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use particle_grid::{Lattice, ParticleOrder};

    /// The difference of the weights of a cell's faces is the gradient of the kernel at its centre.
    #[test]
    fn faces_are_the_integral_of_the_kernel() {
        let lattice = Lattice { dx: 0.1, origin: Vector::<3>::new(0.02, 0.0, -0.01), periods: [0, 2, 0] };
        for x in [
            Vector::<3>::new(0.131, 0.1, 0.07),
            Vector::<3>::new(-0.4, 0.799, 0.25),
            Vector::<3>::new(0.07, 0.35, 0.04),
        ] {
            let mut grid = BlockGrid::new(lattice);
            grid.rebuild(&ParticleOrder::new(), &[x]);
            let n = grid.node_count();
            let mut slope = vec![Vector::<3>::zeros(); n];
            stencil(&grid, &x, &[CENTRE; 3], |s| slope[s.node] -= s.gradient);
            for a in 0..3 {
                let mut share = vec![0.0; n];
                faces_around(&grid, &x, a, |node, weight| share[node] += weight);
                assert!((share.iter().sum::<f64>() - 1.0).abs() < 1e-14);
                for cell in 0..n {
                    let next = grid.along(cell, a, 1);
                    let high = if next == NONE { 0.0 } else { share[next as usize] };
                    assert!(((high - share[cell]) / lattice.dx - slope[cell][a]).abs() < 1e-12, "{x} {a}");
                }
            }
        }
    }
}
