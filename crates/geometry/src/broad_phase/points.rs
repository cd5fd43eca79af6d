//! Radius queries among points.

use super::BroadPhaseError;
use super::rows::{RowTable, cell_index, row_key};

/// Points sorted into cells. Keeps its memory when built again.
#[derive(Clone, Debug, Default)]
pub struct PointGrid {
    inverse_cell: f64,
    table: RowTable,
    cells: Vec<[i32; 3]>,
    /// Positions in the order of the table.
    sorted: Vec<[f64; 3]>,
}

impl PointGrid {
    /// Sorts points into cells of side `cell` [m]; a radius asked often is a good side.
    ///
    /// # Errors
    /// [`BroadPhaseError`] if a point or the cell size is not finite.
    pub fn build(&mut self, points: &[[f64; 3]], cell: f64) -> Result<(), BroadPhaseError> {
        if !(cell > 0.0 && cell.is_finite() && cell.recip().is_finite()) {
            return Err(BroadPhaseError::Cell);
        }
        if points.len() > i32::MAX as usize {
            return Err(BroadPhaseError::TooMany { count: points.len() });
        }
        if let Some(index) = points.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
            return Err(BroadPhaseError::NotFinite { index });
        }
        self.inverse_cell = cell.recip();
        self.cells.clear();
        self.cells.extend(points.iter().map(|p| p.map(|x| cell_index(x, self.inverse_cell))));
        self.table.build(&self.cells);
        self.sorted.clear();
        self.sorted.extend(self.table.order.iter().map(|&i| points[i as usize]));
        Ok(())
    }

    /// Number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.sorted.len()
    }

    /// Whether there is no point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.sorted.is_empty()
    }

    /// Calls `visit(index, squared distance)` for every point within `radius` [m] of `center`, always in the same order.
    pub fn for_each_within(&self, center: &[f64; 3], radius: f64, mut visit: impl FnMut(u32, f64)) {
        let limit = radius * radius;
        let range = |k: usize| {
            let (low, high) = (center[k] - radius, center[k] + radius);
            (cell_index(low, self.inverse_cell), cell_index(high, self.inverse_cell))
        };
        let mut test = |place: usize| {
            let p = &self.sorted[place];
            let d = [p[0] - center[0], p[1] - center[1], p[2] - center[2]];
            let squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            if squared <= limit {
                visit(self.table.order[place], squared);
            }
        };
        let ((x0, x1), (y0, y1), (z0, z1)) = (range(0), range(1), range(2));
        let rows = (f64::from(y1) - f64::from(y0) + 1.0) * (f64::from(z1) - f64::from(z0) + 1.0);
        if rows > self.len() as f64 {
            // Wider than the cloud is rich: look at every point.
            (0..self.len()).for_each(test);
            return;
        }
        for z in z0..=z1 {
            for y in y0..=y1 {
                let row = row_key(y, z);
                for range in self.table.places(row, x0, x1) {
                    for place in range {
                        if self.table.row[place] == row {
                            test(place);
                        }
                    }
                }
            }
        }
    }

    /// The point nearest to `center` within `radius` [m] and its distance [m]; of equally near ones the lowest index.
    #[must_use]
    pub fn nearest(&self, center: &[f64; 3], radius: f64) -> Option<(u32, f64)> {
        let mut best: Option<(u32, f64)> = None;
        self.for_each_within(center, radius, |index, squared| {
            if best.is_none_or(|(i, d)| squared < d || (squared == d && index < i)) {
                best = Some((index, squared));
            }
        });
        best.map(|(index, squared)| (index, squared.sqrt()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn cloud(n: usize) -> impl Strategy<Value = Vec<[f64; 3]>> {
        proptest::collection::vec([-2.0..2.0f64, -2.0..2.0, -1.0..1.0], 0..n)
    }

    proptest! {
        #[test]
        fn finds_exactly_the_points_within(points in cloud(80), cell in 0.05..3.0f64, radius in 0.0..2.0f64, at in [-2.0..2.0f64, -2.0..2.0, -2.0..2.0]) {
            let mut grid = PointGrid::default();
            grid.build(&points, cell).unwrap();
            let mut found = Vec::new();
            grid.for_each_within(&at, radius, |i, _| found.push(i));
            found.sort_unstable();
            let squared = |p: &[f64; 3]| (0..3).map(|k| (p[k] - at[k]).powi(2)).sum::<f64>();
            let expected: Vec<u32> = (0..points.len() as u32).filter(|&i| squared(&points[i as usize]) <= radius * radius).collect();
            prop_assert_eq!(&found, &expected);
            let nearest = expected.iter().map(|&i| squared(&points[i as usize]).sqrt()).fold(f64::INFINITY, f64::min);
            prop_assert_eq!(grid.nearest(&at, radius).map_or(f64::INFINITY, |n| n.1), nearest);
        }
    }

    #[test]
    fn refuses_what_is_not_finite() {
        let mut grid = PointGrid::default();
        assert_eq!(grid.build(&[[0.0; 3], [f64::NAN, 0.0, 0.0]], 1.0), Err(BroadPhaseError::NotFinite { index: 1 }));
        assert_eq!(grid.build(&[[0.0; 3]], 0.0), Err(BroadPhaseError::Cell));
        grid.build(&[[1e300, -1e300, 0.0], [1e300, 1e300, 0.0]], 1.0).unwrap();
        assert_eq!(grid.nearest(&[1e300, 1e300, 0.0], 1.0), Some((1, 0.0)));
    }
}
