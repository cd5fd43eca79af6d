//! Two-dimensional stress tensors stored row-major, as they are written to tables.

use serde::{Deserialize, Serialize};
use std::ops::{Add, AddAssign, Mul, Neg, Sub};

/// A 2×2 tensor `[xx, xy, yx, yy]`; first index is the force component, second the position component.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Tensor2(pub [f64; 4]);

impl Tensor2 {
    /// The zero tensor.
    pub const ZERO: Self = Self([0.0; 4]);

    /// Returns the dyad `a bᵀ`.
    #[inline(always)]
    pub fn dyad(a: [f64; 2], b: [f64; 2]) -> Self {
        Self([a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]])
    }

    /// Returns `c` times the unit tensor.
    #[inline(always)]
    pub fn isotropic(c: f64) -> Self {
        Self([c, 0.0, 0.0, c])
    }

    /// Returns the tensor of a torque, `torque · [[0, -1/2], [1/2, 0]]` (manual, S1-22).
    #[inline(always)]
    pub fn torque(torque: f64) -> Self {
        Self([0.0, -0.5 * torque, 0.5 * torque, 0.0])
    }

    /// Largest magnitude of an entry.
    pub fn max_abs(&self) -> f64 {
        self.0.iter().fold(0.0, |m, v| m.max(v.abs()))
    }

    /// Half the trace: the pressure in the compression-positive sign.
    pub fn pressure(&self) -> f64 {
        0.5 * (self.0[0] + self.0[3])
    }

    /// Shear stress `τ = -σ_xy` (manual, S1-25).
    pub fn shear(&self) -> f64 {
        -self.0[1]
    }

    /// Difference of the off-diagonal entries.
    pub fn asymmetry(&self) -> f64 {
        self.0[1] - self.0[2]
    }
}

impl Add for Tensor2 {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + o.0[i]))
    }
}
impl Sub for Tensor2 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] - o.0[i]))
    }
}
impl Neg for Tensor2 {
    type Output = Self;
    fn neg(self) -> Self {
        self * -1.0
    }
}
impl AddAssign for Tensor2 {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        for i in 0..4 {
            self.0[i] += o.0[i];
        }
    }
}
impl Mul<f64> for Tensor2 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, c: f64) -> Self {
        Self(self.0.map(|v| v * c))
    }
}
