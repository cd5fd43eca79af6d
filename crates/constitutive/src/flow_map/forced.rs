//! Constant loading over the step, plastic flow exact along it.

use super::{ReturnMap, driven};
use crate::shear_flow::ShearFlow;

/// State of the scalar flow at some time, with derivatives by the loading rate and by the modulus.
#[derive(Clone, Copy)]
struct Point {
    value: f64,
    by_loading: f64,
    by_modulus: f64,
}

/// Map for a positive finite step and modulus, trial or previous stress above yield.
///
/// Loading `a = (s* − s₀)/h`. A previous stress beyond yield in the opposite direction first relaxes there. The stress does not change
/// sign within a step: where fast flow followed by unloading would turn it round, it ends at zero.
pub(super) fn return_map(flow: &ShearFlow, trial: f64, previous: f64, mu_hat: f64, dt: f64) -> ReturnMap {
    let previous = if previous.is_finite() { previous } else { trial };
    let yield_norm = flow.yield_norm();
    let loading = (trial - previous) / dt;
    let end = if previous < -yield_norm && loading > 0.0 {
        // mirrored: excess ψ = −s − σ_Y ≥ 0 unloads at the rate a until it is gone, then loading goes on from −σ_Y
        let reverse = driven::advance(flow, -previous - yield_norm, -loading, mu_hat, dt);
        match reverse.unloaded_at {
            None => Point {
                value: -reverse.excess - 2.0 * yield_norm,
                by_loading: reverse.by_loading,
                by_modulus: -reverse.by_modulus,
            },
            Some(gone) => {
                let rest = driven::advance(flow, -2.0 * yield_norm, loading, mu_hat, dt - gone.time);
                let speed = rest.end_rate;
                Point {
                    value: rest.excess,
                    // the time of unloading was differentiated by the mirrored loading −a
                    by_loading: rest.by_loading + speed * gone.by_loading,
                    by_modulus: rest.by_modulus - speed * gone.by_modulus,
                }
            }
        }
    } else {
        let end = driven::advance(flow, previous - yield_norm, loading, mu_hat, dt);
        Point { value: end.excess, by_loading: end.by_loading, by_modulus: end.by_modulus }
    };
    let stress = yield_norm + end.value;
    if stress <= 0.0 {
        // flow early in the step took more than unloading leaves: nothing remains along this direction
        return ReturnMap { stress: 0.0, by_trial: 0.0, by_modulus: 0.0 };
    }
    ReturnMap {
        stress: stress.min(trial.max(previous.abs())),
        by_trial: (end.by_loading / dt).clamp(0.0, 1.0),
        by_modulus: end.by_modulus.min(0.0),
    }
}
