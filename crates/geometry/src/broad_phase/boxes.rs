//! Overlapping pairs among boxes of mixed sizes.

use super::BroadPhaseError;
use super::rows::{RowTable, cell_index, row_key};
use crate::Aabb;
use rayon::prelude::*;

/// Longest sides within this ratio share a level.
const LEVEL_RATIO: f64 = 4.0;
/// Smaller boxes than `LEVEL_RATIO^-(LEVELS - 1)` of the largest join the finest level.
const LEVELS: usize = 10;
/// Cells are this much wider than the widest member, so that rounding of cell indices cannot hide a neighbour.
const SLACK: f64 = 1.0 + 1e-6;
/// Boxes handled by one task.
const CHUNK: usize = 512;
/// Half of the rows around a cell; the other half sees the pair from its side.
const FORWARD_ROWS: [(i32, i32); 4] = [(1, 0), (-1, 1), (0, 1), (1, 1)];
const ALL_ROWS: [(i32, i32); 9] = [(0, 0), (1, 0), (-1, 0), (-1, 1), (0, 1), (1, 1), (-1, -1), (0, -1), (1, -1)];

/// Boxes sorted into nested grids. Keeps its memory when built again.
#[derive(Clone, Debug, Default)]
pub struct BoxGrid {
    levels: Vec<Level>,
    count: usize,
    chunks: Vec<Vec<[u32; 2]>>,
    first: Vec<u32>,
}

/// Boxes of similar size, in cells that are, along every axis, at least as wide as any of them and of any finer level.
#[derive(Clone, Debug, Default)]
struct Level {
    members: Vec<u32>,
    cell: [f64; 3],
    inverse_cell: [f64; 3],
    cells: Vec<[i32; 3]>,
    table: RowTable,
    /// Boxes and numbers in the order of the table.
    bounds: Vec<Aabb>,
    id: Vec<u32>,
}

impl Level {
    fn cell_of(&self, bounds: &Aabb) -> [i32; 3] {
        std::array::from_fn(|k| cell_index(0.5 * (bounds.min[k] + bounds.max[k]), self.inverse_cell[k]))
    }

    fn build(&mut self, boxes: &[Aabb], widest: [f64; 3]) {
        self.cell = widest.map(|w| w * SLACK);
        self.inverse_cell = self.cell.map(f64::recip);
        let mut cells = std::mem::take(&mut self.cells);
        cells.clear();
        cells.extend(self.members.iter().map(|&i| self.cell_of(&boxes[i as usize])));
        self.table.build(&cells);
        self.cells = cells;
        self.id.clear();
        self.id.extend(self.table.order.iter().map(|&place| self.members[place as usize]));
        self.bounds.clear();
        self.bounds.extend(self.id.iter().map(|&i| boxes[i as usize]));
    }

    /// Visits members of the cell row `(y, z)` with first index `x0..=x1` that overlap `bounds`.
    #[inline]
    fn scan(&self, x: (i32, i32), y: i32, z: i32, bounds: &Aabb, visit: &mut impl FnMut(u32)) {
        let row = row_key(y, z);
        for range in self.table.places(row, x.0, x.1) {
            let rows = &self.table.row[range.clone()];
            let candidates = &self.bounds[range.clone()];
            for (offset, candidate) in candidates.iter().enumerate() {
                if candidate.overlaps(bounds) & (rows[offset] == row) {
                    visit(self.id[range.start + offset]);
                }
            }
        }
    }
}

