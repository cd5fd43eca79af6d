//! Groups of contacts that do not feel each other: connected components of the block pattern, solved separately.

use super::BlockMatrix;
use crate::block::{Block, max_abs};

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
        let mut row_start = Vec::with_capacity(self.contacts.len() + 1);
        let mut columns: Vec<u32> = Vec::new();
        let mut blocks: Vec<Block> = Vec::new();
        row_start.push(0);
        for (local, k) in self.contacts.iter().enumerate() {
            let (c, b) = w.row(*k as usize);
            for (j, b) in c.iter().zip(b) {
                if j == k {
                    columns.push(local as u32);
                    blocks.push(*b);
                } else if position[*j as usize] != u32::MAX && max_abs(b) > 0.0 {
                    columns.push(position[*j as usize]);
                    blocks.push(*b);
                }
            }
            row_start.push(columns.len());
        }
        BlockMatrix::from_rows(row_start, columns, blocks)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::{IDENTITY, ZERO};

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
}
