//! Parallel transport and rotations of vectors.
//!
//! The minimal rotation that takes one unit vector to another, for single vectors (nalgebra) and for lanes.

use crate::lanes::{Lane, V3, sin_cos};
use nalgebra::Vector3;

/// Below this value of `1 + s·t` the minimal rotation from `s` to `t` is taken as undefined.
pub const ANTIPARALLEL: f64 = 1e-8;

/// Rotates `v` by the minimal rotation that takes the unit vector `from` to the unit vector `to`.
///
/// `R v = v − (s+t)((s+t)·v)/(1+s·t) + 2 t (s·v)`. The flag is `false` when the vectors are so nearly opposite
/// (`1 + s·t < 10⁻⁸`) that the rotation is undefined; then `v` is turned by π about the part of `v` normal to `from`
/// (about any normal if `v` has none), which leaves a director unchanged.
///
/// Source: Bergou et al. 2008, parallel transport; closed form of Rodrigues' rotation.
#[must_use]
pub fn parallel_transport(v: &Vector3<f64>, from: &Vector3<f64>, to: &Vector3<f64>) -> (Vector3<f64>, bool) {
    let c = 1.0 + from.dot(to);
    if c < ANTIPARALLEL {
        let along = from.dot(v);
        let normal = v - from * along;
        return (normal - from * along, false);
    }
    let sum = from + to;
    (v - sum * (sum.dot(v) / c) + to * (2.0 * from.dot(v)), true)
}

/// Rotates `v` about the unit vector `axis` by `angle` [rad].
#[must_use]
pub fn rotate_about(v: &Vector3<f64>, axis: &Vector3<f64>, angle: f64) -> Vector3<f64> {
    let (s, c) = sin_cos(angle);
    v * c + axis.cross(v) * s + axis * (axis.dot(v) * (1.0 - c))
}

/// Returns a unit vector normal to the unit vector `t`, chosen from `t` alone.
#[must_use]
pub fn any_normal(t: &Vector3<f64>) -> Vector3<f64> {
    let i = t.iamin();
    let mut axis = Vector3::zeros();
    axis[i] = 1.0;
    (axis - t * t[i]).normalize()
}

/// Signed angle [rad] from `a` to `b` about the unit vector `axis`, in (−π, π].
#[must_use]
pub fn signed_angle(a: &Vector3<f64>, b: &Vector3<f64>, axis: &Vector3<f64>) -> f64 {
    crate::lanes::atan2(a.cross(b).dot(axis), a.dot(b))
}

/// Lane form of [`parallel_transport`] for a vector normal to `from`: `v − (s+t)(t·v)/(1+s·t)`.
/// Nearly opposite vectors leave `v` unchanged.
#[inline(always)]
pub fn transport_normal<L: Lane>(v: V3<L>, from: V3<L>, to: V3<L>) -> V3<L> {
    let c = L::splat(1.0) + from.dot(to);
    let limit = L::splat(ANTIPARALLEL);
    let safe = L::select_gt(c, limit, c, L::splat(1.0));
    let factor = L::select_gt(c, limit, to.dot(v) / safe, L::splat(0.0));
    v - (from + to).scale(factor)
}

/// Removes from `v` its part along the unit vector `t` and normalises (one Gram–Schmidt step).
#[inline(always)]
pub fn orthonormalize<L: Lane>(v: V3<L>, t: V3<L>) -> V3<L> {
    let n = v - t.scale(t.dot(v));
    n.scale(L::splat(1.0) / n.dot(n).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn unit() -> impl Strategy<Value = Vector3<f64>> {
        (-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64)
            .prop_filter("not zero", |v| v.0 * v.0 + v.1 * v.1 + v.2 * v.2 > 1e-2)
            .prop_map(|(x, y, z)| Vector3::new(x, y, z).normalize())
    }

    proptest! {
        #[test]
        fn transport_is_the_minimal_rotation(s in unit(), t in unit(), v in unit()) {
            prop_assume!(1.0 + s.dot(&t) > 1e-4);
            let (image, defined) = parallel_transport(&s, &s, &t);
            prop_assert!(defined);
            prop_assert!((image - t).norm() < 1e-10);
            let (axis, _) = parallel_transport(&s.cross(&t), &s, &t);
            prop_assert!((axis - s.cross(&t)).norm() < 1e-10);
            let (w, _) = parallel_transport(&v, &s, &t);
            prop_assert!((w.norm() - 1.0).abs() < 1e-10);
            let normal = v - s * s.dot(&v);
            let lanes = transport_normal(V3::<f64>(normal.into()), V3(s.into()), V3(t.into()));
            let (full, _) = parallel_transport(&normal, &s, &t);
            prop_assert!((Vector3::from(lanes.0) - full).norm() < 1e-10);
        }

        #[test]
        fn rotation_and_signed_angle_are_inverse(t in unit(), angle in -3.0..3.0f64) {
            let d = any_normal(&t);
            prop_assert!(d.dot(&t).abs() < 1e-14 && (d.norm() - 1.0).abs() < 1e-14);
            let turned = rotate_about(&d, &t, angle);
            prop_assert!((signed_angle(&d, &turned, &t) - angle).abs() < 1e-13);
        }
    }

    #[test]
    fn opposite_vectors_keep_a_director_and_raise_the_flag() {
        let s = Vector3::z();
        let (d, defined) = parallel_transport(&Vector3::x(), &s, &-s);
        assert!(!defined);
        assert_eq!(d, Vector3::x());
        assert_eq!(parallel_transport(&s, &s, &-s).0, -s);
    }
}
