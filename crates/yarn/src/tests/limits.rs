//! The step bound is honest: at the bound itself nothing grows, far beyond it the step is divided or refused with the reason.

use super::{Noise, build, pair_settings};
use crate::limits::{CONTACT_WAVES, STRETCH_WAVES};
use crate::settings::{Bending, OversizedStep};
use crate::{YarnError, YarnMaterial, YarnSettings, YarnSystem};

fn elastic<const D: usize>(material: YarnMaterial) -> YarnSettings {
    let mut settings = pair_settings::<D>(0.0);
    settings.materials.insert("yarn".to_owned(), material);
    settings.plastic = false;
    settings.step.safety = 1.0;
    settings
}

/// Small random motion at the full bound, from a squeezed state; gives the growth of the energy above that of the squeeze.
fn growth<const D: usize>(settings: &YarnSettings, steps: usize) -> f64 {
    let mut system: YarnSystem<D> = build(settings);
    let mut noise = Noise(3);
    let n = system.model().len();
    for i in 0..n {
        let state = system.state_mut();
        for a in 1..D {
            let squeezed = state.deformation[i].column(a) * 0.9;
            state.deformation[i].set_column(a, &squeezed);
        }
        state.velocity[i] = noise.vector::<D>() * 1e-3;
    }
    let first = system.energy().total();
    let mut worst = 1.0f64;
    for _ in 0..steps {
        let dt = system.tightest_limit().unwrap().seconds;
        system.advance(dt).unwrap();
        worst = worst.max(system.energy().total() / first);
    }
    worst
}

#[test]
fn motion_at_the_bound_stays_bounded() {
    let materials = [
        YarnMaterial::default(),
        YarnMaterial { stretch_modulus: 1e5, ..YarnMaterial::default() },
        YarnMaterial { stretch_modulus: 10.0, shear_modulus: 2000.0, ..YarnMaterial::default() },
        YarnMaterial { bending: Bending::Rod { stiffness: Some(1e-4) }, ..YarnMaterial::default() },
        YarnMaterial { bending: Bending::Spring { stiffness: Some(1e3) }, ..YarnMaterial::default() },
    ];
    for material in materials {
        let plane = growth::<2>(&elastic::<2>(material), 400);
        assert!(plane < 1.2, "{material:?}: {plane}");
    }
    let space = growth::<3>(&elastic::<3>(YarnMaterial::default()), 200);
    assert!(space < 1.2, "{space}");
}

#[test]
fn large_steps_are_divided_or_refused_with_the_reason() {
    let mut settings = pair_settings::<2>(1.0);
    let mut system: YarnSystem<2> = build(&settings);
    let limit = system.tightest_limit().unwrap();
    assert!(limit.reason == STRETCH_WAVES || limit.reason == CONTACT_WAVES);
    for factor in [2.0, 5.0, 20.0] {
        let report = system.advance(factor * limit.seconds).unwrap();
        assert!(report.substeps as f64 >= factor, "{} {factor}", report.substeps);
        assert!(report.divided_by.is_some());
    }
    settings.step.oversized = OversizedStep::Refuse;
    let mut system: YarnSystem<2> = build(&settings);
    let before = system.state().clone();
    let refused = system.advance(20.0 * limit.seconds).unwrap_err();
    assert!(matches!(refused, YarnError::StepTooLarge { substeps: 20, .. }), "{refused}");
    assert!(refused.to_string().contains("waves"), "{refused}");
    assert!(*system.state() == before, "a refused step changes nothing");
    settings.step.oversized = OversizedStep::Substep;
    settings.step.max_substeps = 10;
    assert!(build::<2>(&settings).advance(20.0 * limit.seconds).is_err());
}

#[test]
fn stiff_yarns_need_smaller_steps() {
    let limit = |k: f64| {
        let mut settings = pair_settings::<2>(0.0);
        settings.materials.insert(
            "yarn".to_owned(),
            YarnMaterial { stretch_modulus: k, bending: Bending::None, ..YarnMaterial::default() },
        );
        build::<2>(&settings).tightest_limit().unwrap()
    };
    let (soft, stiff) = (limit(1e4), limit(1e6));
    assert_eq!(stiff.reason, STRETCH_WAVES);
    assert!((soft.seconds / stiff.seconds - 10.0).abs() < 1e-9);
}
