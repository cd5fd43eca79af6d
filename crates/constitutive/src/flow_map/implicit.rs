//! Backward Euler of the flow: the stress at the end of the step drives it.

use super::{ReturnMap, softplus};
use crate::shear_flow::ShearFlow;

/// Map for a trial stress above yield, positive finite step and modulus.
///
/// Solves `x + X x^{1/n} = 1` for the fraction `x = Φ(h)/Φ*` left of the excess. In `w = ln x` it reads
/// `ln(e^w + e^{ln X + w/n}) = 0`: increasing and convex with known curvature, so Halley's iteration from the upper bound
/// `min(0, −n ln X)` converges in two to four steps, for every `n` and over- or underflowing `X`.
#[inline]
pub(super) fn return_map(flow: &ShearFlow, trial: f64, mu_hat: f64, dt: f64) -> ReturnMap {
    let excess = trial - flow.yield_norm();
    if flow.consistency() == 0.0 {
        return ReturnMap { stress: flow.yield_norm(), by_trial: 0.0, by_modulus: 0.0 };
    }
    let p = flow.inverse_index();
    let ln_excess = excess.ln();
    let ln_x = (2.0 * dt * mu_hat).ln() - ln_excess + (ln_excess - flow.ln_consistency()) * p;
    let w = ln_fraction(ln_x, p);
    let fraction = w.exp();
    let lost = -w.exp_m1();
    let by_trial = flow.index() * fraction / (flow.index() * fraction + lost);
    ReturnMap {
        stress: flow.yield_norm() + excess * fraction,
        by_trial,
        by_modulus: -excess * lost / mu_hat * by_trial,
    }
}

/// Logarithm `w ≤ 0` of the fraction `x` that solves `x + X x^p = 1`: what one implicit step of power-law damping leaves.
///
/// - `ln_x`: logarithm of `X`, any number (−∞: nothing is lost)
/// - `p`: exponent, > 0
#[inline]
#[must_use]
pub fn ln_fraction(ln_x: f64, p: f64) -> f64 {
    if p == 1.0 {
        return -softplus(ln_x);
    }
    let mut w = (-ln_x / p).min(0.0);
    for _ in 0..60 {
        // ln(e^w + e^z) = w + softplus(z − w); the slope is the mean of 1 and p weighted by the two terms
        let d = ln_x + (p - 1.0) * w;
        let e = (-d.abs()).exp();
        let value = w + d.max(0.0) + e.ln_1p();
        let share = if d > 0.0 { 1.0 / (1.0 + e) } else { e / (1.0 + e) };
        let slope = 1.0 + (p - 1.0) * share;
        // Halley's correction; the curvature is (p − 1)² share (1 − share)
        let newton = value / slope;
        let bend = 0.5 * newton * (p - 1.0) * (p - 1.0) * share * (1.0 - share) / slope;
        let step = newton / (1.0 - bend).max(0.5);
        w -= step;
        if step.abs() <= 1e-5 * w.abs().min(1.0) && step.abs() < 1e-5 {
            // third order: the next step would be below round-off
            break;
        }
    }
    w.min(0.0)
}
