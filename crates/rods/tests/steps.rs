//! Whole steps: conservation, exact discrete answers, independence of grouping and threads.

use nalgebra::Vector3;
use rods::*;

type V = Vector3<f64>;

fn hair() -> StrandMaterial {
    StrandMaterial::default()
}

fn curl(vertices: usize, seed: f64) -> StrandSpec {
    let positions = (0..vertices)
        .map(|i| {
            let s = i as f64 * 2e-3;
            V::new(5e-3 * (300.0 * s + seed).sin(), 5e-3 * (300.0 * s + seed).cos() + 0.01 * seed, s)
        })
        .collect();
    StrandSpec::new(positions, 5e-5, hair())
}

#[test]
fn free_fall_is_the_exact_discrete_parabola() {
    let mut rods = RodSet::new();
    rods.add_strand(&curl(12, 0.3)).unwrap();
    rods.add_strand(&curl(2, 0.1)).unwrap();
    let start = rods.clone();
    let g = V::new(0.0, 0.0, -9.81);
    let mut stepper = RodStepper::new(RodSettings::default()).unwrap();
    let h = 1e-3;
    for k in 1..=50 {
        let report = stepper.advance(&mut rods, h, &Loads::gravity(g), &Boundary::default()).unwrap();
        assert!(report.solve.status.is_converged());
        let fall = g * (0.5 * h * h * f64::from(k * (k + 1)));
        for (x, x0) in rods.position.iter().zip(&start.position) {
            assert!((x - x0 - fall).norm() < 1e-12 * 0.1, "{}", (x - x0 - fall).norm());
        }
    }
    rods.check().unwrap();
}

#[test]
fn hair_released_from_straight_swings_and_keeps_its_clamp() {
    let mut rods = RodSet::new();
    let s = rods.add_strand(&StrandSpec::straight(V::zeros(), V::new(0.05, 0.0, 0.0), 41, 5e-5, hair())).unwrap();
    let g = V::new(0.0, 0.0, -9.81);
    let loads = Loads::gravity(g);
    let mut stepper = RodStepper::new(RodSettings::default()).unwrap();
    let mut boundary = Boundary::default();
    boundary.clamp(&rods, s, End::Root);
    let (mut energy, mut lowest) = (rods.energy(&loads).total(), 0.0f64);
    for _ in 0..200 {
        let report = stepper.advance(&mut rods, 1e-3, &loads, &boundary).unwrap();
        assert!(report.solve.iterations < 15, "{report:?}");
        let now = rods.energy(&loads).total();
        assert!(now <= energy + 1e-12, "{now} {energy}");
        energy = now;
        lowest = lowest.min(rods.position[40].z);
    }
    assert_eq!(rods.position[0], V::zeros());
    assert!(lowest < -0.004, "{lowest}");
    let (force, _) = stepper.reaction(&rods, s, &V::zeros());
    assert!(force.z > 0.0);
    rods.check().unwrap();
}

#[test]
fn midpoint_keeps_linear_and_angular_momentum() {
    let mut rods = RodSet::new();
    let mut spec = curl(20, 0.7);
    let w = V::new(30.0, -20.0, 50.0);
    spec.velocities = Some(spec.positions.iter().map(|x| w.cross(x) + V::new(1.0, 2.0, 3.0)).collect());
    rods.add_strand(&spec).unwrap();
    let settings = RodSettings { integrator: Integrator::ImplicitMidpoint, tolerance: 1e-12, ..Default::default() };
    let mut stepper = RodStepper::new(settings).unwrap();
    let loads = Loads::default();
    let before = rods.momentum(&loads);
    for _ in 0..100 {
        stepper.advance(&mut rods, 2e-4, &loads, &Boundary::default()).unwrap();
    }
    let after = rods.momentum(&loads);
    assert!((after.linear - before.linear).norm() < 1e-10 * before.linear.norm());
    let drift = (after.angular - before.angular).norm() / before.angular.norm();
    // the lumped turning inertia of a curved strand lacks the gyroscopic term, a part (radius/length)² of the whole
    assert!(drift < 1e-5, "{drift:e}");
}

