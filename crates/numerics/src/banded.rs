//! Banded LDLᵀ with the half-bandwidth known at compile time, four matrices at a time.
//!
//! Lower band, column-major: column `j` is an array of `W` numbers (`W` = half-bandwidth + 1), entry `i` of which is
//! the matrix element `(j + i, j)`. [`factor`] works in place, right-looking and without pivoting; afterwards entry
//! 0 holds the *reciprocal* pivot and the others the unit lower factor. [`BatchedBand`] does this for four matrices
//! in lanes, [`Band`] for one. Each lane's bits are those of a factorisation on its own.
//!
//! Cost for half-bandwidth K: `n(K² + 3K)` flops for the factor, `4nK` for a solve.

use crate::lanes::{F4, Lane, LaneKernel, dispatch};
use serde::{Deserialize, Serialize};

/// What a factorisation met.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PivotReport {
    /// Row of the first pivot that was not positive (or not a number), if any.
    pub first_bad: Option<usize>,
    /// Number of negative pivots: by Sylvester's law of inertia the number of negative eigenvalues.
    pub negative: usize,
}

impl PivotReport {
    /// Whether the matrix was positive definite.
    #[must_use]
    pub fn is_positive_definite(&self) -> bool {
        self.first_bad.is_none()
    }
}

/// Factors in place; returns per lane the index of the first bad pivot (∞ if none) and the number of negative ones.
#[inline(always)]
fn factor<L: Lane, const W: usize>(a: &mut [[L::Memory; W]]) -> (L, L) {
    let n = a.len();
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let mut first = L::splat(f64::INFINITY);
    let mut negative = zero;
    for j in 0..n {
        let mut column = [zero; W];
        for i in 0..W {
            column[i] = L::load(&a[j][i]);
        }
        let d = column[0];
        // a positive pivot, and not NaN, leaves `first` alone
        first = L::select_gt(d, zero, first, first.min(L::splat(j as f64)));
        negative += L::select_gt(zero, d, one, zero);
        let inverse = one / d;
        inverse.store(&mut a[j][0]);
        let rows = W.min(n - j);
        if rows == W {
            let (head, tail) = a.split_at_mut(j + 1);
            let below: &mut [[L::Memory; W]] = &mut tail[..W - 1];
            for k in 1..W {
                let l = column[k] * inverse;
                l.store(&mut head[j][k]);
                let target = &mut below[k - 1];
                for i in k..W {
                    (L::load(&target[i - k]) - column[i] * l).store(&mut target[i - k]);
                }
            }
        } else {
            for k in 1..rows {
                let l = column[k] * inverse;
                l.store(&mut a[j][k]);
                for i in k..rows {
                    let updated = L::load(&a[j + k][i - k]) - column[i] * l;
                    updated.store(&mut a[j + k][i - k]);
                }
            }
        }
    }
    (first, negative)
}

/// Solves with a factor `f` whose entries are read through `read`; the right-hand side is overwritten.
#[inline(always)]
fn solve<L: Lane, M: Copy, const W: usize>(f: &[[M; W]], rhs: &mut [L::Memory], read: impl Fn(&M) -> L) {
    let n = f.len();
    for j in 0..n {
        let y = L::load(&rhs[j]);
        let rows = W.min(n - j);
        let target = &mut rhs[j..j + rows];
        if rows == W {
            for i in 1..W {
                (L::load(&target[i]) - read(&f[j][i]) * y).store(&mut target[i]);
            }
        } else {
            for i in 1..rows {
                (L::load(&target[i]) - read(&f[j][i]) * y).store(&mut target[i]);
            }
        }
    }
    for j in (0..n).rev() {
        let rows = W.min(n - j);
        let source = &rhs[j..j + rows];
        let mut even = L::load(&source[0]) * read(&f[j][0]);
        let mut odd = L::splat(0.0);
        let mut i = rows - 1;
        // furthest first: the nearest unknowns were computed last
        while i >= 2 {
            even -= read(&f[j][i]) * L::load(&source[i]);
            odd += read(&f[j][i - 1]) * L::load(&source[i - 1]);
            i -= 2;
        }
        if i == 1 {
            even -= read(&f[j][1]) * L::load(&source[1]);
        }
        (even - odd).store(&mut rhs[j]);
    }
}

struct Factor<'a, const W: usize>(&'a mut [[F4; W]]);
impl<const W: usize> LaneKernel for Factor<'_, W> {
    type Output = (F4, F4);
    #[inline(always)]
    fn run<L: Lane<Memory = F4>>(self) -> (F4, F4) {
        let (first, negative) = factor::<L, W>(self.0);
        let mut out = (F4::ZERO, F4::ZERO);
        first.store(&mut out.0);
        negative.store(&mut out.1);
        out
    }
}

struct Solve<'a, const W: usize>(&'a [[F4; W]], &'a mut [F4]);
impl<const W: usize> LaneKernel for Solve<'_, W> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lane<Memory = F4>>(self) {
        solve::<L, F4, W>(self.0, self.1, |m| L::load(m));
    }
}

