//! Hard states: what must stay finite, stable and honest (spec 12, rows 21–26, 37, 38).

use nalgebra::Vector3;
use rods::*;

type V = Vector3<f64>;

const GRAVITY: V = V::new(0.0, 0.0, -9.81);

fn hair(young_modulus: f64) -> StrandMaterial {
    StrandMaterial { young_modulus, ..StrandMaterial::default() }
}

fn clamped(spec: &StrandSpec) -> (RodSet, Boundary) {
    let mut rods = RodSet::new();
    rods.add_strand(spec).unwrap();
    let mut boundary = Boundary::default();
    boundary.clamp(&rods, 0, End::Root);
    (rods, boundary)
}

/// Stiffness over nine decades: Newton converges, energy never grows, the strand ends inside its length.
#[test]
fn soft_and_stiff_strands_fall_and_settle() {
    for young in [1e3, 1e5, 1e7, 1e9, 1e12] {
        let spec = StrandSpec::straight(V::zeros(), V::x() * 0.2, 41, 1e-4, hair(young));
        let (mut rods, boundary) = clamped(&spec);
        let loads = Loads::gravity(GRAVITY);
        let mut stepper = RodStepper::new(RodSettings::default()).unwrap();
        let mut energy = rods.energy(&loads).total();
        let mut most = 0;
        for _ in 0..150 {
            let report = stepper.advance(&mut rods, 2e-3, &loads, &boundary).unwrap();
            most = most.max(report.solve.iterations);
            let now = rods.energy(&loads).total();
            assert!(now <= energy + 1e-9 * energy.abs().max(1e-9), "E = {young:e}: {energy} -> {now}");
            energy = now;
        }
        assert!(most <= 40, "E = {young:e}: {most} iterations");
        rods.check().unwrap();
    }
}

/// Short and long edges, 1 : 1000, in one strand.
#[test]
fn a_strand_of_very_unequal_edges_swings() {
    let mut x = 0.0;
    let mut positions = vec![V::zeros()];
    for i in 0..30 {
        x += if i % 3 == 1 { 2e-5 } else { 2e-2 };
        positions.push(V::new(x, 0.0, 0.0));
    }
    let (mut rods, boundary) = clamped(&StrandSpec::new(positions, 1e-4, hair(3.7e9)));
    let loads = Loads::gravity(GRAVITY);
    let mut stepper = RodStepper::new(RodSettings::default()).unwrap();
    let mut energy = rods.energy(&loads).total();
    for _ in 0..100 {
        stepper.advance(&mut rods, 1e-3, &loads, &boundary).unwrap();
        let now = rods.energy(&loads).total();
        assert!(now <= energy + 1e-12, "{energy} {now}");
        energy = now;
    }
    assert!(rods.position[30].z < -0.01);
}

/// Folded by 175° and let go: unfolds without a jump or a number that is not finite.
#[test]
fn a_strand_folded_back_on_itself_opens() {
    let mut positions: Vec<V> = (0..11).map(|i| V::new(0.01 * i as f64, 0.0, 0.0)).collect();
    let turn = 175f64.to_radians();
    for i in 1..11 {
        positions.push(V::new(0.1 + 0.01 * i as f64 * turn.cos(), 0.01 * i as f64 * turn.sin(), 0.0));
    }
    let spec = StrandSpec::new(positions, 1e-4, hair(1e8)).with_rest(RestShape::Straight);
    let (mut rods, boundary) = clamped(&spec);
    let loads = Loads::default();
    let mut stepper = RodStepper::new(RodSettings::default()).unwrap();
    let mut energy = rods.energy(&loads).total();
    let mut furthest = 0.0f64;
    for _ in 0..400 {
        stepper.advance(&mut rods, 1e-3, &loads, &boundary).unwrap();
        furthest = furthest.max(rods.position[20].norm());
        let now = rods.energy(&loads).total();
        assert!(now.is_finite() && now <= energy * (1.0 + 1e-9));
        energy = now;
    }
    rods.check().unwrap();
    assert!(furthest > 0.15, "{furthest}");
    // an exact fold has no direction to open in and is refused
    let flat = vec![V::zeros(), V::x(), V::zeros() + V::x() * 1e-3];
    assert!(matches!(
        RodSet::new().add_strand(&StrandSpec::new(flat, 1e-4, hair(1e8))),
        Err(RodError::Geometry { .. })
    ));
}

