//! The Delassus matrix as block-sparse rows of 3×3 blocks.

use crate::block::{Block, Vec3, ZERO, add, mat_vec_add, max_abs, trace, transpose};
use rayon::prelude::*;

/// Rows that one task multiplies.
const ROWS: usize = 256;

/// A square block-sparse matrix, rows of 3×3 blocks with ascending columns; every diagonal block is stored.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BlockMatrix {
    row_start: Vec<usize>,
    columns: Vec<u32>,
    blocks: Vec<Block>,
    diagonal: Vec<usize>,
}

impl BlockMatrix {
    /// Builds the matrix of `n` block rows from `(row, column, block)` in any order; repeated entries are added.
    ///
    /// # Panics
    /// If an index is not below `n` (the file readers check before calling).
    #[must_use]
    pub fn from_triplets(n: usize, triplets: &[(u32, u32, Block)]) -> Self {
        let mut count = vec![1usize; n];
        for (i, _, _) in triplets {
            count[*i as usize] += 1;
        }
        let mut start = vec![0usize; n + 1];
        for i in 0..n {
            start[i + 1] = start[i] + count[i];
        }
        let mut slots: Vec<(u32, u32)> = vec![(0, 0); start[n]];
        let mut next = start.clone();
        for i in 0..n {
            slots[next[i]] = (i as u32, u32::MAX);
            next[i] += 1;
        }
        for (t, (i, j, _)) in triplets.iter().enumerate() {
            assert!((*j as usize) < n, "column {j} of {n}");
            slots[next[*i as usize]] = (*j, t as u32);
            next[*i as usize] += 1;
        }
        let mut m = BlockMatrix {
            row_start: Vec::with_capacity(n + 1),
            columns: Vec::with_capacity(start[n]),
            blocks: Vec::with_capacity(start[n]),
            diagonal: Vec::with_capacity(n),
        };
        m.row_start.push(0);
        for i in 0..n {
            let row = &mut slots[start[i]..start[i + 1]];
            row.sort_unstable();
            let mut last = u32::MAX;
            for (j, t) in row.iter() {
                if *j != last {
                    if *j as usize == i {
                        m.diagonal.push(m.columns.len());
                    }
                    m.columns.push(*j);
                    m.blocks.push(ZERO);
                    last = *j;
                }
                if *t != u32::MAX
                    && let Some(b) = m.blocks.last_mut()
                {
                    for (x, y) in b.iter_mut().zip(&triplets[*t as usize].2) {
                        *x += y;
                    }
                }
            }
            m.row_start.push(m.columns.len());
        }
        m
    }

    /// Builds the matrix from ready rows: ascending columns with the diagonal present.
    pub(crate) fn from_rows(row_start: Vec<usize>, columns: Vec<u32>, blocks: Vec<Block>) -> Self {
        let n = row_start.len() - 1;
        let diagonal = (0..n)
            .map(|i| {
                let row = &columns[row_start[i]..row_start[i + 1]];
                row_start[i] + row.binary_search(&(i as u32)).expect("diagonal block present")
            })
            .collect();
        BlockMatrix { row_start, columns, blocks, diagonal }
    }

    /// Number of block rows, which is the number of contacts.
    #[must_use]
    pub fn len(&self) -> usize {
        self.diagonal.len()
    }

