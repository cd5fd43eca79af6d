//! What contact remembers from step to step.

use ::contact::assembly::SOLID;
use ::contact::block::Vec3;
use ::contact::detection::Contact;
use nalgebra::{Rotation3, Vector3};
use serde::{Deserialize, Serialize};

/// Steps a force may be missing before it is forgotten.
const AGE_LIMIT: u8 = 3;

/// The part of contact that survives a step: a copy of it is a snapshot, its bytes go into checkpoints.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ContactMemory {
    /// Forces to start from, in the order of [`Place`].
    pub kept: Vec<Kept>,
    /// Contacts that a bridge of liquid joined in the last step, sorted.
    pub bridges: Vec<Place>,
    /// Steps so far.
    pub steps: u64,
    /// Steps whose contact problem was not solved to its tolerance.
    pub warnings: u64,
    /// What the second solver said.
    pub confirmation: Confirmation,
}

/// What the second solver said so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Confirmation {
    /// Problems solved again.
    pub asked: u64,
    /// Problems on which the second solver did not converge, so that it neither confirms nor denies.
    pub undecided: u64,
    /// Largest difference of a contact velocity in the last one, relative to the largest free velocity.
    pub last: f64,
    /// Worst of all.
    pub worst: f64,
}

/// What touches what, and where along the edge: at its first vertex, between, at its last vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Place {
    a: (u32, u32),
    b: (u32, u32),
    part: u8,
}

/// The force of a contact in the world's axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Kept {
    place: Place,
    age: u8,
    /// Force on side A [N]: impulses scale with the step, forces do not.
    force: Vec3,
    normal: Vec3,
}

impl Place {
    /// The edges of strands that touch here, as strand and edge.
    pub fn edges(&self) -> impl Iterator<Item = (u32, u32)> {
        let other = (self.b.0 != SOLID).then_some(self.b);
        std::iter::once(self.a).chain(other)
    }

    /// The place where two edges of strands touch; the first comes first in the order of strands.
    #[must_use]
    pub fn between(a: (u32, u32), b: (u32, u32)) -> Place {
        Place { a, b, part: 1 }
    }

    /// Whether this can be the same bridge as another, slid along by at most an edge.
    fn continues(&self, before: &Place) -> bool {
        let near = |x: (u32, u32), y: (u32, u32)| x.0 == y.0 && x.1.abs_diff(y.1) <= 1;
        near(self.a, before.a) && if self.b.0 == SOLID { self.b == before.b } else { near(self.b, before.b) }
    }

    /// The place of a contact. Between strands a pair of edges has but one contact; on a solid an edge may have three.
    #[must_use]
    pub fn of(contact: &Contact) -> Place {
        let part = if contact.key.b.0 != SOLID {
            1
        } else if contact.alpha <= 0.0 {
            0
        } else if contact.alpha >= 1.0 {
            2
        } else {
            1
        };
        Place { a: contact.key.a, b: contact.key.b, part }
    }
}

impl ContactMemory {
    /// Whether a bridge of liquid was here in the last step.
    #[must_use]
    pub fn was_bridged(&self, place: &Place) -> bool {
        let first = (place.a.0, place.a.1.saturating_sub(1));
        let from = self.bridges.partition_point(|bridge| bridge.a < first);
        let near = self.bridges[from..].iter().take_while(|b| b.a.0 == place.a.0 && b.a.1 <= place.a.1 + 1);
        near.into_iter().any(|bridge| place.continues(bridge))
    }

    /// Impulse to start from in the given basis (normal first) [N s]; zero where the contact is new. The force of the last
    /// step is turned with the normal.
    #[must_use]
    pub fn start(&self, place: &Place, basis: &[Vec3; 3], step: f64) -> Vec3 {
        let Ok(i) = self.kept.binary_search_by(|kept| kept.place.cmp(place)) else { return [0.0; 3] };
        let kept = &self.kept[i];
        let (old, new) = (Vector3::from(kept.normal), Vector3::from(basis[0]));
        // reversed normals belong to another contact
        let Some(turn) = Rotation3::rotation_between(&old, &new) else { return [0.0; 3] };
        let impulse = turn * Vector3::from(kept.force) * step;
        basis.map(|axis| impulse.dot(&Vector3::from(axis)))
    }

    /// Whether a force is remembered there.
    #[must_use]
    pub fn holds(&self, place: &Place) -> bool {
        self.kept.binary_search_by(|kept| kept.place.cmp(place)).is_ok()
    }

    /// Takes over the forces of a step and forgets what has been missing for too long.
    pub fn renew(&mut self, forces: impl Iterator<Item = (Place, Vec3, Vec3)>) {
        for kept in &mut self.kept {
            kept.age += 1;
        }
        let old = self.kept.len();
        for (place, force, normal) in forces {
            let kept = Kept { place, age: 0, force, normal };
            match self.kept[..old].binary_search_by(|kept| kept.place.cmp(&place)) {
                Ok(i) => self.kept[i] = kept,
                Err(_) => self.kept.push(kept),
            }
        }
        self.kept.retain(|kept| kept.age < AGE_LIMIT);
        self.kept.sort_unstable_by_key(|kept| (kept.place, kept.age));
        self.kept.dedup_by_key(|kept| kept.place);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A force is found again, turned with its normal, scaled with the step, and forgotten after three steps.
    #[test]
    fn forces_are_kept_turned_scaled_and_forgotten() {
        let place = |edge| Place { a: (0, edge), b: (1, 2), part: 1 };
        let mut memory = ContactMemory::default();
        let forces = [(place(7), [0.0, 0.0, 3.0], [0.0, 0.0, 1.0]), (place(2), [1.0, 0.0, 0.0], [0.0, 0.0, 1.0])];
        memory.renew(forces.into_iter());
        let turned = [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]];
        let start = memory.start(&place(7), &turned, 0.5);
        assert!((start[0] - 1.5).abs() < 1e-15 && start[1].abs() < 1e-15 && start[2].abs() < 1e-15, "{start:?}");
        assert_eq!(memory.start(&place(3), &turned, 0.5), [0.0; 3]);
        memory.renew([(place(2), [2.0, 0.0, 0.0], [0.0, 0.0, 1.0])].into_iter());
        memory.renew(std::iter::empty());
        assert_eq!(memory.kept.len(), 2);
        memory.renew(std::iter::empty());
        assert_eq!(memory.kept.len(), 1);
        assert_eq!(memory.kept[0].force, [2.0, 0.0, 0.0]);
    }
}
