//! One level of the multigrid hierarchy: rows ordered by colour, smoothing, and the transfers to the next coarser level.

use crate::multigrid_system::{CellRow, NO_CELL};
use rayon::prelude::*;

/// Rows per parallel task; results do not depend on it.
const CHUNK: usize = 2048;

/// A row as the smoother reads it. Neighbour indices are relative to the half of the *other* colour on a two-coloured level.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row<const D: usize> {
    pub(crate) diagonal: f64,
    pub(crate) inverse: f64,
    pub(crate) conductance: [[f64; 2]; D],
    pub(crate) neighbour: [[u32; 2]; D],
}

impl<const D: usize> Row<D> {
    pub(crate) fn new(row: &CellRow<D>, place: impl Fn(u32) -> u32) -> Self {
        let diagonal = row.diagonal();
        let mut conductance = row.conductance;
        let neighbour = std::array::from_fn(|a| {
            std::array::from_fn(|s| {
                if row.neighbour[a][s] == NO_CELL {
                    conductance[a][s] = 0.0;
                    0
                } else {
                    place(row.neighbour[a][s])
                }
            })
        });
        Self { diagonal, inverse: if diagonal > 0.0 { 1.0 / diagonal } else { 0.0 }, conductance, neighbour }
    }

    #[inline(always)]
    fn coupled(&self, other: &[f64]) -> f64 {
        let mut sum = 0.0;
        for a in 0..D {
            for s in 0..2 {
                sum += self.conductance[a][s] * other[self.neighbour[a][s] as usize];
            }
        }
        sum
    }
}

/// Weight of one coarse cell in the interpolation of a fine one. Weights are products of quarters: exact in 32 bits.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Link {
    pub(crate) cell: u32,
    pub(crate) weight: f32,
}

/// Compressed rows of links.
#[derive(Clone, Debug, Default)]
pub(crate) struct Links {
    pub(crate) start: Vec<u32>,
    pub(crate) link: Vec<Link>,
}

impl Links {
    #[inline(always)]
    fn dot(&self, row: usize, v: &[f64]) -> f64 {
        let mut sum = 0.0;
        for l in &self.link[self.start[row] as usize..self.start[row + 1] as usize] {
            sum += f64::from(l.weight) * v[l.cell as usize];
        }
        sum
    }

    /// The transposed links: for each of `columns` cells the rows that refer to it, in ascending order.
    pub(crate) fn transposed(&self, columns: usize) -> Links {
        let mut start = vec![0u32; columns + 1];
        for l in &self.link {
            start[l.cell as usize + 1] += 1;
        }
        for i in 0..columns {
            start[i + 1] += start[i];
        }
        let mut next = start.clone();
        let mut link = vec![Link::default(); self.link.len()];
        for row in 0..self.start.len().saturating_sub(1) {
            for l in &self.link[self.start[row] as usize..self.start[row + 1] as usize] {
                link[next[l.cell as usize] as usize] = Link { cell: row as u32, weight: l.weight };
                next[l.cell as usize] += 1;
            }
        }
        Links { start, link }
    }
}

/// A level: rows with the red cells first, and the interpolation from the next coarser level to its red cells.
///
/// Pre-smoothing ends with the black cells, whose residual is then zero; post-smoothing begins with them and overwrites what
/// was interpolated there. Both transfers therefore need the red cells only. A level that cannot be two-coloured (an odd
/// period) is smoothed by damped Jacobi and counts as all red.
#[derive(Clone, Debug, Default)]
pub(crate) struct Level<const D: usize> {
    pub(crate) rows: Vec<Row<D>>,
    pub(crate) red: usize,
    pub(crate) two_coloured: bool,
    /// Interpolation: red fine cell from coarse cells.
    pub(crate) prolongation: Links,
    /// Its transpose: coarse cell from red fine cells.
    pub(crate) restriction: Links,
    pub(crate) x: Vec<f64>,
    pub(crate) b: Vec<f64>,
    pub(crate) r: Vec<f64>,
}

