//! The active blocks of a sparse grid and their neighbours.

use crate::lattice::{BLOCK, Lattice, cells_per_block, local_digits, local_index, pack, unpack};
use crate::order::ParticleOrder;
use crate::tile::Part;

/// Marks a block or node that is not active.
pub const NONE: u32 = u32::MAX;

/// Finds blocks by coordinates: a dense box where that is small, a search in the sorted list otherwise.
#[derive(Clone, Debug)]
struct Lookup<const D: usize> {
    low: Option<[i32; D]>,
    size: [usize; D],
    table: Vec<u32>,
}

/// Blocks of `4^D` cells that hold, or lie next to, something.
///
/// Nodes are numbered block by block, x fastest inside a block; a field over the grid is a slice of [`BlockGrid::node_count`]
/// entries. Blocks are sorted by coordinates, so that numbering depends on the particles only.
#[derive(Clone, Debug)]
pub struct BlockGrid<const D: usize> {
    /// Cell size, origin, periodic directions.
    pub lattice: Lattice<D>,
    keys: Vec<u64>,
    blocks: Vec<[i32; D]>,
    neighbours: Vec<[u32; 27]>,
    /// For each occupied block (in the order of the particle order) its index among the active blocks.
    occupied: Vec<u32>,
    /// For each active block its rank among the occupied ones, or [`NONE`].
    rank: Vec<u32>,
    /// For each occupied block the part of its tile that stencils of its particles reach.
    reached: Vec<Part<D>>,
    lookup: Lookup<D>,
}

impl<const D: usize> BlockGrid<D> {
    /// An empty grid.
    #[must_use]
    pub fn new(lattice: Lattice<D>) -> Self {
        Self {
            lattice,
            keys: Vec::new(),
            blocks: Vec::new(),
            neighbours: Vec::new(),
            occupied: Vec::new(),
            rank: Vec::new(),
            reached: Vec::new(),
            lookup: Lookup { low: None, size: [0; D], table: Vec::new() },
        }
    }

    /// Number of neighbour slots of a block, itself included: `3^D`.
    pub const NEIGHBOURS: usize = 3usize.pow(D as u32);

    /// Lets the grid follow the particles: the occupied blocks, every block that one of their stencils can reach, and the
    /// blocks around the `extra` positions (points that are not particles but need a grid around them).
    pub fn rebuild(&mut self, order: &ParticleOrder<D>, extra: &[numerics::tensor::Vector<D>]) {
        self.keys.clear();
        for (rank, block) in order.blocks().iter().enumerate() {
            let extent = order.extent(rank);
            for slot in 0..Self::NEIGHBOURS {
                let offset = Self::slot_offset(slot);
                // A stencil reaches one node below its cell and two above: cells 0 touch the lower, 2 and 3 the upper block.
                let reached = (0..D).all(|a| match offset[a] {
                    -1 => extent.0[a] == 0,
                    1 => extent.1[a] >= 2,
                    _ => true,
                });
                if reached {
                    let neighbour = std::array::from_fn(|a| block[a] + offset[a]);
                    self.keys.push(pack(&self.lattice.wrap_block(neighbour)));
                }
            }
        }
        for x in extra {
            if let Ok((block, _)) = self.lattice.locate(x, 0) {
                for slot in 0..Self::NEIGHBOURS {
                    let offset = Self::slot_offset(slot);
                    let neighbour = std::array::from_fn(|a| block[a] + offset[a]);
                    self.keys.push(pack(&self.lattice.wrap_block(neighbour)));
                }
            }
        }
        self.keys.sort_unstable();
        self.keys.dedup();
        self.blocks.clear();
        self.blocks.extend(self.keys.iter().map(|&k| unpack::<D>(k)));
        self.build_lookup();
        self.neighbours.clear();
        for i in 0..self.blocks.len() {
            let block = self.blocks[i];
            let mut table = [NONE; 27];
            for (slot, entry) in table.iter_mut().enumerate().take(Self::NEIGHBOURS) {
                let offset = Self::slot_offset(slot);
                *entry = self.find(std::array::from_fn(|a| block[a] + offset[a]));
            }
            self.neighbours.push(table);
        }
        self.occupied.clear();
        self.rank.clear();
        self.rank.resize(self.blocks.len(), NONE);
        self.reached.clear();
        for (rank, &block) in order.blocks().iter().enumerate() {
            let (low, high) = order.extent(rank);
            self.reached.push(Part::around(&low, &high));
            let index = self.find(block);
            self.occupied.push(index);
            self.rank[index as usize] = rank as u32;
        }
    }

    fn build_lookup(&mut self) {
        let Lookup { low, size, table } = &mut self.lookup;
        *low = None;
        table.clear();
        let Some(first) = self.blocks.first() else { return };
        let (mut lo, mut hi) = (*first, *first);
        for b in &self.blocks {
            for a in 0..D {
                lo[a] = lo[a].min(b[a]);
                hi[a] = hi[a].max(b[a]);
            }
        }
        let extent: [usize; D] = std::array::from_fn(|a| (hi[a] - lo[a]) as usize + 1);
        let volume = extent.iter().try_fold(1usize, |v, &e| v.checked_mul(e));
        if let Some(volume) = volume
            && volume <= 65_536 + 16 * self.blocks.len()
        {
            *low = Some(lo);
            *size = extent;
            table.resize(volume, NONE);
            for (i, b) in self.blocks.iter().enumerate() {
                let mut index = 0;
                for a in (0..D).rev() {
                    index = index * extent[a] + (b[a] - lo[a]) as usize;
                }
                table[index] = i as u32;
            }
        }
    }

