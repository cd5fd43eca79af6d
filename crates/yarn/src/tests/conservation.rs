//! Momentum and energy.

use super::{build, pair_settings};
use crate::{YarnSettings, YarnSystem};

fn run<const D: usize>(settings: &YarnSettings, steps: usize, dt: f64) -> (YarnSystem<D>, f64, f64) {
    let mut system: YarnSystem<D> = build(settings);
    let mut last = system.energy().total();
    let first = last;
    let mut rise = 0.0f64;
    for _ in 0..steps {
        system.advance(dt).unwrap();
        let now = system.energy().total();
        rise = rise.max(now - last);
        last = now;
    }
    (system, rise / first, last / first)
}

#[test]
fn momentum_is_exact_with_hand_back_and_drifts_without() {
    let settings = pair_settings::<2>(1.0);
    let (system, ..) = run::<2>(&settings, 200, 8e-5);
    assert!(system.momentum_defect() < 1e-13, "{:e}", system.momentum_defect());
    let (system, ..) = run::<3>(&pair_settings::<3>(1.0), 200, 8e-5);
    assert!(system.momentum_defect() < 1e-13, "{:e}", system.momentum_defect());
    let off = YarnSettings { momentum_hand_back: false, ..settings.clone() };
    let (system, ..) = run::<2>(&off, 200, 8e-5);
    assert!(system.momentum_defect() > 1e-6, "the note's rule drifts: {:e}", system.momentum_defect());
    // Massless quadrature points need no hand-back.
    let massless = YarnSettings { quadrature_mass_share: 0.0, ..off };
    let (system, ..) = run::<2>(&massless, 200, 5e-5);
    assert!(system.momentum_defect() < 1e-13, "{:e}", system.momentum_defect());
}

#[test]
fn first_step_keeps_angular_momentum_of_massless_quadrature() {
    let settings = YarnSettings { quadrature_mass_share: 0.0, ..pair_settings::<3>(1.0) };
    let mut system: YarnSystem<3> = build(&settings);
    let before = system.momentum();
    system.advance(5e-5).unwrap();
    let after = system.momentum();
    let scale = before.linear.norm().max(system.model().total_mass());
    for a in 0..3 {
        assert!((after.angular[a] - before.angular[a]).abs() < 1e-15 * scale.max(1.0), "{before:?} {after:?}");
    }
}

#[test]
fn energy_of_a_collision_never_rises_beyond_first_order() {
    let (_, rise, kept) = run::<2>(&pair_settings::<2>(2.0), 400, 8e-5);
    assert!(rise < 3e-4 && kept < 1.0, "{rise:e} {kept}");
    let (_, half, _) = run::<2>(&pair_settings::<2>(2.0), 800, 4e-5);
    assert!(half <= rise, "{half:e} {rise:e}");
    let (_, rise, kept) = run::<3>(&pair_settings::<3>(2.0), 300, 8e-5);
    assert!(rise < 3e-4 && kept < 1.0, "{rise:e} {kept}");
}
