//! The scripts of a group, step by step, exactly as the original executes them.
//!
//! It takes the speed one step ahead of the step that it is used in, sums it over the steps, and carries held vertices
//! and fields along in two different ways: vertices by what the last script of a step changed, fields by everything.
//! The poses at the ends of the steps, joined by straight lines, are that motion to round-off.

use super::ease::speed;
use super::original::scripts::{Kind, Script};
use nalgebra::{Unit, UnitQuaternion, Vector3};

/// What moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Body {
    /// Held vertices.
    Vertices,
    /// A solid, first turned by this.
    Solid(UnitQuaternion<f64>),
    /// A source, first turned by this; the original turns it about axes of the world always.
    Source(UnitQuaternion<f64>),
}

/// A pose at a moment: turned and scaled about the place of the group, then moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Key {
    /// When [s].
    pub time: f64,
    /// Displacement [cm].
    pub translation: Vector3<f64>,
    /// Axis times angle [rad], continuous over the keys.
    pub rotation: Vector3<f64>,
    /// Factors along the axes.
    pub scale: Vector3<f64>,
}

/// More steps than this are not replayed.
pub const MAX_STEPS: f64 = 2e5;

/// The unit axis of a turn, or `None` where it has no direction.
#[must_use]
pub fn unit_axis(axis: [f64; 3]) -> Option<Unit<Vector3<f64>>> {
    Unit::try_new(Vector3::from(axis), 1e-12)
}

struct State {
    position: Vector3<f64>,
    rotation: UnitQuaternion<f64>,
    scale: Vector3<f64>,
}

/// Replays the scripts of one group; keys only where something moves, the first at time 0. Empty: nothing ever moves.
///
/// - `place`: where the group is at the start [cm]
/// - `dt`, `end`: step and end of the run [s]; `end / dt` at most [`MAX_STEPS`]
#[must_use]
pub fn replay(scripts: &[&Script], place: Vector3<f64>, body: Body, dt: f64, end: f64) -> Vec<Key> {
    let mut scripts: Vec<(&Script, f64)> = scripts.iter().map(|script| (*script, 0.0)).collect();
    let mut now = State { position: place, rotation: UnitQuaternion::identity(), scale: Vector3::repeat(1.0) };
    let first_turn = match body {
        Body::Vertices => UnitQuaternion::identity(),
        Body::Solid(turn) | Body::Source(turn) => turn,
    };
    let (mut center, mut turn) = (place, first_turn);
    let mut held = State { position: place, rotation: UnitQuaternion::identity(), scale: Vector3::repeat(1.0) };
    let still = Key { time: 0.0, translation: Vector3::zeros(), rotation: Vector3::zeros(), scale: now.scale };
    let mut keys = vec![still];
    let mut time = 0.0;
    let last = scripts.iter().map(|(script, _)| script.during[1]).fold(0.0, f64::max).min(end);
    while time <= last {
        time += dt;
        let mut before = State { position: now.position, rotation: now.rotation, scale: now.scale };
        for (script, travelled) in &mut scripts {
            let [start, stop] = script.during;
            if !(time >= start && time + dt <= stop) {
                continue;
            }
            let mut pace = |total: f64| {
                let speed = speed(script, total, time + dt, dt, *travelled);
                *travelled += speed * dt;
                speed * dt
            };
            match script.kind {
                Kind::Switch => {}
                Kind::Translate => {
                    before.position = now.position;
                    let way = Vector3::from(script.vector);
                    if way.norm() > 0.0 {
                        let step = way.normalize() * pace(way.norm());
                        now.position += step;
                        center += step;
                    }
                }
                Kind::Rotate | Kind::Swirl => {
                    let Some(axis) = unit_axis(script.vector) else { continue };
                    let step = UnitQuaternion::from_axis_angle(&axis, pace(script.angle));
                    before.rotation = now.rotation;
                    let global = script.global || script.kind == Kind::Swirl;
                    now.rotation = if global { step * now.rotation } else { now.rotation * step };
                    if script.kind == Kind::Rotate {
                        let of_world = global || matches!(body, Body::Source(_));
                        turn = if of_world { step * turn } else { turn * step };
                    }
                    if let Some(origin) = script.origin {
                        before.position = now.position;
                        let change = now.rotation * before.rotation.inverse();
                        let arm = now.position - Vector3::from(origin);
                        let step = change * arm - arm;
                        now.position += step;
                        center += step;
                    }
                }
                Kind::Scale => {
                    before.scale = now.scale;
                    let factors = Vector3::from(script.vector)
                        .map(|factor| (speed(script, factor.max(1e-300).ln(), time + dt, dt, 0.0) * dt).exp());
                    now.scale.component_mul_assign(&factors);
                    if script.global {
                        before.position = now.position;
                        now.position.component_mul_assign(&factors);
                        center.component_mul_assign(&factors);
                    }
                }
            }
        }
        let change = now.rotation * before.rotation.inverse();
        let factors = now.scale.component_div(&before.scale);
        held.position = change * (held.position - before.position).component_mul(&factors) + now.position;
        held.rotation = change * held.rotation;
        held.scale.component_mul_assign(&factors);
        let (translation, rotation, scale) = match body {
            Body::Vertices => (held.position - place, held.rotation, held.scale),
            Body::Solid(_) | Body::Source(_) => (center - place, turn * first_turn.inverse(), now.scale),
        };
        let rotation = continuous(&rotation, &keys[keys.len() - 1].rotation);
        keys.push(Key { time, translation, rotation, scale });
    }
    thin(keys)
}

