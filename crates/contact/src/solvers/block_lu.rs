//! Sparse LU factorisation over 3×3 blocks with a fixed elimination order; pivoting inside the blocks only.
//!
//! The pattern is symmetric, the values need not be. Every solve can be checked and refined by the caller; a block
//! whose pivot vanishes is shifted by its size times 1e-12 and counted.
//!
//! What is nearly dense at the end of the order, as in bundles where all contacts feel each other, is factored as one
//! dense matrix with partial pivoting: several times faster, and safer, than block by block.

use super::ordering::Elimination;
use crate::block::{Block, IDENTITY, Vec3, ZERO, invert, mat_mul, mat_mul_sub, mat_vec, mat_vec_sub, max_abs};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::{factor, solve};
use faer::perm::PermRef;
use faer::{Mat, Par, Spec};

/// Factors and the pattern they live on.
#[derive(Clone, Debug)]
pub struct BlockLu {
    row_start: Vec<usize>,
    columns: Vec<u32>,
    diagonal: Vec<usize>,
    values: Vec<Block>,
    inverse: Vec<Block>,
    position: Vec<u32>,
    tail: Option<Tail>,
    /// Diagonal blocks (single pivots in the dense tail) that had to be shifted in the last factorisation.
    pub shifted: usize,
}

/// The dense end of the matrix.
#[derive(Clone, Debug)]
struct Tail {
    /// Its first place.
    first: usize,
    /// Where the part of each of its rows begins that lies in the tail.
    start: Vec<usize>,
    /// The factors, and rows in the order in which they were pivots.
    factors: Mat<f64>,
    row: Vec<usize>,
    row_inverse: Vec<usize>,
}

impl BlockLu {
    /// Lays out the filled pattern of `elimination`.
    #[must_use]
    pub fn new(elimination: &Elimination) -> Self {
        let n = elimination.order.len();
        let mut count = vec![0usize; n];
        for (i, upper) in elimination.upper.iter().enumerate() {
            count[i] += upper.len() + 1;
            for j in upper {
                count[*j as usize] += 1;
            }
        }
        let mut row_start = vec![0; n + 1];
        for i in 0..n {
            row_start[i + 1] = row_start[i] + count[i];
        }
        let mut columns = vec![0u32; row_start[n]];
        let mut next = row_start.clone();
        let mut diagonal = vec![0; n];
        // going through the pivots in order fills every row's lower part ascending, then its own upper part
        for (i, upper) in elimination.upper.iter().enumerate() {
            diagonal[i] = next[i];
            columns[next[i]] = i as u32;
            next[i] += 1;
            for j in upper {
                columns[next[i]] = *j;
                next[i] += 1;
            }
            for j in upper {
                columns[next[*j as usize]] = i as u32;
                next[*j as usize] += 1;
            }
        }
        let entries = columns.len();
        let first = elimination.tail;
        let tail = (first < n).then(|| Tail {
            first,
            start: (first..n)
                .map(|i| {
                    row_start[i] + columns[row_start[i]..row_start[i + 1]].partition_point(|j| (*j as usize) < first)
                })
                .collect(),
            factors: Mat::zeros(3 * (n - first), 3 * (n - first)),
            row: vec![0; 3 * (n - first)],
            row_inverse: vec![0; 3 * (n - first)],
        });
        BlockLu {
            row_start,
            columns,
            diagonal,
            values: vec![ZERO; entries],
            inverse: vec![ZERO; n],
            position: vec![u32::MAX; n],
            tail,
            shifted: 0,
        }
    }

