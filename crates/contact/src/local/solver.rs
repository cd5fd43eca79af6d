//! The order in which the local methods are tried, and the residual that decides between their answers.

use super::{enumerative, newton, wide};
use crate::block::{Block, Vec3, invert, mat_vec, max_abs, norm_squared, trace};
use crate::law::{natural_map, project_cone};
use serde::{Deserialize, Serialize};

/// Which local method goes first; the other one is the fall-back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum LocalMethod {
    /// Exact cases with the scalar sliding equation: no start needed, the fastest (measured in the bench `mfb_local`).
    #[default]
    Enumerative,
    /// Damped Newton on the Fischer–Burmeister function from the warm start.
    Newton,
}

/// One contact's own block, prepared for repeated local solves.
#[derive(Clone, Copy, Debug)]
pub struct LocalContact {
    /// Own Delassus block [1/kg].
    pub block: Block,
    /// Friction; negative for a bilateral contact.
    pub friction: f64,
    /// Weight of the velocity, `3/tr W_kk` [kg]; 0 marks a contact that no impulse can move.
    pub rho: f64,
    /// Inverse of the block for bilateral contacts.
    inverse: Block,
}

/// A local answer.
#[derive(Clone, Copy, Debug)]
pub struct LocalSolution {
    /// Impulse [N s].
    pub impulse: Vec3,
    /// Natural-map residual with `ρ = 3/tr W`, relative to `max(‖r‖, ρ‖b‖)`.
    pub residual: f64,
    /// Whether the fall-back had to help.
    pub fell_back: bool,
}

/// Residual below which a local answer is accepted without the fall-back.
const ACCEPT: f64 = 1e-12;

/// Dampings of the last fall-back, relative to the mean diagonal, and steps with each.
const DAMPINGS: [f64; 4] = [1e-3, 1e-6, 1e-9, 1e-12];
const PROXIMAL_STEPS: usize = 6;

impl LocalContact {
    /// Prepares a contact.
    #[must_use]
    pub fn new(block: &Block, friction: f64) -> Self {
        let t = trace(block);
        let rho = if t > 0.0 && t.is_finite() { 3.0 / t } else { 0.0 };
        let inverse = if friction < 0.0 {
            // a bilateral contact with a singular block is damped by round-off of its size
            invert(block, 1e-14 * max_abs(block)).unwrap_or_else(|| {
                let mut m = *block;
                for i in 0..3 {
                    m[4 * i] += 1e-12 * max_abs(block) + f64::MIN_POSITIVE;
                }
                invert(&m, 0.0).unwrap_or([0.0; 9])
            })
        } else {
            [0.0; 9]
        };
        LocalContact { block: *block, friction, rho, inverse }
    }

    /// Relative natural-map residual of `r` for the velocity `b`.
    #[must_use]
    pub fn residual(&self, b: &Vec3, r: &Vec3) -> f64 {
        let mut u = mat_vec(&self.block, r);
        for i in 0..3 {
            u[i] += b[i];
        }
        let f = norm_squared(&natural_map(r, &u, self.friction, self.rho)).sqrt();
        let size = norm_squared(r).sqrt().max(self.rho * norm_squared(b).sqrt());
        if size > 0.0 { f / size } else { f }
    }

    /// Solves for the impulse; `start` is the last impulse of this contact.
    #[must_use]
    pub fn solve(&self, b: &Vec3, start: &Vec3, method: LocalMethod) -> LocalSolution {
        self.solve_to(b, start, method, ACCEPT)
    }

