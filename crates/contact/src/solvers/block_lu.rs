//! Sparse LU factorisation over 3×3 blocks with a fixed elimination order; pivoting inside the blocks only.
//!
//! The pattern is symmetric, the values need not be. Every solve can be checked and refined by the caller; a block
//! whose pivot vanishes is shifted by its size times 1e-12 and counted.

use super::ordering::Elimination;
use crate::block::{Block, IDENTITY, Vec3, ZERO, invert, mat_mul, mat_mul_sub, mat_vec, mat_vec_sub, max_abs};

/// Factors and the pattern they live on.
#[derive(Clone, Debug)]
pub struct BlockLu {
    row_start: Vec<usize>,
    columns: Vec<u32>,
    diagonal: Vec<usize>,
    values: Vec<Block>,
    inverse: Vec<Block>,
    position: Vec<u32>,
    /// Diagonal blocks that had to be shifted in the last factorisation.
    pub shifted: usize,
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
        BlockLu {
            row_start,
            columns,
            diagonal,
            values: vec![ZERO; entries],
            inverse: vec![ZERO; n],
            position: vec![u32::MAX; n],
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
            for p in start..end {
                self.position[self.columns[p] as usize] = p as u32;
            }
            for p in start..diag {
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
        true
    }

    /// Solves in place with the factors.
    pub fn solve(&self, x: &mut [Vec3]) {
        let n = self.len();
        for i in 0..n {
            let mut s = x[i];
            for p in self.row_start[i]..self.diagonal[i] {
                mat_vec_sub(&self.values[p], &x[self.columns[p] as usize], &mut s);
            }
            x[i] = s;
        }
        for i in (0..n).rev() {
            let mut s = x[i];
            for p in self.diagonal[i] + 1..self.row_start[i + 1] {
                mat_vec_sub(&self.values[p], &x[self.columns[p] as usize], &mut s);
            }
            x[i] = mat_vec(&self.inverse[i], &s);
        }
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
