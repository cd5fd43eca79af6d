//! Wrapping of the grains and renewal of the pair list; contacts keep their springs and images.

use std::ops::Range;

use super::state::{Body, Pair, Sample};
use crate::model::ContactKind;
use crate::neighbours::later_partners;
use rayon::prelude::*;

/// Grains per task; the lists do not depend on it.
const BLOCK: usize = 2048;
/// Ranges of grains of the two-level sort; the order does not depend on it.
const RANGES: usize = 16;

/// Pairs of a block of grains with what they carry.
#[derive(Default)]
struct Lists {
    pairs: Vec<Pair>,
    kind: Vec<ContactKind>,
    spring: Vec<f64>,
    rest: Vec<f64>,
    /// Pairs of each grain of the block.
    counts: Vec<u32>,
}

impl Lists {
    fn with_capacity(partners: usize) -> Self {
        let capacity = partners + partners / 16 + 16;
        Self {
            pairs: Vec::with_capacity(capacity),
            kind: Vec::with_capacity(capacity),
            spring: Vec::with_capacity(capacity),
            rest: Vec::with_capacity(capacity),
            counts: Vec::with_capacity(BLOCK),
        }
    }

    fn push(&mut self, pair: Pair, kind: ContactKind, spring: f64, rest: f64) {
        self.pairs.push(pair);
        self.kind.push(kind);
        self.spring.push(spring);
        self.rest.push(rest);
    }
}

/// Whether a list of `n` grains is worth sharing out.
fn is_shared_out(n: usize) -> bool {
    n > 4 * BLOCK && rayon::current_num_threads() > 1
}

/// Runs `work` over blocks of grains, or over all at once; results in the order of the grains.
fn in_blocks<T: Send>(n: usize, work: impl Fn(Range<usize>) -> T + Sync) -> Vec<T> {
    if is_shared_out(n) {
        (0..n.div_ceil(BLOCK)).into_par_iter().map(|b| work(b * BLOCK..((b + 1) * BLOCK).min(n))).collect()
    } else {
        vec![work(0..n)]
    }
}

/// Takes the first `n` entries off a slice.
fn cut<'a, T>(rest: &mut &'a mut [T], n: usize) -> &'a mut [T] {
    let (head, tail) = std::mem::take(rest).split_at_mut(n);
    *rest = tail;
    head
}

impl Sample {
    /// Skin of the pair list [µm].
    pub(crate) fn skin(&self) -> f64 {
        self.rules.skin * self.bodies.iter().map(|b| b.radius).sum::<f64>() / self.len().max(1) as f64
    }

    /// Renews the pair list if a grain may have come into reach unlisted.
    pub(crate) fn ensure_pairs(&mut self) {
        if self.valid {
            let skin = self.skin_in_use;
            let turned = (self.cell.strain - self.strain_at_build).abs() + self.closed;
            if (2.0 * self.largest_move + turned * (self.reach + skin)) * (1.0 + turned) < skin {
                return;
            }
        }
        self.rebuild();
    }

    fn rebuild(&mut self) {
        let cell = self.cell;
        let shift = self.wrap_bodies();
        let (x, (y, radius)): (Vec<f64>, (Vec<f64>, Vec<f64>)) =
            self.bodies.iter().map(|b| (b.x, (b.y, b.radius))).unzip();
        let skin = self.skin();
        let found = later_partners(&cell, &x, &y, &radius, skin);
        let sample = &*self;
        let parts = in_blocks(self.len(), |grains| sample.relist(grains, &shift, &x, &y, &found));
        self.take_lists(parts);
        self.index_gather();
        self.moved.fill([0.0; 2]);
        self.largest_move = 0.0;
        self.strain_at_build = cell.strain;
        self.closed = 0.0;
        self.skin_in_use = skin;
        self.reach = 2.0 * radius.iter().fold(0.0f64, |m, &r| m.max(r));
        self.valid = true;
        self.rebuilds += 1;
    }

