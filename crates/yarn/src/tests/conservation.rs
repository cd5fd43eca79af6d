//! Momentum and energy.

use super::{Noise, build, pair_settings};
use crate::settings::{Bending, ContactModuli};
use crate::{YarnMaterial, YarnSettings, YarnSystem};

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

/// Materials from limp to stiff, from slippery to rough, with both laws of bending.
fn materials() -> Vec<YarnMaterial> {
    let base = YarnMaterial { friction: 0.3, ..YarnMaterial::default() };
    vec![
        base,
        YarnMaterial { friction: 0.0, ..base },
        YarnMaterial { friction: 1.0, section_friction: Some(2.0), ..base },
        YarnMaterial { shear_modulus: 0.0, ..base },
        YarnMaterial { shear_modulus: 5e3, ..base },
        YarnMaterial { stretch_modulus: 1e5, bending: Bending::Rod { stiffness: Some(1e-5) }, ..base },
        YarnMaterial { contact: ContactModuli::Lame { mu: 50.0, lambda: 5e3 }, ..base },
        YarnMaterial { bending: Bending::Spring { stiffness: None }, ..base },
    ]
}

/// Largest rise of the energy from one step to the next over the starting energy, from a random state: sections squeezed, sheared and
/// opened, segments stretched, vertices moving at random. `share` of the stable step is taken.
fn rise_from_a_random_state<const D: usize>(material: YarnMaterial, seed: u64, share: f64, steps: usize) -> (f64, f64) {
    let mut settings = pair_settings::<D>(1.0);
    settings.materials.insert("yarn".to_owned(), material);
    settings.step.safety = share;
    let mut system: YarnSystem<D> = build(&settings);
    let mut noise = Noise(seed);
    for i in 0..system.model().len() {
        let state = system.state_mut();
        state.velocity[i] += noise.vector::<D>();
        let kick = nalgebra::SMatrix::<f64, D, D>::from_fn(|_, c| if c == 0 { 0.0 } else { 0.15 * noise.next() });
        let f = state.deformation[i];
        state.deformation[i] += f * kick;
        state.position[i] += noise.vector::<D>() * 5e-4;
    }
    for i in 0..system.model().len() {
        if system.model().has_segment(i) {
            let edge = system.state().position[i + 1] - system.state().position[i];
            let rest = system.model().rest_length[i];
            system.state_mut().deformation[i].set_column(0, &(edge / rest));
        }
    }
    // The random state may lie outside the cones: the first step projects it.
    let mut last = system.energy().total();
    let first = last;
    let mut rise = 0.0f64;
    for _ in 0..steps {
        let dt = system.tightest_limit().unwrap().seconds;
        system.advance(dt).unwrap();
        let now = system.energy().total();
        rise = rise.max(now - last);
        last = now;
    }
    (rise / first, last / first)
}

#[test]
fn energy_with_plastic_flow_never_rises_beyond_first_order() {
    // A rise in one step that is of second order in the step is of first order over a time: steps smaller by four, rises by well over four.
    for (k, material) in materials().into_iter().enumerate() {
        for seed in 0..3 {
            let seed = 100 * k as u64 + seed;
            let (coarse, kept) = rise_from_a_random_state::<2>(material, seed, 0.5, 100);
            let (fine, _) = rise_from_a_random_state::<2>(material, seed, 0.125, 400);
            assert!(coarse < 5e-3 && kept < 1.0, "{material:?} {seed}: {coarse:e} {kept}");
            assert!(fine < (0.25 * coarse).max(1e-9), "{material:?} {seed}: {fine:e} {coarse:e}");
            let (coarse, kept) = rise_from_a_random_state::<3>(material, seed, 0.5, 30);
            assert!(coarse < 5e-3 && kept < 1.0, "{material:?} {seed} in space: {coarse:e} {kept}");
        }
    }
}
