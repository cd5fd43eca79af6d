//! Spheres: conservation, identities, agreement with discs where both apply, threads, restart, a whole run.

use granular::cell::Cell;
use granular::experiment::{Experiment, MicrogelSettings, Oscillation, Rheometer};
use granular::grains::Grains;
use granular::law::{CentralLaw, Tension};
use granular::model::{ContactModel, Dimension, ModelSettings};
use granular::physical::{Rules, Sample};
use granular::preparation::{Cut, PreparationSettings};
use granular::random::Random;
use granular::spheres::{Ball, SphereSample};

fn ball(position: [f64; 3], velocity: [f64; 3], radius: f64, mass: f64, inertia: f64) -> Ball {
    Ball { position, velocity, omega: [0.0; 3], radius, inverse_mass: 1.0 / mass, inverse_inertia: 1.0 / inertia }
}

fn model(viscosity: f64) -> ContactModel {
    ContactModel {
        spring: 1.0,
        viscosity,
        tangential_spring: 0.7,
        tangential_viscosity: 0.5 * viscosity,
        friction: 0.3,
        law: CentralLaw::Blend { repulsion: 0.6 },
        tension: Tension::Linear,
        permanent_ratio_central: 1.0,
        permanent_ratio_tangential: 1.0,
        keep_viscosity: false,
    }
}

#[test]
fn in_one_plane_spheres_move_like_discs() {
    let mut grains = Grains::default();
    grains.push([200.0, 200.0], 60.0, 1.0);
    grains.push([290.0, 220.0], 45.0, 0.8);
    grains.vx = vec![3.0, -4.0];
    grains.vy = vec![10.0, -12.0];
    let mut discs = Sample::new(&grains, Cell::new(500.0, 500.0), model(0.05), Rules::default()).unwrap();
    let balls = (0..2)
        .map(|i| {
            let (x, v) = ([grains.x[i], grains.y[i], 70.0], [grains.vx[i], grains.vy[i], 0.0]);
            ball(x, v, grains.radius[i], grains.mass[i], grains.inertia[i])
        })
        .collect();
    let mut spheres = SphereSample::new(balls, Cell::new(500.0, 500.0), 300.0, model(0.05), Rules::default()).unwrap();
    for _ in 0..400 {
        discs.advance(0.01, 0.9999).unwrap();
        spheres.advance(0.01, 0.9999).unwrap();
    }
    let g = discs.grains();
    for (i, b) in spheres.balls().iter().enumerate() {
        assert!((b.position[0] - g.x[i]).abs() < 1e-9 && (b.position[1] - g.y[i]).abs() < 1e-9);
        assert!((b.omega[2] - g.omega[i]).abs() < 1e-12 && b.position[2] == 70.0);
    }
}

/// A loose cloud in the middle of the box, so that angular momentum is defined.
fn cloud(n: usize) -> SphereSample {
    let mut random = Random::new(5);
    let balls = (0..n)
        .map(|_| {
            let x = std::array::from_fn(|_| 400.0 + 200.0 * random.uniform());
            let v = std::array::from_fn(|_| 20.0 * (random.uniform() - 0.5));
            let r = 25.0 + 10.0 * random.uniform();
            let mut b = ball(x, v, r, 1.0, 0.4 * r * r);
            b.omega = std::array::from_fn(|_| random.uniform() - 0.5);
            b
        })
        .collect();
    SphereSample::new(balls, Cell::new(1000.0, 1000.0), 1000.0, model(0.1), Rules::default()).unwrap()
}

#[test]
fn momenta_are_conserved_and_the_stress_is_symmetric() {
    let mut s = cloud(80);
    let p0 = s.momenta();
    for _ in 0..300 {
        let r = s.advance(0.01, 1.0).unwrap();
        assert!(r.stress.identity_defect() < 1e-12, "{:e}", r.stress.identity_defect());
        let b = s.bulk_stress();
        let most = b.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        for (i, j) in [(1, 3), (2, 6), (5, 7)] {
            assert!((b[i] - b[j]).abs() < 1e-12 * most);
        }
    }
    let p1 = s.momenta();
    for k in 0..6 {
        let scale = if k < 3 { 80.0 * 10.0 } else { 80.0 * 10.0 * 500.0 };
        assert!((p1[k] - p0[k]).abs() < 1e-12 * scale, "{k}: {} {}", p0[k], p1[k]);
    }
}

#[test]
fn rotating_the_cloud_rotates_the_result() {
    let mut a = cloud(40);
    let mut b = a.clone();
    // Cyclic exchange of the axes.
    for q in b.balls_mut() {
        for v in [&mut q.position, &mut q.velocity, &mut q.omega] {
            v.rotate_right(1);
        }
    }
    for _ in 0..200 {
        a.advance(0.01, 1.0).unwrap();
        b.advance(0.01, 1.0).unwrap();
    }
    for (p, q) in a.balls().iter().zip(b.balls()) {
        let mut turned = p.position;
        turned.rotate_right(1);
        for c in 0..3 {
            assert!((turned[c] - q.position[c]).abs() < 1e-8);
        }
    }
}

fn settings(grains: usize) -> MicrogelSettings {
    MicrogelSettings {
        seed: 3,
        model: ModelSettings { dimension: Dimension::Three, grains, packing: 0.9, ..ModelSettings::default() },
        preparation: PreparationSettings {
            cut: Cut::Voronoi { points: 4, edge_fuzziness: 0.0 },
            avoid_tall: false,
            relaxation: 0.2,
            ..PreparationSettings::default()
        },
        experiment: Experiment::Oscillation(Oscillation {
            pre_periods: 0.5,
            periods: 1.0,
            post_periods: 0.3,
            ..Default::default()
        }),
        step_factor: 2.0,
        ..MicrogelSettings::default()
    }
}

#[test]
fn a_sample_of_spheres_is_elastic_and_restarts_bit_for_bit() {
    let mut whole = Rheometer::new(&settings(60)).unwrap();
    let mut resumed = None;
    let mut last = None;
    loop {
        match whole.advance().unwrap() {
            granular::experiment::Progress::Finished => break,
            granular::experiment::Progress::Recorded(row) => {
                if row.index == 300 {
                    resumed = Some(serde_json::to_string(&whole).unwrap());
                }
                last = Some(row);
            }
            granular::experiment::Progress::Prepared => {}
        }
    }
    let summary = whole.summary().unwrap();
    assert!(summary.g_prime > 50.0 && summary.g_prime < 20_000.0, "{}", summary.g_prime);
    assert!(summary.identity_defect < 1e-10 && summary.sample.links > 60);
    let mut again: Rheometer = serde_json::from_str(&resumed.unwrap()).unwrap();
    again.run(|_| {}).unwrap();
    assert_eq!(*again.last_row(), last.unwrap());
    assert_eq!(again.summary().unwrap(), summary);
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let mut start = Rheometer::new(&settings(6000)).unwrap();
    for _ in 0..20 {
        start.advance().unwrap();
    }
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut r = start.clone();
            for _ in 0..8 {
                r.advance().unwrap();
            }
            serde_json::to_string(&r).unwrap()
        })
    };
    assert!(run(1) == run(3), "states differ between 1 and 3 threads");
}
