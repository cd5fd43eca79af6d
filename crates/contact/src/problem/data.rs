//! The data of a contact problem and what must hold of them.

use super::BlockMatrix;
use crate::block::Vec3;
use thiserror::Error;

/// `u = W r + q` with Coulomb's law, cohesion and per-contact friction.
///
/// Two-dimensional problems are stored in three dimensions with a second tangent that nothing moves; `dimension` says
/// how they are read and written.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactProblem {
    /// 2 or 3.
    pub dimension: usize,
    /// Delassus matrix `W` [1/kg]; need not be symmetric or of full rank.
    pub delassus: BlockMatrix,
    /// Relative velocity without contact impulses `q` [m/s], one per contact, normal first.
    pub free_velocity: Vec<Vec3>,
    /// Coulomb coefficients; a negative one marks a bilateral contact.
    pub friction: Vec<f64>,
    /// Cohesive impulse bounds `c_a ≥ 0` [N s], one per contact, or empty for none.
    pub cohesion: Vec<f64>,
}

/// Why a problem cannot be posed or read.
#[derive(Debug, Error, Clone, PartialEq, Eq)]
pub enum ProblemError {
    /// Arrays of different lengths.
    #[error("{what} has {found} entries for {expected} contacts")]
    Length {
        /// Which array.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The number of contacts.
        expected: usize,
    },
    /// A number that is not finite, or negative where it may not be.
    #[error("{what} of contact {contact} is not admissible")]
    Value {
        /// Which quantity.
        what: &'static str,
        /// Which contact, from 0.
        contact: usize,
    },
    /// The file does not follow its format.
    #[error("bad contact problem file: {0}")]
    Format(String),
    /// The file cannot be read or written.
    #[error("cannot access contact problem file: {0}")]
    Io(String),
}

impl ContactProblem {
    /// Poses a three-dimensional problem without cohesion.
    ///
    /// # Errors
    /// If the arrays do not fit or a value is not admissible.
    pub fn new(delassus: BlockMatrix, free_velocity: Vec<Vec3>, friction: Vec<f64>) -> Result<Self, ProblemError> {
        let p = ContactProblem { dimension: 3, delassus, free_velocity, friction, cohesion: Vec::new() };
        p.check()?;
        Ok(p)
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

    /// Cohesive bound of contact `k` [N s].
    #[inline]
    #[must_use]
    pub fn cohesion_of(&self, k: usize) -> f64 {
        self.cohesion.get(k).copied().unwrap_or(0.0)
    }

    /// Checks lengths, finiteness and signs.
    ///
    /// # Errors
    /// The first thing found wrong.
    pub fn check(&self) -> Result<(), ProblemError> {
        let n = self.len();
        let length = |what, found| {
            if found == n { Ok(()) } else { Err(ProblemError::Length { what, found, expected: n }) }
        };
        length("Delassus matrix", self.delassus.len())?;
        length("free velocity", self.free_velocity.len())?;
        if !self.cohesion.is_empty() {
            length("cohesion", self.cohesion.len())?;
        }
        for k in 0..n {
            if !self.free_velocity[k].iter().all(|v| v.is_finite()) {
                return Err(ProblemError::Value { what: "free velocity", contact: k });
            }
            if !self.friction[k].is_finite() {
                return Err(ProblemError::Value { what: "friction", contact: k });
            }
            let c = self.cohesion_of(k);
            if !(c >= 0.0 && c.is_finite()) {
                return Err(ProblemError::Value { what: "cohesion", contact: k });
            }
            if !self.delassus.row(k).1.iter().all(|b| b.iter().all(|v| v.is_finite())) {
                return Err(ProblemError::Value { what: "Delassus row", contact: k });
            }
        }
        Ok(())
    }

    /// Velocity `q − W c` that the shifted impulse `r̂ = r + c` sees: `u = W r̂ + (q − W c)`.
    #[must_use]
    pub fn shifted_velocity(&self) -> Vec<Vec3> {
        if self.cohesion.iter().all(|c| *c == 0.0) {
            return self.free_velocity.clone();
        }
        let c: Vec<Vec3> = (0..self.len()).map(|k| [-self.cohesion_of(k), 0.0, 0.0]).collect();
        let mut q = vec![[0.0; 3]; self.len()];
        self.delassus.apply(&c, &self.free_velocity, &mut q);
        q
    }

    /// Relative velocities `W r + q` for impulses `r` (cohesive shift not included).
    #[must_use]
    pub fn velocities(&self, impulses: &[Vec3]) -> Vec<Vec3> {
        let mut u = vec![[0.0; 3]; self.len()];
        self.delassus.apply(impulses, &self.free_velocity, &mut u);
        u
    }
}