    /// Index of the active block at the given coordinates, or [`NONE`]. Periodic directions are wrapped.
    #[inline]
    #[must_use]
    pub fn find(&self, block: [i32; D]) -> u32 {
        let block = self.lattice.wrap_block(block);
        match self.lookup.low {
            Some(low) => {
                let mut index = 0;
                for a in (0..D).rev() {
                    let t = block[a] - low[a];
                    if t < 0 || t as usize >= self.lookup.size[a] {
                        return NONE;
                    }
                    index = index * self.lookup.size[a] + t as usize;
                }
                self.lookup.table[index]
            }
            None => self.keys.binary_search(&pack(&block)).map_or(NONE, |i| i as u32),
        }
    }

    /// Offset in blocks of neighbour slot `slot`, x fastest; the middle slot is the block itself.
    #[inline(always)]
    #[must_use]
    pub fn slot_offset(slot: usize) -> [i32; D] {
        let mut rest = slot;
        std::array::from_fn(|_| {
            let digit = (rest % 3) as i32 - 1;
            rest /= 3;
            digit
        })
    }

    /// Neighbour slot of a block offset, each entry in `−1..=1`.
    #[inline(always)]
    #[must_use]
    pub fn slot(offset: &[i32; D]) -> usize {
        let mut slot = 0;
        for a in (0..D).rev() {
            slot = slot * 3 + (offset[a] + 1) as usize;
        }
        slot
    }

    /// Number of active blocks.
    #[must_use]
    pub fn block_count(&self) -> usize {
        self.blocks.len()
    }

    /// Number of nodes of each field, `4^D` per active block.
    #[must_use]
    pub fn node_count(&self) -> usize {
        self.blocks.len() * cells_per_block::<D>()
    }

    /// Coordinates of the active blocks, sorted with x fastest.
    #[must_use]
    pub fn blocks(&self) -> &[[i32; D]] {
        &self.blocks
    }

    /// Active blocks that hold particles, in the order of the sorted particles.
    #[must_use]
    pub fn occupied(&self) -> &[u32] {
        &self.occupied
    }

    /// Rank of an active block among the occupied ones, or [`NONE`].
    #[inline(always)]
    #[must_use]
    pub fn rank(&self, block: usize) -> u32 {
        self.rank[block]
    }

    /// The part of the tile of an occupied block (by rank) that stencils of its particles reach.
    #[inline(always)]
    #[must_use]
    pub fn reached(&self, rank: usize) -> &Part<D> {
        &self.reached[rank]
    }

    /// The `3^D` neighbours of an active block by slot ([`NONE`] where inactive); the middle one is the block itself.
    #[inline(always)]
    #[must_use]
    pub fn neighbours(&self, block: usize) -> &[u32; 27] {
        &self.neighbours[block]
    }

    /// Global cell index of a node.
    #[inline(always)]
    #[must_use]
    pub fn cell(&self, node: usize) -> [i32; D] {
        let block = self.blocks[node / cells_per_block::<D>()];
        let local = local_digits::<D>(node % cells_per_block::<D>());
        std::array::from_fn(|a| block[a] * BLOCK as i32 + local[a] as i32)
    }

    /// Node `steps` cells away from `node` along `axis` (at most four), or [`NONE`] where its block is inactive.
    #[inline(always)]
    #[must_use]
    pub fn along(&self, node: usize, axis: usize, steps: i32) -> u32 {
        let per = cells_per_block::<D>();
        let (block, index) = (node / per, node % per);
        let stride = BLOCK.pow(axis as u32);
        let digit = ((index / stride) % BLOCK) as i32 + steps;
        if (0..BLOCK as i32).contains(&digit) {
            return (node as i64 + i64::from(steps) * stride as i64) as u32;
        }
        let side = if digit < 0 { -1 } else { 1 };
        let middle = (Self::NEIGHBOURS - 1) / 2;
        let slot = (middle as i32 + side * 3i32.pow(axis as u32)) as usize;
        let neighbour = self.neighbours[block][slot];
        if neighbour == NONE {
            return NONE;
        }
        let wrapped = digit - side * BLOCK as i32;
        let local = index as i64 + (i64::from(wrapped) - ((index / stride) % BLOCK) as i64) * stride as i64;
        (neighbour as usize * per) as u32 + local as u32
    }

    /// Node of a global cell index, or [`NONE`].
    #[inline]
    #[must_use]
    pub fn node(&self, cell: &[i32; D]) -> u32 {
        let block = self.find(std::array::from_fn(|a| cell[a].div_euclid(BLOCK as i32)));
        if block == NONE {
            return NONE;
        }
        let local: [usize; D] = std::array::from_fn(|a| cell[a].rem_euclid(BLOCK as i32) as usize);
        (block as usize * cells_per_block::<D>() + local_index(&local)) as u32
    }
}
