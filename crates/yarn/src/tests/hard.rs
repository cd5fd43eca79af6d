//! Hard cases end in a sound state or in a typed error, never in a number that is not finite.

use std::path::Path;

use geometry::{Motion, ShapeDescription, Vector3};
use nalgebra::{SMatrix, SVector};

use super::{Noise, build, pair_settings, polyline, settings};
use crate::generate::{YarnGroup, YarnShape};
use crate::settings::*;
use crate::{YarnError, YarnSettings, YarnSystem, YarnWarning};

fn sphere(center: [f64; 3], radius: f64) -> ObstacleSettings {
    ObstacleSettings {
        shape: ShapeDescription::Sphere { center: Vector3::from(center), radius },
        motion: Motion::default(),
        friction: 0.3,
        restitution: 0.0,
    }
}

fn run<const D: usize>(system: &mut YarnSystem<D>, steps: usize, dt: f64) -> Result<(), YarnError> {
    for _ in 0..steps {
        system.advance(dt)?;
        assert_eq!(system.state().first_non_finite(), None);
    }
    Ok(())
}

#[test]
fn flattened_and_inverted_sections_are_lifted_and_counted() {
    let mut system: YarnSystem<3> = build(&pair_settings::<3>(1.0));
    for (i, f) in system.state_mut().deformation.iter_mut().enumerate() {
        let scale = [1e-12, -0.5, 0.0][i % 3];
        let squeezed = f.column(2) * scale;
        f.set_column(2, &squeezed);
    }
    let report = system.advance(1e-4).unwrap();
    assert!(report.clamped > 30, "{}", report.clamped);
    run(&mut system, 50, 1e-4).unwrap();
}

#[test]
fn coincident_vertices_in_a_run_stay_finite() {
    for dimension in [2, 3] {
        if dimension == 2 {
            coincident::<2>();
        } else {
            coincident::<3>();
        }
    }
}

fn coincident<const D: usize>() {
    let mut system: YarnSystem<D> = build(&pair_settings::<D>(0.1));
    let state = system.state_mut();
    state.position[7] = state.position[8];
    state.deformation[7].set_column(0, &SVector::<f64, D>::zeros());
    run(&mut system, 50, 1e-4).unwrap();
}

#[test]
fn zero_initial_length_is_an_input_error() {
    let points = [SVector::from([0.5, 0.5]), SVector::from([0.5, 0.5]), SVector::from([0.51, 0.5])];
    let error = YarnSystem::<2>::build(&settings::<2>(vec![polyline(&points, &[])]), Path::new(".")).unwrap_err();
    assert!(error.to_string().contains("length"), "{error}");
}

#[test]
fn frictionless_and_shearless_yarns_run() {
    for (friction, shear_modulus) in [(0.0, 500.0), (0.3, 0.0), (0.0, 0.0)] {
        let mut settings = pair_settings::<3>(2.0);
        settings
            .materials
            .insert("yarn".to_owned(), YarnMaterial { friction, shear_modulus, ..YarnMaterial::default() });
        run(&mut build::<3>(&settings), 60, 1e-4).unwrap();
    }
}

#[test]
fn a_yarn_of_two_vertices_falls_exactly() {
    let points = [SVector::from([0.5, 0.5, 0.5]), SVector::from([0.507, 0.5, 0.5])];
    let mut settings = settings::<3>(vec![polyline(&points, &[])]);
    settings.gravity = vec![0.0, 0.0, -9.8];
    let mut system: YarnSystem<3> = build(&settings);
    run(&mut system, 100, 1e-4).unwrap();
    let drop = -9.8 * 1e-8 * 100.0 * 101.0 / 2.0;
    assert!((system.state().position[1].z - 0.5 - drop).abs() < 1e-13);
    assert!((system.state().deformation[0] - SMatrix::identity()).norm() < 1e-11);
}

