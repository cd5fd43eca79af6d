//! Edges that one contact does not keep apart.
//!
//! Detection gives a pair of edges the place where they meet first. Where one end is stopped there and the other is fast, the
//! edges turn about the contact, and their far ends pass through each other within the same step. Such a pair gets a second
//! contact there, with the normal of the first: who was on which side is known from it.

use ::contact::detection::Contact;
use nalgebra::Vector3;

use super::motion;
use crate::world::contact::{ContactWorld, Lists};

/// Overlap at the end of the step, in radii, that a pair must have away from its contact to get a second one. Less is pushed
/// apart in the next step, where detection finds it.
const PASSED: f64 = 0.5;

/// How far aside of each other, in distances at which the axes touch, two points may lie to count as opposite.
const ASIDE: f64 = 0.5;

/// Part of an edge within which two contacts of one pair are the same.
const SAME_PLACE: f64 = 0.25;

impl ContactWorld {
    /// Poses second contacts where the motion so far makes edges pass through each other beside their contact. Returns
    /// whether there were any.
    pub(super) fn part_crossed(&mut self) -> bool {
        let limit = -PASSED * self.smallest_radius;
        let lists = &self.lists;
        let crossed = |c: &Contact| deepest(c, lists, &self.first_vertex).filter(|(_, end_gap)| *end_gap < limit);
        let mut more: Vec<Contact> = Vec::new();
        let loose = lists.loose.iter().map(|bridge| &bridge.contact);
        for c in lists.active.iter().chain(&lists.spare).chain(loose).filter(|c| !c.with_solid()) {
            let Some((new, _)) = crossed(c) else { continue };
            let there = |old: &Contact| {
                old.key == new.key
                    && (old.alpha - new.alpha).abs() < SAME_PLACE
                    && (old.beta - new.beta).abs() < SAME_PLACE
            };
            if !lists.active.iter().chain(&more).any(there) && !motion::is_held(&new, &self.first_vertex, &lists.held) {
                more.push(new);
            }
        }
        let any = !more.is_empty();
        more.into_iter().for_each(|c| self.lists.pose(c));
        any
    }
}

/// The end of an edge that is deepest beyond the other edge at the end of the step, as a contact along the same normal, and
/// its gap there [m].
fn deepest(c: &Contact, lists: &Lists, first_vertex: &[u32]) -> Option<(Contact, f64)> {
    let corners = |side: (u32, u32), x: &[[f64; 3]]| {
        let v = (first_vertex[side.0 as usize] + side.1) as usize;
        [Vector3::from(x[v]), Vector3::from(x[v + 1])]
    };
    let at = |edge: &[Vector3<f64>; 2], place: f64| edge[0] * (1.0 - place) + edge[1] * place;
    let normal = Vector3::from(c.normal);
    let (a, b) = (corners(c.key.a, &lists.end), corners(c.key.b, &lists.end));
    let (a0, b0) = (corners(c.key.a, &lists.start), corners(c.key.b, &lists.start));
    // the distance along the normal at which detection says that they touch
    let reach = normal.dot(&(at(&a0, c.alpha) - at(&b0, c.beta))) - c.gap;
    // foot of a point on an edge, seen along the normal
    let foot = |point: &Vector3<f64>, edge: &[Vector3<f64>; 2]| {
        let along = edge[1] - edge[0];
        let flat = along - normal * normal.dot(&along);
        let length = flat.norm_squared();
        if length > 0.0 { (flat.dot(&(point - edge[0])) / length).clamp(0.0, 1.0) } else { 0.5 }
    };
    let mut worst: Option<(Contact, f64)> = None;
    for place in [0.0, 1.0] {
        for (alpha, beta) in [(place, foot(&at(&a, place), &b)), (foot(&at(&b, place), &a), place)] {
            let apart = at(&a, alpha) - at(&b, beta);
            let depth = normal.dot(&apart);
            let aside = (apart - normal * depth).norm();
            let gap = depth - reach;
            if aside <= ASIDE * reach && worst.is_none_or(|(_, least)| gap < least) {
                let gap_before = normal.dot(&(at(&a0, alpha) - at(&b0, beta))) - reach;
                worst = Some((Contact { alpha, beta, gap: gap_before, ..*c }, gap));
            }
        }
    }
    worst
}
