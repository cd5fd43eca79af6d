//! The directed-contact mode against trajectories of the original program.

use granular::cell::Cell;
use granular::compat::{DirectedContact, DirectedSample};
use granular::grains::Grains;
use granular::law::{CentralLaw, Tension};
use granular::model::{ContactKind, ContactModel};
use serde_json::Value;

fn load(name: &str) -> Value {
    let path = format!("{}/../../validation/data/granular/{name}", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn f(v: &Value) -> f64 {
    v.as_f64().unwrap()
}

fn sample(params: &Value, initial: &Value, applying_shear: bool) -> DirectedSample {
    let mut grains = Grains::default();
    let mut contacts = Vec::new();
    for s in initial["spheres"].as_array().unwrap() {
        grains.push([f(&s["x"]), f(&s["y"])], f(&s["r"]), f(&s["m"]));
        let i = grains.len() - 1;
        grains.vx[i] = f(&s["vx"]);
        grains.vy[i] = f(&s["vy"]);
        grains.omega[i] = f(&s["omega"]);
        grains.angle[i] = f(&s["phi"]);
        grains.inertia[i] = f(&s["inertia"]);
        contacts.push(s["contacts"].as_array().unwrap().iter().map(entry).collect());
    }
    let repulsion = f(&params["central_repulsion"]);
    let law = match params.get("plateau") {
        Some(Value::Array(p)) => CentralLaw::Plateau { repulsion, begin: f(&p[0]), end: f(&p[1]), slope: f(&p[2]) },
        _ => CentralLaw::Blend { repulsion },
    };
    let model = ContactModel {
        spring: f(&params["k"]),
        viscosity: f(&params["nu"]),
        tangential_spring: f(&params["k_t"]),
        tangential_viscosity: f(&params["nu_t"]),
        friction: f(&params["mu"]),
        law,
        tension: Tension::Linear,
        permanent_ratio_central: f(&params["permanent_ratio_central"]),
        permanent_ratio_tangential: f(&params["permanent_ratio_tangential"]),
        keep_viscosity: params["keep_viscosity_coefficients_constant"].as_bool().unwrap(),
    };
    let mut cell = Cell::new(f(&params["size_x"]), f(&params["size_y"]));
    cell.strain = f(&initial["shear"]);
    cell.rate = f(&initial["shear_rate"]);
    let mut sample = DirectedSample::new(grains, cell, model, 1);
    sample.contacts = contacts;
    sample.applying_shear = applying_shear;
    sample
}

fn entry(c: &Value) -> DirectedContact {
    let kind = match c["type"].as_str().unwrap() {
        "stick" => ContactKind::Stick,
        "slip" => ContactKind::Slip,
        _ => ContactKind::Permanent,
    };
    DirectedContact { other: c["j"].as_u64().unwrap() as u32, kind, spring: f(&c["s"]), rest: f(&c["d_eq"]) }
}

/// Largest difference of tensors and state to a snapshot, each relative to its own scale.
fn tensor_error(sample: &DirectedSample, tensors: &Value) -> f64 {
    let s = sample.stresses();
    let named = [
        ("love_weber", s.love_weber),
        ("external", s.external),
        ("linear_acceleration", s.linear),
        ("unbalanced_torque", s.torque),
        ("internal_torque", s.internal_torque),
        ("spin", s.centrifugal),
        ("otsuki", s.otsuki),
        ("overall", s.overall),
    ];
    // Tensors share one scale per snapshot: small ones are differences of large ones.
    let scale = named
        .iter()
        .fold(1e-300f64, |m, (name, _)| tensors[name].as_array().unwrap().iter().fold(m, |m, v| m.max(f(v).abs())));
    let mut worst = 0.0f64;
    for (name, t) in named {
        for (a, b) in t.0.iter().zip(tensors[name].as_array().unwrap()) {
            worst = worst.max((a - f(b)).abs() / scale);
        }
    }
    worst
}

fn state_error(sample: &DirectedSample, state: &Value) -> f64 {
    let g = &sample.grains;
    let spheres = state["spheres"].as_array().unwrap();
    let mut worst = (sample.cell.strain - f(&state["shear"])).abs();
    let speed = spheres.iter().fold(1e-300f64, |m, s| m.max(f(&s["vx"]).abs()).max(f(&s["vy"]).abs()));
    let spin = spheres.iter().fold(1e-300f64, |m, s| m.max(f(&s["omega"]).abs()));
    for (i, s) in spheres.iter().enumerate() {
        worst = worst.max((g.x[i] - f(&s["x"])).abs() / sample.cell.width);
        worst = worst.max((g.y[i] - f(&s["y"])).abs() / sample.cell.height);
        worst = worst.max((g.vx[i] - f(&s["vx"])).abs() / speed);
        worst = worst.max((g.vy[i] - f(&s["vy"])).abs() / speed);
        worst = worst.max((g.omega[i] - f(&s["omega"])).abs() / spin);
        worst = worst.max((g.angle[i] - f(&s["phi"])).abs());
        let listed: Vec<DirectedContact> = s["contacts"].as_array().unwrap().iter().map(entry).collect();
        assert_eq!(listed.len(), sample.contacts[i].len(), "contacts of grain {i}");
        for (a, b) in sample.contacts[i].iter().zip(&listed) {
            assert_eq!((a.other, a.kind), (b.other, b.kind), "grain {i}");
            worst = worst.max((a.spring - b.spring).abs() / g.radius[i]).max((a.rest - b.rest).abs());
        }
    }
    worst
}

#[test]
fn two_sphere_trajectories_agree_to_1e_12() {
    let data = load("two_sphere_trajectories.json");
    for case in data["cases"].as_array().unwrap() {
        let name = case["name"].as_str().unwrap();
        let mut sample = sample(&case["params"], &case["initial"], case["params"]["applying_shear"].as_bool().unwrap());
        let (dt, damping) = (f(&case["dt"]), f(&case["cool"]));
        let mut done = 0;
        for snapshot in case["snapshots"].as_array().unwrap() {
            let step = snapshot["step"].as_u64().unwrap();
            while done + 1 < step {
                sample.evaluate();
                sample.integrate(dt, damping, false).unwrap();
                done += 1;
            }
            sample.evaluate();
            let forces = snapshot["forces_before_kick"].as_array().unwrap();
            let scale = forces.iter().flat_map(|v| v.as_array().unwrap()).fold(1e-3f64, |m, v| m.max(f(v).abs()));
            for (i, v) in forces.iter().enumerate() {
                for (a, b) in [sample.fx[i], sample.fy[i], sample.torque[i]].iter().zip(v.as_array().unwrap()) {
                    assert!((a - f(b)).abs() <= 1e-12 * scale, "{name} step {step}: force {a} {b}");
                }
            }
            let tensors = tensor_error(&sample, &snapshot["tensors_before_move"]);
            assert!(tensors < 1e-12, "{name} step {step}: tensors {tensors:e}");
            sample.integrate(dt, damping, false).unwrap();
            done = step;
            let state = state_error(&sample, &snapshot["state_after"]);
            assert!(state < 1e-12, "{name} step {step}: state {state:e}");
        }
    }
}

#[test]
fn crosslinked_assembly_agrees_to_1e_10_after_1000_steps() {
    let data = load("assembly_n45.json");
    let mut sample = sample(&data["params"], &data["initial"], true);
    let (dt, damping) = (f(&data["dt"]), f(&data["cool"]));
    let (amplitude, frequency) = (f(&data["amplitude"]), f(&data["f"]));
    let (mut done, mut worst) = (0, 0.0f64);
    for snapshot in data["snapshots"].as_array().unwrap() {
        let step = snapshot["step"].as_u64().unwrap();
        while done < step {
            let phase = 2.0 * std::f64::consts::PI * frequency * sample.time;
            sample.set_rate(amplitude * 2.0 * std::f64::consts::PI * frequency * phase.cos());
            sample.evaluate();
            done += 1;
            if done == step {
                worst = worst.max(tensor_error(&sample, &snapshot["tensors_before_move"]));
                let s = sample.stresses();
                assert!(s.identity_defect() < 1e-12, "{:e}", s.identity_defect());
            }
            sample.integrate(dt, damping, true).unwrap();
        }
        worst = worst.max(state_error(&sample, &snapshot["state_after"]));
        assert!(worst < 1e-10, "step {step}: {worst:e}");
    }
    assert_eq!(done, 1000);
    println!("largest difference after 1000 steps {worst:e}");
}

#[test]
fn candidate_lists_change_no_bit_at_large_strain() {
    use granular::experiment::{Experiment, MicrogelSettings, Oscillation, Rheometer};
    use granular::model::{Mode, ModelSettings};
    let settings = MicrogelSettings {
        mode: Mode::Compat,
        seed: 4,
        model: ModelSettings { grains: 100, ..ModelSettings::default() },
        preparation: granular::preparation::PreparationSettings { links: false, relaxation: 0.2, ..Default::default() },
        experiment: Experiment::Oscillation(Oscillation {
            amplitude: 1.0,
            pre_periods: 0.0,
            periods: 0.5,
            post_periods: 0.0,
            relative_frequency: 0.1,
            ..Oscillation::default()
        }),
        ..MicrogelSettings::default()
    };
    let mut listed = Rheometer::new(&settings).unwrap();
    while listed.preparing() {
        listed.advance().unwrap();
    }
    let mut searched = listed.clone();
    for step in 0..500 {
        searched.forget_candidates();
        let (a, b) = (listed.advance().unwrap(), searched.advance().unwrap());
        assert_eq!(a, b, "step {step}");
    }
}
