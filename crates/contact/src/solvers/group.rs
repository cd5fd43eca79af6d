//! What a solver is given and what it gives back: one group of coupled contacts.

use crate::block::{Vec3, norm_squared};
use crate::problem::residual::{ResidualParts, residual_parts};
use crate::problem::{BlockMatrix, ContactProblem, Scaling};
use crate::report::Method;
use numerics::Status;

/// One group of coupled contacts, posed for the shifted impulse `r̂ = r + c_a e_N`: `u = W r̂ + q`.
#[derive(Clone, Debug)]
pub struct Group<'a> {
    /// Delassus matrix of the group [1/kg].
    pub w: &'a BlockMatrix,
    /// Free velocity less the cohesive shift, `q − W c` [m/s].
    pub q: &'a [Vec3],
    /// Friction; negative for bilateral contacts.
    pub friction: &'a [f64],
    /// Scaling of the residual.
    pub scaling: Scaling,
    /// Relative residual asked for.
    pub tolerance: f64,
    /// Size below which this group counts as small beside the whole problem, in the residual's unit.
    pub size_floor: f64,
}

impl<'a> Group<'a> {
    /// All contacts of a problem as one group; `q` is its shifted velocity.
    #[must_use]
    pub fn whole(problem: &'a ContactProblem, q: &'a [Vec3], scaling: Scaling, tolerance: f64) -> Group<'a> {
        let ContactProblem { delassus, friction, .. } = problem;
        Group { w: delassus, q, friction, scaling, tolerance, size_floor: 0.0 }
    }

    /// Number of contacts.
    #[must_use]
    pub fn len(&self) -> usize {
        self.friction.len()
    }

    /// Whether there are no contacts.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.friction.is_empty()
    }

    /// Residual of `r` relative to the size of the group or of its share in the whole, whichever is larger.
    #[must_use]
    pub fn residual(&self, r: &[Vec3]) -> f64 {
        self.relative(&residual_parts(self.w, self.q, self.friction, r, self.scaling))
    }

    /// The relative residual of sums gathered elsewhere.
    #[must_use]
    pub fn relative(&self, parts: &ResidualParts) -> f64 {
        let size = parts.guarded_size(self.scaling).max(self.size_floor);
        let map = parts.map_squared.sqrt();
        if size > 0.0 { map / size } else { map }
    }

    /// Whether these impulses are beyond all measure and still do not obey the law. Contacts that ask for what no motion of their
    /// bodies gives (pushed apart from two sides at once) have no solution: larger impulses always seem to come nearer to one.
    #[must_use]
    pub fn runs_away(&self, r: &[Vec3]) -> bool {
        let parts = residual_parts(self.w, self.q, self.friction, r, Scaling::PerContact);
        parts.impulse_squared > BEYOND * BEYOND * parts.free_squared && parts.breaks_the_law()
    }
}

/// Impulses over free velocity, in one unit, that no solvable problem is expected to need: a thousand occur.
pub(crate) const BEYOND: f64 = 1e6;

/// How a solver left a group.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroupOutcome {
    /// How it ended.
    pub status: Status,
    /// Relative residual of the impulses left behind, as [`Group::residual`] measures it.
    pub residual: f64,
    /// Iterations by method, in the order of [`Method::ALL`]; `None` where a method was not used.
    pub iterations: [Option<usize>; 4],
    /// The method that ended the solve.
    pub last: Method,
}

impl GroupOutcome {
    /// The outcome of one method alone.
    #[must_use]
    pub fn of(method: Method, status: Status, residual: f64, iterations: usize) -> Self {
        let mut o = GroupOutcome { status, residual, iterations: [None; 4], last: method };
        o.count(method, iterations);
        o
    }

    /// Adds iterations of a method.
    pub fn count(&mut self, method: Method, iterations: usize) {
        let slot = &mut self.iterations[method as usize];
        *slot = Some(slot.unwrap_or(0) + iterations);
    }

    /// Takes over the iterations of an earlier attempt.
    pub fn after(mut self, earlier: &GroupOutcome) -> Self {
        for m in Method::ALL {
            if let Some(i) = earlier.iterations[m as usize] {
                self.count(m, i);
            }
        }
        self
    }
}

/// A solver of one group.
pub trait GroupSolver {
    /// Its name in records.
    fn name(&self) -> &'static str;

    /// Improves `r` (shifted impulses [N s]; the warm start on entry) until the group's tolerance is met or no progress
    /// is possible; always leaves the best iterate behind, finite whatever happens.
    fn solve(&self, group: &Group<'_>, r: &mut [Vec3]) -> GroupOutcome;
}

/// Keeps the best iterate of a run.
#[derive(Clone, Debug)]
pub(crate) struct Best {
    pub residual: f64,
    pub r: Vec<Vec3>,
}

impl Best {
    pub fn start(group: &Group<'_>, r: &mut [Vec3]) -> Self {
        if !r.iter().all(|v| norm_squared(v).is_finite()) {
            r.fill([0.0; 3]);
        }
        let residual = group.residual(r);
        let zero = group.residual(&vec![[0.0; 3]; r.len()]);
        if !(residual <= zero) {
            // a warm start worse than nothing is dropped
            r.fill([0.0; 3]);
            return Best { residual: zero, r: r.to_vec() };
        }
        Best { residual, r: r.to_vec() }
    }

    pub fn offer(&mut self, residual: f64, r: &[Vec3]) -> bool {
        if residual < self.residual {
            self.residual = residual;
            self.r.copy_from_slice(r);
            return true;
        }
        false
    }
}
