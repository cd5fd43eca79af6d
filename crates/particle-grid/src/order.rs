//! Sorting particles by block and cell.
//!
//! The order is stable: particles of one cell keep their relative order, so it depends on nothing but positions and the order
//! they came in. Kernels need particles to be stored block by block; [`permute`] moves one array at a time.

use crate::GridError;
use crate::lattice::{Lattice, cells_per_block, local_index, pack, unpack};
use numerics::tensor::Vector;
use rayon::prelude::*;
use std::ops::Range;

/// Particles per parallel task; the result does not depend on it.
const CHUNK: usize = 16_384;

/// The occupied blocks and the order of the particles in them.
#[derive(Clone, Debug, Default)]
pub struct ParticleOrder<const D: usize> {
    keys: Vec<u64>,
    blocks: Vec<[i32; D]>,
    unique: Vec<u64>,
    bins: Vec<u32>,
    index: Vec<u32>,
    /// Start of each cell of each occupied block in the sorted order, and the total at the end.
    cell_start: Vec<u32>,
    extent: Vec<([u8; D], [u8; D])>,
    sorted: bool,
}

impl<const D: usize> ParticleOrder<D> {
    /// An order of no particles.
    #[must_use]
    pub fn new() -> Self {
        Self {
            keys: Vec::new(),
            blocks: Vec::new(),
            unique: Vec::new(),
            bins: Vec::new(),
            index: Vec::new(),
            cell_start: vec![0],
            extent: Vec::new(),
            sorted: true,
        }
    }

    /// Finds the occupied blocks and the order of the particles; moves nothing.
    ///
    /// # Errors
    /// Where a position is not finite, outside a period, or too far away. The order is then empty.
    pub fn build(&mut self, lattice: &Lattice<D>, positions: &[Vector<D>]) -> Result<(), GridError> {
        let n = positions.len();
        if n >= u32::MAX as usize {
            return Err(GridError::TooMany);
        }
        let per = cells_per_block::<D>();
        self.clear();
        // Key of the block and cell inside the block, in one word: 63 bits of block would leave no room, so the cell goes to `bins`.
        self.keys.resize(n, 0);
        self.bins.resize(n, 0);
        let located: Result<(), GridError> = self
            .keys
            .par_chunks_mut(CHUNK)
            .zip(self.bins.par_chunks_mut(CHUNK))
            .zip(positions.par_chunks(CHUNK))
            .enumerate()
            .map(|(chunk, ((keys, bins), positions))| {
                for (i, x) in positions.iter().enumerate() {
                    let (block, local) = lattice.locate(x, chunk * CHUNK + i)?;
                    keys[i] = pack(&block);
                    bins[i] = local_index(&local) as u32;
                }
                Ok(())
            })
            // The first failing particle is reported whatever the threads did.
            .reduce(|| Ok(()), Result::and);
        if let Err(error) = located {
            self.clear();
            return Err(error);
        }
        let mut last = None;
        for &key in &self.keys {
            if last != Some(key) {
                self.unique.push(key);
                last = Some(key);
            }
        }
        self.unique.sort_unstable();
        self.unique.dedup();
        if self.unique.len() * per >= u32::MAX as usize {
            self.clear();
            return Err(GridError::TooMany);
        }
        self.blocks.extend(self.unique.iter().map(|&k| unpack::<D>(k)));
        let unique = &self.unique;
        self.bins.par_chunks_mut(CHUNK).zip(self.keys.par_chunks(CHUNK)).for_each(|(bins, keys)| {
            let (mut last, mut rank) = (u64::MAX, 0usize);
            for (bin, &key) in bins.iter_mut().zip(keys) {
                if key != last {
                    last = key;
                    // Sorted particles come in runs, so the search is rare.
                    rank = unique.partition_point(|&u| u < key);
                }
                *bin += (rank * per) as u32;
            }
        });
        self.cell_start.clear();
        self.cell_start.resize(self.blocks.len() * per + 1, 0);
        self.sorted = true;
        let mut previous = 0;
        for &bin in &self.bins {
            self.sorted &= bin >= previous;
            previous = bin;
            self.cell_start[bin as usize + 1] += 1;
        }
        for i in 1..self.cell_start.len() {
            self.cell_start[i] += self.cell_start[i - 1];
        }
        self.index.resize(n, 0);
        if self.sorted {
            for (i, index) in self.index.iter_mut().enumerate() {
                *index = i as u32;
            }
        } else {
            let mut next = self.cell_start.clone();
            for (particle, &bin) in self.bins.iter().enumerate() {
                let slot = &mut next[bin as usize];
                self.index[*slot as usize] = particle as u32;
                *slot += 1;
            }
        }
        for rank in 0..self.blocks.len() {
            let (mut low, mut high) = ([u8::MAX; D], [0u8; D]);
            for cell in 0..per {
                if self.cell_range(rank, cell).is_empty() {
                    continue;
                }
                let digits = crate::lattice::local_digits::<D>(cell);
                for a in 0..D {
                    low[a] = low[a].min(digits[a] as u8);
                    high[a] = high[a].max(digits[a] as u8);
                }
            }
            self.extent.push((low, high));
        }
        Ok(())
    }