    /// [`solve`](Self::solve) to the relative residual `accept`: what reaches it is not refined further. Below the digits that
    /// the exact cases keep in an ill-conditioned block, the fall-backs cost many times the case.
    #[must_use]
    pub fn solve_to(&self, b: &Vec3, start: &Vec3, method: LocalMethod, accept: f64) -> LocalSolution {
        if self.friction < 0.0 {
            let r = mat_vec(&self.inverse, b);
            let impulse = [-r[0], -r[1], -r[2]];
            return LocalSolution { impulse, residual: self.residual(b, &impulse), fell_back: false };
        }
        if b[0] >= 0.0 || self.rho == 0.0 || self.block[0] <= 0.0 {
            // take-off (zero solves De Saxcé's form); or nothing can move, and the contact is inactive
            return LocalSolution { impulse: [0.0; 3], residual: 0.0, fell_back: false };
        }
        let mut best = LocalSolution { impulse: [0.0; 3], residual: f64::INFINITY, fell_back: false };
        let consider = |r: Vec3, best: &mut LocalSolution| {
            let e = self.residual(b, &r);
            if e < best.residual {
                *best = LocalSolution { impulse: r, residual: e, fell_back: best.fell_back };
            }
        };
        if method == LocalMethod::Newton && self.friction > 0.0 {
            consider(self.newton(b, start), &mut best);
            if best.residual <= accept {
                return best;
            }
            best.fell_back = true;
        }
        for r in enumerative::candidates(&self.block, b, self.friction, self.slip_rate(b, start)).as_slice() {
            consider(*r, &mut best);
        }
        if best.residual <= accept || self.friction == 0.0 {
            return best;
        }
        best.fell_back = true;
        for r in [best.impulse, *start, [0.0; 3]] {
            consider(self.newton(b, &project_cone(&r, self.friction)), &mut best);
            if best.residual <= accept {
                return best;
            }
        }
        for damping in DAMPINGS {
            for r in self.damped(b, &best.impulse, damping) {
                consider(r, &mut best);
            }
            if best.residual <= accept {
                return best;
            }
        }
        for r in wide::candidates(&self.block, b, self.friction) {
            consider(r, &mut best);
        }
        best
    }

    /// Iterates of the proximal-point method, whose blocks `W + ε` are as well conditioned as `ε` makes them: where the own
    /// block is of rank one within round-off and the contact nearly jammed, nothing else is left.
    fn damped(&self, b: &Vec3, start: &Vec3, damping: f64) -> [Vec3; PROXIMAL_STEPS] {
        let shift = damping * trace(&self.block) / 3.0;
        let mut w = self.block;
        for i in 0..3 {
            w[4 * i] += shift;
        }
        let near = LocalContact { block: w, ..*self };
        let mut r = *start;
        std::array::from_fn(|_| {
            let moved = [0, 1, 2].map(|i| b[i] - shift * r[i]);
            let mut least = f64::INFINITY;
            let mut next = [0.0; 3];
            let found = enumerative::candidates(&w, &moved, self.friction, 0.0);
            let polished = near.newton(&moved, &r);
            for candidate in found.as_slice().iter().chain([&polished]) {
                let residual = near.residual(&moved, candidate);
                if residual < least {
                    (least, next) = (residual, *candidate);
                }
            }
            r = next;
            r
        })
    }

    fn newton(&self, b: &Vec3, start: &Vec3) -> Vec3 {
        let scale = norm_squared(start).sqrt().max(self.rho * norm_squared(b).sqrt());
        newton::refine(&self.block, b, self.friction, self.rho, start, 1e-15 * scale, 20).0
    }

