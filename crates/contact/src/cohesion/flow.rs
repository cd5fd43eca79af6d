//! Optional tangential law of a wet contact: a Herschel–Bulkley liquid between two strands resists sliding.
//!
//! `‖r_T‖ ≤ y + e‖u_T‖ⁿ` with equality and opposition when sliding, `u_T = W_TT r_T + b_T`. One monotone scalar equation
//! in the drag `ζ = ‖r_T‖/‖u_T‖` (spec A.7), solved by bisection: it cannot fail.

use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// The law of one contact, in impulses over the step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TangentialFlow {
    /// Yield impulse `y` [N s].
    pub yield_impulse: f64,
    /// Viscous factor `e` [N s (s/m)ⁿ].
    pub viscous: f64,
    /// Flow index `n` [1].
    pub index: f64,
}

impl TangentialFlow {
    /// The law of a liquid between two strands: `y = h ℓ ¾π r̄ √(2/3) τ_Y`, `e = h ℓ ¾π r̄ η / max(2r̄, g)ⁿ`.
    #[must_use]
    pub fn of_liquid(
        dt: f64,
        length: f64,
        radius: f64,
        gap: f64,
        consistency: f64,
        index: f64,
        yield_stress: f64,
    ) -> Self {
        let size = dt * length * 0.75 * PI * radius;
        TangentialFlow {
            yield_impulse: size * (2.0_f64 / 3.0).sqrt() * yield_stress,
            viscous: size * consistency / (2.0 * radius).max(gap).max(f64::MIN_POSITIVE).powf(index),
            index,
        }
    }

    /// Tangential impulse for the block `w` (2×2, row-major, symmetric positive definite) and free velocity `b`.
    #[must_use]
    pub fn impulse(&self, w: &[f64; 4], b: &[f64; 2]) -> [f64; 2] {
        let speed = b[0].hypot(b[1]);
        let det = w[0] * w[3] - w[1] * w[2];
        if speed == 0.0 || !(det > 0.0) || !speed.is_finite() {
            return [0.0; 2];
        }
        let stick = [-(w[3] * b[0] - w[1] * b[1]) / det, -(w[0] * b[1] - w[2] * b[0]) / det];
        if stick[0].hypot(stick[1]) <= self.yield_impulse {
            return stick;
        }
        let slip = |zeta: f64| -> [f64; 2] {
            // (I + ζ W)⁻¹ b
            let m = [1.0 + zeta * w[0], zeta * w[1], zeta * w[2], 1.0 + zeta * w[3]];
            let d = m[0] * m[3] - m[1] * m[2];
            [(m[3] * b[0] - m[1] * b[1]) / d, (m[0] * b[1] - m[2] * b[0]) / d]
        };
        let excess = |zeta: f64| -> f64 {
            let u = slip(zeta);
            let s = u[0].hypot(u[1]);
            zeta * s - self.yield_impulse - self.viscous * s.powf(self.index)
        };
        let unit = 2.0 / (w[0] + w[3]);
        let (mut lo, mut hi) = (unit, unit);
        while excess(lo) > 0.0 && lo > 1e-280 {
            lo *= 1e-3;
        }
        while excess(hi) < 0.0 && hi < 1e280 {
            hi *= 1e3;
        }
        for _ in 0..200 {
            let mid = (lo.ln() * 0.5 + hi.ln() * 0.5).exp();
            if mid <= lo || mid >= hi {
                break;
            }
            if excess(mid) < 0.0 { lo = mid } else { hi = mid }
        }
        let u = slip(hi);
        [-hi * u[0], -hi * u[1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Sliding: impulse opposes the slip with exactly the law's magnitude. Sticking: below yield and no slip.
        #[test]
        fn the_law_holds(a in 0.1..3.0f64, c in 0.1..3.0f64, s in -0.9..0.9f64, b in proptest::array::uniform2(-2.0..2.0f64), y in 0.0..2.0f64, e in 0.0..3.0f64, n in 0.2..1.5f64) {
            let w = [a, s * (a * c).sqrt(), s * (a * c).sqrt(), c];
            let law = TangentialFlow { yield_impulse: y, viscous: e, index: n };
            let r = law.impulse(&w, &b);
            let u = [w[0] * r[0] + w[1] * r[1] + b[0], w[2] * r[0] + w[3] * r[1] + b[1]];
            let (rs, us) = (r[0].hypot(r[1]), u[0].hypot(u[1]));
            let bound = y + e * us.powf(n);
            prop_assert!(rs <= bound + 1e-9);
            if us > 1e-6 {
                prop_assert!((rs - bound).abs() < 1e-8 * (1.0 + bound), "{rs} {bound}");
                prop_assert!((r[0] * u[1] - r[1] * u[0]).abs() < 1e-9 && r[0] * u[0] + r[1] * u[1] <= 1e-12);
            }
        }
    }
}
