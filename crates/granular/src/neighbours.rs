//! Search for pairs closer than touch plus a skin: a cell list on the sheared box, exact search for small samples.
//!
//! The cells tile the oblique box spanned by `(width, 0)` and `(strain·height, height)` with the strain reduced to
//! half a box, so that neighbouring rows need no shifted columns. Lists come out sorted by grain index, which is what makes
//! every later sum independent of the number of threads.

use crate::cell::Cell;
use rayon::prelude::*;

/// Grains per task; lists do not depend on it.
const BLOCK: usize = 1024;

/// Bins of grains over the oblique box.
struct Bins {
    columns: usize,
    rows: usize,
    starts: Vec<u32>,
    grains: Vec<u32>,
    bin_of: Vec<u32>,
    periodic: [bool; 2],
}

impl Bins {
    /// Returns `None` if the box is too small for three bins along a periodic direction.
    fn build(cell: &Cell, x: &[f64], y: &[f64], reach: f64) -> Option<Self> {
        let n = x.len();
        let periodic = [cell.boundary.periodic_x(), cell.boundary.periodic_y()];
        let span = |v: &[f64]| v.iter().fold((f64::MAX, f64::MIN), |(a, b), &c| (a.min(c), b.max(c)));
        let (left, width) = if periodic[0] {
            (0.0, cell.width)
        } else {
            let (a, b) = span(x);
            (a, (b - a).max(reach))
        };
        let (bottom, height) = if periodic[1] {
            (0.0, cell.height)
        } else {
            let (a, b) = span(y);
            (a, (b - a).max(reach))
        };
        let slope = if periodic[1] {
            let turn = cell.width / cell.height;
            cell.strain - (cell.strain / turn).round() * turn
        } else {
            0.0
        };
        // Enough bins for about one grain each; never narrower than the reach.
        let most = (n as f64).sqrt().max(3.0) * 2.0;
        let count = |length: f64| ((length / reach).min(most).floor() as usize).max(1);
        let columns = count(width / (1.0 + slope * slope).sqrt());
        let rows = count(height);
        if (periodic[0] && columns < 3) || (periodic[1] && rows < 3) {
            return None;
        }
        let place = |v: f64, bins: usize, periodic: bool| {
            let b = (v * bins as f64).floor();
            if periodic {
                (b as i64).rem_euclid(bins as i64) as usize
            } else {
                b.clamp(0.0, bins as f64 - 1.0) as usize
            }
        };
        let bin = |i: usize| {
            let v = (y[i] - bottom) / height;
            let u = (x[i] - slope * (y[i] - bottom) - left) / width;
            (place(v, rows, periodic[1]) * columns + place(u, columns, periodic[0])) as u32
        };
        let bin_of: Vec<u32> = if n > 4 * BLOCK && rayon::current_num_threads() > 1 {
            (0..n).into_par_iter().with_min_len(BLOCK).map(bin).collect()
        } else {
            (0..n).map(bin).collect()
        };
        let mut starts = vec![0u32; columns * rows + 1];
        for &b in &bin_of {
            starts[b as usize + 1] += 1;
        }
        for b in 0..columns * rows {
            starts[b + 1] += starts[b];
        }
        let mut next = starts.clone();
        let mut grains = vec![0u32; n];
        for (i, &b) in bin_of.iter().enumerate() {
            grains[next[b as usize] as usize] = i as u32;
            next[b as usize] += 1;
        }
        Some(Self { columns, rows, starts, grains, bin_of, periodic })
    }

    /// Calls `visit` for every grain in the nine bins around grain `i`, itself included.
    #[inline]
    fn around(&self, i: usize, mut visit: impl FnMut(usize)) {
        let b = self.bin_of[i] as usize;
        let (row, column) = ((b / self.columns) as i64, (b % self.columns) as i64);
        for r in row - 1..=row + 1 {
            let r = match self.periodic[1] {
                true => r.rem_euclid(self.rows as i64),
                false if r < 0 || r >= self.rows as i64 => continue,
                false => r,
            };
            for c in column - 1..=column + 1 {
                let c = match self.periodic[0] {
                    true => c.rem_euclid(self.columns as i64),
                    false if c < 0 || c >= self.columns as i64 => continue,
                    false => c,
                };
                let bin = (r * self.columns as i64 + c) as usize;
                for &j in &self.grains[self.starts[bin] as usize..self.starts[bin + 1] as usize] {
                    visit(j as usize);
                }
            }
        }
    }
}

