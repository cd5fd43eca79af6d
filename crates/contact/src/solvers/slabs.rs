//! Contacts in slabs of which each feels only the two beside it, so that every other slab can be swept at the same time.
//!
//! The slabs are levels of a breadth-first search through the matrix: contacts of one level feel those of the level before,
//! of their own and of the next, and no others (a wisp of hairs falls into layers, as many as it has strands across). They follow from
//! the matrix alone, so that the answer is the same for any number of threads.

use super::clusters::Clusters;
use crate::block::{Block, Vec3};
use crate::problem::BlockMatrix;
use crate::problem::block_matrix::product_sparse;
use rayon::prelude::*;

/// Contacts from which on slabs pay for their searches.
const WORTH: usize = 1000;

/// Most slabs.
const MOST: usize = 16;

/// A slab and what its sweep needs to see.
#[derive(Clone, Debug)]
pub(super) struct Slab {
    /// Its contacts, ascending.
    members: Vec<u32>,
    /// The contacts of the slabs before and after it.
    beside: Vec<u32>,
    /// What is swept one after the other: contacts, or clusters where there are some.
    pub units: Vec<u32>,
    pub rows: Rows,
    /// Impulses of members and contacts beside, by number of the contact; the others are not kept up to date. Empty
    /// until slabs are swept at once.
    copy: Vec<Vec3>,
}

/// Rows of the matrix in the order in which a slab is swept. Lying one after the other they are read three times as fast as
/// rows here and there.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    start: Vec<usize>,
    columns: Vec<u32>,
    blocks: Vec<Block>,
}

impl Rows {
    fn new(w: &BlockMatrix, order: &[u32]) -> Rows {
        let count = order.iter().map(|k| w.row(*k as usize).0.len()).sum();
        let mut rows = Rows { start: vec![0], columns: Vec::with_capacity(count), blocks: Vec::with_capacity(count) };
        for k in order {
            let (columns, blocks) = w.row(*k as usize);
            rows.columns.extend_from_slice(columns);
            rows.blocks.extend_from_slice(blocks);
            rows.start.push(rows.columns.len());
        }
        rows
    }

    /// `Σ_j W_ij x_j` for the row that is swept at `place`.
    #[inline]
    pub fn product_sparse(&self, place: usize, x: &[Vec3]) -> Vec3 {
        let row = self.start[place]..self.start[place + 1];
        product_sparse(&self.columns[row.clone()], &self.blocks[row], x)
    }
}

/// Every other slab, and the rest.
pub(super) type Colours = [Vec<Slab>; 2];

/// The slab of every contact, and their number; `None` where there is too little to part.
pub(super) fn part(w: &BlockMatrix) -> Option<(Vec<u32>, u32)> {
    let n = w.len();
    if n < WORTH {
        return None;
    }
    // from where a first search ends, levels are many and thin
    let end = *search(w, 0).0.last()?;
    let (order, levels) = search(w, end);
    let work = |k: &u32| w.row(*k as usize).0.len();
    let share = w.block_count().div_ceil(MOST);
    let mut slab = vec![0; n];
    let (mut now, mut done) = (0, 0);
    for level in levels.windows(2) {
        let level = &order[level[0]..level[1]];
        level.iter().for_each(|k| slab[*k as usize] = now);
        done += level.iter().map(work).sum::<usize>();
        if done >= share * (now as usize + 1) {
            now = (done / share) as u32;
        }
    }
    // numbers without gaps, in the order of the levels
    let mut used: Vec<u32> = slab.clone();
    used.sort_unstable();
    used.dedup();
    for s in &mut slab {
        *s = used.partition_point(|u| u < s) as u32;
    }
    // where one contact feels another that does not feel it, levels say nothing
    let near = |i: usize| w.row(i).0.iter().all(|j| slab[i].abs_diff(slab[*j as usize]) <= 1);
    (used.len() > 2 && (0..n).all(near)).then_some((slab, used.len() as u32))
}

/// All contacts by their distance from one, and where each distance begins, and the end. What does not hang together follows with
/// distances of its own.
fn search(w: &BlockMatrix, from: u32) -> (Vec<u32>, Vec<usize>) {
    let n = w.len() as u32;
    let mut seen = vec![false; n as usize];
    let mut order: Vec<u32> = Vec::with_capacity(n as usize);
    let mut levels = vec![0];
    for root in std::iter::once(from).chain(0..n) {
        if seen[root as usize] {
            continue;
        }
        seen[root as usize] = true;
        order.push(root);
        let mut begin = order.len() - 1;
        while begin < order.len() {
            let end = order.len();
            levels.push(end);
            for at in begin..end {
                for j in w.row(order[at] as usize).0 {
                    if !seen[*j as usize] {
                        seen[*j as usize] = true;
                        order.push(*j);
                    }
                }
            }
            begin = end;
        }
    }
    (order, levels)
}