    /// Number of block rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.diagonal.len()
    }

    /// Whether there are no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.diagonal.is_empty()
    }

    /// Stored blocks of the factors.
    #[must_use]
    pub fn block_count(&self) -> usize {
        self.values.len()
    }

    /// Where the entry `(i, j)` (places) is stored, if it is in the pattern.
    #[must_use]
    pub fn slot(&self, i: usize, j: usize) -> Option<usize> {
        let row = &self.columns[self.row_start[i]..self.row_start[i + 1]];
        row.binary_search(&(j as u32)).ok().map(|p| self.row_start[i] + p)
    }

    /// Sets every entry to zero before a new matrix is written through [`values_mut`](Self::values_mut).
    pub fn clear(&mut self) {
        self.values.fill(ZERO);
    }

    /// The entries, to be addressed by [`slot`](Self::slot).
    pub fn values_mut(&mut self) -> &mut [Block] {
        &mut self.values
    }

    /// Replaces the matrix by its factors. Returns false where a number that is not finite appeared.
    pub fn factor(&mut self) -> bool {
        let n = self.len();
        self.shifted = 0;
        for i in 0..n {
            let (start, diag, end) = (self.row_start[i], self.diagonal[i], self.row_start[i + 1]);
            let dense_from = self.tail.as_ref().and_then(|t| i.checked_sub(t.first).map(|row| t.start[row]));
            for p in start..end {
                self.position[self.columns[p] as usize] = p as u32;
            }
            for p in start..dense_from.unwrap_or(diag) {
                let k = self.columns[p] as usize;
                let l = mat_mul(&self.values[p], &self.inverse[k]);
                self.values[p] = l;
                for e in self.diagonal[k] + 1..self.row_start[k + 1] {
                    let target = self.position[self.columns[e] as usize];
                    debug_assert!(target != u32::MAX, "filled pattern is closed under elimination");
                    let u = self.values[e];
                    mat_mul_sub(&l, &u, &mut self.values[target as usize]);
                }
            }
            for p in start..end {
                self.position[self.columns[p] as usize] = u32::MAX;
            }
            if dense_from.is_some() {
                continue;
            }
            let d = self.values[diag];
            let size = max_abs(&d);
            if !size.is_finite() {
                return false;
            }
            self.inverse[i] = match invert(&d, 1e-15 * size) {
                Some(inverse) => inverse,
                None => {
                    self.shifted += 1;
                    let mut s = d;
                    for c in 0..3 {
                        s[4 * c] += 1e-12 * size.max(1e-300);
                    }
                    invert(&s, 0.0).unwrap_or(IDENTITY)
                }
            };
        }
        self.factor_tail()
    }

    /// Factors what the sparse part left of the tail.
    fn factor_tail(&mut self) -> bool {
        let Some(tail) = &mut self.tail else { return true };
        let mut size = 0.0_f64;
        for (row, start) in tail.start.iter().enumerate() {
            let i = tail.first + row;
            for p in *start..self.row_start[i + 1] {
                let (column, block) = (self.columns[p] as usize - tail.first, &self.values[p]);
                size = size.max(max_abs(block));
                for c in 0..9 {
                    tail.factors[(3 * row + c / 3, 3 * column + c % 3)] = block[c];
                }
            }
        }
        // a comparison skips NaN, a sum does not
        if !self.values.iter().flatten().sum::<f64>().is_finite() || !size.is_finite() {
            return false;
        }
        let n = tail.row.len();
        let scratch = factor::lu_in_place_scratch::<usize, f64>(n, n, Par::Seq, Spec::default());
        let mut memory = MemBuffer::new(scratch);
        factor::lu_in_place(
            tail.factors.as_mut(),
            &mut tail.row,
            &mut tail.row_inverse,
            Par::Seq,
            MemStack::new(&mut memory),
            Spec::default(),
        );
        for i in 0..n {
            let pivot = tail.factors[(i, i)];
            if pivot.abs() <= 1e-15 * size {
                self.shifted += 1;
                tail.factors[(i, i)] = (1e-12 * size.max(1e-300)).copysign(pivot);
            }
        }
        true
    }

    /// Solves in place with the factors.
    pub fn solve(&self, x: &mut [Vec3]) {
        let n = self.len();
        let sparse = self.tail.as_ref().map_or(n, |t| t.first);
        for i in 0..n {
            let end = if i < sparse { self.diagonal[i] } else { self.tail.as_ref().map_or(0, |t| t.start[i - sparse]) };
            let mut s = x[i];
            for p in self.row_start[i]..end {
                mat_vec_sub(&self.values[p], &x[self.columns[p] as usize], &mut s);
            }
            x[i] = s;
        }
        if let Some(tail) = &self.tail {
            tail.solve(&mut x[sparse..]);
        }
        for i in (0..sparse).rev() {
            let mut s = x[i];
            for p in self.diagonal[i] + 1..self.row_start[i + 1] {
                mat_vec_sub(&self.values[p], &x[self.columns[p] as usize], &mut s);
            }
            x[i] = mat_vec(&self.inverse[i], &s);
        }
    }
}

impl Tail {
    fn solve(&self, x: &mut [Vec3]) {
        let n = self.row.len();
        let rows = PermRef::new_checked(&self.row, &self.row_inverse, n);
        let mut memory = MemBuffer::new(solve::solve_in_place_scratch::<usize, f64>(n, 1, Par::Seq));
        let flat = x.as_flattened_mut();
        let right = faer::MatMut::from_column_major_slice_mut(flat, n, 1);
        let (l, u) = (self.factors.as_ref(), self.factors.as_ref());
        solve::solve_in_place(l, u, rows, right, Par::Seq, MemStack::new(&mut memory));
    }
}

#[cfg(test)]
mod tests {
    use super::super::ordering::minimum_degree;
    use super::*;
    use crate::block::norm_squared;
    use crate::problem::BlockMatrix;
    use proptest::prelude::*;

    proptest! {
        /// A random diagonally heavy block-sparse system is solved to round-off, whatever its pattern.
        #[test]
        fn solves_random_patterns(n in 1usize..20, edges in proptest::collection::vec((0usize..20, 0usize..20, proptest::array::uniform9(-1.0..1.0f64)), 0..60), x in proptest::collection::vec(proptest::array::uniform3(-1.0..1.0f64), 20)) {
            let mut t: Vec<(u32, u32, Block)> = (0..n as u32).map(|i| (i, i, IDENTITY.map(|v| 30.0 * v))).collect();
            t.extend(edges.iter().filter(|e| e.0 < n && e.1 < n).map(|e| (e.0 as u32, e.1 as u32, e.2)));
            let w = BlockMatrix::from_triplets(n, &t);
            let e = minimum_degree(&w, usize::MAX).unwrap();
            let mut lu = BlockLu::new(&e);
            for (i, j, b) in w.iter() {
                let s = lu.slot(e.place[i] as usize, e.place[j] as usize).unwrap();
                lu.values_mut()[s] = *b;
            }
            prop_assert!(lu.factor());
            let zero = vec![[0.0; 3]; n];
            let mut b = vec![[0.0; 3]; n];
            w.apply(&x[..n], &zero, &mut b);
            let mut y: Vec<Vec3> = e.order.iter().map(|k| b[*k as usize]).collect();
            lu.solve(&mut y);
            for (p, k) in e.order.iter().enumerate() {
                let d = crate::block::sub(&y[p], &x[*k as usize]);
                prop_assert!(norm_squared(&d) < 1e-24);
            }
        }
    }
}