/// For each grain all partners whose nearest image is closer than touch plus `skin`, ascending; as offsets and one array.
///
/// `after` keeps only partners of larger index.
fn partners(cell: &Cell, x: &[f64], y: &[f64], radius: &[f64], skin: f64, after: bool) -> (Vec<u32>, Vec<u32>) {
    let n = x.len();
    let largest = radius.iter().fold(0.0f64, |m, &r| m.max(r));
    let bins = if n > 64 { Bins::build(cell, x, y, 2.0 * largest + skin) } else { None };
    let close = |i: usize, j: usize| {
        let ([dx, dy], ..) = cell.nearest(x[j] - x[i], y[j] - y[i]);
        let reach = radius[i] + radius[j] + skin;
        dx * dx + dy * dy < reach * reach
    };
    let block = |range: std::ops::Range<usize>| {
        let (mut counts, mut list) = (Vec::with_capacity(range.len()), Vec::with_capacity(range.len() * 8));
        for i in range {
            let from = list.len();
            match &bins {
                Some(bins) => bins.around(i, |j| {
                    if (if after { j > i } else { j != i }) && close(i, j) {
                        list.push(j as u32);
                    }
                }),
                None => {
                    for j in if after { i + 1 } else { 0 }..n {
                        if j != i && close(i, j) {
                            list.push(j as u32);
                        }
                    }
                }
            }
            list[from..].sort_unstable();
            counts.push((list.len() - from) as u32);
        }
        (counts, list)
    };
    let blocks: Vec<(Vec<u32>, Vec<u32>)> = if n > 4 * BLOCK && rayon::current_num_threads() > 1 {
        (0..n.div_ceil(BLOCK)).into_par_iter().map(|b| block(b * BLOCK..((b + 1) * BLOCK).min(n))).collect()
    } else {
        vec![block(0..n)]
    };
    let mut offsets = Vec::with_capacity(n + 1);
    offsets.push(0);
    let mut list = Vec::with_capacity(blocks.iter().map(|b| b.1.len()).sum());
    for (counts, part) in blocks {
        for c in counts {
            offsets.push(offsets[offsets.len() - 1] + c);
        }
        list.extend_from_slice(&part);
    }
    (offsets, list)
}

/// All partners of each grain within touch plus `skin` [µm]: `(offsets, partners)`, ascending.
pub(crate) fn all_partners(cell: &Cell, x: &[f64], y: &[f64], radius: &[f64], skin: f64) -> (Vec<u32>, Vec<u32>) {
    partners(cell, x, y, radius, skin, false)
}

/// As [`all_partners`], each pair once at its smaller index.
pub(crate) fn later_partners(cell: &Cell, x: &[f64], y: &[f64], radius: &[f64], skin: f64) -> (Vec<u32>, Vec<u32>) {
    partners(cell, x, y, radius, skin, true)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::Boundary;
    use crate::random::Random;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn cell_list_equals_exhaustive_search(seed in 0u64..1000, strain in -4.0..4.0f64, kind in 0usize..4) {
            let mut random = Random::new(seed);
            let mut cell = Cell::new(500.0, 380.0);
            cell.strain = strain;
            cell.boundary = [Boundary::LeesEdwards, Boundary::Periodic, Boundary::Open, Boundary::Walls][kind];
            if cell.boundary != Boundary::LeesEdwards { cell.strain = 0.0; }
            let n = 300;
            // A little outside the box, as between two rebuilds.
            let x: Vec<f64> = (0..n).map(|_| random.uniform() * 520.0 - 10.0).collect();
            let y: Vec<f64> = (0..n).map(|_| random.uniform() * 400.0 - 10.0).collect();
            let radius: Vec<f64> = (0..n).map(|_| 10.0 + 15.0 * random.uniform()).collect();
            let (offsets, list) = all_partners(&cell, &x, &y, &radius, 4.0);
            for i in 0..n {
                let expected: Vec<u32> = (0..n).filter(|&j| {
                    let ([dx, dy], ..) = cell.nearest(x[j] - x[i], y[j] - y[i]);
                    j != i && dx * dx + dy * dy < (radius[i] + radius[j] + 4.0).powi(2)
                }).map(|j| j as u32).collect();
                prop_assert_eq!(&list[offsets[i] as usize..offsets[i + 1] as usize], &expected[..]);
            }
        }
    }
}