/// Strands of mixed sizes advanced together, alone, on other threads: the same bits.
#[test]
fn bits_do_not_depend_on_grouping_or_threads() {
    let sizes = [7, 12, 7, 2, 12, 12, 7, 30, 12, 7, 12];
    let specs: Vec<_> = sizes.iter().enumerate().map(|(k, n)| curl(*n, 0.1 * k as f64)).collect();
    let loads = Loads::gravity(V::new(1.0, 0.0, -9.81));
    let run = |which: &[usize], threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut rods = RodSet::new();
            for &k in which {
                rods.add_strand(&specs[k].clone().with_rest(RestShape::Straight)).unwrap();
            }
            let mut boundary = Boundary::default();
            for s in 0..which.len() {
                if which[s].is_multiple_of(2) {
                    boundary.clamp(&rods, s, End::Root);
                }
            }
            let settings = RodSettings { integrator: Integrator::Bdf2, ..Default::default() };
            let mut stepper = RodStepper::new(settings).unwrap();
            for _ in 0..12 {
                stepper.advance(&mut rods, 5e-4, &loads, &boundary).unwrap();
            }
            rods
        })
    };
    let all: Vec<usize> = (0..sizes.len()).collect();
    let one = run(&all, 1);
    assert_eq!(one, run(&all, 4));
    for k in all {
        let alone = run(&[k], 1);
        let v = one.vertices(k);
        assert_eq!(alone.position[..], one.position[v.clone()], "strand {k}");
        assert_eq!(alone.velocity[..], one.velocity[v]);
        assert_eq!(alone.twist_angle[..], one.twist_angle[one.edges(k)]);
    }
}

#[test]
fn corrections_move_only_what_they_touch_and_agree_with_the_inverse() {
    let mut rods = RodSet::new();
    for k in 0..3 {
        rods.add_strand(&curl(10, 0.2 * f64::from(k))).unwrap();
    }
    let loads = Loads::gravity(V::new(0.0, 0.0, -9.81));
    let mut boundary = Boundary::default();
    boundary.clamp(&rods, 1, End::Root);
    let mut stepper = RodStepper::new(RodSettings::default()).unwrap();
    stepper.solve(&rods, 1e-3, &loads, &boundary).unwrap();
    let mut free = Vec::new();
    stepper.velocities_into(&rods, &mut free);
    stepper.prepare_factors(Some(&[1]));
    let inverse = stepper.strand_inverse(1).unwrap();
    let mut impulses = vec![V::zeros(); rods.vertex_count()];
    impulses[17] = V::new(1e-9, 2e-9, -1e-9);
    let mut x = vec![0.0; inverse.len()];
    for c in 0..3 {
        x[4 * 7 + c] = impulses[17][c];
    }
    inverse.apply(&mut x);
    let mut linear = RodStepper::new(RodSettings::default()).unwrap();
    linear.solve(&rods, 1e-3, &loads, &boundary).unwrap();
    linear.correct(&rods, &impulses).unwrap();
    stepper.resolve(&rods, &impulses).unwrap();
    for v in 0..rods.vertex_count() {
        let (now, exact) = (linear.velocity(&rods, v), stepper.velocity(&rods, v));
        if (10..20).contains(&v) {
            let expected = free[v] + V::new(x[4 * (v - 10)], x[4 * (v - 10) + 1], x[4 * (v - 10) + 2]);
            assert!((now - expected).norm() <= 1e-9 * (expected.norm() + 1e-3), "{v} {now} {expected}");
            assert!((exact - expected).norm() <= 1e-3 * (expected.norm() + 1e-3), "{v} {exact} {expected}");
        } else {
            assert_eq!(now, free[v]);
            assert_eq!(exact, free[v]);
        }
    }
    stepper.accept(&mut rods).unwrap();
    assert!(stepper.accept(&mut rods).is_err());
}

#[test]
fn a_turning_clamp_carries_its_frame_through_many_turns() {
    let mut rods = RodSet::new();
    let spec = StrandSpec::straight(V::zeros(), V::new(0.0, 0.0, 0.1), 21, 1e-3, hair());
    let s = rods.add_strand(&spec.with_director(V::x())).unwrap();
    let mut stepper = RodStepper::new(RodSettings::default()).unwrap();
    let tip = rods.edges(s).end - 1;
    let steps = 60;
    for k in 1..=steps {
        let mut boundary = Boundary::default();
        boundary.clamp(&rods, s, End::Tip);
        let angle = 0.5 * f64::from(k);
        let d = V::new(angle.cos(), angle.sin(), 0.0);
        boundary.clamp_to(&rods, s, End::Root, [rods.position[0], rods.position[1]], d);
        stepper.advance(&mut rods, 0.01, &Loads::default(), &boundary).unwrap();
        let (m1, _) = rods.material_directors(s, 0);
        assert!((m1 - d).norm() < 1e-9);
    }
    // uniform twist −30 rad over 19 vertex lengths of 5 mm
    let total: f64 = (1..20).map(|i| rods.curvature_twist(s, i).1).sum();
    assert!((total + 0.5 * f64::from(steps)).abs() < 1e-9, "{total}");
    assert_eq!(rods.twist_angle[tip], 0.0);
}
