//! Closest points of points and segments.
//!
//! The segment pair is measured through the cross product of the directions rather than `ac - b²`, which loses half the
//! digits when the segments are nearly parallel.

use crate::Vector3;

/// Sine of the angle below which two segments count as parallel. Above it the closest points are unique to working
/// precision; below it the distance changes along the overlap by less than this fraction of the length.
const PARALLEL_SINE: f64 = 1e-10;

/// Closest points of two segments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SegmentPair {
    /// Place on the first segment, 0 at its first end, 1 at its second.
    pub s: f64,
    /// Place on the second segment.
    pub t: f64,
    /// From the point on the first segment to the point on the second [m].
    pub separation: Vector3,
    /// Whether the segments were taken as parallel (the closest points are then not unique; the middle of the
    /// overlap is given).
    pub parallel: bool,
}

/// Place on the segment `a`–`b` closest to `point`, in `[0, 1]`. A segment of no length gives 0.
#[inline]
#[must_use]
pub fn point_segment(point: &Vector3, a: &Vector3, b: &Vector3) -> f64 {
    let d = b - a;
    project(point, a, &d, d.norm_squared())
}

#[inline]
fn project(point: &Vector3, a: &Vector3, d: &Vector3, dd: f64) -> f64 {
    if dd > 0.0 { ((point - a).dot(d) / dd).clamp(0.0, 1.0) } else { 0.0 }
}

/// Distance of a point from the segment `a`–`b` [m].
#[inline]
#[must_use]
pub fn point_segment_distance(point: &Vector3, a: &Vector3, b: &Vector3) -> f64 {
    (point - (a + (b - a) * point_segment(point, a, b))).norm()
}

/// Closest points of the segments `a0`–`a1` and `b0`–`b1`.
///
/// Exact to round-off for crossing, skew, touching and degenerate segments. For parallel segments that overlap the middle
/// of the overlap is chosen, so that the answer does not jump between the ends from one step to the next.
#[must_use]
pub fn segment_segment(a0: &Vector3, a1: &Vector3, b0: &Vector3, b1: &Vector3) -> SegmentPair {
    let (da, db, r) = (a1 - a0, b1 - b0, b0 - a0);
    let (aa, bb) = (da.norm_squared(), db.norm_squared());
    let pair = |s: f64, t: f64, parallel: bool| SegmentPair { s, t, separation: r + db * t - da * s, parallel };
    if aa == 0.0 || bb == 0.0 {
        // One segment is a point (or both are): project it on the other.
        return if aa == 0.0 {
            pair(0.0, project(a0, b0, &db, bb), false)
        } else {
            pair(project(b0, a0, &da, aa), 0.0, false)
        };
    }
    let n = da.cross(&db);
    let nn = n.norm_squared();
    if nn <= PARALLEL_SINE * PARALLEL_SINE * aa * bb {
        // Overlap of the second segment's shadow with the first, in the first one's parameter.
        let (u0, u1) = (r.dot(&da) / aa, (b1 - a0).dot(&da) / aa);
        let (low, high) = (u0.min(u1).max(0.0), u0.max(u1).min(1.0));
        let s = (0.5 * (low + high)).clamp(0.0, 1.0);
        // The reprojection also settles segments that do not overlap: their nearest ends.
        let t = project(&(a0 + da * s), b0, &db, bb);
        let s = if low <= high { s } else { project(&(b0 + db * t), a0, &da, aa) };
        return pair(s, t, true);
    }
    // Lines first, then the box constraint one side at a time (the squared distance is convex in (s, t)).
    let s = (r.cross(&db).dot(&n) / nn).clamp(0.0, 1.0);
    let t_free = (a0 + da * s - b0).dot(&db) / bb;
    let t = t_free.clamp(0.0, 1.0);
    let s = if t == t_free { s } else { project(&(b0 + db * t), a0, &da, aa) };
    pair(s, t, false)
}

#[cfg(test)]
mod tests {
    use super::*;
    use parry3d_f64::math::{Pose, Vector};
    use parry3d_f64::query::PointQuery;
    use parry3d_f64::shape::Segment;
    use proptest::prelude::*;

    fn vector() -> impl Strategy<Value = Vector3> {
        [-1.0..1.0, -1.0..1.0, -1.0..1.0f64].prop_map(Vector3::from)
    }