struct SolveShared<'a, const W: usize>(&'a [[f64; W]], &'a mut [F4]);
impl<const W: usize> LaneKernel for SolveShared<'_, W> {
    type Output = ();
    #[inline(always)]
    fn run<L: Lane<Memory = F4>>(self) {
        solve::<L, f64, W>(self.0, self.1, |m| L::splat(*m));
    }
}

fn report(first: f64, negative: f64) -> PivotReport {
    PivotReport { first_bad: first.is_finite().then_some(first as usize), negative: negative as usize }
}

/// Four symmetric band matrices of equal size, one per lane. `W` is the half-bandwidth plus one.
#[derive(Clone, Debug, Default)]
pub struct BatchedBand<const W: usize> {
    /// Columns of the lower band: `columns[j][i][lane]` is the element `(j + i, j)`.
    pub columns: Vec<[F4; W]>,
}

impl<const W: usize> BatchedBand<W> {
    /// Four zero matrices of `n` rows.
    #[must_use]
    pub fn zeros(n: usize) -> Self {
        Self { columns: vec![[F4::ZERO; W]; n] }
    }

    /// Factors in place. Entries are afterwards the factor, valid in the lanes whose report is positive definite.
    pub fn factor(&mut self) -> [PivotReport; 4] {
        let (first, negative) = dispatch(Factor(&mut self.columns));
        std::array::from_fn(|i| report(first[i], negative[i]))
    }

    /// Solves for one right-hand side per lane, overwriting it. Only after [`factor`](Self::factor).
    ///
    /// # Panics
    /// If `rhs` is shorter than the matrix.
    pub fn solve(&self, rhs: &mut [F4]) {
        dispatch(Solve(&self.columns, &mut rhs[..self.columns.len()]));
    }

    /// Copies lane `lane` of `other` into this one; both must have the same size.
    pub fn copy_lane_from(&mut self, other: &Self, lane: usize) {
        for (to, from) in self.columns.iter_mut().zip(&other.columns) {
            for (t, f) in to.iter_mut().zip(from) {
                t[lane] = f[lane];
            }
        }
    }

    /// The matrix (or factor) of one lane.
    #[must_use]
    pub fn extract(&self, lane: usize) -> Band<W> {
        let mut out = Band::default();
        self.extract_into(lane, &mut out);
        out
    }

    /// The matrix (or factor) of one lane, into existing memory.
    pub fn extract_into(&self, lane: usize, out: &mut Band<W>) {
        out.columns.clear();
        out.columns.extend(self.columns.iter().map(|c| std::array::from_fn(|i| c[i][lane])));
    }
}

/// One symmetric band matrix. `W` is the half-bandwidth plus one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Band<const W: usize> {
    /// Columns of the lower band: `columns[j][i]` is the element `(j + i, j)`.
    pub columns: Vec<[f64; W]>,
}

impl<const W: usize> Band<W> {
    /// Zero matrix of `n` rows.
    #[must_use]
    pub fn zeros(n: usize) -> Self {
        Self { columns: vec![[0.0; W]; n] }
    }

    /// Element `(row, column)`; zero outside the band.
    #[must_use]
    pub fn get(&self, row: usize, column: usize) -> f64 {
        let (i, j) = if row >= column { (row, column) } else { (column, row) };
        if i - j < W { self.columns[j][i - j] } else { 0.0 }
    }

    /// Product with a vector (of the matrix, not of its factor).
    pub fn multiply(&self, x: &[f64], out: &mut [f64]) {
        let n = self.columns.len();
        out[..n].fill(0.0);
        for (j, c) in self.columns.iter().enumerate() {
            out[j] += c[0] * x[j];
            for i in 1..W.min(n - j) {
                out[j + i] += c[i] * x[j];
                out[j] += c[i] * x[j + i];
            }
        }
    }

    /// Factors in place.
    pub fn factor(&mut self) -> PivotReport {
        let (first, negative) = factor::<f64, W>(&mut self.columns);
        report(first, negative)
    }

    /// Solves for one right-hand side, overwriting it. Only after [`factor`](Self::factor).
    ///
    /// # Panics
    /// If `rhs` is shorter than the matrix.
    pub fn solve(&self, rhs: &mut [f64]) {
        solve::<f64, f64, W>(&self.columns, &mut rhs[..self.columns.len()], |m| *m);
    }

    /// Solves for four right-hand sides at once, one per lane, overwriting them.
    ///
    /// # Panics
    /// If `rhs` is shorter than the matrix.
    pub fn solve_four(&self, rhs: &mut [F4]) {
        dispatch(SolveShared(&self.columns, &mut rhs[..self.columns.len()]));
    }