/// 200 turns of twist wound up and let go: continuous past every full turn, uniform, and unwinding gives the energy back.
#[test]
fn two_hundred_turns_are_counted() {
    let spec = StrandSpec::straight(V::zeros(), V::x() * 0.4, 81, 1e-4, hair(1e7));
    let (mut rods, _) = clamped(&spec);
    let mut stepper = RodStepper::new(RodSettings::default()).unwrap();
    let total = 200.0 * std::f64::consts::TAU;
    for k in 1..=500 {
        // all vertices held on the line: pure twist, no loops
        let mut boundary = Boundary::default();
        for v in 0..81 {
            boundary.fix_vertex(v, rods.position[v]);
        }
        boundary.edges.push(FixedEdge { edge: 0, angle: FixedAngle::Angle(0.0) });
        boundary.edges.push(FixedEdge { edge: 79, angle: FixedAngle::Angle(total * f64::from(k) / 500.0) });
        stepper.advance(&mut rods, 1e-2, &Loads::default(), &boundary).unwrap();
    }
    let sum: f64 = (1..80).map(|i| rods.curvature_twist(0, i).1).sum();
    assert!((sum - total).abs() < 1e-8 * total, "{sum} {total}");
    let mut free = Boundary::default();
    free.clamp(&rods, 0, End::Root);
    let mut energy = rods.energy(&Loads::default()).total();
    for _ in 0..100 {
        stepper.advance(&mut rods, 1e-4, &Loads::default(), &free).unwrap();
        let now = rods.energy(&Loads::default()).total();
        assert!(now.is_finite() && now <= energy * (1.0 + 1e-6), "{energy} {now}");
        energy = now;
    }
}

/// Root jerked at 10⁴ m/s²: the clamp is where it was sent, exactly, and the strand follows.
#[test]
fn a_root_jerked_sideways_takes_the_strand_along() {
    for dt in [1e-4, 1e-3] {
        let spec = StrandSpec::straight(V::zeros(), V::new(0.0, 0.0, -0.1), 41, 5e-5, hair(3.7e9));
        let (mut rods, _) = clamped(&spec);
        let (a, b) = (rods.position[0], rods.position[1]);
        let loads = Loads::gravity(GRAVITY);
        let mut stepper = RodStepper::new(RodSettings::default()).unwrap();
        let steps = (4e-3 / dt) as usize;
        let mut most = 0;
        for k in 1..=steps {
            let t = k as f64 * dt;
            let shift = V::x() * (0.5 * 1e4 * t * t);
            let mut boundary = Boundary::default();
            boundary.fix_vertex(0, a + shift);
            boundary.fix_vertex(1, b + shift);
            boundary.edges.push(FixedEdge { edge: 0, angle: FixedAngle::Angle(0.0) });
            let report = stepper.advance(&mut rods, dt, &loads, &boundary).unwrap();
            most = most.max(report.solve.iterations);
            assert_eq!(rods.position[0], a + shift);
        }
        rods.check().unwrap();
        let worst = rods.tension(0).iter().fold(0.0f64, |m, t| m.max(t.abs()));
        assert!(worst.is_finite() && most <= 60, "{worst} {most}");
    }
}

/// Nothing acts, nothing moves: ten thousand steps leave every bit of a curled strand's position in place.
#[test]
fn rest_without_gravity_is_kept() {
    let positions = (0..15).map(|i| V::new((0.5 * i as f64).sin(), (0.5 * i as f64).cos(), 0.1 * i as f64) * 0.01);
    let mut rods = RodSet::new();
    rods.add_strand(&StrandSpec::new(positions.collect(), 5e-5, hair(3.7e9))).unwrap();
    let start = rods.clone();
    let mut stepper = RodStepper::new(RodSettings::default()).unwrap();
    for _ in 0..10_000 {
        stepper.advance(&mut rods, 1e-3, &Loads::default(), &Boundary::default()).unwrap();
    }
    let moved = rods.position.iter().zip(&start.position).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(moved < 1e-12, "{moved:e}");
}

