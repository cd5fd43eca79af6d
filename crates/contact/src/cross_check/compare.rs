//! Two answers to one problem, judged: the same, two solutions of one law, or a disagreement.

use super::dual::{certify, cross_check};
use super::outer::{OracleError, OracleSettings};
use super::polish::refine;
use crate::block::{Vec3, norm_squared};
use crate::problem::{ContactProblem, worst_violation};
use numerics::Status;

/// How the two answers stand to each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The same velocities, to [`AGREED`].
    Agree,
    /// Different velocities, but both keep the law to [`VERIFIED`] contact by contact, and the cone programme with the
    /// shift of ours gives ours back, or Newton steps on the law itself take ours to round-off without leaving it:
    /// Coulomb's law has more than one solution here.
    SecondSolution,
    /// Our answer keeps the law, the second opinion found none.
    OracleFailed,
    /// Neither.
    Disagree,
}

/// Relative difference of velocities up to which two answers are the same.
pub const AGREED: f64 = 1e-5;
/// Violation of the law (velocity units, relative to the free velocities) up to which an answer is a solution.
pub const VERIFIED: f64 = 1e-7;
/// Violation of the law at which a polished answer is exact: round-off of the largest systems compared.
pub const EXACT: f64 = 1e-12;
/// Share of the free velocity below which a system is at rest, and a difference is measured by the free velocity: there
/// is no velocity left to be relative to.
pub const AT_REST: f64 = 1e-7;

/// A comparison of our answer with the second opinion.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// What follows from the figures below.
    pub verdict: Verdict,
    /// Difference of velocities relative to the larger of the two (of the free velocities where both rest).
    pub difference: f64,
    /// Whether both answers are at rest.
    pub at_rest: bool,
    /// Largest violation of the law by our answer, relative to the free velocities.
    pub our_violation: f64,
    /// The same of the second opinion.
    pub oracle_violation: f64,
    /// Where they differ: our velocities against what the cone programme makes of them, as `difference`; else NaN.
    pub confirmation: f64,
    /// Where they differ: largest violation of the law by ours after an independent polish, relative to the free
    /// velocities, and how far the polish moved its velocities, as `difference`; else NaN.
    pub polished: [f64; 2],
    /// How the second opinion ended, and after how many outer iterations.
    pub oracle_status: Status,
    /// Outer iterations of the second opinion.
    pub outer_iterations: usize,
}

/// Asks for a second opinion on `impulses` and judges both.
///
/// # Errors
/// As [`cross_check`].
pub fn compare(
    problem: &ContactProblem,
    impulses: &[Vec3],
    settings: &OracleSettings,
) -> Result<Comparison, OracleError> {
    let ours = problem.velocities(impulses);
    let oracle = cross_check(problem, settings)?;
    let free = size(&problem.shifted_velocity());
    let distance = |a: &[Vec3], b: &[Vec3]| {
        let d: f64 = a.iter().zip(b).map(|(x, y)| norm_squared(&crate::block::sub(x, y))).sum();
        let larger = size(a).max(size(b));
        let at_rest = larger <= AT_REST * free;
        let scale = if at_rest { free } else { larger };
        (if scale > 0.0 { d.sqrt() / scale } else { d.sqrt() }, at_rest)
    };
    let (difference, at_rest) = distance(&ours, &oracle.velocities);
    let our_violation = worst_violation(problem, impulses);
    let oracle_violation = worst_violation(problem, &oracle.impulses);
    let mut confirmation = f64::NAN;
    let mut polished = [f64::NAN; 2];
    let verdict = if difference <= AGREED {
        Verdict::Agree
    } else {
        let back = certify(problem, &ours, settings)?;
        confirmation = distance(&ours, &back.velocities).0;
        let (exact, violation) = refine(problem, impulses);
        polished = [violation, distance(&ours, &problem.velocities(&exact)).0];
        let stands = polished[0] <= EXACT && polished[1] <= AGREED.min(1e-2 * difference);
        match (our_violation <= VERIFIED, oracle_violation <= VERIFIED) {
            (true, true) if confirmation <= AGREED || stands => Verdict::SecondSolution,
            (true, false) if !oracle.status.is_converged() => Verdict::OracleFailed,
            _ => Verdict::Disagree,
        }
    };
    Ok(Comparison {
        verdict,
        difference,
        at_rest,
        our_violation,
        oracle_violation,
        confirmation,
        polished,
        oracle_status: oracle.status,
        outer_iterations: oracle.outer_iterations,
    })
}

fn size(u: &[Vec3]) -> f64 {
    u.iter().map(norm_squared).sum::<f64>().sqrt()
}
