//! Splits a problem into groups, solves them and puts the answer together.

use super::admm::Admm;
use super::auto::Auto;
use super::gauss_seidel::GaussSeidel;
use super::group::{Group, GroupOutcome, GroupSolver};
use super::newton::Newton;
use super::part::Part;
use crate::block::{Vec3, norm_squared};
use crate::law::{ContactState, classify, natural_map};
use crate::problem::residual::ResidualParts;
use crate::problem::{Component, ContactProblem, Scaling, components};
use crate::report::{ContactReport, Method, StageReport};
use crate::settings::{ContactSettings, SolverChoice};
use numerics::{SolveReport, Status};
use rayon::prelude::*;

/// The answer to a contact problem.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// Impulses `r` [N s] (cohesive shift taken off), one per contact, normal first.
    pub impulses: Vec<Vec3>,
    /// Relative velocities `u = W r + q` [m/s].
    pub velocities: Vec<Vec3>,
    /// What each contact does.
    pub states: Vec<ContactState>,
    /// Contacts that press without measure because together they ask for what no motion gives, ascending; empty as a rule.
    pub opposed: Vec<u32>,
    /// How the solve went.
    pub report: ContactReport,
}

/// Solves a problem; `warm` are impulses to start from (cohesive shift not included), as many as contacts.
///
/// Never fails and never returns a number that is not finite: when no method reaches the tolerance the best iterate
/// comes back with its residual and a status that says so.
#[must_use]
pub fn solve(problem: &ContactProblem, warm: Option<&[Vec3]>, settings: &ContactSettings) -> Solution {
    match settings.solver {
        SolverChoice::Auto => {
            let auto = Auto {
                local: settings.local,
                max_newton_iterations: settings.max_newton_iterations,
                // the last resort of `Auto` may not cost what the user would only grant by name
                max_sweeps: settings.max_sweeps.min(2_000),
                max_admm_iterations: settings.max_admm_iterations,
            };
            solve_with(problem, warm, settings, &auto)
        }
        SolverChoice::GaussSeidel => {
            solve_with(problem, warm, settings, &GaussSeidel::new(settings.max_sweeps, settings.local))
        }
        SolverChoice::Newton => {
            let newton = Newton { max_iterations: settings.max_newton_iterations, ..Newton::default() };
            solve_with(problem, warm, settings, &newton)
        }
        SolverChoice::Admm => {
            let admm = Admm { max_iterations: settings.max_admm_iterations, ..Admm::default() };
            solve_with(problem, warm, settings, &admm)
        }
    }
}

/// Solves a problem with a given method for every group.
///
/// Where `W` is far from one the unit step weighs one side of the law alone, and what passes may break the law by the whole
/// free velocity. Such an answer does not count: the problem is solved again with every contact in its own scale, and the
/// answer judged by the unit step as asked.
#[must_use]
pub fn solve_with(
    problem: &ContactProblem,
    warm: Option<&[Vec3]>,
    settings: &ContactSettings,
    solver: &(dyn GroupSolver + Sync),
) -> Solution {
    let first = solve_once(problem, warm, settings, solver);
    let passed = first.report.solve.residual <= settings.tolerance;
    if settings.scaling == Scaling::PerContact || first.report.status().is_converged() || !passed {
        return first;
    }
    let own_scale = ContactSettings { scaling: Scaling::PerContact, ..*settings };
    let second = solve_once(problem, None, &own_scale, solver);
    // at the answer already: only judged
    let mut judged = solve_once(problem, Some(&second.impulses), settings, solver);
    if !judged.report.status().is_converged() {
        return first;
    }
    judged.report.stages = second.report.stages;
    judged.report.solve.iterations += first.report.solve.iterations + second.report.solve.iterations;
    judged
}