/// The slabs, made ready for sweeps over contacts or `clusters`, which lie within slabs.
pub(super) fn colours(w: &BlockMatrix, (slab, count): &(Vec<u32>, u32), clusters: Option<&Clusters>) -> Colours {
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); *count as usize];
    for (k, s) in (0u32..).zip(slab) {
        members[*s as usize].push(k);
    }
    let mut units: Vec<Vec<u32>> = vec![Vec::new(); *count as usize];
    if let Some(clusters) = clusters {
        for c in 0..clusters.count() {
            units[slab[clusters.members(c)[0] as usize] as usize].push(c as u32);
        }
    } else {
        units.clone_from(&members);
    }
    let slab = |s: usize| {
        let mut beside: Vec<u32> = s.checked_sub(1).map(|before| members[before].clone()).unwrap_or_default();
        beside.extend(members.get(s + 1).into_iter().flatten());
        let rows = match clusters {
            None => Rows::new(w, &members[s]),
            Some(clusters) => {
                let order: Vec<u32> = units[s].iter().flat_map(|c| clusters.members(*c as usize)).copied().collect();
                Rows::new(w, &order)
            }
        };
        let (members, units) = (members[s].clone(), units[s].clone());
        Slab { members, beside, units, rows, copy: Vec::new() }
    };
    [0, 1].map(|colour| (colour..*count as usize).into_par_iter().step_by(2).with_max_len(1).map(slab).collect())
}

impl Slab {
    /// Takes its own impulses and those it feels from `r`, and sweeps.
    pub fn sweep<T>(&mut self, r: &[Vec3], sweep: impl FnOnce(&[u32], &Rows, &mut [Vec3]) -> T) -> T {
        self.copy.resize(r.len(), [0.0; 3]);
        for k in self.members.iter().chain(&self.beside) {
            self.copy[*k as usize] = r[*k as usize];
        }
        sweep(&self.units, &self.rows, &mut self.copy)
    }

    /// Gives its own impulses back.
    pub fn write(&self, r: &mut [Vec3]) {
        for k in &self.members {
            r[*k as usize] = self.copy[*k as usize];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::IDENTITY;
    use crate::families::squeezed_bundle;

    /// Slabs of one colour do not feel each other, and each contact is in one of them.
    #[test]
    fn every_other_slab_is_free_of_the_others() {
        let w = squeezed_bundle(400, 4e-3, 0.02, 0.3).delassus;
        assert!(w.len() >= WORTH, "{}", w.len());
        let parted = part(&w).expect("a bundle has layers");
        let (slab, count) = &parted;
        assert!((4..=MOST as u32).contains(count), "{count}");
        for (i, j, _) in w.iter() {
            assert!(slab[i].abs_diff(slab[j]) <= 1, "{i} in {}, {j} in {}", slab[i], slab[j]);
        }
        let colours = colours(&w, &parted, None);
        let mut seen = vec![0; w.len()];
        colours.iter().flatten().flat_map(|s| &s.units).for_each(|k| seen[*k as usize] += 1);
        assert!(seen.iter().all(|n| *n == 1));
        let largest = colours.iter().flatten().map(|s| s.units.len()).max().unwrap();
        assert!(largest < w.len() / 3, "{largest} of {}", w.len());
    }

    /// A chain falls into links; with an end that feels the middle without being felt there it is left whole, as are few contacts.
    #[test]
    fn what_cannot_be_parted_is_left_whole() {
        let n = 4 * WORTH as u32;
        let links = (0..n).flat_map(|k| [(k, k), (k, (k + 1).min(n - 1)), (k, k.saturating_sub(1))]);
        let mut triplets: Vec<(u32, u32, Block)> = links.map(|(i, j)| (i, j, IDENTITY)).collect();
        let chain = |triplets: &[(u32, u32, Block)]| part(&BlockMatrix::from_triplets(n as usize, triplets));
        let (slab, count) = chain(&triplets).expect("a chain has links");
        assert_eq!(count, MOST as u32);
        assert!(slab.is_sorted() || slab.iter().rev().is_sorted());
        triplets.push((0, n / 2, IDENTITY));
        assert!(chain(&triplets).is_none());
        assert!(part(&squeezed_bundle(7, 4e-3, 0.02, 0.3).delassus).is_none());
    }
}