    /// Whether there are no rows.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.diagonal.is_empty()
    }

    /// Number of stored blocks.
    #[must_use]
    pub fn block_count(&self) -> usize {
        self.blocks.len()
    }

    /// Columns and blocks of row `i`.
    #[inline]
    #[must_use]
    pub fn row(&self, i: usize) -> (&[u32], &[Block]) {
        let r = self.row_start[i]..self.row_start[i + 1];
        (&self.columns[r.clone()], &self.blocks[r])
    }

    /// The diagonal block of row `i`.
    #[inline]
    #[must_use]
    pub fn diagonal(&self, i: usize) -> &Block {
        &self.blocks[self.diagonal[i]]
    }

    /// Adds `share` of its mean to the diagonal of block `i`: the contact gives way by so much of what it moves.
    pub fn soften(&mut self, i: usize, share: f64) {
        let block = &mut self.blocks[self.diagonal[i]];
        let more = share * trace(block) / 3.0;
        for c in 0..3 {
            block[4 * c] += more;
        }
    }

    /// `y = W x + q`.
    pub fn apply(&self, x: &[Vec3], q: &[Vec3], y: &mut [Vec3]) {
        y.par_iter_mut().zip(q).enumerate().with_min_len(ROWS).for_each(|(i, (y, q))| {
            *y = add(q, &self.row_product(i, x));
        });
    }

    /// `W x` where most of `x` is zero: blocks that meet zeros are not read.
    #[must_use]
    pub fn product_sparse(&self, x: &[Vec3]) -> Vec<Vec3> {
        (0..self.len()).into_par_iter().with_min_len(ROWS).map(|i| self.row_product_sparse(i, x)).collect()
    }

    /// `Σ_j W_ij x_j`.
    #[inline]
    #[must_use]
    pub fn row_product(&self, i: usize, x: &[Vec3]) -> Vec3 {
        let (columns, blocks) = self.row(i);
        let mut s = [0.0; 3];
        for (j, b) in columns.iter().zip(blocks) {
            mat_vec_add(b, &x[*j as usize], &mut s);
        }
        s
    }

    /// The same where most of `x` is zero, as the impulses of open contacts are: their blocks are not read.
    #[inline]
    #[must_use]
    pub fn row_product_sparse(&self, i: usize, x: &[Vec3]) -> Vec3 {
        let (columns, blocks) = self.row(i);
        product_sparse(columns, blocks, x)
    }

    /// All blocks as `(row, column, block)`.
    pub fn iter(&self) -> impl Iterator<Item = (usize, usize, &Block)> + '_ {
        (0..self.len()).flat_map(move |i| {
            let (c, b) = self.row(i);
            c.iter().zip(b).map(move |(j, b)| (i, *j as usize, b))
        })
    }

    /// Largest difference `|W − Wᵀ|` relative to the largest entry: 0 for a symmetric matrix.
    #[must_use]
    pub fn asymmetry(&self) -> f64 {
        let mut difference = 0.0_f64;
        let mut size = 0.0_f64;
        for (i, j, b) in self.iter() {
            size = size.max(max_abs(b));
            let (columns, blocks) = self.row(j);
            let mirrored = columns.binary_search(&(i as u32)).map_or(ZERO, |p| blocks[p]);
            let t = transpose(&mirrored);
            for k in 0..9 {
                difference = difference.max((b[k] - t[k]).abs());
            }
        }
        if size > 0.0 { difference / size } else { 0.0 }
    }

    /// Mean of the diagonal over all contacts, `tr W / 3n` [1/kg].
    #[must_use]
    pub fn mean_diagonal(&self) -> f64 {
        let sum: f64 = (0..self.len()).map(|i| trace(self.diagonal(i))).sum();
        sum / (3 * self.len().max(1)) as f64
    }

    /// Whether every entry is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.blocks.iter().all(|b| b.iter().all(|v| v.is_finite()))
    }
}

/// Rows that one task writes.
pub(crate) struct RowTask<'a> {
    /// Number of the first.
    pub first: usize,
    /// How many there are.
    pub rows: usize,
    /// Room for their columns and blocks.
    pub columns: &'a mut [u32],
    pub blocks: &'a mut [Block],
}

/// Shares out columns and blocks of rows with these lengths among tasks of `rows` rows.
pub(crate) fn row_tasks<'a>(
    lengths: &[usize],
    rows: usize,
    mut columns: &'a mut [u32],
    mut blocks: &'a mut [Block],
) -> Vec<RowTask<'a>> {
    let share = |(task, lengths): (usize, &[usize])| {
        let room = lengths.iter().sum();
        let (own_columns, rest) = std::mem::take(&mut columns).split_at_mut(room);
        columns = rest;
        let (own_blocks, rest) = std::mem::take(&mut blocks).split_at_mut(room);
        blocks = rest;
        RowTask { first: task * rows, rows: lengths.len(), columns: own_columns, blocks: own_blocks }
    };
    lengths.chunks(rows).enumerate().map(share).collect()
}

/// `Σ_j B_j x_j` over the columns of a row, without those where `x` is zero.
#[inline]
pub(crate) fn product_sparse(columns: &[u32], blocks: &[Block], x: &[Vec3]) -> Vec3 {
    let mut s = [0.0; 3];
    for (j, b) in columns.iter().zip(blocks) {
        let x = &x[*j as usize];
        if *x != [0.0; 3] {
            mat_vec_add(b, x, &mut s);
        }
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::IDENTITY;

    #[test]
    fn triplets_are_sorted_summed_and_the_diagonal_completed() {
        let two = IDENTITY.map(|v| 2.0 * v);
        let m = BlockMatrix::from_triplets(3, &[(2, 0, two), (0, 0, IDENTITY), (0, 0, two), (2, 2, IDENTITY)]);
        assert_eq!(m.len(), 3);
        assert_eq!(m.diagonal(0)[0], 3.0);
        assert_eq!(m.diagonal(1), &ZERO);
        assert_eq!(m.row(2).0, &[0, 2]);
        let mut y = vec![[0.0; 3]; 3];
        m.apply(&[[1.0; 3]; 3], &[[0.5; 3]; 3], &mut y);
        assert_eq!(y, vec![[3.5; 3], [0.5; 3], [3.5; 3]]);
        assert!(m.asymmetry() > 0.5);
    }
}