    /// Number of eigenvalues below `shift` (Sylvester's law), using `scratch` for the factor.
    #[must_use]
    pub fn eigenvalues_below(&self, shift: f64, scratch: &mut Self) -> usize {
        scratch.columns.clear();
        scratch.columns.extend(self.columns.iter().map(|c| {
            let mut c = *c;
            c[0] -= shift;
            c
        }));
        scratch.factor().negative
    }

    /// Smallest eigenvalue, by bisection on the inertia to the relative accuracy `tolerance` of the spectral bound.
    #[must_use]
    pub fn smallest_eigenvalue(&self, tolerance: f64) -> f64 {
        let n = self.columns.len();
        let mut radius = vec![0.0; n];
        for (j, c) in self.columns.iter().enumerate() {
            for i in 1..W.min(n - j) {
                radius[j] += c[i].abs();
                radius[j + i] += c[i].abs();
            }
        }
        let low = (0..n).map(|j| self.columns[j][0] - radius[j]).fold(f64::INFINITY, f64::min);
        let high = (0..n).map(|j| self.columns[j][0]).fold(f64::INFINITY, f64::min);
        let bound = (0..n).map(|j| self.columns[j][0].abs() + radius[j]).fold(0.0, f64::max);
        let (mut low, mut high) = (low - tolerance * bound, high + tolerance * bound);
        let mut scratch = Self::default();
        while high - low > tolerance * bound {
            let mid = 0.5 * (low + high);
            if mid <= low || mid >= high {
                break;
            }
            if self.eigenvalues_below(mid, &mut scratch) > 0 {
                high = mid;
            } else {
                low = mid;
            }
        }
        0.5 * (low + high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    const W: usize = 11;

    /// A pseudo-random symmetric band matrix whose diagonal is `shift` plus something positive.
    fn matrix(n: usize, seed: u64, shift: f64) -> Band<W> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            ((state >> 11) as f64) / ((1u64 << 53) as f64) - 0.5
        };
        let mut a = Band::zeros(n);
        for j in 0..n {
            a.columns[j][0] = next() + shift;
            for i in 1..W.min(n - j) {
                a.columns[j][i] = next();
            }
        }
        a
    }

    fn dense(a: &Band<W>) -> DMatrix<f64> {
        DMatrix::from_fn(a.columns.len(), a.columns.len(), |i, j| a.get(i, j))
    }

    #[test]
    fn batched_and_single_solves_agree_bit_for_bit_and_with_a_dense_solver() {
        for n in [1, 2, 7, 11, 12, 40, 163] {
            let a: Vec<_> = (0..4).map(|s| matrix(n, 11 + s, 8.0)).collect();
            let mut batch = BatchedBand::<W>::zeros(n);
            for j in 0..n {
                for i in 0..W {
                    batch.columns[j][i] = F4(std::array::from_fn(|l| a[l].columns[j][i]));
                }
            }
            let b: Vec<F4> = (0..n).map(|j| F4(std::array::from_fn(|l| ((j * 7 + l * 3) % 13) as f64 - 6.0))).collect();
            let mut x = b.clone();
            assert!(batch.factor().iter().all(PivotReport::is_positive_definite));
            batch.solve(&mut x);
            for l in 0..4 {
                let mut f = a[l].clone();
                assert!(f.factor().is_positive_definite());
                assert_eq!(f, batch.extract(l));
                let mut y: Vec<f64> = b.iter().map(|v| v[l]).collect();
                f.solve(&mut y);
                for j in 0..n {
                    assert_eq!(y[j].to_bits(), x[j][l].to_bits());
                }
                let mut shared = b.clone();
                f.solve_four(&mut shared);
                let rhs = DVector::from_iterator(n, b.iter().map(|v| v[l]));
                let exact = dense(&a[l]).lu().solve(&rhs).unwrap();
                for j in 0..n {
                    assert!((y[j] - exact[j]).abs() <= 1e-12 * exact.amax());
                    assert_eq!(shared[j][l].to_bits(), y[j].to_bits());
                }
                let mut back = vec![0.0; n];
                a[l].multiply(&y, &mut back);
                assert!((0..n).all(|j| (back[j] - b[j][l]).abs() < 1e-12 * 20.0));
            }
        }
    }

    #[test]
    fn pivots_count_negative_eigenvalues_and_name_the_first_bad_row() {
        for seed in 0..6 {
            let a = matrix(50, seed, 0.5);
            let eigenvalues = dense(&a).symmetric_eigenvalues();
            let negative = eigenvalues.iter().filter(|e| **e < 0.0).count();
            let report = a.clone().factor();
            assert_eq!(report.negative, negative);
            assert_eq!(report.is_positive_definite(), negative == 0);
            assert!((a.smallest_eigenvalue(1e-12) - eigenvalues.min()).abs() < 1e-10);
        }
        let mut a = matrix(20, 3, 8.0);
        a.columns[13][0] = -1.0;
        assert_eq!(a.clone().factor().first_bad, Some(13));
        a.columns[5][0] = f64::NAN;
        assert_eq!(a.factor().first_bad, Some(5));
    }
}