    /// Wraps all grains; gives by how many boxes each one moved, so that images stay the same vectors.
    fn wrap_bodies(&mut self) -> Vec<[i32; 2]> {
        let cell = self.cell;
        let mut shift = vec![[0i32; 2]; self.len()];
        let wrap = |(bodies, shift): (&mut [Body], &mut [[i32; 2]])| {
            for (b, s) in bodies.iter_mut().zip(shift) {
                let ([x, y], kick) = cell.wrap(b.x, b.y);
                if x != b.x || y != b.y {
                    let rows = ((y - b.y) / cell.height).round();
                    s[1] = rows as i32;
                    s[0] = ((x - b.x - rows * (cell.height * cell.strain)) / cell.width).round() as i32;
                    b.vy -= (y - b.y) * cell.closing;
                    b.x = x;
                    b.y = y;
                    b.vx += kick;
                }
            }
        };
        if is_shared_out(self.bodies.len()) {
            self.bodies.par_chunks_mut(BLOCK).zip(shift.par_chunks_mut(BLOCK)).for_each(wrap);
        } else {
            wrap((&mut self.bodies, &mut shift));
        }
        shift
    }

    /// The new list of some grains: known pairs keep what they carry, fresh ones start apart.
    fn relist(
        &self,
        grains: Range<usize>,
        shift: &[[i32; 2]],
        x: &[f64],
        y: &[f64],
        (offsets, partners): &(Vec<u32>, Vec<u32>),
    ) -> Lists {
        let cell = &self.cell;
        let mut lists = Lists::with_capacity((offsets[grains.end] - offsets[grains.start]) as usize);
        for i in grains {
            let from = lists.pairs.len();
            let fresh = &partners[offsets[i] as usize..offsets[i + 1] as usize];
            let (mut k, end) = (self.first[i] as usize, self.first[i + 1] as usize);
            let mut at = 0;
            loop {
                let next_old = if k < end { self.pairs[k].j } else { u32::MAX };
                let next_new = fresh.get(at).copied().unwrap_or(u32::MAX);
                if next_old == u32::MAX && next_new == u32::MAX {
                    break;
                }
                let listed = next_new <= next_old;
                if next_old <= next_new {
                    // Known pair: keep it while in reach, touching or linked.
                    if listed || self.kind[k] != ContactKind::Apart {
                        let (p, j) = (self.pairs[k], next_old as usize);
                        let pair = Pair {
                            columns: p.columns - shift[j][0] + shift[i][0],
                            rows: p.rows - shift[j][1] + shift[i][1],
                            ..p
                        };
                        lists.push(pair, self.kind[k], self.spring[k], self.rest[k]);
                    }
                    k += 1;
                } else {
                    let j = next_new as usize;
                    let (dx, dy) = (x[j] - x[i], y[j] - y[i]);
                    let ([nx, ny], ..) = cell.nearest(dx, dy);
                    let rows = ((ny - dy) / cell.height).round();
                    let columns = ((nx - dx - rows * (cell.height * cell.strain)) / cell.width).round();
                    let pair = Pair { i: i as u32, j: next_new, columns: columns as i32, rows: rows as i32 };
                    lists.push(pair, ContactKind::Apart, 0.0, 0.0);
                }
                at += usize::from(listed);
            }
            lists.counts.push((lists.pairs.len() - from) as u32);
        }
        lists
    }

