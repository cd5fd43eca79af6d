//! Two moving capsules: where they are closest now, or where they first meet within the step.

use crate::block::{Vec3, dot, norm_squared, sub};
use crate::families::bodies::cross;
use geometry::Vector3;
use geometry::broad_phase::largest_relative_motion;
use geometry::closest::segment_segment;

/// Contact of two capsules.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PairContact {
    /// Place on the first edge, 0 … 1.
    pub alpha: f64,
    /// Place on the second edge.
    pub beta: f64,
    /// Unit normal from the second to the first.
    pub normal: Vec3,
    /// Gap along the normal at the start of the step [m]; negative when overlapping.
    pub gap: f64,
    /// When in the step they meet, 0 … 1; 0 when near or overlapping already.
    pub time: f64,
}

/// A capsule over the step: both ends at its start and end.
pub(super) type Capsule = [[Vec3; 2]; 2];

#[inline]
fn at(edge: &Capsule, t: f64) -> [Vector3; 2] {
    [0, 1].map(|i| {
        let (a, b) = (&edge[0][i], &edge[1][i]);
        Vector3::new(a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2]))
    })
}

/// Finds the contact of two capsules whose radii sum to `reach`; `proximity` is the gap that counts as near [m].
///
/// Near or overlapping at the start: the closest points of now. Else, with `continuous`, conservative advancement finds the
/// first time at which the distance falls to `reach`: each advance is the gap over the largest relative displacement, so no
/// contact is stepped over, at any speed. Returns `None` where they stay apart.
#[must_use]
pub fn pair_contact(
    a: &[[Vec3; 2]; 2],
    b: &[[Vec3; 2]; 2],
    reach: f64,
    proximity: f64,
    continuous: bool,
) -> Option<PairContact> {
    match meeting(a, b, reach, |gap| gap <= proximity, continuous) {
        Meeting::Near(contact) => contact,
        Meeting::OnTheWay(contact, _) => Some(contact),
        Meeting::Apart(_) => None,
    }
}

/// How two capsules stand to each other over a step.
#[derive(Clone, Copy, Debug)]
pub(super) enum Meeting {
    /// Near or overlapping at the start; no contact where neither place nor motion gives it a normal.
    Near(Option<PairContact>),
    /// Apart at the start by this gap \[m\], and meeting on the way.
    OnTheWay(PairContact, f64),
    /// Apart at the start by this gap \[m\], and staying so.
    Apart(f64),
}

/// Largest displacement of a point of one against a point of the other, a convex combination of those of the ends: capsules
/// that are farther apart at the start stay apart.
#[inline]
pub(super) fn speed(a: &Capsule, b: &Capsule) -> f64 {
    let whole = |edge: &Capsule| edge.map(|ends| ends.map(Vector3::from));
    largest_relative_motion(&whole(a), &whole(b))
}

/// Finds where two capsules meet; `is_near` decides which gap at the start counts as near.
pub(super) fn meeting(
    a: &Capsule,
    b: &Capsule,
    reach: f64,
    is_near: impl FnOnce(f64) -> bool,
    continuous: bool,
) -> Meeting {
    let (a0, b0) = (at(a, 0.0), at(b, 0.0));
    let now = segment_segment(&a0[0], &a0[1], &b0[0], &b0[1]);
    let distance = now.separation.norm();
    let gap = distance - reach;
    if is_near(gap) {
        // along the chosen normal, so that edges through each other keep a consistent sign
        let contact = |normal| PairContact { alpha: now.s, beta: now.t, normal, gap, time: 0.0 };
        return Meeting::Near(direction(&now.separation, a, b, 0.0).map(contact));
    }
    if !continuous {
        return Meeting::Apart(gap);
    }
    let speed = speed(a, b);
    if gap > speed {
        return Meeting::Apart(gap);
    }
    let tolerance = 1e-3 * reach.max(1e-300);
    let mut t = 0.0;
    let mut d = distance;
    let (mut nearest, mut meet) = ((distance, now), 0.0);
    for _ in 0..200 {
        let step = (d - reach) / speed;
        t += step;
        if !(t <= 1.0) {
            return Meeting::Apart(gap);
        }
        let (pa, pb) = (at(a, t), at(b, t));
        let last = segment_segment(&pa[0], &pa[1], &pb[0], &pb[1]);
        d = last.separation.norm();
        // edges that graze each other take ever smaller steps: what counts is where they are closest, not where the steps end
        if d < nearest.0 {
            (nearest, meet) = ((d, last), t);
        }
        if d <= reach + tolerance {
            break;
        }
    }
    let (last, t) = (nearest.1, meet);
    let Some(normal) = direction(&last.separation, a, b, t) else { return Meeting::Apart(gap) };
    let point = |e: &Capsule, s: f64| [0, 1, 2].map(|c| e[0][0][c] + s * (e[0][1][c] - e[0][0][c]));
    let start = sub(&point(a, last.s), &point(b, last.t));
    let contact = PairContact { alpha: last.s, beta: last.t, normal, gap: dot(&normal, &start) - reach, time: t };
    Meeting::OnTheWay(contact, gap)
}

