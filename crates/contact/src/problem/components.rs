//! Groups of contacts that do not feel each other: connected components of the block pattern, solved separately.

use super::BlockMatrix;
use super::block_matrix::{RowTask, row_tasks};
use crate::block::{Block, ZERO, max_abs};
use rayon::prelude::*;

/// Rows that one task copies.
const ROWS: usize = 128;

/// Contacts of one group, ascending.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Component {
    /// Indices of the contacts in the whole problem.
    pub contacts: Vec<u32>,
}

/// Splits the contacts into groups; blocks of zeros do not connect. Groups are ordered by their first contact.
#[must_use]
pub fn components(w: &BlockMatrix) -> Vec<Component> {
    let n = w.len();
    let mut parent: Vec<u32> = (0..n as u32).collect();
    fn find(parent: &mut [u32], mut i: u32) -> u32 {
        while parent[i as usize] != i {
            parent[i as usize] = parent[parent[i as usize] as usize];
            i = parent[i as usize];
        }
        i
    }
    let mut groups = n;
    for i in 0..n {
        let (columns, blocks) = w.row(i);
        for (j, b) in columns.iter().zip(blocks) {
            if *j as usize == i {
                continue;
            }
            let (a, c) = (find(&mut parent, i as u32), find(&mut parent, *j));
            // blocks within a group are not even read
            if a != c && max_abs(b) > 0.0 {
                // the smaller index leads, so that the order of groups is that of their first contacts
                parent[a.max(c) as usize] = a.min(c);
                groups -= 1;
            }
        }
        if groups == 1 && i + 1 < n {
            break;
        }
    }
    let mut index = vec![u32::MAX; n];
    let mut out: Vec<Component> = Vec::with_capacity(groups);
    for i in 0..n {
        let root = find(&mut parent, i as u32) as usize;
        if index[root] == u32::MAX {
            index[root] = out.len() as u32;
            out.push(Component { contacts: Vec::new() });
        }
        out[index[root] as usize].contacts.push(i as u32);
    }
    out
}

impl Component {
    /// The rows and columns of `w` that belong to this group; `position` maps a contact to its place in its group, or to
    /// `u32::MAX` where it is to be left out.
    #[must_use]
    pub fn extract(&self, w: &BlockMatrix, position: &[u32]) -> BlockMatrix {
        let place = |j: u32| position[j as usize];
        // room for blocks of zeros too: they are rare, and to see them is to read the matrix twice
        let most = |k: &u32| w.row(*k as usize).0.iter().filter(|j| *j == k || place(**j) != u32::MAX).count();
        let rows: Vec<usize> = self.contacts.par_iter().with_min_len(ROWS).map(most).collect();
        let stored = rows.iter().sum();
        let mut columns = vec![0u32; stored];
        let mut blocks: Vec<Block> = vec![ZERO; stored];
        let lengths: Vec<(usize, Vec<usize>)> = row_tasks(&rows, ROWS, &mut columns, &mut blocks)
            .into_par_iter()
            .map(|RowTask { first, rows, columns, blocks }| {
                let members = &self.contacts[first..first + rows];
                let mut at = 0;
                let row = |(local, k): (usize, &u32)| {
                    let begin = at;
                    let (c, b) = w.row(*k as usize);
                    for (j, b) in c.iter().zip(b) {
                        let place = if j == k { local as u32 } else { place(*j) };
                        if place != u32::MAX && (j == k || max_abs(b) > 0.0) {
                            (columns[at], blocks[at]) = (place, *b);
                            at += 1;
                        }
                    }
                    at - begin
                };
                let lengths = (first..).zip(members).map(row).collect();
                (columns.len(), lengths)
            })
            .collect();
        let (mut row_start, mut read, mut write) = (vec![0], 0, 0);
        for (room, lengths) in &lengths {
            let begin = write;
            for length in lengths {
                write += length;
                row_start.push(write);
            }
            if read != begin {
                columns.copy_within(read..read + (write - begin), begin);
                blocks.copy_within(read..read + (write - begin), begin);
            }
            read += room;
        }
        columns.truncate(write);
        blocks.truncate(write);
        BlockMatrix::from_rows(row_start, columns, blocks)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::IDENTITY;

    #[test]
    fn zero_blocks_do_not_connect() {
        let w = BlockMatrix::from_triplets(
            5,
            &[(0, 3, IDENTITY), (3, 0, IDENTITY), (1, 2, ZERO), (2, 4, IDENTITY), (4, 4, IDENTITY)],
        );
        let c = components(&w);
        let contacts: Vec<Vec<u32>> = c.iter().map(|g| g.contacts.clone()).collect();
        assert_eq!(contacts, vec![vec![0, 3], vec![1], vec![2, 4]]);
        let sub = c[2].extract(&w, &[0, 0, 0, 1, 1]);
        assert_eq!(sub.len(), 2);
        assert_eq!(sub.row(0).0, &[0, 1]);
        assert_eq!(sub.diagonal(1), &IDENTITY);
    }

    /// What is taken out in parallel is what the definition says, also where blocks of zeros leave holes in the room made for them.
    #[test]
    fn a_part_has_the_blocks_of_its_members() {
        let n = 5 * ROWS as u32 + 17;
        let mut triplets = Vec::new();
        for i in 0..n {
            for j in [i, (7 * i + 3) % n, (i + 1) % n, (i * i) % n] {
                let size = if (i + j) % 5 == 0 { 0.0 } else { f64::from(i) + 0.01 * f64::from(j) };
                triplets.push((i, j, IDENTITY.map(|x| size * x)));
            }
        }
        let w = BlockMatrix::from_triplets(n as usize, &triplets);
        let part = Component { contacts: (0..n).filter(|i| i % 3 != 1).collect() };
        let mut position = vec![u32::MAX; n as usize];
        part.contacts.iter().zip(0u32..).for_each(|(k, place)| position[*k as usize] = place);
        let small = part.extract(&w, &position);
        assert_eq!(small.len(), part.contacts.len());
        for (place, k) in part.contacts.iter().enumerate() {
            let (columns, blocks) = w.row(*k as usize);
            let kept = columns
                .iter()
                .zip(blocks)
                .filter(|(j, b)| position[**j as usize] != u32::MAX && (*j == k || max_abs(b) > 0.0));
            let expected: (Vec<u32>, Vec<Block>) = kept.map(|(j, b)| (position[*j as usize], *b)).unzip();
            assert_eq!(small.row(place), (&expected.0[..], &expected.1[..]));
        }
    }
}
