//! Pairs of segments that come near each other.

use super::{BoxGrid, BroadPhaseError};
use crate::closest::segment_segment;
use crate::{Aabb, Vector3};
use nalgebra::{Matrix3, Rotation3};
use rayon::prelude::*;

/// Share of the squared length that must run along one axis for the grid to be turned there.
const ALIGNED: f64 = 0.5;

/// Finds near pairs among segments, at rest or moving. Keeps its memory between calls.
///
/// Hair in a bundle is long, thin and aligned: boxes along the coordinate axes would overlap by the hundred if the bundle runs
/// across them. So the boxes are taken in axes turned along the prevailing direction, and only pairs whose true distance
/// counts are kept.
#[derive(Clone, Debug, Default)]
pub struct SegmentGrid {
    grid: BoxGrid,
    boxes: Vec<Aabb>,
    sketches: Vec<Sketch>,
    turn: Rotation3<f64>,
    /// Members whose boxes are no longer those that the grid was built of.
    stale: Vec<u32>,
}

/// What of a segment suffices to tell in a few operations that most others are far away.
#[derive(Clone, Copy, Debug)]
struct Sketch {
    middle: Vector3,
    /// From the middle to the second end.
    half: Vector3,
    /// Along the segment, of length one; zero where it has none.
    direction: Vector3,
    /// Displacement of the middle, and how far the ends move beyond it.
    travel: Vector3,
    turn: f64,
    reach: f64,
    /// Reach on the way; −∞ where nothing moves.
    reach_moving: f64,
}

impl Sketch {
    fn of([a, b]: &[Vector3; 2], reach: f64, motion: Option<(&[Vector3; 2], f64)>) -> Sketch {
        let half = 0.5 * (b - a);
        let middle = a + half;
        let (travel, turn, reach_moving) = motion
            .map_or((Vector3::zeros(), 0.0, f64::NEG_INFINITY), |([c, d], reach)| {
                (0.5 * (c + d) - middle, (0.5 * (d - c) - half).norm(), reach)
            });
        let direction = half.try_normalize(0.0).unwrap_or_else(Vector3::zeros);
        Sketch { middle, half, direction, travel, turn, reach, reach_moving }
    }

    /// Whether a plane along this segment parts it from the other by more than their reaches and motions.
    #[inline]
    fn is_far_from(&self, other: &Sketch) -> bool {
        let between = other.middle - self.middle;
        let across = between - self.direction * self.direction.dot(&between);
        let (squared, extent) = (across.norm_squared(), other.half.dot(&across).abs());
        // no point of either moves farther against the other than the middles and both turns
        let moves = (other.travel - self.travel).norm() + self.turn + other.turn;
        let reach = (self.reach + other.reach).max(self.reach_moving + other.reach_moving + moves);
        // with a margin for round-off
        squared - extent > (1.0 + 1e-9) * reach * squared.sqrt() + 1e-12 * (squared + extent)
    }
}

/// Segments, at rest or moving.
#[derive(Clone, Copy, Debug)]
pub struct Segments<'a> {
    /// Both ends [m].
    pub ends: &'a [[Vector3; 2]],
    /// Radius of each segment, with whatever margin is wanted [m], not negative.
    pub reach: &'a [f64],
    /// Where they move. Two can meet on the way if their distance is at most their reaches and the largest relative
    /// displacement of two ends.
    pub motion: Option<SegmentMotion<'a>>,
}

/// Where segments move.
#[derive(Clone, Copy, Debug)]
pub struct SegmentMotion<'a> {
    /// Both ends after the motion, along straight lines [m].
    pub ends: &'a [[Vector3; 2]],
    /// Radius of each segment on the way, with whatever margin is wanted [m], not negative.
    pub reach: &'a [f64],
}

/// How two segments lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearness {
    /// Their distance before any motion [m].
    pub distance: f64,
    /// Whether they can come within their reaches on the way.
    pub may_meet: bool,
}