impl BoxGrid {
    /// Sorts boxes into grids.
    ///
    /// # Errors
    /// [`BroadPhaseError`] names the first box that is not finite.
    pub fn build(&mut self, boxes: &[Aabb]) -> Result<(), BroadPhaseError> {
        if boxes.len() > i32::MAX as usize {
            return Err(BroadPhaseError::TooMany { count: boxes.len() });
        }
        if let Some(index) = boxes.iter().position(|b| !b.is_valid()) {
            return Err(BroadPhaseError::NotFinite { index });
        }
        self.count = boxes.len();
        let largest = boxes.iter().map(Aabb::longest_side).fold(0.0, f64::max);
        self.levels.resize_with(LEVELS, Level::default);
        let mut widest = [[0.0f64; 3]; LEVELS];
        self.levels.iter_mut().for_each(|level| level.members.clear());
        for (i, bounds) in boxes.iter().enumerate() {
            let side = bounds.longest_side();
            let mut level = 0;
            let mut limit = largest / LEVEL_RATIO;
            while side <= limit && level + 1 < LEVELS && limit > 0.0 {
                limit /= LEVEL_RATIO;
                level += 1;
            }
            self.levels[level].members.push(i as u32);
            for k in 0..3 {
                widest[level][k] = widest[level][k].max(bounds.max[k] - bounds.min[k]);
            }
        }
        for level in (0..LEVELS - 1).rev() {
            for k in 0..3 {
                widest[level][k] = widest[level][k].max(widest[level + 1][k]);
            }
        }
        // A flat axis (two-dimensional scenes, points) still needs a cell: of the size that spreads the members.
        let cloud = boxes.iter().fold(Aabb::EMPTY, |all, b| all.merge(b));
        let spread = if boxes.is_empty() { 1.0 } else { cloud.longest_side() / (boxes.len() as f64).cbrt() };
        let floor =
            [spread, cloud.longest_side(), 1.0].into_iter().find(|s| s.recip().is_finite() && *s > 0.0).unwrap_or(1.0);
        for (level, widest) in self.levels.iter_mut().zip(widest) {
            let smallest = widest.into_iter().fold(0.0, f64::max) * 1e-3;
            let sides =
                widest.map(|w| if w > smallest && w.recip().is_finite() { w } else { smallest.max(floor * 1e-3) });
            level.build(boxes, sides);
        }
        Ok(())
    }

    /// All pairs `[i, j]`, `i < j`, of boxes that overlap (touching counts), in ascending order, whatever the number of threads.
    pub fn overlapping_pairs(&mut self, pairs: &mut Vec<[u32; 2]>) {
        self.overlapping_pairs_where(|_, _| true, pairs);
    }

    /// Those pairs of overlapping boxes for which `keep(i, j)` holds (`i < j`), in ascending order. What is not kept costs no memory.
    pub fn overlapping_pairs_where(&mut self, keep: impl Fn(u32, u32) -> bool + Sync, pairs: &mut Vec<[u32; 2]>) {
        let BoxGrid { levels, count, chunks, first } = self;
        let tasks: Vec<(usize, usize)> = levels
            .iter()
            .enumerate()
            .flat_map(|(k, level)| (0..level.id.len()).step_by(CHUNK).map(move |from| (k, from)))
            .collect();
        chunks.resize_with(tasks.len().max(chunks.len()), Vec::new);
        let levels = &*levels;
        tasks.par_iter().zip(chunks.par_iter_mut()).for_each(|(&(k, from), found)| {
            found.clear();
            let level = &levels[k];
            for place in from..(from + CHUNK).min(level.id.len()) {
                let (i, bounds) = (level.id[place], &level.bounds[place]);
                let [x, y, z] = level.cell_of(bounds);
                let mut report = |j: u32| {
                    let (low, high) = (i.min(j), i.max(j));
                    if keep(low, high) {
                        found.push([low, high]);
                    }
                };
                // Within the own row both see each other: the lower number reports.
                level.scan((x - 1, x + 1), y, z, bounds, &mut |j| {
                    if j > i {
                        report(j);
                    }
                });
                for (dy, dz) in FORWARD_ROWS {
                    level.scan((x - 1, x + 1), y + dy, z + dz, bounds, &mut report);
                }
                for coarser in levels[..k].iter().filter(|coarser| !coarser.id.is_empty()) {
                    let [x, y, z] = coarser.cell_of(bounds);
                    for (dy, dz) in ALL_ROWS {
                        coarser.scan((x - 1, x + 1), y + dy, z + dz, bounds, &mut report);
                    }
                }
            }
        });
        let found = &chunks[..tasks.len()];
        // Counting sort by the first of the pair, then each short run by the second.
        first.clear();
        first.resize(*count + 1, 0);
        for pair in found.iter().flatten() {
            first[pair[0] as usize + 1] += 1;
        }
        for i in 0..*count {
            first[i + 1] += first[i];
        }
        pairs.clear();
        pairs.resize(first[*count] as usize, [0; 2]);
        for pair in found.iter().flatten() {
            let place = &mut first[pair[0] as usize];
            pairs[*place as usize] = *pair;
            *place += 1;
        }
        // `first[i]` is now the end of run `i`.
        let mut from = 0;
        for &end in &first[..*count] {
            pairs[from..end as usize].sort_unstable();
            from = end as usize;
        }
    }

