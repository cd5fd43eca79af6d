//! A small deterministic generator of random numbers, and random contact systems.

use crate::block::{Block, Vec3, ZERO};
use crate::problem::{BlockMatrix, ContactProblem};

/// SplitMix64 (Steele, Lea and Flood 2014): the same numbers everywhere from the same seed.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// A generator for a seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x1234_5678_9ABC_DEF0)
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in `[a, b)`.
    pub fn uniform(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * ((self.bits() >> 11) as f64 / (1u64 << 53) as f64)
    }

    /// A whole number in `a..b`.
    pub fn index(&mut self, a: usize, b: usize) -> usize {
        a + (self.bits() % (b - a).max(1) as u64) as usize
    }

    /// Standard normal.
    pub fn normal(&mut self) -> f64 {
        let u = self.uniform(f64::MIN_POSITIVE, 1.0).max(1e-300);
        let v = self.uniform(0.0, std::f64::consts::TAU);
        (-2.0 * u.ln()).sqrt() * v.cos()
    }

    /// A random unit vector.
    pub fn direction(&mut self) -> Vec3 {
        loop {
            let v = [self.normal(), self.normal(), self.normal()];
            let l = crate::block::norm_squared(&v).sqrt();
            if l > 1e-3 {
                return v.map(|x| x / l);
            }
        }
    }
}

/// A random dense system of `contacts` contacts over `dofs` degrees of freedom: `W = H Hᵀ/dofs` has rank at most
/// `dofs`, so `dofs < 3·contacts` makes it rank deficient. Free velocities lie in the range of `H` plus a closing part
/// that some motion can undo, so that a solution exists.
#[must_use]
pub fn random_system(
    random: &mut Random,
    contacts: usize,
    dofs: usize,
    friction: (f64, f64),
    cohesion: f64,
) -> ContactProblem {
    let h: Vec<Vec<f64>> = (0..3 * contacts).map(|_| (0..dofs).map(|_| random.normal()).collect()).collect();
    // a motion that opens every contact with room for sliding: rows shifted so that H v₀ lies inside the dual cone
    let v0: Vec<f64> = (0..dofs).map(|_| random.normal()).collect();
    let norm2: f64 = v0.iter().map(|v| v * v).sum();
    let friction: Vec<f64> = (0..contacts).map(|_| random.uniform(friction.0, friction.1)).collect();
    let mut h = h;
    for k in 0..contacts {
        for c in 0..3 {
            let along: f64 = h[3 * k + c].iter().zip(&v0).map(|(a, b)| a * b).sum();
            // opening speed one, tangential speed small
            let wanted = if c == 0 { 1.0 } else { 0.2 * random.uniform(-1.0, 1.0) };
            let f = (wanted - along) / norm2;
            for (a, b) in h[3 * k + c].iter_mut().zip(&v0) {
                *a += f * b;
            }
        }
    }
    let v: Vec<f64> = (0..dofs).map(|_| random.normal()).collect();
    let close = random.uniform(0.0, 1.5);
    let mut q = vec![[0.0; 3]; contacts];
    let mut triplets: Vec<(u32, u32, Block)> = Vec::new();
    for k in 0..contacts {
        for c in 0..3 {
            q[k][c] = h[3 * k + c].iter().zip(v.iter().zip(&v0)).map(|(a, (b, o))| a * (b - close * o)).sum();
        }
        for l in 0..contacts {
            let mut b = ZERO;
            for i in 0..3 {
                for j in 0..3 {
                    b[3 * i + j] =
                        h[3 * k + i].iter().zip(&h[3 * l + j]).map(|(x, y)| x * y).sum::<f64>() / dofs as f64;
                }
            }
            triplets.push((k as u32, l as u32, b));
        }
    }
    let cohesion = if cohesion > 0.0 {
        (0..contacts)
            .map(|_| if random.uniform(0.0, 1.0) < 0.5 { random.uniform(0.0, cohesion) } else { 0.0 })
            .collect()
    } else {
        Vec::new()
    };
    ContactProblem {
        dimension: 3,
        delassus: BlockMatrix::from_triplets(contacts, &triplets),
        free_velocity: q,
        friction,
        cohesion,
    }
}
