//! Equilibria, stability, rest shapes; the lane kernel against the element-wise assembly.

use nalgebra::Vector3;
use rods::*;

type V = Vector3<f64>;

fn material() -> StrandMaterial {
    StrandMaterial { young_modulus: 1e7, poisson_ratio: 0.3, density: 1000.0, ..Default::default() }
}

#[test]
fn heavy_cantilever_reaches_the_tabulated_shape() {
    // Γ = ρ g A L³/(E I) = 10, reach 0.656354, drop 0.700200 (length from the effective clamp)
    let (n, l, r, g) = (81usize, 1.0, 0.01, 9.81);
    let gamma = 10.0;
    let edge = l / (n as f64 - 1.5);
    let mut m = material();
    m.young_modulus = 4.0 * m.density * g * l * l * l / (r * r * gamma);
    let mut rods = RodSet::new();
    let end = V::new(l + 0.5 * edge, 0.0, 0.0);
    let s = rods.add_strand(&StrandSpec::straight(V::zeros(), end, n, r, m)).unwrap();
    let mut boundary = Boundary::default();
    boundary.clamp(&rods, s, End::Root);
    let loads = Loads::gravity(V::new(0.0, 0.0, -g));
    let report = equilibrium(&mut rods, &loads, &boundary, &EquilibriumSettings::default()).unwrap();
    let tip = rods.position[n - 1];
    eprintln!("{report:?} {} {}", tip.x - 0.5 * edge, tip.z);
    assert!((tip.x - 0.5 * edge - 0.656354).abs() < 5e-4);
    assert!((tip.z + 0.700200).abs() < 5e-4);
    assert_eq!(rods.unstable_modes(s, &loads, &boundary), 0);
    // forces balance
    let g = rods.elastic_gradient(s);
    for i in 2..n {
        let weight = rods.vertex_mass(s, i) * 9.81;
        assert!((g[4 * i + 2] + weight).abs() < 1e-6 * weight);
    }
}

#[test]
fn a_sag_free_curl_stays_where_it_is() {
    let positions: Vec<V> = (0..60)
        .map(|i| {
            let a = 0.25 * i as f64;
            V::new(0.02 * a.cos(), 0.02 * a.sin(), -0.003 * i as f64)
        })
        .collect();
    let mut spec = StrandSpec::new(positions, 2e-4, StrandMaterial { young_modulus: 1e9, ..material() });
    spec.radii = vec![[3e-4, 2e-4]];
    spec.twist_angles = Some((0..59).map(|j| 0.03 * j as f64).collect());
    let mut rods = RodSet::new();
    let s = rods.add_strand(&spec).unwrap();
    let mut boundary = Boundary::default();
    boundary.clamp(&rods, s, End::Root);
    let loads = Loads::gravity(V::new(0.0, 0.0, -9.81));
    let start = rods.clone();
    make_sag_free(&mut rods, &loads, &boundary).unwrap();
    let g = rods.elastic_gradient(s);
    let weight = rods.vertex_mass(s, 30) * 9.81;
    for i in 2..60 {
        for c in 0..3 {
            let pull = if c == 2 { -rods.vertex_mass(s, i) * 9.81 } else { 0.0 };
            assert!((g[4 * i + c] - pull).abs() < 1e-6 * weight, "{i} {c}: {} {pull}", g[4 * i + c]);
        }
    }
    assert_eq!(rods.unstable_modes(s, &loads, &boundary), 0);
    let mut stepper = RodStepper::new(RodSettings::default()).unwrap();
    for _ in 0..100 {
        stepper.advance(&mut rods, 1e-2, &loads, &boundary).unwrap();
    }
    for (x, y) in rods.position.iter().zip(&start.position) {
        assert!((x - y).norm() < 1e-7, "{}", (x - y).norm());
    }
}