    fn parry(x: &Vector3) -> Vector {
        Vector::new(x.x, x.y, x.z)
    }

    proptest! {
        #[test]
        fn segments_agree_with_parry_at_any_scale(a0 in vector(), a1 in vector(), b0 in vector(), b1 in vector(), scale in -9.0..9.0f64) {
            let ours = segment_segment(&a0, &a1, &b0, &b1);
            let theirs = parry3d_f64::query::distance(
                &Pose::IDENTITY, &Segment::new(parry(&a0), parry(&a1)),
                &Pose::IDENTITY, &Segment::new(parry(&b0), parry(&b1))).unwrap().distance;
            prop_assert!((ours.separation.norm() - theirs).abs() <= 1e-10, "{} {}", ours.separation.norm(), theirs);
            let direct = (b0 + (b1 - b0) * ours.t) - (a0 + (a1 - a0) * ours.s);
            prop_assert!((direct - ours.separation).norm() <= 1e-14);
            // parry's thresholds are absolute, ours are not: small and large segments are compared with ourselves.
            let k = 10f64.powf(scale);
            let scaled = segment_segment(&(a0 * k), &(a1 * k), &(b0 * k), &(b1 * k));
            prop_assert!((scaled.separation / k - ours.separation).norm() <= 1e-9);
        }

        #[test]
        fn points_agree_with_parry(p in vector(), a in vector(), b in vector()) {
            let theirs = Segment::new(parry(&a), parry(&b)).distance_to_local_point(parry(&p), true);
            prop_assert!((point_segment_distance(&p, &a, &b) - theirs).abs() < 1e-13);
        }

        /// Nearly parallel pairs: no point of either end may be closer than the answer, at any angle down to round-off.
        #[test]
        fn nearly_parallel_is_minimal(a0 in vector(), d in vector(), tilt in vector(), gap in vector(),
                                      exponent in -18.0..0.0f64, shift in -1.5..1.5f64, flip in any::<bool>()) {
            prop_assume!(d.norm() > 0.1);
            let angle = 10f64.powf(exponent);
            let a1 = a0 + d;
            let (mut b0, mut b1) = (a0 + d * shift + gap, a1 + d * shift + gap + tilt * angle);
            if flip { std::mem::swap(&mut b0, &mut b1); }
            let ours = segment_segment(&a0, &a1, &b0, &b1).separation.norm();
            let mut best = [point_segment_distance(&a0, &b0, &b1), point_segment_distance(&a1, &b0, &b1),
                point_segment_distance(&b0, &a0, &a1), point_segment_distance(&b1, &a0, &a1)]
                .into_iter().fold(f64::INFINITY, f64::min);
            for i in 0..=50 {
                let s = f64::from(i) / 50.0;
                best = best.min(point_segment_distance(&(a0 + d * s), &b0, &b1));
            }
            prop_assert!(ours <= best + 1e-9, "{ours} > {best}");
        }
    }

    #[test]
    fn special_positions() {
        let v = |x: f64, y: f64, z: f64| Vector3::new(x, y, z);
        let parallel = segment_segment(&v(0., 0., 0.), &v(4., 0., 0.), &v(1., 1., 0.), &v(9., 1., 0.));
        assert!(parallel.parallel && parallel.s == 2.5 / 4.0 && parallel.separation == v(0., 1., 0.));
        let apart = segment_segment(&v(0., 0., 0.), &v(1., 0., 0.), &v(3., 0., 0.), &v(2., 0., 0.));
        assert_eq!((apart.s, apart.t, apart.separation), (1.0, 1.0, v(1., 0., 0.)));
        let point = segment_segment(&v(0., 0., 0.), &v(0., 0., 0.), &v(-1., 1., 0.), &v(1., 1., 0.));
        assert_eq!((point.t, point.separation), (0.5, v(0., 1., 0.)));
        let crossing = segment_segment(&v(-1., 0., 0.), &v(1., 0., 0.), &v(0., -1., 0.), &v(0., 1., 0.));
        assert_eq!((crossing.s, crossing.t, crossing.separation.norm()), (0.5, 0.5, 0.0));
        let both = segment_segment(&v(1., 0., 0.), &v(1., 0., 0.), &v(1., 2., 0.), &v(1., 2., 0.));
        assert_eq!(both.separation, v(0., 2., 0.));
    }
}