    /// Slip rate over tangential impulse at the start, the first guess of the sliding root; 0 when not sliding.
    fn slip_rate(&self, b: &Vec3, start: &Vec3) -> f64 {
        let tt = start[1] * start[1] + start[2] * start[2];
        if tt == 0.0 {
            return 0.0;
        }
        let mut u = mat_vec(&self.block, start);
        for i in 0..3 {
            u[i] += b[i];
        }
        -(u[1] * start[1] + u[2] * start[2]) / tt
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::{Config, TestRunner};

    fn random_block(h: &[f64], rows: usize, floor: f64) -> Block {
        let mut w = [0.0; 9];
        for i in 0..3 {
            for j in 0..3 {
                for k in 0..rows {
                    w[3 * i + j] += h[rows * i + k] * h[rows * j + k];
                }
            }
            w[4 * i] += floor;
        }
        w
    }

    /// 1e5 random blocks, from well conditioned to rank two and one: exact law to 1e-11, no failure, by either method.
    #[test]
    fn hundred_thousand_blocks_without_failure() {
        for method in [LocalMethod::Enumerative, LocalMethod::Newton] {
            let config = Config { cases: 100_000, failure_persistence: None, ..Config::default() };
            let mut runner = TestRunner::new(config);
            let strategy = (
                proptest::collection::vec(-1.0..1.0f64, 12),
                proptest::array::uniform3(-2.0..2.0f64),
                0.01..1.5f64,
                1usize..5,
                -16.0..0.0f64,
                -9.0..9.0f64,
            );
            let worst = std::cell::Cell::new(0.0_f64);
            runner
                .run(&strategy, |(h, b, nu, rows, floor, size)| {
                    let unit = 10f64.powf(size);
                    let w = random_block(&h, rows, 10f64.powf(floor)).map(|v| v * unit);
                    let local = LocalContact::new(&w, nu);
                    let s = local.solve(&b, &[0.0; 3], method);
                    worst.set(worst.get().max(s.residual));
                    prop_assert!(s.residual <= 1e-11, "residual {} for {w:?} {b:?} {nu}", s.residual);
                    Ok(())
                })
                .unwrap();
            assert!(worst.get() > 0.0);
        }
    }

    /// Both methods agree where the block is well conditioned.
    #[test]
    fn methods_agree() {
        let mut runner = TestRunner::new(Config { cases: 2000, failure_persistence: None, ..Config::default() });
        let strategy =
            (proptest::collection::vec(-1.0..1.0f64, 12), proptest::array::uniform3(-2.0..2.0f64), 0.01..1.2f64);
        runner
            .run(&strategy, |(h, b, nu)| {
                let w = random_block(&h, 4, 0.5);
                let local = LocalContact::new(&w, nu);
                let e = local.solve(&b, &[0.0; 3], LocalMethod::Enumerative).impulse;
                let n = local.solve(&b, &[0.0; 3], LocalMethod::Newton).impulse;
                for i in 0..3 {
                    prop_assert!((e[i] - n[i]).abs() < 1e-9 * (1.0 + e[0]), "{e:?} {n:?}");
                }
                Ok(())
            })
            .unwrap();
    }

    #[test]
    fn frozen_and_bilateral_contacts() {
        let frozen = LocalContact::new(&[0.0; 9], 0.5).solve(&[-1.0, 0.3, 0.0], &[1.0; 3], LocalMethod::Enumerative);
        assert_eq!(frozen.impulse, [0.0; 3]);
        let w = [2.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 4.0];
        let glued = LocalContact::new(&w, -1.0).solve(&[1.0, 2.0, -4.0], &[0.0; 3], LocalMethod::Newton);
        assert_eq!(glued.impulse, [-0.5, -2.0, 1.0]);
    }

    /// A block on a plane inclined by its friction angle: sticks just below, slides just above with u_T = g h (sin − ν cos).
    #[test]
    fn incline_threshold() {
        let nu: f64 = 0.3;
        let w = crate::block::IDENTITY;
        for (angle, slides) in [(nu.atan() - 1e-9, false), (nu.atan() + 1e-9, true), (0.55, true)] {
            let gh = 9.81e-3;
            let b = [-gh * angle.cos(), gh * angle.sin(), 0.0];
            let r = LocalContact::new(&w, nu).solve(&b, &[0.0; 3], LocalMethod::Enumerative).impulse;
            let u = [r[0] + b[0], r[1] + b[1]];
            let expected = if slides { gh * (angle.sin() - nu * angle.cos()) } else { 0.0 };
            assert!((u[1] - expected).abs() < 1e-17 && u[0].abs() < 1e-17, "{u:?} {expected}");
        }
    }
}
