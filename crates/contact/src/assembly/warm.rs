//! Impulses kept from step to step, found again by what touches what.

use crate::block::{Vec3, dot};
use crate::families::bodies::cross;
use std::collections::BTreeMap;

/// What touches what: strand and edge of both sides; a solid has [`SOLID`] as strand and its index as edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ContactKey {
    /// Strand and edge of side A.
    pub a: (u32, u32),
    /// Strand and edge of side B.
    pub b: (u32, u32),
}

/// Strand index that marks a solid in a [`ContactKey`].
pub const SOLID: u32 = u32::MAX;

#[derive(Clone, Copy, Debug)]
struct Kept {
    impulse: Vec3,
    normal: Vec3,
    age: u32,
}

/// Impulses of the last steps in world axes. An entry that is not renewed for three steps is dropped.
#[derive(Clone, Debug, Default)]
pub struct WarmStarts {
    kept: BTreeMap<ContactKey, Kept>,
}

/// Steps an entry may miss.
const AGE_LIMIT: u32 = 3;

impl WarmStarts {
    /// Number of contacts remembered.
    #[must_use]
    pub fn len(&self) -> usize {
        self.kept.len()
    }

    /// Whether nothing is remembered.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.kept.is_empty()
    }

    /// Impulse to start from in the given basis (normal first); zero if the contact is new. The old impulse is turned
    /// with the shortest rotation from the old normal to the new one.
    #[must_use]
    pub fn start(&self, key: &ContactKey, basis: &[Vec3; 3]) -> Vec3 {
        let Some(k) = self.kept.get(key) else { return [0.0; 3] };
        let turned = transport(&k.impulse, &k.normal, &basis[0]);
        [0, 1, 2].map(|i| dot(&basis[i], &turned))
    }

    /// Ages what is remembered and takes over the impulses of a step, in world axes with their normals.
    pub fn renew(&mut self, step: impl IntoIterator<Item = (ContactKey, Vec3, Vec3)>) {
        for k in self.kept.values_mut() {
            k.age += 1;
        }
        for (key, impulse, normal) in step {
            self.kept.insert(key, Kept { impulse, normal, age: 0 });
        }
        self.kept.retain(|_, k| k.age < AGE_LIMIT);
    }
}

/// Rotates `v` by the shortest rotation that takes unit vector `from` to unit vector `to`.
fn transport(v: &Vec3, from: &Vec3, to: &Vec3) -> Vec3 {
    let axis = cross(from, to);
    let c = dot(from, to);
    if c <= -0.99 {
        // nearly reversed normals belong to another contact: keep only the normal part
        let n = dot(v, from);
        return to.map(|x| n * x);
    }
    let a = cross(&axis, v);
    let along = dot(&axis, v) / (1.0 + c);
    [0, 1, 2].map(|i| c * v[i] + a[i] + along * axis[i])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::families::bodies::basis;

    #[test]
    fn impulses_follow_the_normal_and_age_out() {
        let key = ContactKey { a: (0, 1), b: (SOLID, 0) };
        let mut warm = WarmStarts::default();
        let (n0, n1) = ([0.0, 0.0, 1.0], [0.0, 0.6, 0.8]);
        warm.renew([(key, [1.0, 0.0, 2.0], n0)]);
        let start = warm.start(&key, &basis(&n1));
        // normal part and length are kept, the transverse part stays across the plane of rotation
        assert!((start[0] - 2.0).abs() < 1e-14 && (start[1].hypot(start[2]) - 1.0).abs() < 1e-14);
        assert_eq!(warm.start(&ContactKey { a: (0, 2), ..key }, &basis(&n1)), [0.0; 3]);
        for _ in 0..AGE_LIMIT {
            warm.renew([]);
        }
        assert!(warm.is_empty());
    }
}