    /// Calls `visit` for every box that overlaps `bounds` (touching counts), always in the same order.
    pub fn for_each_overlapping(&self, bounds: &Aabb, mut visit: impl FnMut(u32)) {
        for level in self.levels.iter().filter(|level| !level.id.is_empty()) {
            // Centres of overlapping members lie at most half a cell outside.
            let range = |k: usize| {
                let margin = 0.5 * level.cell[k];
                (
                    cell_index(bounds.min[k] - margin, level.inverse_cell[k]),
                    cell_index(bounds.max[k] + margin, level.inverse_cell[k]),
                )
            };
            let (x, (y0, y1), (z0, z1)) = (range(0), range(1), range(2));
            let rows = (f64::from(y1) - f64::from(y0) + 1.0) * (f64::from(z1) - f64::from(z0) + 1.0);
            if rows > level.id.len() as f64 {
                for (place, candidate) in level.bounds.iter().enumerate() {
                    if candidate.overlaps(bounds) {
                        visit(level.id[place]);
                    }
                }
                continue;
            }
            for z in z0..=z1 {
                for y in y0..=y1 {
                    level.scan(x, y, z, bounds, &mut visit);
                }
            }
        }
    }

    /// Number of boxes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there is no box.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn boxes(n: usize) -> impl Strategy<Value = Vec<Aabb>> {
        let one = ([-3.0..3.0f64, -3.0..3.0, -3.0..3.0], [-6.0..0.3f64, -6.0..0.3, -6.0..0.3], 0..4u8);
        proptest::collection::vec(one, 0..n).prop_map(|list| {
            list.into_iter()
                .map(|(center, exponent, kind)| {
                    // Mixed sizes, flat ones, points, and centres on a lattice so that many boxes just touch.
                    let half: [f64; 3] = std::array::from_fn(|k| match kind {
                        0 => 0.0,
                        1 => 0.5,
                        2 if k == 2 => 0.0,
                        _ => 10f64.powf(exponent[k]),
                    });
                    let center = if kind == 1 { center.map(f64::round) } else { center };
                    Aabb {
                        min: std::array::from_fn(|k| center[k] - half[k]),
                        max: std::array::from_fn(|k| center[k] + half[k]),
                    }
                })
                .collect()
        })
    }

    fn brute(boxes: &[Aabb]) -> Vec<[u32; 2]> {
        let n = boxes.len() as u32;
        (0..n)
            .flat_map(|i| (i + 1..n).map(move |j| [i, j]))
            .filter(|p| boxes[p[0] as usize].overlaps(&boxes[p[1] as usize]))
            .collect()
    }

    proptest! {
        #[test]
        fn pairs_and_queries_equal_brute_force(first in boxes(60), second in boxes(60)) {
            let mut grid = BoxGrid::default();
            let mut pairs = Vec::new();
            for list in [first, second] {
                grid.build(&list).unwrap();
                grid.overlapping_pairs(&mut pairs);
                prop_assert_eq!(&pairs, &brute(&list));
                for probe in list.iter().take(10) {
                    let mut found = Vec::new();
                    grid.for_each_overlapping(probe, |i| found.push(i));
                    found.sort_unstable();
                    let expected: Vec<u32> = (0..list.len() as u32).filter(|&i| list[i as usize].overlaps(probe)).collect();
                    prop_assert_eq!(found, expected);
                }
            }
        }
    }

    #[test]
    fn same_pairs_for_any_number_of_threads() {
        let boxes: Vec<Aabb> = (0..3000)
            .map(|i| {
                let x = f64::from(i) * 0.618_034;
                let center = crate::Vector3::new(x.fract() * 9.0, (x * 7.0).fract() * 9.0, (x * 31.0).fract() * 9.0);
                Aabb::around(&center, if i % 10 == 0 { 0.9 } else { 0.2 })
            })
            .collect();
        let pairs_with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let (mut grid, mut pairs) = (BoxGrid::default(), Vec::new());
                grid.build(&boxes).unwrap();
                grid.overlapping_pairs(&mut pairs);
                pairs
            })
        };
        let one = pairs_with(1);
        assert_eq!(one, brute(&boxes));
        assert_eq!(one, pairs_with(3));
    }

    #[test]
    fn refuses_what_is_not_finite() {
        let good = Aabb { min: [0.0; 3], max: [1.0; 3] };
        let bad = Aabb { min: [0.0; 3], max: [1.0, f64::INFINITY, 1.0] };
        let mut grid = BoxGrid::default();
        assert_eq!(grid.build(&[good, bad]), Err(BroadPhaseError::NotFinite { index: 1 }));
        assert_eq!(grid.build(&[good, Aabb::EMPTY]), Err(BroadPhaseError::NotFinite { index: 1 }));
        grid.build(&[]).unwrap();
        let mut pairs = vec![[0, 1]];
        grid.overlapping_pairs(&mut pairs);
        assert!(pairs.is_empty());
    }
}