#[test]
fn yarns_outside_the_box_are_named() {
    let shape = YarnShape::Line { from: vec![0.1, 0.5], to: vec![1.4, 0.5] };
    let settings = YarnSettings {
        domain: Some(DomainSettings {
            origin: vec![0.0; 2],
            cells: vec![64, 64],
            walls: WallSettings::default(),
            layers: 3,
        }),
        ..settings::<2>(vec![YarnGroup::new(shape)])
    };
    let error = YarnSystem::<2>::build(&settings, Path::new(".")).unwrap_err();
    assert!(matches!(error, YarnError::LeftDomain { yarn: 0, vertex: 115, step: 0, .. }), "{error}");
    // And a yarn that flies out of an open box stops with its name.
    let shape = YarnShape::Line { from: vec![0.1, 0.5], to: vec![0.4, 0.5] };
    let settings =
        YarnSettings { yarns: vec![YarnGroup { velocity: vec![0.0, 30.0], ..YarnGroup::new(shape) }], ..settings };
    let error = run(&mut build::<2>(&settings), 400, 1e-4).unwrap_err();
    assert!(matches!(error, YarnError::LeftDomain { yarn: 0, step: 160..180, .. }), "{error}");
}

#[test]
fn fast_small_and_overlapping_obstacles() {
    let mut settings = pair_settings::<2>(1.0);
    let rush = serde_json::from_str(r#"[{"Translate": {"by": [0.0, -1.0, 0.0], "during": [0.0, 0.02]}}]"#).unwrap();
    settings.obstacles = vec![
        ObstacleSettings { motion: rush, ..sphere([0.5, 0.62, 0.0], 0.05) },
        sphere([0.45, 0.44, 0.0], 0.05),
        sphere([0.48, 0.44, 0.0], 0.05),
        sphere([0.56, 0.5, 0.0], 0.01),
        sphere([0.5, 0.5, 0.0], 0.02),
    ];
    settings.push_out = true;
    let mut system: YarnSystem<2> = build(&settings);
    assert!(system.warnings().iter().any(|w| matches!(w, YarnWarning::SmallObstacle { obstacle: 3, .. })));
    assert!(system.warnings().iter().any(|w| matches!(w, YarnWarning::StartsInside { .. })));
    // 50 m/s is 0.5 cells in 1.5e-4 s: the motion of the obstacle limits the step.
    let report = system.advance(2e-3).unwrap();
    assert!(report.substeps >= 20 && report.divided_by.is_some());
    run(&mut system, 20, 1e-3).unwrap();
    assert!(system.advance(1e-3).unwrap().depth < 1e-2);
}

#[test]
fn a_dense_pile_in_a_box_stays_sound() {
    let shape = YarnShape::CutPile { low: vec![0.1; 3], high: vec![0.3, 0.3, 0.3], count: 60, length: 0.1, seed: 5 };
    let settings = YarnSettings {
        domain: Some(DomainSettings {
            origin: vec![0.0; 3],
            cells: vec![26, 26, 26],
            walls: WallSettings::All(WallKind::Friction(0.3)),
            layers: 3,
        }),
        gravity: vec![0.0, -98.0, 0.0],
        ..settings::<3>(vec![YarnGroup::new(shape)])
    };
    let mut system: YarnSystem<3> = build(&settings);
    run(&mut system, 60, 1e-3).unwrap();
    assert!(system.momentum_defect() < 1e-12, "{:e}", system.momentum_defect());
}

#[test]
fn random_states_do_not_break_a_step() {
    let mut noise = Noise(77);
    for _ in 0..20 {
        let mut system: YarnSystem<3> = build(&pair_settings::<3>(1.0));
        for f in &mut system.state_mut().deformation {
            *f = SMatrix::from_fn(|_, _| noise.next() * 2.0);
        }
        match system.advance(1e-5) {
            Ok(_) => assert_eq!(system.state().first_non_finite(), None),
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
}
