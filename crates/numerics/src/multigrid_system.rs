//! The linear system of a scalar on the cells of a regular grid: symmetric, diagonally dominant, stored row by row.

/// Marks an absent neighbour.
pub const NO_CELL: u32 = u32::MAX;

/// A face of a cell towards a region where the unknown is zero (a free surface).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ZeroFace {
    /// Coupling that the face would have towards a neighbour one cell away.
    pub conductance: f64,
    /// Distance from the cell centre to the zero level in cells, in `(0, 1]`; unused where the conductance is zero.
    pub fraction: f64,
}

impl ZeroFace {
    /// What the face adds to the diagonal.
    #[inline]
    #[must_use]
    pub fn coefficient(self) -> f64 {
        if self.conductance > 0.0 { self.conductance / self.fraction } else { 0.0 }
    }
}

/// One row: `(own + Σ conductance + Σ zero-face coefficients) x − Σ conductance x_neighbour`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellRow<const D: usize> {
    /// Index of the neighbour on the low and high side of each direction, or [`NO_CELL`].
    pub neighbour: [[u32; 2]; D],
    /// Coupling to that neighbour, non-negative and the same from both sides.
    pub conductance: [[f64; 2]; D],
    /// Faces to the zero region on the low and high side of each direction.
    pub zero: [[ZeroFace; 2]; D],
    /// What the cell adds to the diagonal by itself (a compliance), non-negative.
    pub own: f64,
}

impl<const D: usize> Default for CellRow<D> {
    fn default() -> Self {
        Self { neighbour: [[NO_CELL; 2]; D], conductance: [[0.0; 2]; D], zero: [[ZeroFace::default(); 2]; D], own: 0.0 }
    }
}

impl<const D: usize> CellRow<D> {
    /// The diagonal entry.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        let mut sum = self.own;
        for a in 0..D {
            for side in 0..2 {
                sum += self.conductance[a][side] + self.zero[a][side].coefficient();
            }
        }
        sum
    }
}

/// A scalar system on grid cells.
#[derive(Clone, Debug, Default)]
pub struct CellSystem<const D: usize> {
    /// Integer coordinates of the cells, all different.
    pub cells: Vec<[i32; D]>,
    /// One row per cell.
    pub rows: Vec<CellRow<D>>,
}

/// A set of cells that only sees itself, without a zero face or an own term: its matrix cannot tell a constant.
#[derive(Clone, Debug, Default)]
pub struct ClosedRegions {
    /// For each cell the number of its closed region, or [`NO_CELL`].
    pub label: Vec<u32>,
    /// Number of cells in each closed region.
    pub size: Vec<usize>,
}

impl ClosedRegions {
    /// Removes the mean of `v` in each closed region; returns the largest magnitude of a mean that was removed.
    pub fn project(&self, v: &mut [f64]) -> f64 {
        if self.size.is_empty() {
            return 0.0;
        }
        let mut mean = vec![0.0; self.size.len()];
        for (x, &l) in v.iter().zip(&self.label) {
            if l != NO_CELL {
                mean[l as usize] += x;
            }
        }
        for (m, &n) in mean.iter_mut().zip(&self.size) {
            *m /= n as f64;
        }
        for (x, &l) in v.iter_mut().zip(&self.label) {
            if l != NO_CELL {
                *x -= mean[l as usize];
            }
        }
        mean.iter().fold(0.0, |m: f64, x| m.max(x.abs()))
    }
}

impl<const D: usize> CellSystem<D> {
    /// Removes all cells.
    pub fn clear(&mut self) {
        self.cells.clear();
        self.rows.clear();
    }

    /// `out = A x`, row by row.
    pub fn apply(&self, x: &[f64], out: &mut [f64]) {
        for (i, row) in self.rows.iter().enumerate() {
            let mut sum = row.diagonal() * x[i];
            for a in 0..D {
                for side in 0..2 {
                    let n = row.neighbour[a][side];
                    if n != NO_CELL {
                        sum -= row.conductance[a][side] * x[n as usize];
                    }
                }
            }
            out[i] = sum;
        }
    }

    /// Finds the connected regions that have neither a zero face nor an own term.
    #[must_use]
    pub fn closed_regions(&self) -> ClosedRegions {
        let n = self.rows.len();
        let mut regions = ClosedRegions::default();
        // Where every cell has an own term nothing is singular; the usual case costs one pass.
        if self.rows.iter().all(|r| r.own > 0.0) {
            return regions;
        }
        regions.label.resize(n, NO_CELL);
        let mut seen = vec![false; n];
        let mut stack = Vec::new();
        for start in 0..n {
            if seen[start] {
                continue;
            }
            let mut members = Vec::new();
            let mut open = false;
            seen[start] = true;
            stack.push(start);
            while let Some(i) = stack.pop() {
                members.push(i);
                let row = &self.rows[i];
                open |= row.own > 0.0;
                for a in 0..D {
                    for side in 0..2 {
                        open |= row.zero[a][side].conductance > 0.0;
                        let j = row.neighbour[a][side];
                        if j != NO_CELL && row.conductance[a][side] > 0.0 && !seen[j as usize] {
                            seen[j as usize] = true;
                            stack.push(j as usize);
                        }
                    }
                }
            }
            if !open {
                for &i in &members {
                    regions.label[i] = regions.size.len() as u32;
                }
                regions.size.push(members.len());
            }
        }
        regions
    }
}
