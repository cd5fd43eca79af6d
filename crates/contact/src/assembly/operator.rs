//! The Delassus matrix without its entries: `W r + q = H K⁻¹ Hᵀ r + q` by one pass of every strand's inverse dynamics.
//!
//! Costs one band solve a strand whatever the number of contacts, and no memory for blocks: what residuals and Krylov
//! methods need where `m` contacts on one strand would store `m²` blocks.

use super::delassus::InverseDynamics;
use super::point::{ContactSide, PosedContact};
use crate::block::{Vec3, dot};

/// The operator with its reusable memory.
#[derive(Debug)]
pub struct DelassusOperator<'a, D> {
    dynamics: &'a D,
    contacts: &'a [PosedContact],
    bases: Vec<[Vec3; 3]>,
    /// Strands that are touched, and where the freedoms of each begin in `freedoms` (by strand).
    busy: Vec<usize>,
    start: Vec<usize>,
    freedoms: Vec<f64>,
}

impl<'a, D: InverseDynamics> DelassusOperator<'a, D> {
    /// The operator of these contacts over `strands` strands.
    ///
    /// # Panics
    /// If a contact names a strand or freedom that is not there; [`assemble`](super::assemble) checks the same contacts.
    #[must_use]
    pub fn new(contacts: &'a [PosedContact], dynamics: &'a D, strands: usize) -> Self {
        let mut touched = vec![false; strands];
        for c in contacts {
            for side in [Some(c.a), c.b].into_iter().flatten() {
                touched[side.strand as usize] = true;
                assert!(side.dof.iter().all(|d| *d as usize + 3 <= dynamics.dofs(side.strand as usize)));
            }
        }
        let busy: Vec<usize> = (0..strands).filter(|s| touched[*s]).collect();
        let mut start = vec![usize::MAX; strands];
        let mut total = 0;
        for s in &busy {
            start[*s] = total;
            total += dynamics.dofs(*s);
        }
        let bases = contacts.iter().map(PosedContact::basis).collect();
        DelassusOperator { dynamics, contacts, bases, busy, start, freedoms: vec![0.0; total] }
    }

    /// `u = W r + q`, in the fixed order of contacts and strands.
    pub fn apply(&mut self, r: &[Vec3], q: &[Vec3], u: &mut [Vec3]) {
        self.freedoms.fill(0.0);
        for ((c, e), r) in self.contacts.iter().zip(&self.bases).zip(r) {
            let world = [0, 1, 2].map(|i| e[0][i] * r[0] + e[1][i] * r[1] + e[2][i] * r[2]);
            for (side, sign) in [(Some(c.a), 1.0), (c.b, -1.0)] {
                let Some(ContactSide { strand, dof, weight }) = side else { continue };
                let first = self.start[strand as usize];
                for (dof, weight) in dof.iter().zip(weight) {
                    for i in 0..3 {
                        self.freedoms[first + *dof as usize + i] += sign * weight * world[i];
                    }
                }
            }
        }
        for s in &self.busy {
            let (first, n) = (self.start[*s], self.dynamics.dofs(*s));
            self.dynamics.apply(*s, &mut self.freedoms[first..first + n]);
        }
        for (k, (c, e)) in self.contacts.iter().zip(&self.bases).enumerate() {
            let velocity = |side: &ContactSide| side.velocity(&self.freedoms[self.start[side.strand as usize]..]);
            let mut v = velocity(&c.a);
            if let Some(b) = &c.b {
                let o = velocity(b);
                v = [v[0] - o[0], v[1] - o[1], v[2] - o[2]];
            }
            u[k] = [0, 1, 2].map(|i| dot(&e[i], &v) + q[k][i]);
        }
    }
}
