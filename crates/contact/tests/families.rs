//! The project's own hyperstatic problems, threads, warm starts, jammed and infeasible problems.

use contact::block::IDENTITY;
use contact::families::{Bodies, Family, Random, arch, boxes, capsules, squeezed_bundle, tower};
use contact::{BlockMatrix, ContactProblem, ContactSettings, Scaling, SolverChoice, solve};

/// Three members of every family are solved to 1e-8 in both scalings.
#[test]
fn every_family_is_solved() {
    for family in Family::ALL {
        for seed in 0..3 {
            let p = family.member(seed);
            for scaling in [Scaling::UnitStep, Scaling::PerContact] {
                let s = solve(&p, None, &ContactSettings { scaling, ..ContactSettings::default() });
                assert!(s.report.status().is_converged(), "{} {seed} {scaling:?} {:?}", family.name(), s.report);
            }
        }
    }
}

/// Larger piles, each of which some method alone does not solve: alternating directions, Newton, and patches are all needed.
#[test]
fn larger_piles_are_solved() {
    for (family, seed, times) in [
        (Family::Tower, 8, 4),
        (Family::Boxes, 4, 4),
        (Family::Spheres, 15, 1),
        (Family::Capsules, 16, 4),
        (Family::Capsules, 2, 16),
    ] {
        let p = family.larger_member(seed, times);
        let s = solve(&p, None, &ContactSettings::default());
        assert!(s.report.status().is_converged(), "{} {seed} times {times}: {:?}", family.name(), s.report);
    }
}

/// Members in units of mass from 1e-10 to 1e10, with the unit step too: where that weighs one side of the law alone, the
/// answer must still be that of the law.
#[test]
fn every_family_is_solved_in_any_units() {
    for family in Family::ALL {
        let p = family.member(1);
        for exponent in [-10, -6, -3, 3, 6, 10] {
            let w = 10f64.powi(exponent);
            let triplets: Vec<_> = p.delassus.iter().map(|(i, j, b)| (i as u32, j as u32, b.map(|x| x * w))).collect();
            let matrix = BlockMatrix::from_triplets(p.len(), &triplets);
            let scaled = ContactProblem::new(matrix, p.free_velocity.clone(), p.friction.clone()).unwrap();
            for scaling in [Scaling::UnitStep, Scaling::PerContact] {
                let s = solve(&scaled, None, &ContactSettings { scaling, ..ContactSettings::default() });
                assert!(s.report.status().is_converged(), "{} 1e{exponent} {scaling:?} {:?}", family.name(), s.report);
            }
        }
    }
}

/// Squeezed and rubbed hairs: many contacts a strand, nine of ten of them open in the end.
#[test]
fn a_squeezed_bundle_is_solved() {
    let p = squeezed_bundle(19, 4e-3, 0.02, 0.3);
    let s = solve(&p, None, &ContactSettings { tolerance: 1e-6, ..ContactSettings::default() });
    let open = s.states.iter().filter(|s| **s == contact::law::ContactState::Open).count();
    assert!(s.report.status().is_converged(), "{:?}", s.report);
    assert!(p.len() > 200 && open > 0 && open < p.len(), "{open} of {} open", p.len());
}

/// The contact impulses take energy from rigid bodies, they never give any.
#[test]
fn impulses_never_add_energy() {
    let mut random = Random::new(9);
    let mut s = Bodies::default();
    for j in 0..6 {
        let b = s.add([0.0, 0.0, j as f64 + 0.5], random.uniform(0.2, 5.0), [0.2; 3]);
        for d in [[-0.5, -0.5], [-0.5, 0.5], [0.5, -0.5], [0.5, 0.5]] {
            s.touch(b, b.checked_sub(1), [d[0], d[1], j as f64], [0.0, 0.0, 1.0], 0.4);
        }
    }
    for step in 0..20 {
        for v in &mut s.velocity {
            for c in v.iter_mut() {
                *c += 0.1 * random.normal();
            }
        }
        s.accelerate([1.0, 0.0, -9.81], 0.01);
        let before = s.kinetic_energy();
        let solution = solve(&s.problem(), None, &ContactSettings { tolerance: 1e-10, ..ContactSettings::default() });
        assert!(solution.report.status().is_converged(), "step {step}: {:?}", solution.report);
        s.apply(&solution.impulses);
        assert!(s.kinetic_energy() <= before * (1.0 + 1e-9));
    }
}

