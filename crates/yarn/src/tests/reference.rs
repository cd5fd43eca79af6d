//! The reference trajectories of the independent numpy implementation, corrected and printed law.

use geometry::{Motion, ShapeDescription, Vector3};
use serde_json::Value;

use crate::settings::*;
use crate::{YarnGroup, YarnSettings, YarnShape, YarnSystem};

/// The set-up of the reference: two yarns, three circles, an attractor on an orbit.
fn settings(compat: bool) -> YarnSettings {
    let cell: f64 = 1.0 / 64.0;
    let length = 0.5 * cell;
    let index = (0..20).map(f64::from);
    let a = index.clone().map(|i| vec![0.42 + i * length, 0.575]).collect();
    let b = index.map(|i| vec![0.44 + i * length * 0.3f64.cos(), 0.590 + i * length * 0.3f64.sin() * 0.5]).collect();
    let line = |points| YarnGroup::new(YarnShape::Polyline { points, rest_lengths: vec![], velocities: vec![] });
    let circle = |x: f64, y: f64, radius| ObstacleSettings {
        shape: ShapeDescription::Sphere { center: Vector3::new(x, y, 0.0), radius },
        motion: Motion::default(),
        friction: 0.3,
        restitution: 0.0,
    };
    let material = YarnMaterial {
        contact: ContactModuli::Lame { mu: 400.0, lambda: 600.0 },
        bending: Bending::Spring { stiffness: None },
        ..YarnMaterial::default()
    };
    YarnSettings {
        dimension: 2,
        cell,
        domain: Some(DomainSettings {
            origin: vec![0.0, 0.0],
            cells: vec![64, 64],
            walls: WallSettings::All(WallKind::Stick),
            layers: 3,
        }),
        materials: [("yarn".to_owned(), material)].into(),
        yarns: vec![line(a), YarnGroup { velocity: vec![0.5, -2.0], ..line(b) }],
        gravity: vec![0.0, -9.8],
        attractor: Some(AttractorSettings {
            path: PathSettings::Orbit { center: vec![0.5, 0.6], radii: (0.2, 0.1), angular_velocity: 40.0, phase: 0.0 },
            strength: vec![(0.0, 20.0)],
            softening: 0.01,
        }),
        obstacles: vec![circle(0.45, 0.50, 0.05), circle(0.62, 0.46, 0.04), circle(0.30, 0.42, 0.05)],
        momentum_hand_back: false,
        min_section: 1e-3,
        compat,
        ..YarnSettings::default()
    }
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        other => vec![other.as_f64().unwrap()],
    }
}

fn compare(file: &str, compat: bool, checksum: f64) {
    let path = format!("{}/../../validation/data/yarn/{file}", env!("CARGO_MANIFEST_DIR"));
    let document: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let mut system = YarnSystem::<2>::build(&settings(compat), std::path::Path::new(".")).unwrap();
    let mut step = 0;
    for snapshot in document["snapshots"].as_array().unwrap() {
        let until = snapshot["step"].as_u64().unwrap_or(0);
        while step < until {
            let report = system.advance(1e-4).unwrap();
            assert_eq!(report.substeps, 1, "the reference step is within the bounds");
            step += 1;
        }
        let state = system.state();
        let worst = |key: &str, ours: Vec<f64>| {
            let theirs = numbers(&snapshot[key]);
            assert_eq!(ours.len(), theirs.len(), "{key}");
            ours.iter().zip(&theirs).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        let position: Vec<f64> = state.position.iter().flatten().copied().collect();
        let velocity: Vec<f64> = state.velocity.iter().flatten().copied().collect();
        let affine: Vec<f64> =
            state.affine.iter().flat_map(|c| c.transpose().iter().copied().collect::<Vec<_>>()).collect();
        assert!(worst("x2", position) < 1e-10, "positions at step {step}");
        assert!(worst("v2", velocity) < 1e-10, "velocities at step {step}");
        assert!(worst("C2", affine) < 1e-8, "affine velocities [1/s] at step {step}");
        let energy = system.energy();
        for (key, value) in [
            ("kinetic", energy.kinetic),
            ("elastic", energy.elastic),
            ("bending", energy.bending),
            ("gravity", energy.gravity),
        ] {
            let theirs = snapshot["energy"][key].as_f64().unwrap();
            assert!((value - theirs).abs() < 1e-10 * energy.kinetic.max(1e-3), "{key} {value} {theirs} at step {step}");
        }
        let momentum = system.momentum();
        assert!((momentum.angular[2] - snapshot["angular_momentum"].as_f64().unwrap()).abs() < 1e-12);
    }
    assert_eq!(step, 200);
    let sum: f64 = system.state().position.iter().map(|x| x.sum()).sum();
    assert!((sum - checksum).abs() < 1e-9, "{sum}");
}

#[test]
fn corrected_law_follows_the_reference() {
    compare("two_yarns_200.json", false, 43.205_047_987_491_27);
}

#[test]
fn printed_law_follows_the_reference() {
    compare("two_yarns_200_printed.json", true, 43.218_339_615_314_18);
}