impl SegmentGrid {
    /// All pairs `[i, j]`, `i < j`, of segments whose distance is at most the sum of their reaches, or that can come within the
    /// reaches of their motion, and for which `keep(i, j, nearness)` holds, in ascending order, whatever the number of threads.
    ///
    /// # Errors
    /// [`BroadPhaseError`] names the first segment that is not finite.
    ///
    /// # Panics
    /// If reaches or the motion are shorter than the list of segments.
    pub fn near_pairs(
        &mut self,
        segments: Segments<'_>,
        keep: impl Fn(u32, u32, Nearness) -> bool + Sync,
        pairs: &mut Vec<[u32; 2]>,
    ) -> Result<(), BroadPhaseError> {
        let n = segments.ends.len();
        assert!(segments.reach.len() >= n, "one reach per segment");
        assert!(segments.motion.is_none_or(|m| m.ends.len() >= n && m.reach.len() >= n), "one motion per segment");
        self.turn = prevailing(segments.ends);
        self.stale.clear();
        self.boxes.clear();
        self.boxes.extend((0..n).map(|i| segments.bounds(&self.turn, i)));
        self.sketches.clear();
        self.sketches.extend((0..n).map(|i| segments.sketch(i)));
        self.grid.build(&self.boxes)?;
        let sketches = &self.sketches;
        let near = |i: u32, j: u32| segments.nearness(sketches, [i, j]).is_some_and(|near| keep(i, j, near));
        self.grid.overlapping_pairs_where(near, pairs);
        Ok(())
    }

    /// Brings `pairs` up to date where some members (ascending) have other reaches or motions than when
    /// [`near_pairs`](Self::near_pairs) found them. Costs little where they are few.
    ///
    /// # Errors
    /// [`BroadPhaseError`] names the first of them that is not finite.
    ///
    /// # Panics
    /// If there are other segments than then.
    pub fn update(
        &mut self,
        changed: &[u32],
        segments: Segments<'_>,
        keep: impl Fn(u32, u32, Nearness) -> bool + Sync,
        pairs: &mut Vec<[u32; 2]>,
    ) -> Result<(), BroadPhaseError> {
        assert_eq!(segments.ends.len(), self.boxes.len(), "the segments of the grid");
        for i in changed.iter().map(|i| *i as usize) {
            self.boxes[i] = segments.bounds(&self.turn, i);
            self.sketches[i] = segments.sketch(i);
            if !self.boxes[i].is_valid() {
                return Err(BroadPhaseError::NotFinite { index: i });
            }
        }
        self.stale.extend_from_slice(changed);
        self.stale.sort_unstable();
        self.stale.dedup();
        let SegmentGrid { grid, boxes, sketches, stale, .. } = &*self;
        let found: Vec<Vec<[u32; 2]>> = changed
            .par_iter()
            .map(|i| {
                let mut found = Vec::new();
                let own = &boxes[*i as usize];
                let mut visit = |j: u32| {
                    let pair = [*i.min(&j), *i.max(&j)];
                    let near = || segments.nearness(sketches, pair);
                    if j != *i
                        && boxes[j as usize].overlaps(own)
                        && near().is_some_and(|near| keep(pair[0], pair[1], near))
                    {
                        found.push(pair);
                    }
                };
                grid.for_each_overlapping(own, &mut visit);
                stale.iter().for_each(|j| visit(*j));
                found
            })
            .collect();
        let is_changed = |i: u32| changed.binary_search(&i).is_ok();
        pairs.retain(|[i, j]| !is_changed(*i) && !is_changed(*j));
        let mut new: Vec<[u32; 2]> = found.into_iter().flatten().collect();
        new.sort_unstable();
        pairs.append(&mut new);
        // two runs in order: merged in one pass
        pairs.sort();
        pairs.dedup();
        Ok(())
    }
}

