//! Properties that every flow map must have, and the tables of the specification.

use proptest::prelude::*;

use super::{FlowMap, ReturnMap};
use crate::flow_curve::FlowCurve;
use crate::shear_flow::ShearFlow;

fn flow(yield_stress: f64, consistency: f64, index: f64) -> ShearFlow {
    ShearFlow::new(&FlowCurve::J2 { yield_stress, consistency, index }).unwrap()
}

fn exact(law: &ShearFlow, trial: f64, mu_hat: f64, dt: f64) -> ReturnMap {
    law.return_map(FlowMap::Exact, trial, trial, mu_hat, dt)
}

/// Right-hand side `a − 2μ̂γ̇(s)` integrated by many small classical Runge–Kutta steps, in the stress (signed).
fn integrate(law: &ShearFlow, s0: f64, a: f64, mu_hat: f64, dt: f64, steps: usize) -> f64 {
    let rhs = |s: f64| a - 2.0 * mu_hat * law.rate(s.abs()) * s.signum();
    let h = dt / steps as f64;
    let mut s = s0;
    for _ in 0..steps {
        let k1 = rhs(s);
        let k2 = rhs(s + 0.5 * h * k1);
        let k3 = rhs(s + 0.5 * h * k2);
        let k4 = rhs(s + h * k3);
        s += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    }
    s
}

#[test]
fn the_table_of_the_specification() {
    let map = exact(&flow(319.0, 272.0, 0.22), 600.0, 2900.0, 1e-3);
    approx::assert_relative_eq!(map.stress, 585.608_672_4, max_relative = 1e-9);
    approx::assert_relative_eq!(map.by_trial, 0.821_304_326_5, max_relative = 1e-9);
    approx::assert_relative_eq!(map.by_modulus, -4.501_399_46e-3, max_relative = 1e-8);
    for (trial, mu_hat, dt, tau, eta, n, expected) in [
        (600.0, 2900.0, 1e-2, 319.0, 272.0, 0.22, 518.132_487_1),
        (100.0, 1e3, 1e-3, 16.813, 6.49, 0.5173, 32.189_767_64),
        (20.0, 1e4, 1e-4, 0.0, 10.0, 1.0, 16.374_615_06),
        (10.0, 100.0, 1e-3, 3.0, 2.0, 2.0, 9.616_399_685),
        (400.0, 4e3, 1e-3, 300.0, 28.0, 0.98, 360.391_573_4),
    ] {
        approx::assert_relative_eq!(exact(&flow(tau, eta, n), trial, mu_hat, dt).stress, expected, max_relative = 1e-9);
    }
}

#[test]
fn extinction_above_index_one_is_exact() {
    let law = flow(0.0, 1.0, 2.0);
    assert!((exact(&law, 1.0, 1.0, 0.9999).stress - 1e-8).abs() < 1e-15);
    let gone = exact(&law, 1.0, 1.0, 1.0001);
    assert_eq!((gone.stress, gone.by_trial, gone.by_modulus), (0.0, 0.0, -0.0));
}

#[test]
fn limits() {
    // rate-independent limits of n → 0: excess above η falls to η, below η nothing flows
    let sharp = flow(0.0, 272.0, 0.01);
    assert!((exact(&sharp, 100.0, 2900.0, 1e-3).stress - 100.0).abs() < 1e-9);
    assert!((exact(&sharp, 500.0, 2900.0, 1e-3).stress - 257.6).abs() < 20.0);
    for map in FlowMap::ALL {
        // perfectly plastic, and inviscid
        assert_eq!(
            flow(300.0, 0.0, 0.5).return_map(map, 400.0, 100.0, 1e3, 1e-3).stress,
            flow(300.0, 0.0, 0.5).yield_norm()
        );
        assert_eq!(flow(0.0, 0.0, 0.5).return_map(map, 400.0, 100.0, 1e3, 1e-3).stress, 0.0);
        // elastic below yield; zero stress; zero step; long step
        assert_eq!(flow(300.0, 5.0, 0.5).return_map(map, 100.0, 90.0, 1e3, 1e-3), ReturnMap::elastic(100.0));
        assert_eq!(flow(0.0, 5.0, 0.5).return_map(map, 0.0, 0.0, 1e3, 1e-3).radial(0.0), (1.0, 0.0, 0.0));
        assert_eq!(flow(3.0, 5.0, 0.5).return_map(map, 10.0, 9.0, 1e3, 0.0).stress, 10.0);
        let law = flow(300.0, 28.0, 0.98);
        assert!((law.return_map(map, 400.0, 400.0, 4e3, 1e6).stress / law.yield_norm() - 1.0).abs() < 1e-6);
        // nothing that is not a number leaves
        for trial in [f64::NAN, f64::INFINITY] {
            let out = law.return_map(map, trial, 1.0, 1e3, 1e-3);
            assert!(out.stress.is_finite() && out.by_trial.is_finite() && out.by_modulus.is_finite());
        }
    }
}