    fn clear(&mut self) {
        self.keys.clear();
        self.blocks.clear();
        self.unique.clear();
        self.bins.clear();
        self.index.clear();
        self.cell_start.clear();
        self.cell_start.push(0);
        self.extent.clear();
        self.sorted = true;
    }

    /// Coordinates of the occupied blocks, sorted.
    #[must_use]
    pub fn blocks(&self) -> &[[i32; D]] {
        &self.blocks
    }

    /// For each place in the sorted order the particle that belongs there.
    #[must_use]
    pub fn index(&self) -> &[u32] {
        &self.index
    }

    /// Whether the particles were in order already.
    #[must_use]
    pub fn is_sorted(&self) -> bool {
        self.sorted
    }

    /// Places of the particles of an occupied block in the sorted order.
    #[must_use]
    pub fn block_range(&self, rank: usize) -> Range<usize> {
        let per = cells_per_block::<D>();
        self.cell_start[rank * per] as usize..self.cell_start[(rank + 1) * per] as usize
    }

    /// Places of the particles of one cell of an occupied block in the sorted order.
    #[inline(always)]
    #[must_use]
    pub fn cell_range(&self, rank: usize, cell: usize) -> Range<usize> {
        let i = rank * cells_per_block::<D>() + cell;
        self.cell_start[i] as usize..self.cell_start[i + 1] as usize
    }

    /// Smallest and largest local cell index in use, per direction.
    #[must_use]
    pub(crate) fn extent(&self, rank: usize) -> ([u8; D], [u8; D]) {
        self.extent[rank]
    }

    /// Splits an array of sorted particles into one slice per occupied block.
    #[must_use]
    pub fn split<'a, T>(&self, mut array: &'a mut [T]) -> Vec<&'a mut [T]> {
        let mut parts = Vec::with_capacity(self.blocks.len());
        for rank in 0..self.blocks.len() {
            let (head, tail) = array.split_at_mut(self.block_range(rank).len());
            parts.push(head);
            array = tail;
        }
        parts
    }
}

/// Brings one particle array into the given order; `scratch` is swapped with it.
pub fn permute<T: Copy + Send + Sync>(array: &mut Vec<T>, index: &[u32], scratch: &mut Vec<T>) {
    debug_assert_eq!(array.len(), index.len());
    scratch.clear();
    // The array that comes back is this one: it may not be twice as large as it has to be.
    if scratch.capacity() < index.len() {
        scratch.reserve_exact(index.len() + index.len() / 8);
    }
    if index.len() <= CHUNK {
        scratch.extend(index.iter().map(|&i| array[i as usize]));
    } else {
        let source = &*array;
        scratch.par_extend(index.par_iter().with_min_len(CHUNK).map(|&i| source[i as usize]));
    }
    std::mem::swap(array, scratch);
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector2;

    #[test]
    fn the_order_is_stable_and_complete() {
        let lattice = Lattice::<2>::new(0.5);
        let mut positions: Vec<Vector2<f64>> = (0..3000)
            .map(|i| {
                let t = f64::from(i);
                Vector2::new((t * 0.7).sin() * 9.0, (t * 0.37).cos() * 7.0)
            })
            .collect();
        let mut order = ParticleOrder::new();
        order.build(&lattice, &positions).unwrap();
        assert!(!order.is_sorted());
        let mut seen = vec![false; positions.len()];
        for rank in 0..order.blocks().len() {
            for cell in 0..16 {
                let range = order.cell_range(rank, cell);
                assert!(order.index()[range.clone()].is_sorted(), "stable inside a cell");
                for &p in &order.index()[range] {
                    let (block, local) = lattice.locate(&positions[p as usize], 0).unwrap();
                    assert_eq!((block, local_index(&local)), (order.blocks()[rank], cell));
                    assert!(!std::mem::replace(&mut seen[p as usize], true));
                }
            }
        }
        assert!(seen.iter().all(|&s| s));
        let index = order.index().to_vec();
        permute(&mut positions, &index, &mut Vec::new());
        order.build(&lattice, &positions).unwrap();
        assert!(order.is_sorted());
        positions[17].x = f64::NAN;
        assert_eq!(order.build(&lattice, &positions), Err(GridError::NonFinite { particle: 17 }));
        assert!(order.blocks().is_empty());
    }
}