impl Segments<'_> {
    fn motion_of(&self, i: usize) -> Option<(&[Vector3; 2], f64)> {
        self.motion.map(|m| (&m.ends[i], m.reach[i]))
    }

    /// The box around a segment and its motion in turned axes.
    fn bounds(&self, turn: &Rotation3<f64>, i: usize) -> Aabb {
        let around = |[a, b]: &[Vector3; 2], reach: f64| {
            // Turning rounds: a few units in the last place more keep touching pairs.
            let slack = 1e-14 * (a.amax() + b.amax());
            Aabb::around_segment(&(turn * a), &(turn * b), reach + slack)
        };
        let (still, reach) = (&self.ends[i], self.reach[i]);
        self.motion_of(i)
            .map_or(around(still, reach), |(end, moving)| around(still, reach.max(moving)).merge(&around(end, moving)))
    }

    fn sketch(&self, i: usize) -> Sketch {
        Sketch::of(&self.ends[i], self.reach[i], self.motion_of(i))
    }

    /// How two segments lie, where they are near.
    fn nearness(&self, sketches: &[Sketch], pair: [u32; 2]) -> Option<Nearness> {
        let [i, j] = pair.map(|i| i as usize);
        if sketches[i].is_far_from(&sketches[j]) {
            return None;
        }
        let (a, b) = (&self.ends[i], &self.ends[j]);
        let squared = segment_segment(&a[0], &a[1], &b[0], &b[1]).separation.norm_squared();
        let within = |limit: f64| squared <= limit * limit;
        let may_meet = self.motion.is_some_and(|m| {
            let reach = m.reach[i] + m.reach[j];
            within(reach) || within(reach + largest_relative_motion(&[*a, m.ends[i]], &[*b, m.ends[j]]))
        });
        let near = may_meet || within(self.reach[i] + self.reach[j]);
        near.then(|| Nearness { distance: squared.sqrt(), may_meet })
    }
}

/// The largest displacement of an end of one segment against an end of the other, each given at the start and at the end of
/// the motion \[m\]: no two points of them move farther against each other.
#[must_use]
pub fn largest_relative_motion(a: &[[Vector3; 2]; 2], b: &[[Vector3; 2]; 2]) -> f64 {
    let (da, db) = ([a[1][0] - a[0][0], a[1][1] - a[0][1]], [b[1][0] - b[0][0], b[1][1] - b[0][1]]);
    let mut squared = 0.0_f64;
    for i in da {
        for j in db {
            squared = squared.max((i - j).norm_squared());
        }
    }
    squared.sqrt()
}