#[test]
fn a_free_strand_has_no_net_force_or_torque_and_a_consistent_hessian() {
    let positions: Vec<V> =
        (0..15).map(|i| V::new((0.7 * i as f64).sin(), (0.4 * i as f64).cos(), 0.3 * i as f64) * 0.01).collect();
    let mut spec = StrandSpec::new(positions, 1e-3, material()).with_rest(RestShape::Straight);
    spec.radii = (0..15).map(|i| [1e-3 + 2e-5 * i as f64, 7e-4]).collect();
    spec.twist_angles = Some((0..14).map(|j| 3.0 * (j as f64).sin()).collect());
    spec.rest_lengths = Some(vec![0.006; 14]);
    let mut rods = RodSet::new();
    let s = rods.add_strand(&spec).unwrap();
    let g = rods.elastic_gradient(s);
    let largest = g.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let (mut force, mut torque) = (V::zeros(), V::zeros());
    for i in 0..15 {
        let f = V::new(g[4 * i], g[4 * i + 1], g[4 * i + 2]);
        force += f;
        torque += rods.position[i].cross(&f);
        if i < 14 {
            torque += rods.tangent(s, i).0 * g[4 * i + 3];
        }
    }
    assert!(force.norm() < 1e-10 * largest);
    assert!(torque.norm() < 1e-10 * largest * 0.05);
    // six rigid motions leave the strand without first-order stress: the Hessian applied to a translation vanishes
    let h = rods.elastic_hessian(s);
    let mut out = vec![0.0; 60];
    let x: Vec<f64> = (0..60).map(|d| if d % 4 == 1 { 1.0 } else { 0.0 }).collect();
    h.multiply(&x, &mut out);
    let scale = h.columns.iter().flatten().fold(0.0f64, |m, v| m.max(v.abs()));
    assert!(out.iter().all(|v| v.abs() < 1e-10 * scale));
}

/// One Newton step of the lane kernel equals the step computed from the element-wise gradient and Hessian.
#[test]
fn lane_kernel_and_elementwise_assembly_agree() {
    let positions: Vec<V> =
        (0..9).map(|i| V::new((0.7 * i as f64).sin(), (0.4 * i as f64).cos(), 0.3 * i as f64) * 0.01).collect();
    let mut spec = StrandSpec::new(positions, 1e-3, material()).with_rest(RestShape::Straight);
    spec.twist_angles = Some((0..8).map(|j| 0.1 * (j as f64).sin()).collect());
    let mut rods = RodSet::new();
    let s = rods.add_strand(&spec).unwrap();
    let dt = 1e-6;
    let loads = Loads::default();
    let mut stepper = RodStepper::new(RodSettings { tolerance: 1e-12, ..Default::default() }).unwrap();
    stepper.solve(&rods, dt, &loads, &Boundary::default()).unwrap();
    stepper.prepare_factors(None);
    let inverse = stepper.strand_inverse(s).unwrap();
    let mut moved = rods.clone();
    stepper.accept(&mut moved).unwrap();
    // at the solution: M v = −τ ∇E(q)
    let g = moved.elastic_gradient(s);
    let mass = moved.mass_diagonal(s, &loads);
    for i in 0..9 {
        for c in 0..3 {
            let p = mass[4 * i + c] * moved.velocity[i][c];
            assert!((p + dt * g[4 * i + c]).abs() < 1e-8 * dt * g[4 * i + c].abs().max(1e-3), "{i} {c}");
        }
    }
    // and K = M + τ² H there
    let h = moved.elastic_hessian(s);
    let x: Vec<f64> = (0..36).map(|d| if d == 35 { 0.0 } else { (d as f64 * 1.7).sin() }).collect();
    let mut y = vec![0.0; 36];
    h.multiply(&x, &mut y);
    for d in 0..36 {
        y[d] = mass[d] * x[d] + dt * dt * y[d];
    }
    inverse.apply(&mut y);
    for d in 0..35 {
        assert!((x[d] - y[d]).abs() < 1e-8, "{d}: {} {}", x[d], y[d]);
    }
}
