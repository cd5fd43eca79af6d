//! A hash table of grid cells in which cells that follow each other along the first axis sit in buckets that follow each other.
//!
//! A cell's bucket is the hash of its row (second and third index) plus its first index, so three neighbouring cells of a row are read in
//! one run of memory. Members are placed by a counting sort, stable in their index.

use std::ops::Range;

/// Cell indices are kept within this, so that a neighbour's index never overflows; cells beyond share the last one.
const FAR: f64 = (1u32 << 30) as f64;

/// Index of the cell that holds a coordinate.
#[inline]
pub(super) fn cell_index(coordinate: f64, inverse_cell: f64) -> i32 {
    (coordinate * inverse_cell).floor().clamp(-FAR, FAR) as i32
}

/// Second and third cell index as one number.
#[inline]
pub(super) fn row_key(y: i32, z: i32) -> u64 {
    (u64::from(y as u32) << 32) | u64::from(z as u32)
}

/// Members sorted by bucket.
#[derive(Clone, Debug, Default)]
pub(super) struct RowTable {
    /// First place of every bucket in `order`; one more entry than buckets.
    start: Vec<u32>,
    /// Members, bucket after bucket.
    pub order: Vec<u32>,
    /// Row of every member, in the same order.
    pub row: Vec<u64>,
    mask: u32,
    bucket: Vec<u32>,
}

impl RowTable {
    /// Sorts members given by their cells.
    pub fn build(&mut self, cells: &[[i32; 3]]) {
        let buckets = (2 * cells.len()).next_power_of_two().max(8);
        self.mask = (buckets - 1) as u32;
        self.start.clear();
        self.start.resize(buckets + 1, 0);
        self.bucket.clear();
        self.bucket.extend(cells.iter().map(|c| bucket_of(c[0], row_key(c[1], c[2]), self.mask)));
        for &b in &self.bucket {
            self.start[b as usize + 1] += 1;
        }
        for b in 0..buckets {
            self.start[b + 1] += self.start[b];
        }
        self.order.clear();
        self.order.resize(cells.len(), 0);
        self.row.clear();
        self.row.resize(cells.len(), 0);
        // Backwards with falling ends keeps equal buckets in ascending order of member, and leaves the starts in place.
        let mut end: Vec<u32> = self.start[1..].to_vec();
        for i in (0..cells.len()).rev() {
            let place = &mut end[self.bucket[i] as usize];
            *place -= 1;
            self.order[*place as usize] = i as u32;
            self.row[*place as usize] = row_key(cells[i][1], cells[i][2]);
        }
    }

    /// Places that may hold members of row `row` with first index from `first` to `last`; other rows share them, so compare `row`.
    /// Every member of those cells is in exactly one of the two ranges, once.
    #[inline]
    pub fn places(&self, row: u64, first: i32, last: i32) -> [Range<usize>; 2] {
        let buckets = self.mask + 1;
        let count = (i64::from(last) - i64::from(first) + 1).clamp(0, i64::from(buckets)) as u32;
        let from = bucket_of(first, row, self.mask);
        let place = |b: u32| self.start[b as usize] as usize;
        if from + count <= buckets {
            [place(from)..place(from + count), 0..0]
        } else {
            [place(from)..place(buckets), 0..place(from + count - buckets)]
        }
    }
}

#[inline]
fn bucket_of(x: i32, row: u64, mask: u32) -> u32 {
    let mut h = row.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    h ^= h >> 29;
    h = h.wrapping_mul(0xBF58_476D_1CE4_E5B9);
    ((h >> 32) as u32).wrapping_add(x as u32) & mask
}