/// Damping of the Jacobi smoother.
const JACOBI: f64 = 0.8;

fn for_each_row(target: &mut [f64], f: impl Fn(usize, &mut f64) + Sync) {
    if target.len() <= 2 * CHUNK {
        for (i, t) in target.iter_mut().enumerate() {
            f(i, t);
        }
    } else {
        target.par_chunks_mut(CHUNK).enumerate().for_each(|(c, part)| {
            for (i, t) in part.iter_mut().enumerate() {
                f(c * CHUNK + i, t);
            }
        });
    }
}

impl<const D: usize> Level<D> {
    /// Updates all cells of one colour from the other.
    fn relax(&mut self, red: bool) {
        let (x_red, x_black) = self.x.split_at_mut(self.red);
        let (rows, b) = (&self.rows, &self.b);
        if red {
            for_each_row(x_red, |i, x| *x = (b[i] + rows[i].coupled(x_black)) * rows[i].inverse);
        } else {
            let n = self.red;
            for_each_row(x_black, |i, x| *x = (b[n + i] + rows[n + i].coupled(x_red)) * rows[n + i].inverse);
        }
    }

    fn jacobi(&mut self) {
        let Self { rows, x, b, r, .. } = self;
        for_each_row(r, |i, r| *r = (b[i] + rows[i].coupled(x)) * rows[i].inverse);
        for_each_row(x, |i, x| *x += JACOBI * (r[i] - *x));
    }

    /// Smooths from a zero guess; leaves the residual of the red cells in `r`.
    pub(crate) fn smooth_down(&mut self, sweeps: usize) {
        if !self.two_coloured {
            self.x.fill(0.0);
            for _ in 0..sweeps {
                self.jacobi();
            }
            let Self { rows, x, b, r, .. } = self;
            for_each_row(r, |i, r| *r = b[i] + rows[i].coupled(x) - rows[i].diagonal * x[i]);
            return;
        }
        let n = self.red;
        let Self { rows, x, b, .. } = self;
        for_each_row(&mut x[..n], |i, x| *x = b[i] * rows[i].inverse);
        self.relax(false);
        for _ in 1..sweeps {
            self.relax(true);
            self.relax(false);
        }
        let Self { rows, x, b, r, .. } = self;
        let (x_red, x_black) = x.split_at(n);
        for_each_row(&mut r[..n], |i, r| *r = b[i] + rows[i].coupled(x_black) - rows[i].diagonal * x_red[i]);
    }

    /// Adds the interpolated correction of the coarse level and smooths in the reverse order.
    pub(crate) fn smooth_up(&mut self, coarse: &[f64], sweeps: usize) {
        let n = self.red;
        let prolongation = &self.prolongation;
        for_each_row(&mut self.x[..n], |i, x| *x += prolongation.dot(i, coarse));
        for _ in 0..sweeps {
            if self.two_coloured {
                self.relax(false);
                self.relax(true);
            } else {
                self.jacobi();
            }
        }
    }

    /// Sums the residual of the red cells into the coarse right-hand side.
    pub(crate) fn restrict(&self, coarse: &mut [f64]) {
        let r = &self.r;
        for_each_row(coarse, |i, c| *c = self.restriction.dot(i, r));
    }

    /// `out = A x` in the order of this level.
    pub(crate) fn apply(&self, x: &[f64], out: &mut [f64]) {
        let n = self.red;
        let (x_red, x_black) = x.split_at(n);
        let rows = &self.rows;
        if !self.two_coloured {
            for_each_row(out, |i, o| *o = rows[i].diagonal * x[i] - rows[i].coupled(x));
            return;
        }
        let (out_red, out_black) = out.split_at_mut(n);
        for_each_row(out_red, |i, o| *o = rows[i].diagonal * x_red[i] - rows[i].coupled(x_black));
        for_each_row(out_black, |i, o| *o = rows[n + i].diagonal * x_black[i] - rows[n + i].coupled(x_red));
    }
}