/// Rotation that brings the prevailing direction of the segments to the first axis; none if there is no such direction.
fn prevailing(segments: &[[Vector3; 2]]) -> Rotation3<f64> {
    let mut moment = Matrix3::zeros();
    for [a, b] in segments {
        let d = b - a;
        moment += d * d.transpose();
    }
    let trace = moment.trace();
    if !(trace.is_finite() && trace > 0.0) {
        return Rotation3::identity();
    }
    let eigen = (moment / trace).symmetric_eigen();
    let k = eigen.eigenvalues.imax();
    if eigen.eigenvalues[k] < ALIGNED {
        return Rotation3::identity();
    }
    let direction: Vector3 = eigen.eigenvectors.column(k).into();
    Rotation3::rotation_between(&direction, &Vector3::x()).unwrap_or_else(Rotation3::identity)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn near_pairs_equal_brute_force(starts in proptest::collection::vec([-2.0..2.0f64, -2.0..2.0, -2.0..2.0], 0..60),
                                        along in [-1.0..1.0f64, -1.0..1.0, -1.0..1.0], wild in 0.0..1.0f64, size in 0.0..0.3f64) {
            let segments: Vec<[Vector3; 2]> = starts.iter().enumerate().map(|(i, s)| {
                let s = Vector3::from(*s);
                let x = i as f64;
                let noise = Vector3::new((x * 1.3).sin(), (x * 2.7).cos(), (x * 0.9).sin());
                [s, s + Vector3::from(along) + noise * wild]
            }).collect();
            let reach: Vec<f64> = (0..segments.len()).map(|i| size * (1.0 + (i % 3) as f64)).collect();
            let keep = |i: u32, j: u32, _: Nearness| j != i + 1;
            let mut pairs = Vec::new();
            SegmentGrid::default().near_pairs(Segments { ends: &segments, reach: &reach, motion: None }, keep, &mut pairs).unwrap();
            let n = segments.len() as u32;
            let expected: Vec<[u32; 2]> = (0..n).flat_map(|i| (i + 2..n).map(move |j| [i, j])).filter(|&[i, j]| {
                let (a, b) = (&segments[i as usize], &segments[j as usize]);
                segment_segment(&a[0], &a[1], &b[0], &b[1]).separation.norm() <= reach[i as usize] + reach[j as usize]
            }).collect();
            prop_assert_eq!(pairs, expected);
        }

        /// Whatever sampling the motion finds near is among the pairs.
        #[test]
        fn no_pair_is_missed_on_the_way(starts in proptest::collection::vec([-2.0..2.0f64, -2.0..2.0, -2.0..2.0], 0..30),
                                        along in [-1.0..1.0f64, -1.0..1.0, -1.0..1.0], speed in 0.0..2.0f64) {
            let noise = |i: usize, k: f64| {
                let x = i as f64 + k;
                Vector3::new((x * 1.3).sin(), (x * 2.7).cos(), (x * 0.9).sin())
            };
            let segments: Vec<[Vector3; 2]> = starts.iter().enumerate()
                .map(|(i, s)| [Vector3::from(*s), Vector3::from(*s) + Vector3::from(along) + noise(i, 0.0) * 0.2]).collect();
            let moved: Vec<[Vector3; 2]> = segments.iter().enumerate()
                .map(|(i, [a, b])| [a + noise(i, 100.0) * speed, b + noise(i, 200.0) * speed]).collect();
            let reach = vec![0.1; segments.len()];
            let mut pairs = Vec::new();
            let motion = Some(SegmentMotion { ends: &moved, reach: &reach });
            let keep = |_, _, near: Nearness| near.may_meet;
            let moving = Segments { ends: &segments, reach: &reach, motion };
            SegmentGrid::default().near_pairs(moving, keep, &mut pairs).unwrap();
            let at = |i: u32, t: f64| [0, 1].map(|k| segments[i as usize][k].lerp(&moved[i as usize][k], t));
            for i in 0..segments.len() as u32 {
                for j in i + 1..segments.len() as u32 {
                    let meet = (0..=40).any(|k| {
                        let ([a, b], [c, d]) = (at(i, f64::from(k) / 40.0), at(j, f64::from(k) / 40.0));
                        segment_segment(&a, &b, &c, &d).separation.norm() <= 0.2
                    });
                    prop_assert!(!meet || pairs.contains(&[i, j]));
                }
            }
        }
    }

    /// Pairs brought up to date are those of a new grid.
    #[test]
    fn updated_pairs_are_those_of_a_new_grid() {
        let at = |i: usize, k: f64| {
            Vector3::new((i as f64 * 1.7 + k).sin(), (i as f64 * 2.3 - k).cos(), (i as f64 * 0.7).sin())
        };
        let segments: Vec<[Vector3; 2]> = (0..200).map(|i| [at(i, 0.0), at(i, 0.3)]).collect();
        let mut ends = segments.clone();
        let mut reach = vec![0.02; 200];
        let (mut grid, mut pairs, mut fresh) = (SegmentGrid::default(), Vec::new(), Vec::new());
        let keep = |i: u32, j: u32, _: Nearness| !(i + j).is_multiple_of(7);
        let still = vec![0.03; 200];
        let motion = Some(SegmentMotion { ends: &ends, reach: &reach });
        grid.near_pairs(Segments { ends: &segments, reach: &still, motion }, keep, &mut pairs).unwrap();
        let before = pairs.len();
        for changed in [vec![3, 50, 51, 120], vec![4, 50, 199], vec![]] {
            for i in changed.iter().map(|i| *i as usize) {
                ends[i] = [at(i, 1.0), at(i, 1.2)];
                reach[i] = 0.1;
            }
            let motion = Some(SegmentMotion { ends: &ends, reach: &reach });
            let moving = Segments { ends: &segments, reach: &still, motion };
            grid.update(&changed, moving, keep, &mut pairs).unwrap();
            SegmentGrid::default().near_pairs(moving, keep, &mut fresh).unwrap();
            assert_eq!(pairs, fresh);
        }
        assert!(pairs.len() > before + 20, "{} {before}", pairs.len());
    }

    #[test]
    fn segments_that_are_not_finite_are_named() {
        let good = [Vector3::zeros(), Vector3::x()];
        let bad = [Vector3::zeros(), Vector3::new(f64::NAN, 0.0, 0.0)];
        let segments = Segments { ends: &[good, bad], reach: &[0.1, 0.1], motion: None };
        let outcome = SegmentGrid::default().near_pairs(segments, |_, _, _| true, &mut Vec::new());
        assert_eq!(outcome, Err(BroadPhaseError::NotFinite { index: 1 }));
    }
}
