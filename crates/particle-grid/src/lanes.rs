//! Four numbers that travel together: one 256-bit register where the machine has one, the same bits where it has not.

use std::ops::{Add, AddAssign, Mul};

/// Four `f64` side by side, aligned for one vector register.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(align(32))]
pub struct Lanes(pub [f64; 4]);

impl Lanes {
    /// Four zeros.
    pub const ZERO: Lanes = Lanes([0.0; 4]);

    /// The same number four times.
    #[inline(always)]
    #[must_use]
    pub fn splat(x: f64) -> Self {
        Lanes([x; 4])
    }

    /// Sum of the four in a fixed order.
    #[inline(always)]
    #[must_use]
    pub fn sum(self) -> f64 {
        let a = self.0;
        (a[0] + a[2]) + (a[1] + a[3])
    }
}

impl Add for Lanes {
    type Output = Lanes;
    #[inline(always)]
    fn add(self, o: Lanes) -> Lanes {
        let (a, b) = (self.0, o.0);
        Lanes([a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]])
    }
}

impl AddAssign for Lanes {
    #[inline(always)]
    fn add_assign(&mut self, o: Lanes) {
        *self = *self + o;
    }
}

impl Mul for Lanes {
    type Output = Lanes;
    #[inline(always)]
    fn mul(self, o: Lanes) -> Lanes {
        let (a, b) = (self.0, o.0);
        Lanes([a[0] * b[0], a[1] * b[1], a[2] * b[2], a[3] * b[3]])
    }
}

impl Mul<f64> for Lanes {
    type Output = Lanes;
    #[inline(always)]
    fn mul(self, s: f64) -> Lanes {
        self * Lanes::splat(s)
    }
}
