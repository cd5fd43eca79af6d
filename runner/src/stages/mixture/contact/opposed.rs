//! Contacts that ask for what no motion gives.
//!
//! A strand wedged between others that are held cannot be pushed away from all of them at once: the impulses that seem to come
//! nearer to it grow without end, and the rods that get them are torn apart. That an overlap is pushed apart is this program's
//! wish, not a law, so what opposes each other stops wishing it first; rest is then a motion that all of them allow. Where walls
//! close in on a strand even that does not help, and the contacts become soft: impulses stay in proportion, and the step warns.

use ::contact::assembly::ContactSystem;
use ::contact::block::Vec3;
use ::contact::problem::residual;
use ::contact::{ContactProblem, ContactSettings, Solution};
use numerics::Status;

use super::{Setting, motion};
use crate::world::contact::{ContactWorld, Yielding};

/// Solves of one round in which contacts may give way. Each makes at least one contact yield.
const MOST_SOLVES: usize = 12;

/// Softness of a contact that is one, in parts of its own mobility.
const SOFTNESS: f64 = 0.1;

impl ContactWorld {
    /// Solves the posed problem; contacts that turn out to oppose each other give way, and it is solved again.
    pub(super) fn solve(
        &mut self,
        system: &mut ContactSystem,
        start: &[Vec3],
        settings: &ContactSettings,
        setting: &Setting<'_>,
    ) -> Solution {
        let mut settings = *settings;
        let mut solves = 0;
        loop {
            let solution = self.solve_soft(&system.problem, start, &settings);
            self.report.iterations += solution.report.solve.iterations;
            solves += 1;
            let opposed = &solution.opposed;
            if solves == MOST_SOLVES || opposed.is_empty() {
                return solution;
            }
            if self.stop_pushing(&mut system.problem, opposed, setting) {
                continue;
            }
            // a contact next to a clamp needs impulses so large that a rough answer breaks the law: it is asked exactly first
            let rough = settings.tolerance > self.settings.tolerance;
            settings.tolerance = self.settings.tolerance;
            if !rough && !self.soften(opposed) {
                return solution;
            }
        }
    }

    /// Solves with the soft contacts softened; residual and status are those of the problem as it was posed.
    fn solve_soft(&self, problem: &ContactProblem, start: &[Vec3], settings: &ContactSettings) -> Solution {
        let soft: Vec<usize> = (0..problem.len()).filter(|k| self.lists.yielding[*k] == Yielding::Soft).collect();
        if soft.is_empty() {
            return ::contact::solve(problem, Some(start), settings);
        }
        let mut softened = problem.clone();
        soft.iter().for_each(|k| softened.delassus.soften(*k, SOFTNESS));
        let mut solution = ::contact::solve(&softened, Some(start), settings);
        let shifted = |(k, r): (usize, &Vec3)| [r[0] + problem.cohesion_of(k), r[1], r[2]];
        let whole: Vec<Vec3> = solution.impulses.iter().enumerate().map(shifted).collect();
        let q = problem.shifted_velocity();
        let told = &mut solution.report.solve;
        told.residual = residual(&problem.delassus, &q, &problem.friction, &whole, settings.scaling);
        let held = told.residual <= settings.tolerance;
        if told.status.is_converged() && !held {
            told.status = Status::Stalled;
        }
        solution.velocities = problem.velocities(&solution.impulses);
        solution
    }

    /// Contacts that oppose each other stop pushing their overlap apart. Returns whether there were any that did.
    fn stop_pushing(&mut self, problem: &mut ContactProblem, opposed: &[u32], setting: &Setting<'_>) -> bool {
        let lists = &mut self.lists;
        let step = if lists.drift.is_empty() { setting.dt } else { setting.tau };
        let mut any = false;
        for k in opposed.iter().map(|k| *k as usize) {
            let c = &lists.active[k];
            // what bounces is driven apart by its restitution, not by a push
            let bounces = c.with_solid() && setting.solids[c.key.b.1 as usize].restitution > 0.0;
            if lists.yielding[k] == Yielding::No && !bounces && c.gap < 0.0 {
                problem.free_velocity[k][0] -= motion::push(c, lists, &self.first_vertex) / step;
                lists.yielding[k] = Yielding::Still;
                any = true;
            }
        }
        any
    }

    /// Contacts that oppose each other even at rest become soft. Returns whether there were any that did.
    fn soften(&mut self, opposed: &[u32]) -> bool {
        let mut any = false;
        for k in opposed {
            let yielding = &mut self.lists.yielding[*k as usize];
            any |= *yielding != Yielding::Soft;
            *yielding = Yielding::Soft;
        }
        any
    }
}
