//! Some contacts of a problem as a group of their own: taken out, solved, put back.

use super::group::Group;
use crate::block::Vec3;
use crate::problem::{BlockMatrix, Component, Scaling};

/// Contacts taken out of a larger problem, with copies of all that concerns them.
#[derive(Clone, Debug)]
pub(crate) struct Part<'a> {
    members: &'a Component,
    w: BlockMatrix,
    /// Free velocities; the rest of the problem may be added to them [m/s].
    pub q: Vec<Vec3>,
    friction: Vec<f64>,
    /// Impulses to start from, and then the answer [N s].
    pub impulses: Vec<Vec3>,
}

/// The place of every contact in the list of members; `u32::MAX` for the others of `n`.
pub(crate) fn places(members: &Component, n: usize) -> Vec<u32> {
    let mut position = vec![u32::MAX; n];
    for (place, k) in members.contacts.iter().enumerate() {
        position[*k as usize] = place as u32;
    }
    position
}

impl<'a> Part<'a> {
    /// The members of a problem; `position` as [`Component::extract`] wants it.
    pub fn take(
        members: &'a Component,
        position: &[u32],
        w: &BlockMatrix,
        q: &[Vec3],
        friction: &[f64],
        r: &[Vec3],
    ) -> Self {
        let of = |all: &[Vec3]| members.contacts.iter().map(|k| all[*k as usize]).collect();
        let friction = members.contacts.iter().map(|k| friction[*k as usize]).collect();
        Part { members, w: members.extract(w, position), q: of(q), friction, impulses: of(r) }
    }

    /// Adds to the free velocities what the rest of the problem does with impulses `r`, which stays as it is.
    pub fn hold_the_rest(&mut self, w: &BlockMatrix, r: &[Vec3]) {
        for (place, k) in self.members.contacts.iter().enumerate() {
            let (all, own) = (w.row_product_sparse(*k as usize, r), self.w.row_product_sparse(place, &self.impulses));
            let free = self.q[place];
            self.q[place] = [0, 1, 2].map(|i| free[i] + all[i] - own[i]);
        }
    }

    /// Solves the part as a group.
    pub fn solve<T>(
        &mut self,
        scaling: Scaling,
        tolerance: f64,
        size_floor: f64,
        solve: impl FnOnce(&Group<'_>, &mut [Vec3]) -> T,
    ) -> T {
        let group = Group { w: &self.w, q: &self.q, friction: &self.friction, scaling, tolerance, size_floor };
        solve(&group, &mut self.impulses)
    }

    /// Writes the impulses where they belong.
    pub fn put_back(&self, r: &mut [Vec3]) {
        for (k, x) in self.members.contacts.iter().zip(&self.impulses) {
            r[*k as usize] = *x;
        }
    }
}