fn solve_once(
    problem: &ContactProblem,
    warm: Option<&[Vec3]>,
    settings: &ContactSettings,
    solver: &(dyn GroupSolver + Sync),
) -> Solution {
    let n = problem.len();
    if n == 0 {
        return Solution {
            impulses: Vec::new(),
            velocities: Vec::new(),
            states: Vec::new(),
            opposed: Vec::new(),
            report: ContactReport::empty(settings.tolerance),
        };
    }
    let q = problem.shifted_velocity();
    let mut r: Vec<Vec3> = match warm {
        Some(w) if w.len() == n => (0..n).map(|k| [w[k][0] + problem.cohesion_of(k), w[k][1], w[k][2]]).collect(),
        _ => vec![[0.0; 3]; n],
    };
    let groups = components(&problem.delassus);
    let outcomes: Vec<GroupOutcome> = if groups.len() == 1 {
        let group = Group::whole(problem, &q, settings.scaling, settings.tolerance);
        vec![solver.solve(&group, &mut r)]
    } else {
        let mut free = 0.0;
        for k in 0..n {
            let rho = settings.scaling.weight(&problem.delassus, k);
            free += rho * rho * norm_squared(&q[k]);
        }
        // Half the tolerance per group, relative to its own size or to an even share of ‖ρq‖: the squares then sum to
        // at most the tolerance of the whole.
        let floor = (free / groups.len() as f64).sqrt();
        let mut position = vec![0u32; n];
        for g in &groups {
            for (local, k) in g.contacts.iter().enumerate() {
                position[*k as usize] = local as u32;
            }
        }
        let one = |g| {
            let mut part = Part::take(g, &position, &problem.delassus, &q, &problem.friction, &r);
            let (scaling, tolerance) = (settings.scaling, 0.5 * settings.tolerance);
            let outcome = part.solve(scaling, tolerance, floor, |group, x| solver.solve(group, x));
            (outcome, part)
        };
        let solved: Vec<(GroupOutcome, Part<'_>)> = if n >= settings.parallel_above && rayon::current_num_threads() > 1
        {
            groups.par_iter().map(one).collect()
        } else {
            groups.iter().map(one).collect()
        };
        solved
            .into_iter()
            .map(|(outcome, part)| {
                part.put_back(&mut r);
                outcome
            })
            .collect()
    };
    finish(problem, settings, q, r, &groups, &outcomes)
}

fn finish(
    problem: &ContactProblem,
    settings: &ContactSettings,
    q: Vec<Vec3>,
    mut r: Vec<Vec3>,
    groups: &[Component],
    outcomes: &[GroupOutcome],
) -> Solution {
    let n = problem.len();
    let (mut parts, mut violation) = (ResidualParts::default(), ResidualParts::default());
    let mut velocities = vec![[0.0; 3]; n];
    problem.delassus.apply(&r, &q, &mut velocities);
    for k in 0..n {
        let rho = settings.scaling.weight(&problem.delassus, k);
        parts.add(&r[k], &velocities[k], &q[k], problem.friction[k], rho);
        let own = Scaling::PerContact.weight(&problem.delassus, k);
        violation.add(&r[k], &velocities[k], &q[k], problem.friction[k], own);
    }
    let residual = parts.relative();
    let worst = outcomes.iter().map(|o| o.status).max_by_key(|s| s.severity()).unwrap_or(Status::Converged);
    // Impulses that run away (no solution exists) make any residual relative to them small. In velocity terms the law must
    // hold to a hundredth of the free velocity as well.
    let jammed = violation.breaks_the_law();
    let guarded = parts.guarded_size(settings.scaling);
    let held = residual <= settings.tolerance && parts.map_squared.sqrt() <= settings.tolerance * guarded.max(0.0);
    let status = if jammed {
        if worst.is_converged() { Status::Stalled } else { worst }
    } else if held {
        Status::Converged
    } else if worst.is_converged() {
        Status::Stalled
    } else {
        worst
    };
    let opposed = opposed(problem, groups, (&q, &r, &velocities));
    let stages = Method::ALL
        .into_iter()
        .filter_map(|method| {
            let used = outcomes.iter().filter_map(|o| o.iterations[method as usize]);
            let (groups, iterations) = used.fold((0, 0), |(g, i), x| (g + 1, i + x));
            let converged = outcomes.iter().filter(|o| o.last == method && o.status.is_converged()).count();
            (groups > 0).then_some(StageReport { method, groups, iterations, converged })
        })
        .collect::<Vec<_>>();
    let tolerance = settings.tolerance.max(1e-14);
    let impulse_scale = 10.0 * tolerance * (parts.impulse_squared / n as f64).sqrt();
    let velocity_scale =
        10.0 * tolerance * (q.iter().chain(&velocities).map(norm_squared).sum::<f64>() / n as f64).sqrt();
    let states = (0..n)
        .map(|k| {
            classify(&r[k], &velocities[k], problem.friction[k], problem.cohesion_of(k), impulse_scale, velocity_scale)
        })
        .collect();
    for (k, v) in r.iter_mut().enumerate() {
        v[0] -= problem.cohesion_of(k);
    }
    let solve = SolveReport {
        status,
        iterations: stages.iter().map(|s: &StageReport| s.iterations).sum(),
        residual,
        tolerance: settings.tolerance,
    };
    Solution {
        impulses: r,
        velocities,
        states,
        opposed,
        report: ContactReport { solve, groups: outcomes.len(), stages },
    }
}

/// Impulses over free velocity, in one unit, from which on the contacts of a group are looked at for opposition.
const LOUD: f64 = 100.0;

/// Share of the largest impulse that contacts have which oppose each other.
const SHARE: f64 = 0.01;

/// Share of the free velocity of its group by which such a contact alone breaks the law.
const BROKEN: f64 = 1e-3;

/// Contacts whose demands contradict each other: their impulses grew without end, and they still break the law. A rough tolerance
/// may call such a group solved, since it is relative to the impulses.
fn opposed(problem: &ContactProblem, groups: &[Component], (q, r, u): (&[Vec3], &[Vec3], &[Vec3])) -> Vec<u32> {
    let mut found = Vec::new();
    let weight = |k: usize| Scaling::PerContact.weight(&problem.delassus, k);
    for group in groups {
        let mut parts = ResidualParts::default();
        let mut largest = 0.0_f64;
        for k in group.contacts.iter().map(|k| *k as usize) {
            parts.add(&r[k], &u[k], &q[k], problem.friction[k], weight(k));
            largest = largest.max(norm_squared(&r[k]));
        }
        if largest <= LOUD * LOUD * parts.free_squared {
            continue;
        }
        let broken = BROKEN * BROKEN * parts.free_squared;
        let opposes = |k: &&u32| {
            let k = **k as usize;
            let map = natural_map(&r[k], &u[k], problem.friction[k], weight(k));
            norm_squared(&r[k]) > SHARE * SHARE * largest && norm_squared(&map) > broken
        };
        found.extend(group.contacts.iter().filter(opposes));
    }
    found.sort_unstable();
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::IDENTITY;
    use crate::problem::BlockMatrix;

    /// A body is to be pushed away from two walls that face each other, and another from one: no motion does the first. The two
    /// contacts are named, the third is not; and nobody is once the walls only forbid to come nearer.
    #[test]
    fn contacts_that_contradict_each_other_are_named() {
        let mirrored = [-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        let triplets = [(0, 0, IDENTITY), (0, 2, mirrored), (1, 1, IDENTITY), (2, 0, mirrored), (2, 2, IDENTITY)];
        let solved = |push: f64| {
            let q = vec![[-push, 0.1, 0.0], [-1.0, 0.2, 0.0], [-push, 0.1, 0.0]];
            let problem = ContactProblem::new(BlockMatrix::from_triplets(3, &triplets), q, vec![0.4; 3]).unwrap();
            solve(&problem, None, &ContactSettings::default())
        };
        let wedged = solved(1.0);
        assert!(!wedged.report.status().is_converged());
        assert_eq!(wedged.opposed, [0, 2]);
        let at_rest = solved(0.0);
        assert!(at_rest.report.status().is_converged() && at_rest.opposed.is_empty(), "{at_rest:?}");
    }
}
