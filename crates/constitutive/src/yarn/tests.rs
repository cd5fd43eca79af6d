use nalgebra::{Matrix2, Matrix3, Rotation2, Rotation3, SMatrix, Vector3};
use proptest::prelude::*;

use super::*;

fn law() -> YarnLaw {
    YarnLaw {
        stretch_modulus: 1000.0,
        shear_modulus: 500.0,
        mu: 400.0,
        lambda: 600.0,
        friction: 0.05,
        section_friction: 0.3,
        min_section: 0.05,
        form: YarnForm::Corrected,
    }
}

/// Worst difference of stress and fourth-order differences of the energy, relative to the stress.
fn stress_error<const D: usize>(law: &YarnLaw, f: &SMatrix<f64, D, D>) -> f64 {
    let stress = law.stress(f);
    let step = 1e-3;
    let mut worst = 0.0f64;
    for c in 0..D {
        for r in 0..D {
            let at = |h: f64| {
                let mut moved = *f;
                moved[(r, c)] += h;
                law.energy(&moved)
            };
            // Sixth order, so that rounding (1e-13/1e-3) and truncation both stay below 1e-9.
            let slope = (45.0 * (at(step) - at(-step)) - 9.0 * (at(2.0 * step) - at(-2.0 * step))
                + (at(3.0 * step) - at(-3.0 * step)))
                / (60.0 * step);
            worst = worst.max((slope - stress[(r, c)]).abs());
        }
    }
    worst / stress.norm().max(1.0)
}

#[test]
fn hand_checked_values_2d() {
    let law = law();
    let f = Matrix2::new(1.02, 0.13, 0.21, 0.88);
    let r = triangular_factor(&f);
    approx::assert_relative_eq!(r[(0, 0)], 1.041_393_297_462_586_8, max_relative = 1e-15);
    approx::assert_relative_eq!(r[(0, 1)], 0.304_783_985_813_393_4, max_relative = 1e-14);
    approx::assert_relative_eq!(r[(1, 1)], 0.835_707_318_378_690_1, max_relative = 1e-15);
    approx::assert_relative_eq!(law.energy(&f), 46.628_373_494_993_824, max_relative = 1e-13);
    let expected =
        Matrix2::new(-1.862_295_817_465_123, 209.891_293_012_609_2, 214.315_448_910_606_68, -263.757_708_918_387_4);
    approx::assert_relative_eq!(law.stress(&f), expected, max_relative = 1e-12, epsilon = 1e-11);
    let printed = YarnLaw { form: YarnForm::Printed, ..law };
    let wrong = Matrix2::new(-64.0825, 251.1541, 243.7133, -315.6101);
    approx::assert_relative_eq!(printed.stress(&f), wrong, epsilon = 1e-4, max_relative = 1e-6);
    let mapped = law.return_map(&f);
    approx::assert_relative_eq!(mapped.frame.shear[0], 0.030_066_453_797_264_99, max_relative = 1e-13);
    let after = Matrix2::new(1.02, -0.139_074_021_639_282, 0.21, 0.824_602_407_309_56);
    approx::assert_relative_eq!(mapped.deformation, after, max_relative = 1e-13);
    let bound = printed.return_map(&f).frame.shear[0];
    approx::assert_relative_eq!(bound, 0.008_214_634_081_065_498, max_relative = 1e-13);
}

#[test]
fn hand_checked_values_3d() {
    let law = law();
    let f = Matrix3::new(1.01, 0.12, -0.07, 0.10, 0.93, 0.04, -0.05, 0.03, 0.95);
    let r = triangular_factor(&f);
    approx::assert_relative_eq!(r[(0, 2)], -0.112_382_850_533_066_82, max_relative = 1e-14);
    approx::assert_relative_eq!(r[(1, 2)], 0.088_375_905_588_876_81, max_relative = 1e-14);
    approx::assert_relative_eq!(r[(2, 2)], 0.942_634_496_619_664_5, max_relative = 1e-14);
    approx::assert_relative_eq!(law.energy(&f), 27.247_402_892_795_066, max_relative = 1e-13);
    let expected = Matrix3::new(
        -0.739_460_042_929_216_7,
        124.109_274_585_524_06,
        -67.596_792_704_028_57,
        134.367_904_935_679_35,
        -168.371_972_991_809_86,
        40.901_993_913_366_105,
        -74.815_738_259_421_66,
        43.263_400_643_965_03,
        -141.651_224_794_644_55,
    );
    assert!((law.stress(&f) - expected).norm() < 1e-14 * 1e3 * expected.norm(), "{}", law.stress(&f) - expected);
}