    /// Puts the lists of the blocks one after the other.
    fn take_lists(&mut self, parts: Vec<Lists>) {
        let total: usize = parts.iter().map(|part| part.pairs.len()).sum();
        let mut at = 0;
        for (k, count) in parts.iter().flat_map(|part| &part.counts).enumerate() {
            self.first[k] = at;
            at += count;
        }
        self.first[self.bodies.len()] = at;
        let empty = Pair { i: 0, j: 0, columns: 0, rows: 0 };
        self.pairs.resize(total, empty);
        self.kind.resize(total, ContactKind::Apart);
        self.spring.resize(total, 0.0);
        self.rest.resize(total, 0.0);
        let (mut pairs, mut kind) = (&mut self.pairs[..], &mut self.kind[..]);
        let (mut spring, mut rest) = (&mut self.spring[..], &mut self.rest[..]);
        let mut jobs = Vec::with_capacity(parts.len());
        for part in &parts {
            let n = part.pairs.len();
            jobs.push((part, cut(&mut pairs, n), cut(&mut kind, n), cut(&mut spring, n), cut(&mut rest, n)));
        }
        type Job<'a> = (&'a Lists, &'a mut [Pair], &'a mut [ContactKind], &'a mut [f64], &'a mut [f64]);
        let copy = |(part, pairs, kind, spring, rest): Job| {
            pairs.copy_from_slice(&part.pairs);
            kind.copy_from_slice(&part.kind);
            spring.copy_from_slice(&part.spring);
            rest.copy_from_slice(&part.rest);
        };
        if jobs.len() > 1 {
            jobs.into_par_iter().for_each(copy);
        } else {
            jobs.into_iter().for_each(copy);
        }
    }

    /// For each grain its pairs in ascending order: `2 k` where it comes first, `2 k + 1` where it comes second.
    ///
    /// Pairs are sorted by their first grain, so those where a grain comes second stand before those where it comes first. They are
    /// found by a counting sort in two levels: blocks of pairs sort them by range of grains, then each range sorts its own.
    fn index_gather(&mut self) {
        let n = self.len();
        let width = if is_shared_out(n) { n.div_ceil(RANGES) } else { n.max(1) };
        let ranges = n.div_ceil(width);
        let (pairs, first) = (&self.pairs, &self.first);
        let buckets: Vec<Vec<Vec<[u32; 2]>>> = in_blocks(n, |grains| {
            let own = first[grains.start] as usize..first[grains.end] as usize;
            let mut buckets = vec![Vec::with_capacity(own.len() / ranges + 16); ranges];
            for k in own {
                let j = pairs[k].j;
                buckets[j as usize / width].push([j, k as u32]);
            }
            buckets
        });
        let sort = |range: usize| {
            let grains = range * width..((range + 1) * width).min(n);
            let mut ends = vec![0u32; grains.len() + 1];
            for [j, _] in buckets.iter().flat_map(|block| &block[range]) {
                ends[*j as usize - grains.start + 1] += 1;
            }
            for i in grains.clone() {
                ends[i - grains.start + 1] += ends[i - grains.start] + first[i + 1] - first[i];
            }
            let mut gather = vec![0u32; ends[grains.len()] as usize];
            let mut next = ends.clone();
            for [j, k] in buckets.iter().flat_map(|block| &block[range]) {
                let slot = &mut next[*j as usize - grains.start];
                gather[*slot as usize] = 2 * k + 1;
                *slot += 1;
            }
            for i in grains.clone() {
                let to = ends[i - grains.start + 1] as usize;
                let own = first[i]..first[i + 1];
                for (slot, k) in gather[to - own.len()..to].iter_mut().zip(own) {
                    *slot = 2 * k;
                }
            }
            (ends, gather)
        };
        let parts: Vec<(Vec<u32>, Vec<u32>)> =
            if ranges > 1 { (0..ranges).into_par_iter().map(sort).collect() } else { (0..ranges).map(sort).collect() };
        self.gather_offsets.clear();
        self.gather_offsets.push(0);
        self.gather.clear();
        for (ends, gather) in &parts {
            let base = self.gather.len() as u32;
            self.gather_offsets.extend(ends[1..].iter().map(|end| base + end));
            self.gather.extend_from_slice(gather);
        }
        // The next evaluation writes every entry.
        self.forces.resize(self.pairs.len(), [0.0; 4]);
    }
}
