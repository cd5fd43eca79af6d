//! The fit on curves whose parameters are known.

use super::*;

fn rates(count: usize, low: f64, high: f64) -> Vec<f64> {
    (0..count).map(|i| low * (high / low).powf(i as f64 / (count - 1) as f64)).collect()
}

/// Deterministic, roughly normal noise of unit variance.
fn noise(seed: u64, i: usize) -> f64 {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(i as u64 + 1);
    let mut sum = 0.0;
    for _ in 0..12 {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        sum += (state >> 11) as f64 / (1u64 << 53) as f64;
    }
    sum - 6.0
}

fn curve(yield_stress: f64, consistency: f64, index: f64) -> FlowCurve {
    FlowCurve::Rheometer { yield_stress, consistency, index }
}

#[test]
fn clean_curves_are_recovered_with_their_model() {
    for (liquid, model) in [
        (curve(18.4, 17.8, 0.22), FlowModel::HerschelBulkley),
        (curve(0.9707, 0.3836, 0.5173), FlowModel::HerschelBulkley),
        (curve(17.3, 1.41, 0.98), FlowModel::HerschelBulkley),
        (curve(5.0, 0.2, 1.0), FlowModel::Bingham),
        (curve(0.0, 3.0, 0.6), FlowModel::PowerLaw),
        (curve(0.0, 8.9e-4, 1.0), FlowModel::Newtonian),
        (curve(0.0, 0.01, 1.7), FlowModel::PowerLaw),
    ] {
        let rates = rates(25, 0.01, 1000.0);
        let stresses: Vec<f64> = rates.iter().map(|r| liquid.shear_stress(*r)).collect();
        let fit = fit_flow_curve(&rates, &stresses, &FitSettings::default()).unwrap();
        assert_eq!(fit.model, model, "{liquid:?}: {fit:?}");
        let (tau, k, n) = liquid.raw();
        assert!((fit.yield_stress.value - tau).abs() <= 1e-7 * (tau + k), "{fit:?}");
        approx::assert_relative_eq!(fit.consistency.value, k, max_relative = 1e-7);
        approx::assert_relative_eq!(fit.index.value, n, max_relative = 1e-7);
        assert!(fit.converged && fit.outliers() == 0);
    }
}

#[test]
fn intervals_cover_the_truth_as_often_as_they_say() {
    let liquid = curve(18.4, 17.8, 0.35);
    let rates = rates(24, 0.01, 300.0);
    for robust in [false, true] {
        let (mut covered, mut trials) = ([0; 3], 0);
        for seed in 0..300 {
            let stresses: Vec<f64> = rates
                .iter()
                .enumerate()
                .map(|(i, r)| liquid.shear_stress(*r) * (0.03 * noise(seed, i)).exp())
                .collect();
            let settings = FitSettings { model: Some(FlowModel::HerschelBulkley), robust, confidence: 0.95 };
            let fit = fit_flow_curve(&rates, &stresses, &settings).unwrap();
            trials += 1;
            for (k, (estimate, truth)) in
                [(fit.yield_stress, 18.4), (fit.consistency, 17.8), (fit.index, 0.35)].into_iter().enumerate()
            {
                covered[k] += usize::from(estimate.low <= truth && truth <= estimate.high.unwrap());
            }
        }
        for c in covered {
            let share = c as f64 / f64::from(trials);
            assert!((0.88..=0.99).contains(&share), "robust {robust}: {share}");
        }
    }
}

#[test]
fn outliers_are_named_and_do_little_harm() {
    let liquid = curve(10.0, 4.0, 0.5);
    let rates = rates(30, 0.01, 1000.0);
    let mut stresses: Vec<f64> =
        rates.iter().enumerate().map(|(i, r)| liquid.shear_stress(*r) * (0.01 * noise(7, i)).exp()).collect();
    stresses[4] *= 2.0;
    stresses[20] *= 0.4;
    let settings = FitSettings { model: Some(FlowModel::HerschelBulkley), ..FitSettings::default() };
    let fit = fit_flow_curve(&rates, &stresses, &settings).unwrap();
    assert!(fit.points[4].weight < 0.1 && fit.points[20].weight < 0.1);
    approx::assert_relative_eq!(fit.yield_stress.value, 10.0, max_relative = 0.05);
    approx::assert_relative_eq!(fit.index.value, 0.5, max_relative = 0.05);
    let plain = fit_flow_curve(&rates, &stresses, &FitSettings { robust: false, ..settings }).unwrap();
    assert!((plain.index.value - 0.5).abs() > (fit.index.value - 0.5).abs());
}

#[test]
fn an_unsupported_yield_stress_ends_at_zero_with_an_interval_from_there() {
    let rates = rates(15, 1.0, 100.0);
    let stresses: Vec<f64> =
        rates.iter().enumerate().map(|(i, r)| 2.0 * r.powf(0.7) * (0.02 * noise(3, i)).exp()).collect();
    let settings = FitSettings { model: Some(FlowModel::HerschelBulkley), ..FitSettings::default() };
    let fit = fit_flow_curve(&rates, &stresses, &settings).unwrap();
    assert!(fit.yield_stress.low == 0.0 && fit.yield_stress.high.unwrap() < 1.0);
    assert!(fit.yield_stress.value.is_finite() && fit.index.value > 0.6);
}

#[test]
fn poor_data_are_refused_or_fitted_without_an_interval() {
    let settings = FitSettings::default();
    assert!(fit_flow_curve(&[1.0, 2.0], &[1.0], &settings).is_err());
    assert!(
        fit_flow_curve(&[1.0, -2.0, 3.0], &[1.0, 2.0, 3.0], &settings).unwrap_err().to_string().contains("point 2")
    );
    assert!(fit_flow_curve(&[1.0, 1.0, 1.0], &[1.0, 1.1, 0.9], &settings).is_err());
    assert!(fit_flow_curve(&[1.0, 2.0, 3.0], &[1.0, f64::NAN, 3.0], &settings).is_err());
    let three = fit_flow_curve(&[0.1, 1.0, 10.0], &[3.0, 5.0, 12.0], &settings).unwrap();
    assert!(three.index.value.is_finite() && three.rms < 1e-6);
    assert_eq!(three.index.high, None);
}