/// Normal from the separation (first to second), or from the edge directions where the axes cross.
fn direction(separation: &Vector3, a: &Capsule, b: &Capsule, t: f64) -> Option<Vec3> {
    let l = separation.norm();
    let size = norm_squared(&sub(&a[0][1], &a[0][0])).max(norm_squared(&sub(&b[0][1], &b[0][0]))).sqrt();
    if l > 1e-9 * size && l > 0.0 {
        return Some([-separation.x / l, -separation.y / l, -separation.z / l]);
    }
    let (pa, pb) = (at(a, t), at(b, t));
    let da = pa[1] - pa[0];
    let db = pb[1] - pb[0];
    let n = cross(&[da.x, da.y, da.z], &[db.x, db.y, db.z]);
    let l = norm_squared(&n).sqrt();
    if l > 1e-12 * size * size {
        // of the two, the one against which they come together
        let approach = [0, 1, 2].map(|c| (a[1][0][c] - a[0][0][c]) - (b[1][0][c] - b[0][0][c]));
        let sign = if dot(&n, &approach) > 0.0 { -1.0 } else { 1.0 };
        return Some(n.map(|v| sign * v / l));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A capsule dropped through another at 100 radii per step is caught, and the gap leads exactly to touching.
    #[test]
    fn no_tunnelling_at_a_hundred_radii() {
        let r = 0.01;
        for height in [0.025, 0.1, 0.5, 0.99] {
            let low = [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]];
            let high = [[0.1, -1.0, height], [0.1, 1.0, height]];
            let moved = high.map(|p| [p[0], p[1], p[2] - 100.0 * r]);
            let c = pair_contact(&[high, moved], &[low, low], 2.0 * r, 0.1 * r, true).unwrap();
            assert!((c.normal[2] - 1.0).abs() < 1e-12);
            assert!((c.gap - (height - 2.0 * r)).abs() < 1e-12);
            assert!((c.time - (height - 2.0 * r) / (100.0 * r)).abs() < 1e-3);
            assert!(pair_contact(&[high, moved], &[low, low], 2.0 * r, 0.0, false).is_none());
        }
    }

    /// Edges that pass each other at a distance of hardly more than their radii do not count as met after they have passed:
    /// that they come no nearer is all that such a contact may ask for.
    #[test]
    fn what_grazes_is_met_where_it_is_closest() {
        let reach = 1.0;
        for miss in [1.1e-3, 1.5e-3, 3e-3, 1e-2] {
            let height = reach * (1.0 + miss);
            let low = [[-3.0, 0.0, 0.0], [3.0, 0.0, 0.0]];
            let end = [[0.0, -2.0, height], [0.0, -2.0, height + 4.0]];
            let moved = end.map(|p| [p[0], p[1] + 5.0, p[2]]);
            if let Some(c) = pair_contact(&[end, moved], &[low, low], reach, 0.0, true) {
                assert!(c.gap > -1e-2 * reach && c.normal[1].abs() < 0.1, "{miss}: {c:?}");
            }
        }
    }

    proptest! {
        /// Whatever dense sampling in time finds, continuous detection finds, no later.
        #[test]
        fn sampling_never_finds_more(p in proptest::collection::vec(proptest::array::uniform3(-1.0..1.0f64), 8)) {
            let a = [[p[0], p[1]], [p[2], p[3]]];
            let b = [[p[4], p[5]], [p[6], p[7]]];
            let reach = 0.05;
            let first = (0..=400).map(|i| i as f64 / 400.0).find(|t| {
                let (x, y) = (at(&a, *t), at(&b, *t));
                segment_segment(&x[0], &x[1], &y[0], &y[1]).separation.norm() <= reach
            });
            let c = pair_contact(&a, &b, reach, 0.0, true);
            if let Some(t) = first {
                prop_assert!(c.is_some_and(|c| c.time <= t + 1e-9), "{c:?} {t}");
            }
            if let Some(c) = c { prop_assert!(c.gap.is_finite() && (norm_squared(&c.normal) - 1.0).abs() < 1e-12); }
        }
    }
}
