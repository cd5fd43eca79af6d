//! Scripted motion: where a body is at any time, and how fast each of its points moves.
//!
//! A [`Motion`] is a list of movements; each is a similarity that depends on time only, and they apply one after the
//! other in the order written. Nothing is integrated, so a run that restarts at time `t` finds the same pose to the last bit.

mod ease;
mod keyframes;
mod pose;

pub use ease::Ease;
pub use keyframes::{Interpolation, Key};
pub use pose::{Pose, VelocityField};

use crate::Vector3;
use nalgebra::{Unit, UnitQuaternion};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The point about which a body turns or grows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Pivot {
    /// The body's own centre, wherever earlier movements in the list have brought it.
    #[default]
    Center,
    /// A fixed point of the world [m].
    Point(#[serde(with = "crate::vector_format")] Vector3),
}

/// One movement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Movement {
    /// Moves along a straight line.
    Translate {
        /// Total displacement [m].
        #[serde(with = "crate::vector_format")]
        by: Vector3,
        /// Start and end [s].
        during: (f64, f64),
        /// Progress curve.
        #[serde(default)]
        ease: Ease,
    },
    /// Turns about an axis.
    Rotate {
        /// Direction of the axis (any length but zero).
        #[serde(with = "crate::vector_format")]
        axis: Vector3,
        /// Total angle [rad], right-handed; may exceed one turn.
        angle: f64,
        /// Start and end [s].
        during: (f64, f64),
        /// Point on the axis.
        #[serde(default)]
        about: Pivot,
        /// Progress curve.
        #[serde(default)]
        ease: Ease,
    },
    /// Grows or shrinks uniformly.
    Scale {
        /// Final size relative to the initial one, positive; lengths grow geometrically with progress.
        factor: f64,
        /// Start and end [s].
        during: (f64, f64),
        /// Point that stays.
        #[serde(default)]
        about: Pivot,
        /// Progress curve.
        #[serde(default)]
        ease: Ease,
    },
    /// Swings along a line: `amplitude · (sin(2π f (t - start) + phase) - sin(phase))` between start and end; rests where it is after the end.
    Oscillate {
        /// Amplitude and direction [m].
        #[serde(with = "crate::vector_format")]
        amplitude: Vector3,
        /// Frequency [Hz].
        frequency: f64,
        /// Phase at the start [rad].
        #[serde(default)]
        phase: f64,
        /// Start and end [s].
        during: (f64, f64),
    },
    /// Passes through given poses.
    Keyframes {
        /// Poses with strictly rising times.
        keys: Vec<Key>,
        /// Curve between keys.
        #[serde(default)]
        interpolation: Interpolation,
        /// Point about which the poses turn and scale.
        #[serde(default)]
        about: Pivot,
    },
}

/// A whole script: movements applied one after the other in the order written.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Motion {
    /// The movements.
    pub movements: Vec<Movement>,
}

/// What is wrong with a script.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum MotionError {
    /// A movement must end after it starts.
    #[error("movement {index}: `during` must be two finite times with the end after the start, got ({start}, {end}) s")]
    Interval {
        /// Which movement, from zero.
        index: usize,
        /// Start [s].
        start: f64,
        /// End [s].
        end: f64,
    },
    /// A parameter is out of range.
    #[error("movement {index}: {what}")]
    Parameter {
        /// Which movement, from zero.
        index: usize,
        /// What must hold.
        what: &'static str,
    },
}

impl Motion {
    /// Whether nothing ever moves.
    #[must_use]
    pub fn is_still(&self) -> bool {
        self.movements.is_empty()
    }

