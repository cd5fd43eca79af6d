//! Exact relaxation of the trial stress.

use super::{ReturnMap, softplus};
use crate::shear_flow::ShearFlow;

/// `ln(Φ(h)/Φ*)` of an excess that relaxes by `ln X = ln(2hμ̂/Φ*) + ln(Φ*/η)/n`; −∞ when extinct.
///
/// With `m = (n−1)/n`: `Φ(h) = Φ* (1 − mX)₊^{1/m}`, `Φ* e^{−X}` at `m = 0`. `log1p` is accurate for every other `m`, so the
/// branch at `n = 1` exactly makes no jump.
#[inline]
pub(super) fn ln_decay(flow: &ShearFlow, ln_x: f64) -> f64 {
    let m = 1.0 - flow.inverse_index();
    if m == 0.0 {
        -ln_x.exp()
    } else if m > 0.0 {
        let y = m * ln_x.min(700.0).exp();
        if y >= 1.0 { f64::NEG_INFINITY } else { (-y).ln_1p() / m }
    } else {
        softplus((-m).ln() + ln_x) / m
    }
}

/// Map for a trial stress above yield, positive finite step and modulus.
#[inline]
pub(super) fn return_map(flow: &ShearFlow, trial: f64, mu_hat: f64, dt: f64) -> ReturnMap {
    let excess = trial - flow.yield_norm();
    if flow.consistency() == 0.0 {
        return ReturnMap { stress: flow.yield_norm(), by_trial: 0.0, by_modulus: 0.0 };
    }
    let p = flow.inverse_index();
    let ln_excess = excess.ln();
    let ln_rate = (ln_excess - flow.ln_consistency()) * p;
    let ln_ratio = ln_decay(flow, (2.0 * dt * mu_hat).ln() - ln_excess + ln_rate);
    ReturnMap {
        stress: flow.yield_norm() + excess * ln_ratio.exp(),
        by_trial: (ln_ratio * p).exp(),
        by_modulus: -2.0 * dt * (ln_ratio * p + ln_rate).exp(),
    }
}
