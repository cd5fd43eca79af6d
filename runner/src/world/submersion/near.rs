//! Points around points: particles around the vertices of strands, within the reach of the kernel.

use mpm::Vector;
use numerics::bspline;
use particle_grid::{BLOCK, Lattice};

/// Points sorted by cell, those alone that lie near the places of interest.
#[derive(Clone, Debug, Default)]
pub struct Neighbourhood {
    /// Blocks near the places of interest, sorted.
    blocks: Vec<u64>,
    /// Cell and index of each point near them, sorted.
    entries: Vec<(u64, u32)>,
}

/// A point near another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Near {
    /// Which.
    pub index: usize,
    /// Kernel of the displacement in cells [1].
    pub weight: f64,
    /// Distance [m].
    pub distance: f64,
}

const SHIFT: i32 = 1 << 20;

fn pack(cell: [i32; 3]) -> u64 {
    cell.iter().rev().fold(0, |key, c| (key << 21) | (c + SHIFT).clamp(0, (1 << 21) - 1) as u64)
}

/// Cell of a point in unbounded numbering.
fn cell_of(lattice: &Lattice<3>, x: &Vector<3>) -> [i32; 3] {
    lattice.to_cells(x).map(|c| c.floor().clamp(-1e6, 1e6) as i32)
}

/// Cell brought into the period.
fn wrapped(lattice: &Lattice<3>, mut cell: [i32; 3]) -> [i32; 3] {
    for a in 0..3 {
        let period = (lattice.periods[a] as usize * BLOCK) as i32;
        if period > 0 {
            cell[a] = cell[a].rem_euclid(period);
        }
    }
    cell
}

impl Neighbourhood {
    /// Takes over the points that lie near `places`.
    pub fn gather(&mut self, lattice: &Lattice<3>, places: impl Iterator<Item = Vector<3>>, points: &[Vector<3>]) {
        self.blocks.clear();
        self.entries.clear();
        let block = BLOCK as i32;
        for x in places {
            let cell = cell_of(lattice, &x);
            for corner in 0..8 {
                let reached = std::array::from_fn(|a| cell[a] + if corner >> a & 1 == 0 { -2 } else { 2 });
                self.blocks.push(pack(wrapped(lattice, reached).map(|c| c.div_euclid(block))));
            }
        }
        self.blocks.sort_unstable();
        self.blocks.dedup();
        if self.blocks.is_empty() {
            return;
        }
        for (index, x) in points.iter().enumerate() {
            let cell = wrapped(lattice, cell_of(lattice, x));
            if self.blocks.binary_search(&pack(cell.map(|c| c.div_euclid(block)))).is_ok() {
                self.entries.push((pack(cell), index as u32));
            }
        }
        self.entries.sort_unstable();
    }

    /// Calls `visit` for the points within the kernel's reach of `x`, in a fixed order.
    pub fn around(&self, lattice: &Lattice<3>, x: &Vector<3>, points: &[Vector<3>], mut visit: impl FnMut(Near)) {
        if self.entries.is_empty() {
            return;
        }
        let at = lattice.to_cells(x);
        let range = |a: usize| (at[a] - 1.5).floor() as i32..=(at[a] + 1.5).floor() as i32;
        for k in range(2) {
            for j in range(1) {
                for i in range(0) {
                    let key = pack(wrapped(lattice, [i, j, k]));
                    let first = self.entries.partition_point(|entry| entry.0 < key);
                    for (_, index) in self.entries[first..].iter().take_while(|entry| entry.0 == key) {
                        let index = *index as usize;
                        let d = lattice.displacement(x, &points[index]);
                        let weight = (0..3).map(|a| bspline::value(d[a] / lattice.dx)).product();
                        if weight > 0.0 {
                            visit(Near { index, weight, distance: d.norm() });
                        }
                    }
                }
            }
        }
    }

    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        8 * self.blocks.capacity() + 16 * self.entries.capacity()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every point within reach is found once, also across a period; the kernel of a full lattice sums to one.
    #[test]
    fn all_neighbours_are_found() {
        let lattice = Lattice { dx: 0.1, origin: Vector::<3>::new(0.03, 0.0, 0.0), periods: [3, 0, 0] };
        let mut points = Vec::new();
        for i in 0..24 {
            for j in -6..12 {
                for k in -6..12 {
                    points.push(Vector::<3>::new(
                        0.03 + 0.05 * f64::from(i) + 0.025,
                        0.05 * f64::from(j),
                        0.05 * f64::from(k),
                    ));
                }
            }
        }
        for x in
            [Vector::<3>::new(0.031, 0.1, 0.07), Vector::<3>::new(1.2, 0.13, 0.2), Vector::<3>::new(0.6, 0.0, 0.11)]
        {
            let mut near = Neighbourhood::default();
            near.gather(&lattice, [x].into_iter(), &points);
            let mut found = Vec::new();
            let mut sum = 0.0;
            near.around(&lattice, &x, &points, |n| {
                found.push(n.index);
                sum += n.weight / 8.0;
            });
            // the very edge of the kernel, where its value is round-off, may fall either way
            let inside = |reach: f64| points.iter().filter(|p| lattice.displacement(&x, p).amax() < reach).count();
            found.sort_unstable();
            found.dedup();
            assert!((inside(0.15 - 1e-9)..=inside(0.15 + 1e-9)).contains(&found.len()), "{}", found.len());
            assert!((sum - 1.0).abs() < 1e-9, "{sum}");
        }
    }
}