/// The same bits for one and for four threads.
#[test]
fn threads_do_not_change_the_answer() {
    let mut random = Random::new(4);
    let p = capsules(&mut random, 250, 0.4, 0.05, 0.0);
    let settings = ContactSettings { parallel_above: 1, ..ContactSettings::default() };
    let run = |threads: usize| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| solve(&p, None, &settings))
    };
    let (one, four) = (run(1), run(4));
    assert!(one.report.groups > 1);
    assert_eq!(one.impulses, four.impulses);
    assert_eq!(one.report, four.report);
}

/// Units do not decide: a problem in other units of mass, length and time takes the same way to the same answer.
#[test]
fn units_do_not_decide() {
    let mut random = Random::new(8);
    let p = arch(&mut random, 9, 0.6, 0.01, 0.0);
    let base = solve(&p, None, &ContactSettings::default());
    let (mass, speed) = (2f64.powi(-30), 2f64.powi(7));
    let triplets: Vec<_> = p.delassus.iter().map(|(i, j, b)| (i as u32, j as u32, b.map(|v| v / mass))).collect();
    let q = p.free_velocity.iter().map(|v| v.map(|x| x * speed)).collect();
    let scaled = ContactProblem::new(BlockMatrix::from_triplets(p.len(), &triplets), q, p.friction.clone()).unwrap();
    let other = solve(&scaled, None, &ContactSettings::default());
    assert!(base.report.status().is_converged() && other.report.status().is_converged());
    for (a, b) in base.velocities.iter().zip(&other.velocities) {
        for c in 0..3 {
            assert!((a[c] * speed - b[c]).abs() <= 1e-6 * speed);
        }
    }
}

/// A warm start at the answer costs nothing; a useless one (infinite, too large) does no harm.
#[test]
fn warm_starts() {
    let mut random = Random::new(6);
    let p = boxes(&mut random, 3, 3, 0.5, [0.5, 0.0, -9.81], 0.0, 0.0);
    let settings = ContactSettings::default();
    let cold = solve(&p, None, &settings);
    let warm = solve(&p, Some(&cold.impulses), &settings);
    assert_eq!(warm.report.solve.iterations, 0);
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        let s = solve(&p, Some(&vec![[bad; 3]; p.len()]), &settings);
        assert!(s.report.status().is_converged());
        assert!(s.impulses.iter().flatten().all(|v| v.is_finite()));
    }
}

/// A contact squeezed between two walls that close on it has no solution: best iterate, finite, and a status that says so.
/// (Impulses that grow without bound would make any residual relative to them small: that must not count as solved.)
#[test]
fn jammed_problems_end_with_a_status() {
    // one freedom along x, two opposite contacts, both forced to close
    let w = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let minus = [-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0];
    let m = BlockMatrix::from_triplets(2, &[(0, 0, w), (0, 1, minus), (1, 0, minus), (1, 1, w)]);
    let p = ContactProblem::new(m, vec![[-1.0, 0.2, 0.0], [-1.0, 0.2, 0.0]], vec![0.3, 0.3]).unwrap();
    for solver in SolverChoice::ALL {
        let s = solve(&p, None, &ContactSettings { solver, max_sweeps: 200, ..ContactSettings::default() });
        assert!(!s.report.status().is_converged(), "{solver:?}");
        assert!(s.impulses.iter().chain(&s.velocities).flatten().all(|v| v.is_finite()));
        assert!(s.report.solve.residual.is_finite());
    }
}

/// Frictionless, bilateral, frozen and cohesive contacts side by side.
#[test]
fn mixed_kinds_of_contact() {
    let mut random = Random::new(12);
    for solver in SolverChoice::ALL {
        let mut p = tower(&mut random, 4, 0.5, [0.3, 0.0, -9.81], 0.02, 0.0);
        for k in 0..4 {
            p.friction[k] = 0.0;
        }
        p.friction[12] = 1e-14;
        p.cohesion = vec![0.01; p.len()];
        let s = solve(&p, None, &ContactSettings { solver, ..ContactSettings::default() });
        assert!(s.report.status().is_converged(), "{solver:?} {:?}", s.report);
        // a bilateral contact holds in every direction
        let w = BlockMatrix::from_triplets(
            2,
            &[(0, 0, IDENTITY), (0, 1, IDENTITY.map(|v| 0.5 * v)), (1, 0, IDENTITY.map(|v| 0.5 * v)), (1, 1, IDENTITY)],
        );
        let glued = ContactProblem::new(w, vec![[1.0, 0.3, -0.2], [-1.0, 0.5, 0.0]], vec![-1.0, 0.4]).unwrap();
        let s = solve(&glued, None, &ContactSettings { solver, ..ContactSettings::default() });
        assert!(s.report.status().is_converged(), "{solver:?} {:?}", s.report);
        assert!(s.velocities[0].iter().all(|v| v.abs() < 1e-7));
    }
}
