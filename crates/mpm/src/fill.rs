//! Particles on a regular sub-lattice of the cells inside a region: tanks, columns, samples of sources.

use numerics::tensor::Vector;
use particle_grid::Lattice;

/// Positions of the sub-lattice points (`per_axis` per cell and direction) of the box `low..high` for which `inside` holds.
///
/// The points sit at the centres of equal parts of each cell, so a box aligned with the cells is filled exactly: the number of
/// points times [`sample_volume`] is its volume. Order is x fastest.
#[must_use]
pub fn fill<const D: usize>(
    lattice: &Lattice<D>,
    per_axis: usize,
    low: &Vector<D>,
    high: &Vector<D>,
    inside: impl Fn(&Vector<D>) -> bool,
) -> Vec<Vector<D>> {
    let spacing = lattice.dx / per_axis as f64;
    // Index of the first point at or above `low` and the first at or above `high`, with a little tolerance for round numbers.
    let index = |x: f64, a: usize| ((x - lattice.origin[a]) / spacing - 0.5 - 1e-9).ceil() as i64;
    let first: [i64; D] = std::array::from_fn(|a| index(low[a], a));
    let count: [i64; D] = std::array::from_fn(|a| (index(high[a], a) - first[a]).max(0));
    let total: i64 = count.iter().product();
    let mut points = Vec::new();
    for k in 0..total {
        let mut rest = k;
        let x = Vector::<D>::from_fn(|a, _| {
            let i = rest % count[a];
            rest /= count[a];
            lattice.origin[a] + ((first[a] + i) as f64 + 0.5) * spacing
        });
        if inside(&x) {
            points.push(x);
        }
    }
    points
}

/// Volume that one point of the sub-lattice stands for [m³].
#[must_use]
pub fn sample_volume<const D: usize>(lattice: &Lattice<D>, per_axis: usize) -> f64 {
    (lattice.dx / per_axis as f64).powi(D as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_aligned_with_cells_are_filled_exactly() {
        for dx in [0.1, 0.3, 1.0 / 7.0] {
            let lattice = Lattice::<3>::new(dx);
            let points = fill(
                &lattice,
                4,
                &(Vector::<3>::new(-1.0, 0.0, 2.0) * dx),
                &(Vector::<3>::new(2.0, 1.0, 4.0) * dx),
                |_| true,
            );
            assert_eq!(points.len(), 3 * 2 * 64);
            let volume = points.len() as f64 * sample_volume(&lattice, 4);
            assert!((volume / (6.0 * dx.powi(3)) - 1.0).abs() < 1e-12);
        }
    }
}
