//! The same problem solved again by an independent method, every so many steps. Its answer is compared, never used.

use ::contact::assembly::ContactSystem;
use ::contact::block::{norm_squared, sub};
use ::contact::cross_check::{OracleSettings, certify, cross_check};

use crate::world::contact::ContactWorld;
use crate::world::contact::memory::ContactMemory;

impl ContactWorld {
    /// Asks the second solver where it is due, and records by how much the velocities differ.
    ///
    /// Coulomb's law may have several solutions. Where the second solver finds another one, or none, it is asked whether
    /// it confirms ours, and the smaller difference counts.
    pub(super) fn confirm(&self, memory: &mut ContactMemory, system: &ContactSystem) {
        let Some(every) = self.cross_check else { return };
        if !memory.steps.is_multiple_of(every.max(1)) {
            return;
        }
        let problem = &system.problem;
        let ours = problem.velocities(&self.law_impulses());
        let largest = problem.free_velocity.iter().map(norm_squared).fold(0.0, f64::max).sqrt();
        let difference = |theirs: &[[f64; 3]]| {
            let worst = ours.iter().zip(theirs).map(|(a, b)| norm_squared(&sub(a, b))).fold(0.0, f64::max).sqrt();
            if largest > 0.0 { worst / largest } else { worst }
        };
        let settings = OracleSettings::default();
        let mut least: Option<f64> = None;
        for found_anew in [true, false] {
            let answer = if found_anew { cross_check(problem, &settings) } else { certify(problem, &ours, &settings) };
            let Ok(answer) = answer else { continue };
            if answer.status.is_converged() {
                let found = difference(&answer.velocities);
                least = Some(least.map_or(found, |least| least.min(found)));
            }
            if least.is_some_and(|least| least <= 10.0 * self.settings.tolerance) {
                break;
            }
        }
        let told = &mut memory.confirmation;
        told.asked += 1;
        match least {
            Some(difference) => {
                told.last = difference;
                told.worst = told.worst.max(difference);
            }
            None => told.undecided += 1,
        }
    }
}
