//! Contacts that feel each other most, taken together: a sweep goes over them several times before it goes on.
//!
//! Neighbouring contacts of a strand are nearly redundant, and one after the other they find their shares slowly. Their own
//! blocks are few and stay in the cache, where the rows of the whole matrix do not.

use crate::block::{Block, Vec3, ZERO, mat_vec_add, trace};
use crate::problem::BlockMatrix;

/// A partition of the contacts of a group.
#[derive(Clone, Debug)]
pub struct Clusters {
    /// Contacts, cluster after cluster.
    members: Vec<u32>,
    /// First member of each cluster, and the end.
    start: Vec<usize>,
    /// Blocks of each cluster among its members, row by row, and where they begin.
    blocks: Vec<Block>,
    first_block: Vec<usize>,
}

impl Clusters {
    /// Groups each contact with those that feel it by more than `share` of what both feel of themselves, at most `most` together,
    /// and none with one of another `slab`.
    #[must_use]
    pub fn new(w: &BlockMatrix, share: f64, most: usize, slab: Option<&[u32]>) -> Clusters {
        let n = w.len();
        let mut taken = vec![false; n];
        let mut c =
            Clusters { members: Vec::with_capacity(n), start: vec![0], blocks: Vec::new(), first_block: vec![0] };
        let size: Vec<f64> = (0..n).map(|k| trace(w.diagonal(k))).collect();
        let mut near: Vec<(f64, u32)> = Vec::new();
        for k in 0..n {
            if taken[k] {
                continue;
            }
            near.clear();
            let (columns, blocks) = w.row(k);
            for (j, b) in columns.iter().zip(blocks) {
                let ju = *j as usize;
                let coupling = b.iter().map(|x| x * x).sum::<f64>();
                if ju != k
                    && !taken[ju]
                    && slab.is_none_or(|slab| slab[ju] == slab[k])
                    && coupling > share * share * size[k] * size[ju] / 3.0
                {
                    near.push((coupling / (size[k] * size[ju]), *j));
                }
            }
            near.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
            near.truncate(most - 1);
            let begin = c.members.len();
            c.members.push(k as u32);
            c.members.extend(near.iter().map(|x| x.1));
            c.members[begin..].sort_unstable();
            let own = &c.members[begin..];
            for i in own {
                taken[*i as usize] = true;
                let (columns, blocks) = w.row(*i as usize);
                c.blocks.extend(own.iter().map(|j| columns.binary_search(j).map_or(ZERO, |at| blocks[at])));
            }
            c.start.push(c.members.len());
            c.first_block.push(c.blocks.len());
        }
        c
    }

    /// Number of clusters.
    #[must_use]
    pub fn count(&self) -> usize {
        self.start.len() - 1
    }

    /// Members of a cluster, ascending.
    #[must_use]
    pub fn members(&self, cluster: usize) -> &[u32] {
        &self.members[self.start[cluster]..self.start[cluster + 1]]
    }

    /// `Σ_j W_ij r_j` over the members of a cluster, for its member at `place`.
    #[inline]
    #[must_use]
    pub fn inner_product(&self, cluster: usize, place: usize, r: &[Vec3]) -> Vec3 {
        let members = self.members(cluster);
        let row = self.first_block[cluster] + place * members.len();
        let mut s = [0.0; 3];
        for (j, b) in members.iter().zip(&self.blocks[row..row + members.len()]) {
            mat_vec_add(b, &r[*j as usize], &mut s);
        }
        s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::families::squeezed_bundle;

    /// Every contact is in one cluster, none is too large, and products among members are those of the matrix.
    #[test]
    fn clusters_part_the_contacts() {
        let w = squeezed_bundle(7, 4e-3, 0.02, 0.3).delassus;
        let clusters = Clusters::new(&w, 0.1, 8, None);
        let mut seen = vec![0; w.len()];
        let r: Vec<Vec3> = (0..w.len()).map(|k| [k as f64, 1.0, -0.5 * k as f64]).collect();
        let mut together = 0;
        for c in 0..clusters.count() {
            let members = clusters.members(c);
            assert!(!members.is_empty() && members.len() <= 8, "{members:?}");
            together += usize::from(members.len() > 1);
            members.iter().for_each(|k| seen[*k as usize] += 1);
            let inside: Vec<Vec3> =
                (0..w.len()).map(|k| if members.contains(&(k as u32)) { r[k] } else { [0.0; 3] }).collect();
            for (place, k) in members.iter().enumerate() {
                assert_eq!(clusters.inner_product(c, place, &r), w.row_product_sparse(*k as usize, &inside));
            }
        }
        assert!(seen.iter().all(|times| *times == 1) && together > 0, "{together} {seen:?}");
    }
}
