//! Poses given at instants, with interpolation between them.

use super::pose::{Pose, VelocityField};
use crate::Vector3;
use nalgebra::UnitQuaternion;
use serde::{Deserialize, Serialize};

/// One given pose, relative to where the shape was described.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Key {
    /// Instant [s].
    pub time: f64,
    /// Translation [m].
    #[serde(default, with = "crate::vector_format")]
    pub translation: Vector3,
    /// Rotation vector (axis times angle) [rad]; may exceed one turn.
    #[serde(default, with = "crate::vector_format")]
    pub rotation: Vector3,
    /// Scale, positive.
    #[serde(default = "one")]
    pub scale: f64,
}

fn one() -> f64 {
    1.0
}

/// Curve between keys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Interpolation {
    /// Straight between keys: velocity jumps at keys.
    Linear,
    /// Cubic through the keys with continuous velocity (Catmull–Rom tangents for uneven times, at rest at both ends).
    #[default]
    Cubic,
    /// Straight between keys, at rest at each key.
    Smoothstep,
}

/// The seven numbers of a key as one curve: translation, rotation vector, logarithm of scale.
type Values = nalgebra::SVector<f64, 7>;

fn values(key: &Key) -> Values {
    let (x, r) = (&key.translation, &key.rotation);
    Values::from([x.x, x.y, x.z, r.x, r.y, r.z, key.scale.ln()])
}

/// Pose and velocity field about `pivot` (in the shape's frame) at `time`; before the first and after the last key the pose rests.
pub(super) fn evaluate(
    keys: &[Key],
    interpolation: Interpolation,
    pivot: &Vector3,
    time: f64,
) -> (Pose, VelocityField) {
    let (value, rate) = curve(keys, interpolation, time);
    let part = |v: &Values, from: usize| Vector3::new(v[from], v[from + 1], v[from + 2]);
    let turn = part(&value, 3);
    let rotation = UnitQuaternion::from_scaled_axis(turn);
    let scale = value[6].exp();
    let centre = pivot + part(&value, 0);
    let pose = Pose { rotation, scale, translation: centre - rotation * (pivot * scale) };
    let angular = angular_velocity(&turn, &part(&rate, 3));
    (pose, VelocityField::about(&centre, part(&rate, 0), angular, rate[6]))
}

/// `ω = J(φ) φ̇` with the left Jacobian of the rotation group: the angular velocity of a changing rotation vector.
fn angular_velocity(turn: &Vector3, rate: &Vector3) -> Vector3 {
    let angle2 = turn.norm_squared();
    let (a, b) = if angle2 < 1e-6 {
        (0.5 - angle2 / 24.0, 1.0 / 6.0 - angle2 / 120.0)
    } else {
        let angle = angle2.sqrt();
        ((1.0 - angle.cos()) / angle2, (angle - angle.sin()) / (angle2 * angle))
    };
    let first = turn.cross(rate);
    rate + first * a + turn.cross(&first) * b
}

fn curve(keys: &[Key], interpolation: Interpolation, time: f64) -> (Values, Values) {
    let Some(first) = keys.first() else { return (Values::zeros(), Values::zeros()) };
    if time < first.time {
        return (values(first), Values::zeros());
    }
    let next = keys.partition_point(|key| key.time <= time);
    if next == keys.len() {
        return (values(&keys[next - 1]), Values::zeros());
    }
    let (a, b) = (&keys[next - 1], &keys[next]);
    let span = b.time - a.time;
    let u = (time - a.time) / span;
    let (pa, pb) = (values(a), values(b));
    match interpolation {
        Interpolation::Linear => (pa + (pb - pa) * u, (pb - pa) / span),
        Interpolation::Smoothstep => {
            let (s, rate) = super::Ease::Smoothstep.evaluate(u);
            (pa + (pb - pa) * s, (pb - pa) * (rate / span))
        }
        Interpolation::Cubic => {
            let tangent = |k: usize| -> Values {
                if k == 0 || k + 1 == keys.len() {
                    return Values::zeros();
                }
                let (before, after) = (keys[k].time - keys[k - 1].time, keys[k + 1].time - keys[k].time);
                let (left, right) = (
                    (values(&keys[k]) - values(&keys[k - 1])) / before,
                    (values(&keys[k + 1]) - values(&keys[k])) / after,
                );
                (left * after + right * before) / (before + after)
            };
            let (ma, mb) = (tangent(next - 1) * span, tangent(next) * span);
            let (u2, u3) = (u * u, u * u * u);
            let value = pa * (2.0 * u3 - 3.0 * u2 + 1.0)
                + ma * (u3 - 2.0 * u2 + u)
                + pb * (3.0 * u2 - 2.0 * u3)
                + mb * (u3 - u2);
            let rate = (pa - pb) * (6.0 * u2 - 6.0 * u) + ma * (3.0 * u2 - 4.0 * u + 1.0) + mb * (3.0 * u2 - 2.0 * u);
            (value, rate / span)
        }
    }
}