#[test]
fn index_one_is_reached_from_both_sides_without_a_jump() {
    for map in FlowMap::ALL {
        let at = |n: f64| flow(10.0, 100.0, n).return_map(map, 90.0, 60.0, 2900.0, 1e-3).stress;
        let here = at(1.0);
        for distance in [1e-15, 1e-12, 1e-9] {
            for n in [1.0 - distance, 1.0 + distance] {
                assert!((at(n) / here - 1.0).abs() < 1e-12 + 10.0 * distance, "{map:?} n = 1 ± {distance}");
            }
        }
        for n in [0.99, 1.01] {
            assert!((at(n * (1.0 + 1e-13)) / at(n * (1.0 - 1e-13)) - 1.0).abs() < 1e-11);
        }
    }
}

#[test]
fn the_forced_map_solves_its_equation() {
    let mut worst = 0.0f64;
    for n in [0.22, 0.5173, 0.98, 1.0, 1.5, 2.0] {
        for (s0, trial) in
            [(5.0, 30.0), (12.0, 14.0), (40.0, 41.0), (90.0, 60.0), (35.0, 8.0), (-60.0, 50.0), (-25.0, 3.0)]
        {
            for dt in [1e-3, 1e-2, 0.1] {
                let law = flow(12.0, 8.0, n);
                let mu_hat = 50.0;
                let reference = integrate(&law, s0, (trial - s0) / dt, mu_hat, dt, 40_000);
                if !reference.is_finite() {
                    continue; // too stiff for the explicit reference
                }
                let out = law.return_map(FlowMap::Forced, trial, s0, mu_hat, dt).stress;
                let error = (out - reference.max(0.0)).abs() / trial.max(s0.abs());
                worst = worst.max(error);
                assert!(error < 3e-6, "n {n} s0 {s0} trial {trial} dt {dt}: {out} against {reference}");
            }
        }
    }
    assert!(worst > 0.0);
}

#[test]
fn implicit_and_forced_keep_the_steady_stress_at_any_step() {
    for n in [0.22, 0.5173, 0.98, 1.0, 1.7] {
        for dt in [1e-5, 1e-3, 1e-1] {
            let law = flow(17.0, 6.5, n);
            let mu_hat = 1e3;
            let rate = 35.0;
            let steady = law.stress_at(rate);
            let loading = 2.0 * mu_hat * rate * dt;
            for map in [FlowMap::Implicit, FlowMap::Forced] {
                let out = law.return_map(map, steady + loading, steady, mu_hat, dt);
                approx::assert_relative_eq!(out.stress, steady, max_relative = 1e-12);
            }
        }
    }
}

