//! Random yarns from a seed.

use nalgebra::SVector;

use super::curve::{divisions, line};

/// SplitMix64: a short generator whose stream is part of the contract, so that a seed means the same yarns for ever.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// In `[-1, 1)`.
    fn signed(&mut self) -> f64 {
        (self.next() >> 11) as f64 * (2.0 / (1u64 << 53) as f64) - 1.0
    }

    /// Evenly spread in the unit ball.
    fn in_ball<const D: usize>(&mut self) -> SVector<f64, D> {
        loop {
            let v = SVector::<f64, D>::from_fn(|_, _| self.signed());
            let n = v.norm_squared();
            if n <= 1.0 && n > 1e-6 {
                return v;
            }
        }
    }

    fn direction<const D: usize>(&mut self) -> SVector<f64, D> {
        let v = self.in_ball::<D>();
        v / v.norm()
    }
}

/// Persistent random walks that stay inside a ball.
pub(super) fn ball<const D: usize>(
    center: SVector<f64, D>,
    radius: f64,
    count: usize,
    length: f64,
    curl: f64,
    seed: u64,
    segment: f64,
) -> Vec<Vec<SVector<f64, D>>> {
    let n = divisions(length, segment);
    let step = length / n as f64;
    // Each segment turns by about `sqrt(step / curl)`: the direction is forgotten over `curl`.
    let turn = (step / curl).sqrt().min(1.0);
    (0..count)
        .map(|i| {
            let mut random = Random(seed ^ (i as u64 + 1).wrapping_mul(0xD1B5_4A32_D192_ED03));
            let mut x: SVector<f64, D> = random.in_ball::<D>() * radius;
            let mut direction: SVector<f64, D> = random.direction();
            let mut points = Vec::with_capacity(n + 1);
            points.push(center + x);
            for _ in 0..n {
                direction += random.direction::<D>() * turn;
                // Near the surface the course bends inward.
                let out = x / radius;
                let depth = out.norm();
                if depth > 0.7 {
                    direction -= out * ((depth - 0.7) * 2.0 * turn.max(0.3));
                }
                direction /= direction.norm().max(1e-12);
                let mut next = x + direction * step;
                if next.norm() > radius {
                    // Slide along the surface, of the same length to first order.
                    let normal = x / x.norm().max(1e-12);
                    let mut along = direction - normal * direction.dot(&normal);
                    if along.norm() < 1e-9 {
                        along = -normal;
                    }
                    direction = along / along.norm();
                    next = x + direction * step;
                    let over = next.norm();
                    if over > radius {
                        next *= radius / over;
                    }
                }
                x = next;
                points.push(center + x);
            }
            points
        })
        .collect()
}

/// Straight pieces whose middles and directions are random; whole pieces lie in the box where it is long enough.
pub(super) fn pile<const D: usize>(
    low: SVector<f64, D>,
    high: SVector<f64, D>,
    count: usize,
    length: f64,
    seed: u64,
    segment: f64,
) -> Vec<Vec<SVector<f64, D>>> {
    let mut random = Random(seed);
    (0..count)
        .map(|_| {
            let direction: SVector<f64, D> = random.direction();
            let middle = SVector::<f64, D>::from_fn(|a, _| {
                let half = (0.5 * length * direction[a]).abs().min(0.5 * (high[a] - low[a]).max(0.0));
                let (lo, hi) = (low[a] + half, high[a] - half);
                lo + (hi - lo) * 0.5 * (random.signed() + 1.0)
            });
            line(middle - direction * (0.5 * length), middle + direction * (0.5 * length), segment)
        })
        .collect()
}
