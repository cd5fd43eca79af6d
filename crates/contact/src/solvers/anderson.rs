//! Anderson acceleration of a fixed-point iteration on impulses: from the last few iterates and their images the
//! combination whose change is smallest (Anderson 1965; Walker and Ni 2011, type II).
//!
//! Where states no longer change, a Gauss–Seidel sweep is nearly an affine map and the combination converges like GMRES
//! on it; where they do, the safeguard of [`super::gauss_seidel`] forgets the past.

use crate::block::Vec3;

/// Differences of the last iterates.
#[derive(Clone, Debug)]
pub struct Anderson {
    window: usize,
    /// Squared weight of each contact in the norm.
    weight: Vec<f64>,
    /// Differences of the changes `f = g − x` and of the images `g`, as rings.
    changes: Vec<Vec<Vec3>>,
    images: Vec<Vec<Vec3>>,
    /// Products of the differences of changes, by place in the ring.
    gram: Vec<f64>,
    /// How many places of the rings are filled, and which is written next.
    filled: usize,
    next: usize,
    last_change: Vec<Vec3>,
    last_image: Vec<Vec3>,
    started: bool,
}

impl Anderson {
    /// Remembers `window` differences; `weight` is the squared weight of each contact.
    #[must_use]
    pub fn new(window: usize, weight: Vec<f64>) -> Self {
        let n = weight.len();
        let zero = vec![[0.0; 3]; n];
        Anderson {
            window,
            weight,
            changes: vec![zero.clone(); window],
            images: vec![zero.clone(); window],
            gram: vec![0.0; window * window],
            filled: 0,
            next: 0,
            last_change: zero.clone(),
            last_image: zero,
            started: false,
        }
    }

    /// Forgets everything.
    pub fn restart(&mut self) {
        self.filled = 0;
        self.next = 0;
        self.started = false;
    }

    /// Weighted size of the change from `x` to its image `g`.
    #[must_use]
    pub fn change(&self, x: &[Vec3], g: &[Vec3]) -> f64 {
        let term = |k: usize| {
            let d = [g[k][0] - x[k][0], g[k][1] - x[k][1], g[k][2] - x[k][2]];
            self.weight[k] * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        };
        (0..x.len()).map(term).sum::<f64>().sqrt()
    }

    /// Takes the pair `x → g` and writes the accelerated next iterate into `out`.
    pub fn advance(&mut self, x: &[Vec3], g: &[Vec3], out: &mut [Vec3]) {
        let n = x.len();
        if self.started {
            let at = self.next;
            for k in 0..n {
                for c in 0..3 {
                    let f = g[k][c] - x[k][c];
                    self.changes[at][k][c] = f - self.last_change[k][c];
                    self.images[at][k][c] = g[k][c] - self.last_image[k][c];
                }
            }
            self.filled = (self.filled + 1).min(self.window);
            for j in 0..self.filled {
                let p = self.product(&self.changes[at], &self.changes[j]);
                self.gram[at * self.window + j] = p;
                self.gram[j * self.window + at] = p;
            }
            self.next = (at + 1) % self.window;
        }
        self.started = true;
        for k in 0..n {
            self.last_image[k] = g[k];
            for c in 0..3 {
                self.last_change[k][c] = g[k][c] - x[k][c];
            }
        }
        out.copy_from_slice(g);
        let right: Vec<f64> = (0..self.filled).map(|j| self.product(&self.changes[j], &self.last_change)).collect();
        let Some(share) = self.least_squares(right) else { return };
        for (j, share) in share.iter().enumerate() {
            for k in 0..n {
                for c in 0..3 {
                    out[k][c] -= share * self.images[j][k][c];
                }
            }
        }
    }

    fn product(&self, a: &[Vec3], b: &[Vec3]) -> f64 {
        let term = |k: usize| self.weight[k] * (a[k][0] * b[k][0] + a[k][1] * b[k][1] + a[k][2] * b[k][2]);
        (0..a.len()).map(term).sum()
    }

    /// Solves the normal equations by Cholesky, scaled to a unit diagonal; `None` where there is nothing to combine.
    fn least_squares(&self, right: Vec<f64>) -> Option<Vec<f64>> {
        let m = right.len();
        let scale: Vec<f64> = (0..m).map(|j| self.gram[j * self.window + j].sqrt()).collect();
        if m == 0 || scale.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
            return None;
        }
        let mut l = vec![0.0; m * m];
        for i in 0..m {
            for j in 0..=i {
                let mut s = self.gram[i * self.window + j] / (scale[i] * scale[j]);
                if i == j {
                    s += 1e-12;
                }
                for k in 0..j {
                    s -= l[i * m + k] * l[j * m + k];
                }
                if i == j {
                    if s <= 0.0 {
                        return None;
                    }
                    l[i * m + i] = s.sqrt();
                } else {
                    l[i * m + j] = s / l[j * m + j];
                }
            }
        }
        let mut y: Vec<f64> = right.iter().zip(&scale).map(|(r, s)| r / s).collect();
        for i in 0..m {
            for k in 0..i {
                y[i] -= l[i * m + k] * y[k];
            }
            y[i] /= l[i * m + i];
        }
        for i in (0..m).rev() {
            for k in i + 1..m {
                y[i] -= l[k * m + i] * y[k];
            }
            y[i] /= l[i * m + i];
        }
        let shares: Vec<f64> = y.iter().zip(&scale).map(|(y, s)| y / s).collect();
        shares.iter().all(|s| s.is_finite()).then_some(shares)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::families::Random;

    /// On an affine map of dimension six a window of six finds the fixed point in eight steps, where the plain iteration
    /// with a factor of 0.99 would need thousands.
    #[test]
    fn an_affine_map_is_solved_in_as_many_steps_as_it_has_dimensions() {
        let mut random = Random::new(4);
        let factors: Vec<f64> = (0..6).map(|i| 0.99 - 0.15 * i as f64).collect();
        let shift: Vec<f64> = (0..6).map(|_| random.normal()).collect();
        let map = |x: &[Vec3]| -> Vec<Vec3> {
            (0..2).map(|k| [0, 1, 2].map(|c| factors[3 * k + c] * x[k][c] + shift[3 * k + c])).collect()
        };
        let mut anderson = Anderson::new(6, vec![1.0, 2.0]);
        let mut x = vec![[0.0; 3]; 2];
        for _ in 0..8 {
            let g = map(&x);
            let old = x.clone();
            anderson.advance(&old, &g, &mut x);
        }
        for k in 0..2 {
            for c in 0..3 {
                let fixed = shift[3 * k + c] / (1.0 - factors[3 * k + c]);
                assert!((x[k][c] - fixed).abs() < 1e-6 * fixed.abs(), "{} {fixed}", x[k][c]);
            }
        }
    }
}
