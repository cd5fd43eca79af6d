//! Pairs of segments that come near each other.

use super::{BoxGrid, BroadPhaseError};
use crate::closest::segment_segment;
use crate::{Aabb, Vector3};
use nalgebra::{Matrix3, Rotation3};

/// Share of the squared length that must run along one axis for the grid to be turned there.
const ALIGNED: f64 = 0.5;

/// Finds near pairs among segments. Keeps its memory between calls.
///
/// Hair in a bundle is long, thin and aligned: boxes along the coordinate axes would overlap by the hundred if the bundle runs
/// across them. So the boxes are taken in axes turned along the prevailing direction, and only pairs whose true distance
/// counts are kept.
#[derive(Clone, Debug, Default)]
pub struct SegmentGrid {
    grid: BoxGrid,
    boxes: Vec<Aabb>,
}

impl SegmentGrid {
    /// All pairs `[i, j]`, `i < j`, of segments whose distance is at most `reach[i] + reach[j]` [m] and for which `skip(i, j)` is
    /// false, in ascending order, whatever the number of threads.
    ///
    /// - `segments`: both ends [m]
    /// - `reach`: radius of each segment, with whatever margin is wanted [m], not negative
    ///
    /// # Errors
    /// [`BroadPhaseError`] names the first segment that is not finite.
    ///
    /// # Panics
    /// If `reach` is shorter than `segments`.
    pub fn near_pairs(
        &mut self,
        segments: &[[Vector3; 2]],
        reach: &[f64],
        skip: impl Fn(u32, u32) -> bool + Sync,
        pairs: &mut Vec<[u32; 2]>,
    ) -> Result<(), BroadPhaseError> {
        assert!(reach.len() >= segments.len(), "one reach per segment");
        let turn = prevailing(segments);
        self.boxes.clear();
        self.boxes.extend(segments.iter().zip(reach).map(|([a, b], reach)| {
            // Turning rounds: a few units in the last place more keep touching pairs.
            let slack = 1e-14 * (a.amax() + b.amax());
            Aabb::around_segment(&(turn * a), &(turn * b), reach + slack)
        }));
        self.grid.build(&self.boxes)?;
        let near = |i: u32, j: u32| {
            let ([a0, a1], [b0, b1]) = (&segments[i as usize], &segments[j as usize]);
            let limit = reach[i as usize] + reach[j as usize];
            !skip(i, j) && segment_segment(a0, a1, b0, b1).separation.norm_squared() <= limit * limit
        };
        self.grid.overlapping_pairs_where(near, pairs);
        Ok(())
    }
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
            let skip = |i: u32, j: u32| j == i + 1;
            let mut pairs = Vec::new();
            SegmentGrid::default().near_pairs(&segments, &reach, skip, &mut pairs).unwrap();
            let n = segments.len() as u32;
            let expected: Vec<[u32; 2]> = (0..n).flat_map(|i| (i + 2..n).map(move |j| [i, j])).filter(|&[i, j]| {
                let (a, b) = (&segments[i as usize], &segments[j as usize]);
                segment_segment(&a[0], &a[1], &b[0], &b[1]).separation.norm() <= reach[i as usize] + reach[j as usize]
            }).collect();
            prop_assert_eq!(pairs, expected);
        }
    }

    #[test]
    fn segments_that_are_not_finite_are_named() {
        let good = [Vector3::zeros(), Vector3::x()];
        let bad = [Vector3::zeros(), Vector3::new(f64::NAN, 0.0, 0.0)];
        let outcome = SegmentGrid::default().near_pairs(&[good, bad], &[0.1, 0.1], |_, _| false, &mut Vec::new());
        assert_eq!(outcome, Err(BroadPhaseError::NotFinite { index: 1 }));
    }
}