/// The rotation vector of a turn nearest to the one before: turns beyond half a circle go on counting.
fn continuous(turn: &UnitQuaternion<f64>, before: &Vector3<f64>) -> Vector3<f64> {
    let vector = turn.scaled_axis();
    let full = std::f64::consts::TAU;
    let axis = if vector.norm() > 1e-9 { vector.normalize() } else { before.try_normalize(1e-9).unwrap_or(vector) };
    if axis.norm() < 0.5 {
        return vector;
    }
    let turns = ((before.dot(&axis) - vector.dot(&axis)) / full).round();
    vector + axis * (turns * full)
}

/// Drops keys between equal poses.
fn thin(keys: Vec<Key>) -> Vec<Key> {
    let same = |a: &Key, b: &Key| a.translation == b.translation && a.rotation == b.rotation && a.scale == b.scale;
    let count = keys.len();
    let kept: Vec<Key> = (0..count)
        .filter(|&k| {
            let resting = k > 0 && same(&keys[k - 1], &keys[k]) && (k + 1 == count || same(&keys[k], &keys[k + 1]));
            !resting
        })
        .map(|k| keys[k])
        .collect();
    if kept.len() == 1 { Vec::new() } else { kept }
}

#[cfg(test)]
mod tests {
    use super::super::document::Sited;
    use super::super::original::scripts::Progress;
    use super::*;
    use crate::scene::tree::Span;

    fn script(kind: Kind, vector: [f64; 3], angle: f64, during: [f64; 2]) -> Script {
        let third = (during[1] - during[0]) / 3.0;
        Script {
            span: Span::NONE,
            kind,
            progress: Progress::Cubic,
            vector,
            angle,
            origin: None,
            during,
            ramps: [third; 2],
            group: Sited::made(0),
            mask: 0,
            global: false,
        }
    }

    #[test]
    fn the_first_step_is_the_one_the_original_takes() {
        let down = script(Kind::Translate, [0.0, -8.0, 0.0], 0.0, [0.0, 0.3]);
        let keys = replay(&[&down], Vector3::zeros(), Body::Vertices, 0.02, 4.0);
        assert!((keys[1].translation.y + 0.2816).abs() < 1e-12, "{:?}", keys[1]);
        let last = keys[keys.len() - 1];
        assert!(last.time < 0.34 && (last.translation.y + 8.0).abs() < 0.1, "{last:?}");
    }

    #[test]
    fn turns_about_an_origin_carry_vertices_and_fields_along_one_circle() {
        let mut round = script(Kind::Rotate, [0.0, 0.0, 1.0], 4.0 * std::f64::consts::PI, [0.0, 1.0]);
        round.origin = Some([1.0, 0.0, 0.0]);
        let place = Vector3::new(3.0, 0.0, 0.0);
        let identity = UnitQuaternion::identity();
        let held = replay(&[&round], place, Body::Vertices, 1e-3, 1.0);
        let solid = replay(&[&round], place, Body::Solid(identity), 1e-3, 1.0);
        assert_eq!(held.len(), solid.len());
        for (a, b) in held.iter().zip(&solid) {
            assert!((a.translation - b.translation).norm() < 1e-10);
            let radius = (place + a.translation - Vector3::new(1.0, 0.0, 0.0)).norm();
            assert!((radius - 2.0).abs() < 1e-10);
        }
        // two full turns are counted as such
        assert!((held[held.len() - 1].rotation.z - 4.0 * std::f64::consts::PI).abs() < 0.1);
    }

    #[test]
    fn two_moves_at_once_carry_vertices_by_the_last_one_only() {
        let x = script(Kind::Translate, [1.0, 0.0, 0.0], 0.0, [0.0, 1.0]);
        let y = script(Kind::Translate, [0.0, 1.0, 0.0], 0.0, [0.0, 1.0]);
        let last = |keys: Vec<Key>| keys[keys.len() - 1].translation;
        let held = last(replay(&[&x, &y], Vector3::zeros(), Body::Vertices, 1e-3, 1.0));
        let solid = last(replay(&[&x, &y], Vector3::zeros(), Body::Solid(UnitQuaternion::identity()), 1e-3, 1.0));
        assert!(held.x.abs() < 1e-12 && (held.y - 1.0).abs() < 1e-3, "{held}");
        assert!((solid.x - 1.0).abs() < 1e-3 && (solid.y - 1.0).abs() < 1e-3, "{solid}");
    }

    #[test]
    fn what_rests_has_no_keys() {
        let never = script(Kind::Translate, [1.0, 0.0, 0.0], 0.0, [5.0, 6.0]);
        assert!(replay(&[&never], Vector3::zeros(), Body::Vertices, 0.1, 1.0).is_empty());
    }
}