fn any_law() -> impl Strategy<Value = ShearFlow> {
    (prop_oneof![Just(0.0), 0.1f64..1e3], -2.0f64..3.0, prop_oneof![Just(1.0), 0.05f64..4.0])
        .prop_map(|(tau, ln_eta, n)| flow(tau, 10f64.powf(ln_eta), n))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn bounded_and_finite_over_24_decades(law in any_law(), ln_excess in -27.0f64..27.0, ln_mu in -5.0f64..14.0,
                                          ln_dt in -20.0f64..3.0, start in -1.0f64..2.0) {
        let trial = law.yield_norm() + law.consistency() * ln_excess.exp();
        let (mu, dt) = (ln_mu.exp(), ln_dt.exp());
        for map in FlowMap::ALL {
            let out = law.return_map(map, trial, start * trial, mu, dt);
            prop_assert!(out.stress.is_finite() && out.by_trial.is_finite() && out.by_modulus.is_finite(), "{map:?} {out:?}");
            prop_assert!((0.0..=1.0).contains(&out.by_trial) && out.by_modulus <= 0.0);
            if map != FlowMap::Forced {
                prop_assert!(out.stress >= law.yield_norm() && out.stress <= trial);
            } else {
                prop_assert!(out.stress >= 0.0 && out.stress <= trial.max(start.abs() * trial));
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_the_map(law in any_law(), ln_excess in -2.0f64..3.0, ln_mu in 0.0f64..9.0,
                                        ln_dt in -14.0f64..-2.0, start in -0.9f64..1.8) {
        let excess = law.consistency() * ln_excess.exp();
        let trial = law.yield_norm() + excess;
        let (mu, dt) = (ln_mu.exp(), ln_dt.exp());
        let previous = start * trial;
        for map in FlowMap::ALL {
            let f = |s: f64, m: f64| law.return_map(map, s, previous, m, dt).stress;
            let out = law.return_map(map, trial, previous, mu, dt);
            // differences of two widths: where they disagree, a kink lies between (yield, extinction) and nothing is claimed
            let difference = |h: f64| {
                ((f(trial + h * excess, mu) - f(trial - h * excess, mu)) / (2.0 * h * excess),
                 (f(trial, mu * (1.0 + h)) - f(trial, mu * (1.0 - h))) / (2.0 * h * mu))
            };
            let ((s1, m1), (s2, m2)) = (difference(1e-5), difference(3e-5));
            let noise = 1e-9 * trial.max(previous.abs());
            if (s1 - s2).abs() < 1e-6 {
                prop_assert!((out.by_trial - s1).abs() < 1e-5 + noise / excess, "{map:?} by trial {} against {s1}", out.by_trial);
            }
            if (m1 - m2).abs() * mu < 1e-6 * trial {
                prop_assert!((out.by_modulus - m1).abs() * mu < 1e-5 * trial + noise, "{map:?} by modulus {} against {m1}", out.by_modulus);
            }
        }
    }

    #[test]
    fn two_steps_of_relaxation_are_one(law in any_law(), ln_excess in -6.0f64..6.0, ln_mu in 0.0f64..9.0,
                                       ln_dt in -14.0f64..-2.0, part in 0.01f64..0.99) {
        let trial = law.yield_norm() + law.consistency() * ln_excess.exp();
        let (mu, dt) = (ln_mu.exp(), ln_dt.exp());
        for map in [FlowMap::Exact, FlowMap::Forced] {
            let whole = law.return_map(map, trial, trial, mu, dt).stress;
            let half = law.return_map(map, trial, trial, mu, part * dt).stress;
            let both = law.return_map(map, half, half, mu, (1.0 - part) * dt).stress;
            // the exponent 1/n multiplies the rounding of ln(Φ/η)
            prop_assert!((whole - both).abs() <= 1e-11 * trial);
        }
    }

    #[test]
    fn units_do_not_matter(law in any_law(), ln_excess in -6.0f64..6.0, ln_mu in 0.0f64..9.0, ln_dt in -14.0f64..-2.0,
                           scale in 0.01f64..100.0, start in -0.5f64..1.5) {
        let (tau, eta, n) = FlowCurve::from(law).j2();
        let trial = law.yield_norm() + law.consistency() * ln_excess.exp();
        let (mu, dt) = (ln_mu.exp(), ln_dt.exp());
        for map in FlowMap::ALL {
            let here = law.return_map(map, trial, start * trial, mu, dt).stress;
            let stress_unit = flow(scale * tau, scale * eta, n)
                .return_map(map, scale * trial, scale * start * trial, scale * mu, dt).stress;
            prop_assert!((stress_unit / scale - here).abs() <= 1e-10 * trial, "{map:?}: {} {here}", stress_unit / scale);
            let time_unit = flow(tau, eta * scale.powf(n), n).return_map(map, trial, start * trial, mu, scale * dt).stress;
            prop_assert!((time_unit - here).abs() <= 1e-10 * trial, "{map:?}: {time_unit} {here}");
        }
    }
}
