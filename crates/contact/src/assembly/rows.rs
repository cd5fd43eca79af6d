//! The rows of the Delassus matrix from the shares of the strands: every row is the union of the contacts on its two strands.

use super::share::Share;
use crate::block::{Block, ZERO};
use crate::problem::BlockMatrix;
use crate::problem::block_matrix::{RowTask, row_tasks};
use rayon::prelude::*;

/// A strand in contact: who touches it, in order, and the blocks between them.
pub(super) struct Busy {
    pub contacts: Vec<u32>,
    pub share: Share,
}

/// Where a contact stands: the busy strand, and the place among its contacts. The second is absent with a solid and where a
/// strand touches itself.
pub(super) type Standing = [Option<(u32, u32)>; 2];

/// Rows that one task writes.
const ROWS: usize = 64;

/// Puts the matrix together. Every row is written by one task in a fixed order, so its bits know nothing of threads.
pub(super) fn rows(standing: &[Standing], busy: &[Busy]) -> BlockMatrix {
    let contacts = |at: Option<(u32, u32)>| at.map_or(&[][..], |(strand, _)| &busy[strand as usize].contacts[..]);
    let lengths: Vec<usize> = standing
        .par_iter()
        .with_min_len(ROWS)
        .map(|[a, b]| {
            let mut length = 0;
            unite(contacts(*a), contacts(*b), |_, _, _| length += 1);
            length
        })
        .collect();
    let mut row_start = Vec::with_capacity(standing.len() + 1);
    row_start.push(0);
    for length in &lengths {
        row_start.push(row_start[row_start.len() - 1] + length);
    }
    let stored = row_start[standing.len()];
    let mut columns = vec![0u32; stored];
    let mut blocks: Vec<Block> = vec![ZERO; stored];
    row_tasks(&lengths, ROWS, &mut columns, &mut blocks).into_par_iter().for_each(|task| {
        let RowTask { first, rows, columns, blocks } = task;
        let mut at = 0;
        for [a, b] in &standing[first..first + rows] {
            let of = |side: &Option<(u32, u32)>, other: usize| {
                side.map_or(ZERO, |(strand, place)| busy[strand as usize].share.block(place as usize, other))
            };
            unite(contacts(*a), contacts(*b), |contact, in_a, in_b| {
                columns[at] = contact;
                blocks[at] = match (in_a, in_b) {
                    (Some(i), Some(j)) => sum(&of(a, i), &of(b, j)),
                    (Some(i), None) => of(a, i),
                    (None, Some(j)) => of(b, j),
                    (None, None) => ZERO,
                };
                at += 1;
            });
        }
    });
    BlockMatrix::from_rows(row_start, columns, blocks)
}

/// Goes through the contacts of two strands in ascending order, each once, with its place in either list.
#[inline(always)]
fn unite(a: &[u32], b: &[u32], mut visit: impl FnMut(u32, Option<usize>, Option<usize>)) {
    let (mut i, mut j) = (0, 0);
    while i < a.len() || j < b.len() {
        let (x, y) = (a.get(i).map_or(u32::MAX, |x| *x), b.get(j).map_or(u32::MAX, |y| *y));
        let (in_a, in_b) = (x <= y, y <= x);
        visit(x.min(y), in_a.then_some(i), in_b.then_some(j));
        i += usize::from(in_a);
        j += usize::from(in_b);
    }
}

#[inline(always)]
fn sum(a: &Block, b: &Block) -> Block {
    [0, 1, 2, 3, 4, 5, 6, 7, 8].map(|e| a[e] + b[e])
}
