//! Kinetic tensor of the fluctuations about the homogeneous flow that the grains themselves show.
//!
//! The published tensor takes velocities against the imposed flow, so that a single grain in free flight and two grains in a
//! central collision already have a "stress", against the manual's own expectation. Here the flow is the affine field that fits
//! the velocities best (weighted by mass); what one or two grains do is then flow, not fluctuation, and the tensor vanishes.
//! In a sheared sample of many grains the two definitions agree up to a share of order one over the number of grains.

use crate::tensor::Tensor2;

/// Moments of mass, position and velocity.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FlowSums {
    mass: f64,
    position: [f64; 2],
    velocity: [f64; 2],
    /// `Σ m x xᵀ`, upper triangle.
    second: [f64; 3],
    /// `Σ m v xᵀ`.
    mixed: [f64; 4],
    /// `Σ m v vᵀ`, upper triangle.
    kinetic: [f64; 3],
}

impl FlowSums {
    #[inline(always)]
    pub fn grain(&mut self, m: f64, x: [f64; 2], v: [f64; 2]) {
        let (mx, mv) = ([m * x[0], m * x[1]], [m * v[0], m * v[1]]);
        self.mass += m;
        for k in 0..2 {
            self.position[k] += mx[k];
            self.velocity[k] += mv[k];
        }
        self.second[0] += mx[0] * x[0];
        self.second[1] += mx[0] * x[1];
        self.second[2] += mx[1] * x[1];
        self.mixed[0] += mv[0] * x[0];
        self.mixed[1] += mv[0] * x[1];
        self.mixed[2] += mv[1] * x[0];
        self.mixed[3] += mv[1] * x[1];
        self.kinetic[0] += mv[0] * v[0];
        self.kinetic[1] += mv[0] * v[1];
        self.kinetic[2] += mv[1] * v[1];
    }

    pub fn add(&mut self, o: &Self) {
        self.mass += o.mass;
        for k in 0..2 {
            self.position[k] += o.position[k];
            self.velocity[k] += o.velocity[k];
        }
        for k in 0..3 {
            self.second[k] += o.second[k];
            self.kinetic[k] += o.kinetic[k];
        }
        for k in 0..4 {
            self.mixed[k] += o.mixed[k];
        }
    }

    /// `Σ m v′ v′ᵀ` of the velocities left over by the best affine fit.
    pub fn fluctuation(&self) -> Tensor2 {
        if self.mass <= 0.0 {
            return Tensor2::ZERO;
        }
        let (x, v) = (self.position.map(|c| c / self.mass), self.velocity.map(|c| c / self.mass));
        // Moments about the centre of mass.
        let s = [
            self.second[0] - self.mass * x[0] * x[0],
            self.second[1] - self.mass * x[0] * x[1],
            self.second[2] - self.mass * x[1] * x[1],
        ];
        let c = [
            self.mixed[0] - self.mass * v[0] * x[0],
            self.mixed[1] - self.mass * v[0] * x[1],
            self.mixed[2] - self.mass * v[1] * x[0],
            self.mixed[3] - self.mass * v[1] * x[1],
        ];
        let mut k = [
            self.kinetic[0] - self.mass * v[0] * v[0],
            self.kinetic[1] - self.mass * v[0] * v[1],
            self.kinetic[2] - self.mass * v[1] * v[1],
        ];
        // Along each principal axis of the positions the fitted gradient takes its share, unless the grains lie in one line.
        let angle = 0.5 * (2.0 * s[1]).atan2(s[0] - s[2]);
        let (sin, cos) = angle.sin_cos();
        let scale = self.second[0] + self.second[2];
        for axis in [[cos, sin], [-sin, cos]] {
            let spread = s[0] * axis[0] * axis[0] + 2.0 * s[1] * axis[0] * axis[1] + s[2] * axis[1] * axis[1];
            if spread > 1e-12 * scale {
                let g = [c[0] * axis[0] + c[1] * axis[1], c[2] * axis[0] + c[3] * axis[1]];
                k[0] -= g[0] * g[0] / spread;
                k[1] -= g[0] * g[1] / spread;
                k[2] -= g[1] * g[1] / spread;
            }
        }
        // Differences of sums below their round-off are none.
        let noise = 64.0 * f64::EPSILON * (self.kinetic[0] + self.kinetic[2]);
        Tensor2([k[0], k[1], k[1], k[2]].map(|e| if e.abs() <= noise { 0.0 } else { e }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn affine_motion_has_no_fluctuation_and_noise_has_its_own() {
        let mut random = Random::new(1);
        let mut flow = FlowSums::default();
        let mut noisy = FlowSums::default();
        let mut expected = 0.0;
        for _ in 0..2000 {
            let x = [random.uniform() * 500.0 - 250.0, random.uniform() * 500.0 - 250.0];
            let v = [3.0 + 0.2 * x[0] - 0.7 * x[1], -1.0 + 0.4 * x[0] + 0.1 * x[1]];
            flow.grain(1.5, x, v);
            let e = [random.uniform() - 0.5, random.uniform() - 0.5];
            expected += 1.5 * e[0] * e[0];
            noisy.grain(1.5, x, [v[0] + e[0], v[1] + e[1]]);
        }
        assert!(flow.fluctuation().max_abs() < 1e-9 * noisy.kinetic[0]);
        assert!((noisy.fluctuation().0[0] / expected - 1.0).abs() < 0.01);
    }
}
