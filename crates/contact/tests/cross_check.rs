//! The solver and the cone programmes agree on random systems; the convex model lifts sliding bodies.

use contact::cross_check::{OracleSettings, PrimalProblem, certify, convex_model, cross_check, cross_check_primal};
use contact::families::{Random, random_system};
use contact::{BlockMatrix, ContactProblem, ContactSettings, solve};

fn difference(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let (mut d, mut s) = (0.0, 0.0);
    for (x, y) in a.iter().zip(b) {
        for i in 0..3 {
            d += (x[i] - y[i]).powi(2);
            s += x[i].powi(2).max(y[i].powi(2));
        }
    }
    if s > 0.0 { (d / s).sqrt() } else { d.sqrt() }
}

/// Random systems of all ranks, with and without cohesion: velocities agree (median 5e-7, nine tenths within 1e-5); where they differ, the
/// cone solver confirms ours as a second solution.
#[test]
fn velocities_agree_with_the_dual_form() {
    let mut random = Random::new(11);
    let mut found = Vec::new();
    for _ in 0..24 {
        let n = random.index(2, 16);
        let dofs = random.index(3, 6 * n);
        let p = random_system(&mut random, n, dofs, (0.0, 0.8), 0.2);
        let ours = solve(&p, None, &ContactSettings { tolerance: 1e-10, ..ContactSettings::default() });
        assert!(ours.report.status().is_converged(), "{:?}", ours.report);
        let oracle = cross_check(&p, &OracleSettings::default()).unwrap();
        let mut d = difference(&ours.velocities, &oracle.velocities);
        if d > 1e-4 && oracle.residual < 1e-6 {
            // two solutions of the same law: the cone solver must confirm ours too
            let confirmed = certify(&p, &ours.velocities, &OracleSettings::default()).unwrap();
            d = difference(&ours.velocities, &confirmed.velocities);
        }
        found.push(d);
    }
    found.sort_by(f64::total_cmp);
    assert!(found[12] < 5e-7, "median {}", found[12]);
    assert!(found[21] < 1e-5, "nine tenths {}", found[21]);
}

/// The primal form, which never forms W, gives the same velocities.
#[test]
fn velocities_agree_with_the_primal_form() {
    let mut random = Random::new(5);
    let mut found = Vec::new();
    for _ in 0..10 {
        let (n, m) = (random.index(2, 8), 12);
        let h: Vec<Vec<f64>> = (0..3 * n).map(|_| (0..m).map(|_| random.normal()).collect()).collect();
        let mass: Vec<f64> = (0..m).map(|_| random.uniform(0.5, 2.0)).collect();
        let f: Vec<f64> = (0..m).map(|_| random.normal()).collect();
        let w: Vec<[f64; 3]> = (0..n).map(|_| [random.normal() + 0.5, random.normal(), random.normal()]).collect();
        let friction: Vec<f64> = (0..n).map(|_| random.uniform(0.1, 0.5)).collect();
        let cohesion: Vec<f64> = (0..n).map(|_| random.uniform(0.0, 0.05)).collect();
        let mut triplets = Vec::new();
        for k in 0..n {
            for l in 0..n {
                let mut b = [0.0; 9];
                for i in 0..3 {
                    for j in 0..3 {
                        b[3 * i + j] = (0..m).map(|d| h[3 * k + i][d] * h[3 * l + j][d] / mass[d]).sum();
                    }
                }
                triplets.push((k as u32, l as u32, b));
            }
        }
        let q = (0..n)
            .map(|k| [0, 1, 2].map(|c| w[k][c] + (0..m).map(|d| h[3 * k + c][d] * f[d] / mass[d]).sum::<f64>()))
            .collect();
        let p = ContactProblem {
            dimension: 3,
            delassus: BlockMatrix::from_triplets(n, &triplets),
            free_velocity: q,
            friction: friction.clone(),
            cohesion: cohesion.clone(),
        };
        let primal = PrimalProblem {
            dofs: m,
            stiffness: (0..m).map(|d| (d, d, mass[d])).collect(),
            force: f,
            jacobian: (0..3 * n).flat_map(|r| (0..m).map(move |d| (r, d))).map(|(r, d)| (r, d, h[r][d])).collect(),
            prescribed: w,
            friction,
            cohesion,
        };
        let ours = solve(&p, None, &ContactSettings { tolerance: 1e-10, ..ContactSettings::default() });
        let oracle = cross_check_primal(&primal, &OracleSettings::default()).unwrap();
        if oracle.status.is_converged() && ours.report.status().is_converged() {
            found.push(difference(&ours.velocities, &oracle.velocities));
        }
    }
    found.sort_by(f64::total_cmp);
    assert!(found.len() >= 7, "only {} of 10 comparable", found.len());
    assert!(found[found.len() / 2] < 1e-6, "{found:?}");
}

/// A block sliding on a plane: exact Coulomb keeps it down, the one-shot convex model lifts it with u_N = ν u_T.
#[test]
fn the_convex_model_lifts_and_exact_coulomb_does_not() {
    let w = BlockMatrix::from_triplets(1, &[(0, 0, contact::block::IDENTITY)]);
    let p = ContactProblem::new(w, vec![[-0.1, 1.0, 0.0]], vec![0.3]).unwrap();
    let exact = solve(&p, None, &ContactSettings::default());
    assert!(exact.velocities[0][0].abs() < 1e-15);
    assert!((exact.velocities[0][1] - 0.97).abs() < 1e-15);
    let relaxed = convex_model(&p, &OracleSettings::default()).unwrap();
    let u = relaxed.velocities[0];
    assert!((u[0] - 0.3 * u[1]).abs() < 1e-8 && u[0] > 0.2, "{u:?}");
    let checked = cross_check(&p, &OracleSettings::default()).unwrap();
    assert!(checked.status.is_converged() && checked.velocities[0][0].abs() < 1e-8);
}

/// An unsymmetric matrix has no convex form, and that is said.
#[test]
fn unsymmetric_problems_are_refused() {
    let mut b = contact::block::IDENTITY;
    b[1] = 0.01;
    let p =
        ContactProblem::new(BlockMatrix::from_triplets(1, &[(0, 0, b)]), vec![[-1.0, 0.5, 0.0]], vec![0.3]).unwrap();
    let e = cross_check(&p, &OracleSettings::default()).unwrap_err();
    assert!(e.to_string().contains("not symmetric"), "{e}");
}