/// No strands, strands of two vertices, a step that changes from one step to the next.
#[test]
fn empty_sets_single_edges_and_changing_steps() {
    let mut stepper = RodStepper::new(RodSettings { integrator: Integrator::Bdf2, ..Default::default() }).unwrap();
    let mut none = RodSet::new();
    assert!(stepper.advance(&mut none, 1e-3, &Loads::default(), &Boundary::default()).is_ok());
    let mut rods = RodSet::new();
    let mut material = hair(3.7e9);
    material.viscosity = 1e6;
    rods.add_strand(&StrandSpec::straight(V::zeros(), V::x() * 0.01, 2, 5e-5, material)).unwrap();
    rods.add_strand(&StrandSpec::straight(V::zeros(), V::x() * 0.1, 20, 5e-5, material)).unwrap();
    let mut boundary = Boundary::default();
    boundary.clamp(&rods, 1, End::Root);
    for k in 0..60 {
        let dt = [1e-3, 5e-4, 2e-3, 1e-5][k % 4];
        stepper.advance(&mut rods, dt, &Loads::gravity(GRAVITY), &boundary).unwrap();
    }
    rods.check().unwrap();
    assert!(RodSet::new().add_strand(&StrandSpec::new(vec![V::zeros()], 1e-4, material)).is_err());
    let mut broken = rods.clone();
    broken.position[3].x = f64::NAN;
    assert!(broken.check().is_err());
    assert!(stepper.advance(&mut broken, 1e-3, &Loads::default(), &Boundary::default()).is_err());
}

/// A snapshot taken in mid-run continues with the same bits, history included.
#[test]
fn a_snapshot_continues_with_the_same_bits() {
    for integrator in [Integrator::ImplicitEuler, Integrator::Bdf2, Integrator::ImplicitMidpoint] {
        let mut material = hair(3.7e9);
        material.viscosity = 1e5;
        let (mut rods, boundary) = clamped(&StrandSpec::straight(V::zeros(), V::x() * 0.1, 20, 5e-5, material));
        let loads = Loads::gravity(GRAVITY);
        let settings = RodSettings { integrator, ..Default::default() };
        let mut stepper = RodStepper::new(settings).unwrap();
        for _ in 0..10 {
            stepper.advance(&mut rods, 1e-3, &loads, &boundary).unwrap();
        }
        let mut copy = rods.clone();
        let mut other = RodStepper::new(settings).unwrap();
        for _ in 0..10 {
            stepper.advance(&mut rods, 1e-3, &loads, &boundary).unwrap();
            other.advance(&mut copy, 1e-3, &loads, &boundary).unwrap();
        }
        assert_eq!(rods, copy);
    }
}

/// Wind and drag: a free strand reaches the speed of the fluid; a film adds weight, not acceleration.
#[test]
fn drag_pulls_to_the_fluid_and_film_mass_falls_alike() {
    let mut rods = RodSet::new();
    rods.add_strand(&StrandSpec::straight(V::zeros(), V::x() * 0.05, 11, 5e-5, hair(3.7e9))).unwrap();
    let (drag, wind) = (vec![1e-6; 11], vec![V::new(0.3, 0.2, -0.1); 11]);
    let mut stepper = RodStepper::new(RodSettings::default()).unwrap();
    let loads = Loads { drag: Some(&drag), fluid_velocity: Some(&wind), ..Loads::default() };
    for _ in 0..200 {
        stepper.advance(&mut rods, 5e-3, &loads, &Boundary::default()).unwrap();
    }
    assert!(rods.velocity.iter().all(|v| (v - wind[0]).norm() < 1e-6));
    let (mass, height) = (vec![1e-7; 11], vec![1e-4; 11]);
    let loads = Loads { gravity: GRAVITY, film_mass: Some(&mass), film_height: Some(&height), ..Loads::default() };
    let before = rods.velocity[5];
    stepper.advance(&mut rods, 1e-3, &loads, &Boundary::default()).unwrap();
    assert!((rods.velocity[5] - before - GRAVITY * 1e-3).norm() < 1e-9);
}
