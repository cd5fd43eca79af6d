//! The reference trajectories of the independent numpy implementation, corrected and printed law.

use serde_json::Value;

use crate::YarnSystem;
use crate::scenes::two_yarns;

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(items) => items.iter().flat_map(numbers).collect(),
        other => vec![other.as_f64().unwrap()],
    }
}

fn compare(file: &str, compat: bool, checksum: f64) {
    let path = format!("{}/../../validation/data/yarn/{file}", env!("CARGO_MANIFEST_DIR"));
    let document: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let mut system = YarnSystem::<2>::build(&two_yarns(compat), std::path::Path::new(".")).unwrap();
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
