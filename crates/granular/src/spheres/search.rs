//! Pair list of spheres: bins over the oblique box, contacts carried over by merging sorted lists.

use super::state::{SpherePair, SphereSample};
use crate::model::ContactKind;
use rayon::prelude::*;

impl SphereSample {
    /// Renews the pair list if a sphere may have come into reach unlisted.
    pub(crate) fn ensure_pairs(&mut self) {
        if self.valid {
            let turned = (self.cell.strain - self.strain_at_build).abs();
            let reach = self.reach + self.skin_in_use;
            if (2.0 * self.largest_move + turned * reach) * (1.0 + turned) < self.skin_in_use {
                return;
            }
        }
        self.rebuild();
    }

    /// Nearest image of a separation and the boxes added to get there.
    fn nearest(&self, s: [f64; 3]) -> ([f64; 3], [i32; 3]) {
        let ([x, y], ..) = self.cell.nearest(s[0], s[1]);
        let layers = -(s[2] / self.depth).round();
        let rows = ((y - s[1]) / self.cell.height).round();
        let columns = ((x - s[0] - rows * (self.cell.height * self.cell.strain)) / self.cell.width).round();
        ([x, y, s[2] + layers * self.depth], [columns as i32, rows as i32, layers as i32])
    }

    fn rebuild(&mut self) {
        let n = self.len();
        let (cell, depth) = (self.cell, self.depth);
        let mut shift = vec![[0i32; 3]; n];
        for (b, s) in self.balls.iter_mut().zip(&mut shift) {
            let p = b.position;
            let ([x, y], kick) = cell.wrap(p[0], p[1]);
            let rows = ((y - p[1]) / cell.height).round();
            let columns = ((x - p[0] - rows * (cell.height * cell.strain)) / cell.width).round();
            let layers = -(p[2] / depth).floor();
            *s = [columns as i32, rows as i32, layers as i32];
            b.position = [x, y, p[2] + layers * depth];
            b.velocity[0] += kick;
        }
        let largest = self.balls.iter().fold(0.0f64, |m, b| m.max(b.radius));
        let skin = self.rules.skin * self.balls.iter().map(|b| b.radius).sum::<f64>() / n.max(1) as f64;
        let fresh = self.later_partners(2.0 * largest + skin, skin);

        let old = std::mem::take(&mut self.pairs);
        self.pairs.reserve(fresh.iter().map(Vec::len).sum());
        let mut first = Vec::with_capacity(n + 1);
        first.push(0);
        for i in 0..n {
            let (mut k, end, mut at) = (self.first[i] as usize, self.first[i + 1] as usize, 0);
            loop {
                let known = if k < end { old[k].j } else { u32::MAX };
                let found = fresh[i].get(at).copied().unwrap_or(u32::MAX);
                if known == u32::MAX && found == u32::MAX {
                    break;
                }
                let listed = found <= known;
                if known <= found {
                    if listed || old[k].kind != ContactKind::Apart {
                        let j = known as usize;
                        let image = std::array::from_fn(|c| old[k].image[c] - shift[j][c] + shift[i][c]);
                        self.pairs.push(SpherePair { image, ..old[k] });
                    }
                    k += 1;
                } else {
                    let (a, b) = (&self.balls[i].position, &self.balls[found as usize].position);
                    let (_, image) = self.nearest(std::array::from_fn(|c| b[c] - a[c]));
                    let kind = ContactKind::Apart;
                    self.pairs.push(SpherePair { i: i as u32, j: found, image, kind, spring: [0.0; 3], rest: 0.0 });
                }
                at += usize::from(listed);
            }
            first.push(self.pairs.len() as u32);
        }
        self.first = first;
        self.index_gather();
        self.moved.fill([0.0; 3]);
        self.largest_move = 0.0;
        self.strain_at_build = cell.strain;
        self.skin_in_use = skin;
        self.reach = 2.0 * largest;
        self.valid = true;
    }

    /// For each sphere the partners of larger index within touch plus `skin`, ascending.
    fn later_partners(&self, reach: f64, skin: f64) -> Vec<Vec<u32>> {
        let n = self.len();
        let turn = self.cell.width / self.cell.height;
        let slope = self.cell.strain - (self.cell.strain / turn).round() * turn;
        let most = (n as f64).cbrt().max(3.0) * 2.0;
        let count = |length: f64| ((length / reach).min(most).floor() as i64).max(1);
        let bins = [count(self.cell.width / (1.0 + slope * slope).sqrt()), count(self.cell.height), count(self.depth)];
        let close = |i: usize, j: usize| {
            let (a, b) = (&self.balls[i], &self.balls[j]);
            let (s, _) = self.nearest(std::array::from_fn(|c| b.position[c] - a.position[c]));
            let limit = a.radius + b.radius + skin;
            super::state::dot(s, s) < limit * limit
        };
        if n <= 64 || bins.iter().any(|b| *b < 3) {
            return (0..n)
                .into_par_iter()
                .map(|i| (i + 1..n).filter(|&j| close(i, j)).map(|j| j as u32).collect())
                .collect();
        }
        let place = |i: usize| -> [i64; 3] {
            let p = self.balls[i].position;
            let u = [(p[0] - slope * p[1]) / self.cell.width, p[1] / self.cell.height, p[2] / self.depth];
            std::array::from_fn(|c| ((u[c] * bins[c] as f64).floor() as i64).rem_euclid(bins[c]))
        };
        let index = |b: [i64; 3]| ((b[2] * bins[1] + b[1]) * bins[0] + b[0]) as usize;
        let mut starts = vec![0usize; (bins[0] * bins[1] * bins[2]) as usize + 1];
        let places: Vec<[i64; 3]> = (0..n).map(place).collect();
        for b in &places {
            starts[index(*b) + 1] += 1;
        }
        for b in 1..starts.len() {
            starts[b] += starts[b - 1];
        }
        let mut next = starts.clone();
        let mut sorted = vec![0u32; n];
        for (i, b) in places.iter().enumerate() {
            sorted[next[index(*b)]] = i as u32;
            next[index(*b)] += 1;
        }
        (0..n)
            .into_par_iter()
            .map(|i| {
                let mut list = Vec::with_capacity(12);
                for dz in -1..=1 {
                    for dy in -1..=1 {
                        for dx in -1..=1 {
                            let b = places[i];
                            let at = index([
                                (b[0] + dx).rem_euclid(bins[0]),
                                (b[1] + dy).rem_euclid(bins[1]),
                                (b[2] + dz).rem_euclid(bins[2]),
                            ]);
                            for &j in &sorted[starts[at]..starts[at + 1]] {
                                if j as usize > i && close(i, j as usize) {
                                    list.push(j);
                                }
                            }
                        }
                    }
                }
                list.sort_unstable();
                list
            })
            .collect()
    }

    fn index_gather(&mut self) {
        let n = self.len();
        let mut offsets = vec![0u32; n + 1];
        for p in &self.pairs {
            offsets[p.i as usize + 1] += 1;
            offsets[p.j as usize + 1] += 1;
        }
        for i in 0..n {
            offsets[i + 1] += offsets[i];
        }
        let mut next = offsets.clone();
        self.gather.clear();
        self.gather.resize(2 * self.pairs.len(), 0);
        for (k, p) in self.pairs.iter().enumerate() {
            for (ball, side) in [(p.i, 0), (p.j, 1)] {
                let slot = &mut next[ball as usize];
                self.gather[*slot as usize] = 2 * k as u32 + side;
                *slot += 1;
            }
        }
        self.gather_offsets = offsets;
        self.forces.clear();
        self.forces.resize(self.pairs.len(), [0.0; 6]);
    }
}