    /// Checks every parameter of every movement.
    ///
    /// # Errors
    /// [`MotionError`] with the index of the first movement that is wrong.
    pub fn check(&self) -> Result<(), MotionError> {
        for (index, movement) in self.movements.iter().enumerate() {
            let refuse = |what| Err(MotionError::Parameter { index, what });
            let finite = |v: &Vector3| v.iter().all(|x| x.is_finite());
            match movement {
                Movement::Translate { by, .. } if !finite(by) => return refuse("`by` must be finite"),
                Movement::Rotate { axis, .. } if !(finite(axis) && axis.norm() > 0.0) => {
                    return refuse("`axis` must be finite and not zero");
                }
                Movement::Rotate { angle, .. } if !angle.is_finite() => return refuse("`angle` must be finite [rad]"),
                Movement::Scale { factor, .. } if !(factor.is_finite() && *factor > 0.0) => {
                    return refuse("`factor` must be positive and finite");
                }
                Movement::Rotate { about: Pivot::Point(p), .. } | Movement::Scale { about: Pivot::Point(p), .. }
                    if !finite(p) =>
                {
                    return refuse("`about` must be finite");
                }
                Movement::Oscillate { amplitude, frequency, phase, .. }
                    if !(finite(amplitude) && frequency.is_finite() && phase.is_finite()) =>
                {
                    return refuse("`amplitude`, `frequency` and `phase` must be finite");
                }
                Movement::Keyframes { keys, .. } => {
                    let sound = |k: &Key| {
                        k.time.is_finite()
                            && finite(&k.translation)
                            && finite(&k.rotation)
                            && k.scale.is_finite()
                            && k.scale > 0.0
                    };
                    if keys.is_empty() || !keys.iter().all(sound) {
                        return refuse("`keys` needs at least one key, all finite, with positive `scale`");
                    }
                    if keys.windows(2).any(|pair| pair[0].time >= pair[1].time) {
                        return refuse("`keys` must have strictly rising times");
                    }
                }
                _ => {}
            }
            if let Some(((start, end), ease)) = movement.clock() {
                if !(start.is_finite() && end.is_finite() && end > start) {
                    return Err(MotionError::Interval { index, start, end });
                }
                if !ease.is_valid() {
                    return refuse("`ramp` must be in (0, 0.5]; `rise` and `fall` 0 or more and together at most 1");
                }
            }
        }
        Ok(())
    }

    /// Pose and velocity field at `time` [s] of a body whose centre was described at `center` [m].
    ///
    /// The velocity is the right-hand derivative of the pose: at the start of a movement it moves already, at the end it rests.
    #[must_use]
    pub fn evaluate(&self, center: &Vector3, time: f64) -> (Pose, VelocityField) {
        let mut pose = Pose::identity();
        let mut field = VelocityField::default();
        for movement in &self.movements {
            let body_center = pose.apply(center);
            let (step, own) = movement.evaluate(&body_center, &field.at(&body_center), time);
            // The earlier velocity is carried along by the later transform, which adds its own.
            let carried = VelocityField::about(
                &step.translation,
                step.rotation * (field.linear * step.scale),
                step.rotation * field.angular,
                field.growth,
            );
            field = VelocityField {
                linear: own.linear + carried.linear,
                angular: own.angular + carried.angular,
                growth: own.growth + carried.growth,
            };
            pose = pose.then(&step);
        }
        (pose, field)
    }

    /// The pose alone.
    #[must_use]
    pub fn pose(&self, center: &Vector3, time: f64) -> Pose {
        self.evaluate(center, time).0
    }

    /// Instants at which the velocity may jump [s], ascending: where movements start, end or pass a key.
    #[must_use]
    pub fn corner_times(&self) -> Vec<f64> {
        let mut times = Vec::new();
        for movement in &self.movements {
            match movement {
                Movement::Keyframes { keys, .. } => times.extend(keys.iter().map(|key| key.time)),
                other => {
                    if let Some(((start, end), _)) = other.clock() {
                        times.extend([start, end]);
                    }
                }
            }
        }
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }

    /// The same script with all lengths multiplied (unit conversion).
    #[must_use]
    pub fn with_length_unit(&self, unit: f64) -> Motion {
        let mut scaled = self.clone();
        for movement in &mut scaled.movements {
            match movement {
                Movement::Translate { by: v, .. }
                | Movement::Oscillate { amplitude: v, .. }
                | Movement::Rotate { about: Pivot::Point(v), .. }
                | Movement::Scale { about: Pivot::Point(v), .. } => *v *= unit,
                Movement::Keyframes { keys, about, .. } => {
                    keys.iter_mut().for_each(|key| key.translation *= unit);
                    if let Pivot::Point(point) = about {
                        *point *= unit;
                    }
                }
                Movement::Rotate { .. } | Movement::Scale { .. } => {}
            }
        }
        scaled
    }
}

impl Movement {
    fn clock(&self) -> Option<((f64, f64), Ease)> {
        match self {
            Movement::Translate { during, ease, .. }
            | Movement::Rotate { during, ease, .. }
            | Movement::Scale { during, ease, .. } => Some((*during, *ease)),
            Movement::Oscillate { during, .. } => Some((*during, Ease::Linear)),
            Movement::Keyframes { .. } => None,
        }
    }

    /// The movement's own transform at `time` and the velocity field it adds at fixed earlier state plus, for pivots
    /// that ride on the body, the velocity of the pivot.
    fn evaluate(&self, center: &Vector3, center_velocity: &Vector3, time: f64) -> (Pose, VelocityField) {
        let progress = |during: (f64, f64), ease: Ease| {
            let span = during.1 - during.0;
            let (value, rate) = ease.evaluate((time - during.0) / span);
            (value, rate / span)
        };
        let pivot = |about: Pivot| match about {
            Pivot::Center => (*center, *center_velocity),
            Pivot::Point(point) => (point, Vector3::zeros()),
        };
        let shift = |by: Vector3, velocity: Vector3| {
            (
                Pose { translation: by, ..Pose::identity() },
                VelocityField { linear: velocity, ..VelocityField::default() },
            )
        };
        match self {
            Movement::Translate { by, during, ease } => {
                let (value, rate) = progress(*during, *ease);
                shift(by * value, by * rate)
            }
            Movement::Oscillate { amplitude, frequency, phase, during } => {
                let circular = std::f64::consts::TAU * frequency;
                let elapsed = (time.min(during.1) - during.0).max(0.0);
                let moving = time >= during.0 && time < during.1;
                let argument = circular * elapsed + phase;
                let rate = if moving { circular * argument.cos() } else { 0.0 };
                shift(amplitude * (argument.sin() - phase.sin()), amplitude * rate)
            }
            Movement::Rotate { axis, angle, during, about, ease } => {
                let (value, rate) = progress(*during, *ease);
                let axis = Unit::new_normalize(*axis);
                let rotation = UnitQuaternion::from_axis_angle(&axis, angle * value);
                about_pivot(rotation, 1.0, axis.into_inner() * (angle * rate), 0.0, pivot(*about))
            }
            Movement::Scale { factor, during, about, ease } => {
                let (value, rate) = progress(*during, *ease);
                let scale = if value == 1.0 { *factor } else { factor.powf(value) };
                about_pivot(UnitQuaternion::identity(), scale, Vector3::zeros(), factor.ln() * rate, pivot(*about))
            }
            Movement::Keyframes { keys, interpolation, about } => {
                let (center, center_velocity) = pivot(*about);
                let (step, mut own) = keyframes::evaluate(keys, *interpolation, &center, time);
                // The pivot may ride on the body; add its velocity, less what the carried field already counts.
                own.linear += center_velocity - step.rotation * (center_velocity * step.scale);
                (step, own)
            }
        }
    }
}

/// `x ↦ c + s R (x - c)` with the pivot `c` moving at its own velocity.
fn about_pivot(
    rotation: UnitQuaternion<f64>,
    scale: f64,
    angular: Vector3,
    growth: f64,
    (pivot, velocity): (Vector3, Vector3),
) -> (Pose, VelocityField) {
    let pose = Pose { rotation, scale, translation: pivot - rotation * (pivot * scale) };
    let carried = rotation * (velocity * scale);
    (pose, VelocityField::about(&pivot, velocity - carried, angular, growth))
}
