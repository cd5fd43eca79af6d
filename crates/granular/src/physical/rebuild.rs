//! Wrapping of the grains and renewal of the pair list; contacts keep their springs and images.

use super::state::{Pair, Sample};
use crate::model::ContactKind;
use crate::neighbours::later_partners;

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
        let n = self.len();
        let cell = self.cell;
        // Wrap; remember by how many boxes each grain moved so that images stay the same vectors.
        let mut shift = vec![[0i32; 2]; n];
        for (b, s) in self.bodies.iter_mut().zip(&mut shift) {
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
        let (x, (y, radius)): (Vec<f64>, (Vec<f64>, Vec<f64>)) =
            self.bodies.iter().map(|b| (b.x, (b.y, b.radius))).unzip();
        let skin = self.skin();
        let (offsets, partners) = later_partners(&cell, &x, &y, &radius, skin);

        let old = (
            std::mem::take(&mut self.pairs),
            std::mem::take(&mut self.kind),
            std::mem::take(&mut self.spring),
            std::mem::take(&mut self.rest),
        );
        let capacity = partners.len() + partners.len() / 16 + 16;
        self.pairs.reserve(capacity);
        self.kind.reserve(capacity);
        self.spring.reserve(capacity);
        self.rest.reserve(capacity);
        let mut first = Vec::with_capacity(n + 1);
        first.push(0);
        for i in 0..n {
            let fresh = &partners[offsets[i] as usize..offsets[i + 1] as usize];
            let (mut k, end) = (self.first[i] as usize, self.first[i + 1] as usize);
            let mut at = 0;
            loop {
                let next_old = if k < end { old.0[k].j } else { u32::MAX };
                let next_new = fresh.get(at).copied().unwrap_or(u32::MAX);
                if next_old == u32::MAX && next_new == u32::MAX {
                    break;
                }
                let listed = next_new <= next_old;
                if next_old <= next_new {
                    // Known pair: keep it while in reach, touching or linked.
                    if listed || old.1[k] != ContactKind::Apart {
                        let (p, j) = (old.0[k], next_old as usize);
                        self.pairs.push(Pair {
                            columns: p.columns - shift[j][0] + shift[i][0],
                            rows: p.rows - shift[j][1] + shift[i][1],
                            ..p
                        });
                        self.kind.push(old.1[k]);
                        self.spring.push(old.2[k]);
                        self.rest.push(old.3[k]);
                    }
                    k += 1;
                } else {
                    let j = next_new as usize;
                    let (dx, dy) = (x[j] - x[i], y[j] - y[i]);
                    let ([nx, ny], ..) = cell.nearest(dx, dy);
                    let rows = ((ny - dy) / cell.height).round();
                    let columns = ((nx - dx - rows * (cell.height * cell.strain)) / cell.width).round();
                    self.pairs.push(Pair { i: i as u32, j: next_new, columns: columns as i32, rows: rows as i32 });
                    self.kind.push(ContactKind::Apart);
                    self.spring.push(0.0);
                    self.rest.push(0.0);
                }
                at += usize::from(listed);
            }
            first.push(self.pairs.len() as u32);
        }
        self.first = first;
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

    /// For each grain its pairs in ascending order: `2 k` where it comes first, `2 k + 1` where it comes second.
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
            for (grain, side) in [(p.i, 0), (p.j, 1)] {
                let slot = &mut next[grain as usize];
                self.gather[*slot as usize] = 2 * k as u32 + side;
                *slot += 1;
            }
        }
        self.gather_offsets = offsets;
        self.forces.clear();
        self.forces.resize(self.pairs.len(), [0.0; 4]);
    }
}