#[test]
fn printed_stress_is_not_the_derivative_of_the_energy() {
    let printed = YarnLaw { form: YarnForm::Printed, ..law() };
    assert!(stress_error(&printed, &Matrix2::new(1.02, 0.13, 0.21, 0.88)) > 0.1);
}

#[test]
fn degenerate_states_stay_finite() {
    let law = law();
    for f in [
        Matrix3::zeros(),
        Matrix3::new(0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0),
        Matrix3::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        Matrix3::new(1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0),
        Matrix3::new(1.0, 0.0, 0.0, 0.0, 1e-300, 0.0, 0.0, 0.0, 1e-300),
        Matrix3::new(1e-12, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
    ] {
        assert!(law.energy(&f).is_finite() && law.stress(&f).iter().all(|x| x.is_finite()), "{f}");
        let mapped = law.return_map(&f);
        assert!(mapped.deformation.iter().all(|x| x.is_finite()), "{f}");
        assert!(mapped.frame.section.iter().all(|s| *s >= law.min_section));
        assert!(law.energy(&mapped.deformation) <= law.energy(&f) + 1e-9 * law.energy(&f).abs());
    }
    for f in [Matrix2::zeros(), Matrix2::new(1.0, 0.0, 0.0, -0.5), Matrix2::new(0.0, 0.0, 0.0, 1.0)] {
        let mapped = law.return_map(&f);
        assert!(law.stress(&f).iter().chain(mapped.deformation.iter()).all(|x| x.is_finite()));
        assert!(mapped.frame.section[0] >= law.min_section);
    }
}

#[test]
fn zero_friction_and_zero_shear_modulus() {
    let f = Matrix2::new(1.02, 0.13, 0.21, 0.88);
    assert_eq!(YarnLaw { friction: 0.0, ..law() }.return_map(&f).frame.shear[0], 0.0);
    let free = YarnLaw { shear_modulus: 0.0, ..law() }.return_map(&f);
    assert_eq!((free.mode, free.deformation), (YieldMode::Elastic, f));
}

fn section_trace<const D: usize>(frame: &YarnFrame<D>) -> f64 {
    (0..D - 1).map(|i| frame.section[i].max(1e-300).ln()).sum()
}

fn check_map<const D: usize>(law: &YarnLaw, f: &SMatrix<f64, D, D>) -> Result<(), TestCaseError> {
    let mapped = law.return_map(f);
    let once = mapped.deformation;
    prop_assert!(law.energy(&once) <= law.energy(f) * (1.0 + 1e-12) + 1e-12);
    let twice = law.return_map(&once).deformation;
    prop_assert!((twice - once).norm() <= 1e-13 * once.norm(), "not idempotent: {}", (twice - once).norm());
    prop_assert!((once.column(0) - f.column(0)).norm() == 0.0);
    let frame = YarnFrame::new(&once);
    let pressure = law.pressure(&frame);
    let resolved = frame.principal_shear();
    let traction = law.shear_modulus * (0..D - 1).map(|i| (frame.section[i] * resolved[i]).powi(2)).sum::<f64>().sqrt();
    let scale = law.mu + law.lambda;
    prop_assert!(traction <= law.friction * pressure + 1e-12 * scale, "outside the fibre cone");
    if mapped.slip > 0.0 {
        prop_assert!((traction - law.friction * pressure).abs() <= 1e-12 * scale, "not on the fibre cone");
    }
    if D == 3 {
        let shape = 2.0 * law.mu * (frame.section[0].ln() - frame.section[1].ln());
        prop_assert!(shape <= 2.0 * law.section_friction * pressure + 1e-12 * scale, "outside the section cone");
    }
    if section_trace(&YarnFrame::new(f)) > 0.0 && !mapped.clamped {
        prop_assert!(mapped.mode == YieldMode::Separated && pressure <= 1e-12 * scale);
    }
    Ok(())
}

fn tangent_error<const D: usize>(
    law: &YarnLaw,
    f: &SMatrix<f64, D, D>,
    d: &SMatrix<f64, D, D>,
    e: &SMatrix<f64, D, D>,
) -> (f64, f64) {
    let tangent = law.tangent(f);
    let exact = tangent.apply(d);
    let h = 1e-3;
    let at = |t: f64| law.stress(&(f + d * t));
    let numeric =
        ((at(h) - at(-h)) * 45.0 - (at(2.0 * h) - at(-2.0 * h)) * 9.0 + (at(3.0 * h) - at(-3.0 * h))) / (60.0 * h);
    let scale = exact.norm().max(1.0);
    let symmetry = (e.dot(&exact) - d.dot(&tangent.apply(e))).abs() / scale;
    ((numeric - exact).norm() / scale, symmetry)
}

/// Errors of the flowing law at fixed limits: stress against energy, differential against stress, symmetry of the differential.
fn flow_error<const D: usize>(
    law: &YarnLaw,
    f: &SMatrix<f64, D, D>,
    d: &SMatrix<f64, D, D>,
    e: &SMatrix<f64, D, D>,
    limits: &FlowLimits,
) -> [f64; 3] {
    let h = 1e-3;
    let sixth = |a: [f64; 6]| (45.0 * (a[2] - a[3]) - 9.0 * (a[1] - a[4]) + (a[0] - a[5])) / (60.0 * h);
    let at = |k: f64| f + d * (k * h);
    let energies = [3.0, 2.0, 1.0, -1.0, -2.0, -3.0].map(|k| law.flow_energy(&at(k), limits));
    let stress = law.flow_stress(f, limits);
    let scale = stress.norm().max(1.0);
    let energy_error = (sixth(energies) - stress.dot(d)).abs() / scale;
    let exact = law.flow_tangent(f, limits, false).apply(d);
    let probe = [3.0, 2.0, 1.0, -1.0, -2.0, -3.0].map(|k| law.flow_stress(&at(k), limits).dot(e));
    let tangent_error = (sixth(probe) - exact.dot(e)).abs() / exact.norm().max(1.0);
    let symmetry = (e.dot(&exact) - d.dot(&law.flow_tangent(f, limits, false).apply(e))).abs() / exact.norm().max(1.0);
    [energy_error, tangent_error, symmetry]
}

/// The traction and the shape's stress of the flowing law are those of the projected state.
fn check_flow<const D: usize>(law: &YarnLaw, f: &SMatrix<f64, D, D>) -> Result<(), TestCaseError> {
    let limits = law.flow_limits(f);
    let mapped = law.return_map(f);
    prop_assert!(law.flow_energy(f, &limits) <= law.energy(f) * (1.0 + 1e-12));
    prop_assert!(law.flow_energy(f, &limits) >= law.energy(&mapped.deformation) - 1e-9);
    if mapped.clamped {
        return Ok(());
    }
    let (flowing, after) = (law.flow_stress(f, &limits), law.stress(&mapped.deformation));
    let tangent = mapped.frame.tangent;
    for a in 1..D {
        // Columns of the section: traction along the yarn, and what is normal to it in the principal directions.
        let (x, y) = (flowing.column(a).dot(&tangent), after.column(a).dot(&tangent));
        prop_assert!((x - y).abs() < 1e-9 * (1.0 + y.abs()), "traction {x} {y}");
    }
    let frame = YarnFrame::new(f);
    for i in 0..D - 1 {
        // Kirchhoff stress in the principal direction: s h'(s).
        let kirchhoff = |stress: &SMatrix<f64, D, D>, section: f64| {
            (1..D).map(|a| stress.column(a).dot(&frame.directions[i]) * frame.material[i][a - 1]).sum::<f64>() * section
        };
        let (x, y) = (kirchhoff(&flowing, frame.section[i]), kirchhoff(&after, mapped.frame.section[i]));
        prop_assert!((x - y).abs() < 1e-9 * (1.0 + y.abs()), "section {i}: {x} {y}");
    }
    Ok(())
}

prop_compose! {
    fn near_identity_2d()(v in prop::array::uniform4(-0.25f64..0.25)) -> Matrix2<f64> {
        Matrix2::identity() + Matrix2::from_row_slice(&v)
    }
}
prop_compose! {
    fn near_identity_3d()(v in prop::array::uniform9(-0.25f64..0.25)) -> Matrix3<f64> {
        Matrix3::identity() + Matrix3::from_row_slice(&v)
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn stress_is_the_derivative_of_the_energy_2d(f in near_identity_2d()) {
        prop_assume!((YarnFrame::new(&f).section[0] - 1.0).abs() > 0.01); // off the kink of the second derivative
        let error = stress_error(&law(), &f);
        prop_assert!(error < 1e-9, "{error}");
    }

    #[test]
    fn stress_is_the_derivative_of_the_energy_3d(f in near_identity_3d()) {
        prop_assume!(section_trace(&YarnFrame::new(&f)).abs() > 0.02);
        let error = stress_error(&law(), &f);
        prop_assert!(error < 1e-9, "{error}");
    }

    #[test]
    fn stress_below_the_smallest_section_is_the_derivative_too(f in near_identity_3d()) {
        let clamping = YarnLaw { min_section: 0.9, ..law() };
        let frame = YarnFrame::new(&f);
        prop_assume!(frame.section.iter().all(|s| (s - 0.9).abs() > 0.02));
        let at: f64 = frame.section.iter().map(|s| s.max(0.9).ln()).sum();
        prop_assume!(at.abs() > 0.02);
        let error = stress_error(&clamping, &f);
        prop_assert!(error < 1e-9, "{error}");
    }

    #[test]
    fn tangent_is_the_derivative_of_the_stress(
        f in near_identity_3d(), d in near_identity_3d(), e in near_identity_3d(), g in near_identity_2d(), c in near_identity_2d()
    ) {
        prop_assume!(section_trace(&YarnFrame::new(&f)).abs() > 0.02);
        let (error, symmetry) = tangent_error(&law(), &f, &d, &e);
        prop_assert!(error < 1e-8 && symmetry < 1e-13, "{error} {symmetry}");
        prop_assume!((YarnFrame::new(&g).section[0] - 1.0).abs() > 0.01);
        let (error, symmetry) = tangent_error(&law(), &g, &c, &g);
        prop_assert!(error < 1e-8 && symmetry < 1e-13, "{error} {symmetry}");
    }

    #[test]
    fn flowing_law_has_a_potential_and_the_stress_of_the_projected_state(
        f in near_identity_3d(), d in near_identity_3d(), e in near_identity_3d(), g in near_identity_2d(), c in near_identity_2d(), share in 0.2f64..0.9
    ) {
        check_flow(&law(), &f)?;
        check_flow(&law(), &g)?;
        let frame = YarnFrame::new(&f);
        prop_assume!(section_trace(&frame).abs() > 0.02);
        let shear = (frame.shear[0].powi(2) + frame.shear[1].powi(2)).sqrt();
        let shape = 0.5 * (frame.section[0].ln() - frame.section[1].ln());
        prop_assume!(shear > 0.05 && shape > 0.05);
        // Well beyond the limits: no kink within the differences.
        let limits = FlowLimits { shear: share * (shear - 0.01), shape: share * (shape - 0.01) };
        for limits in [limits, FlowLimits { shear: f64::INFINITY, ..limits }, FlowLimits { shape: f64::INFINITY, ..limits }] {
            let [energy, tangent, symmetry] = flow_error(&law(), &f, &d, &e, &limits);
            prop_assert!(energy < 1e-8 && tangent < 1e-7 && symmetry < 1e-12, "{energy} {tangent} {symmetry}");
        }
        let frame = YarnFrame::new(&g);
        prop_assume!((frame.section[0] - 1.0).abs() > 0.01 && frame.shear[0].abs() > 0.05);
        let limits = FlowLimits { shear: share * (frame.shear[0].abs() - 0.01), shape: f64::INFINITY };
        let [energy, tangent, symmetry] = flow_error(&law(), &g, &c, &g, &limits);
        prop_assert!(energy < 1e-8 && tangent < 1e-7 && symmetry < 1e-12, "{energy} {tangent} {symmetry}");
    }

    #[test]
    fn stress_turns_with_the_body(f in near_identity_3d(), axis in prop::array::uniform3(-3.0f64..3.0), angle in -3.0f64..3.0, g in near_identity_2d()) {
        let turn = *Rotation3::new(Vector3::from(axis)).matrix();
        let law = law();
        prop_assert!((law.stress(&(turn * f)) - turn * law.stress(&f)).norm() < 1e-12 * (1000.0 + law.stress(&f).norm()));
        let turn = *Rotation2::new(angle).matrix();
        prop_assert!((law.stress(&(turn * g)) - turn * law.stress(&g)).norm() < 1e-12 * (1000.0 + law.stress(&g).norm()));
        let mapped = law.return_map(&(turn * g)).deformation;
        prop_assert!((mapped - turn * law.return_map(&g).deformation).norm() < 1e-12);
    }

    #[test]
    fn section_is_isotropic(f in near_identity_3d(), angle in -3.0f64..3.0) {
        // Turning the reference cross-section about the yarn changes neither energy nor stress (in turned columns).
        let (s, c) = angle.sin_cos();
        let turn = Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c);
        let law = law();
        prop_assert!((law.energy(&(f * turn)) - law.energy(&f)).abs() < 1e-12 * (1.0 + law.energy(&f)));
        prop_assert!((law.stress(&(f * turn)) - law.stress(&f) * turn).norm() < 1e-10);
    }

    #[test]
    fn frame_puts_the_gradient_together_again(f in near_identity_3d(), g in near_identity_2d()) {
        prop_assert!((YarnFrame::new(&f).compose() - f).norm() < 1e-14);
        prop_assert!((YarnFrame::new(&g).compose() - g).norm() < 1e-14);
        let r = triangular_factor(&f);
        prop_assert!((r.transpose() * r - f.transpose() * f).norm() < 1e-14);
    }

    #[test]
    fn return_map_is_a_projection(f in near_identity_3d(), g in near_identity_2d(), friction in 0.0f64..1.0, section in 0.0f64..1.0) {
        let law = YarnLaw { friction, section_friction: section, ..law() };
        check_map(&law, &f)?;
        check_map(&law, &g)?;
    }
}

/// Uniaxial compression of a cross-section whose sides are free, stepped with the return map: the law carries it only where its friction is above one.
///
/// With no cohesion a free side has no pressure but what the shape's friction gives: `τ₁ − τ₂ ≤ 2 α p`, `p = −(τ₁ + τ₂)/2` and `τ₁ = 0` leave
/// `−τ₂ ≤ −α τ₂`, so `τ₂ = 0` for every α below 1.
#[test]
fn free_sides_carry_load_only_with_section_friction_above_one() {
    for (friction, carries) in [(0.3, false), (0.9, false), (1.1, true), (2.0, true)] {
        let law = YarnLaw { section_friction: friction, ..law() };
        // Principal strains: pressed along the second direction, the first one follows so that its stress vanishes.
        let mut f = Matrix3::<f64>::identity();
        let (steps, pressed) = (400, 0.04f64);
        let free_side = |f: &Matrix3<f64>, side: f64| {
            let mut trial = *f;
            trial[(1, 1)] *= side;
            let after = law.return_map(&trial).deformation;
            (law.stress(&after)[(1, 1)] * after[(1, 1)], after)
        };
        for _ in 0..steps {
            f[(2, 2)] *= (-pressed / steps as f64).exp();
            let (mut low, mut high) = (0.99, 1.01);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if free_side(&f, middle).0 < 0.0 { low = middle } else { high = middle }
            }
            f = free_side(&f, low).1;
        }
        let load = -law.stress(&f)[(2, 2)] * f[(2, 2)];
        // Elastic uniaxial load of the section at the same closing: 4 μ N/(μ + N) ε, N = μ + λ.
        let area = law.mu + law.lambda;
        let elastic = 4.0 * law.mu * area / (law.mu + area) * pressed;
        if carries {
            assert!((load / elastic - 1.0).abs() < 1e-6, "{friction}: {load} {elastic}");
        } else {
            assert!(load < 1e-6 * elastic, "{friction}: {load} {elastic}");
        }
    }
}
