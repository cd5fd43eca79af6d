//! Motion scripts of a scene as motions of `geometry`, which evaluates them.

use geometry::motion::{Interpolation, Key, Movement, Pivot};
use geometry::{Ease, Motion};
use nalgebra::Vector3;

use super::BuildError;
use crate::scene::motion as described;

/// The motion of a script; `end` [s] closes the movements that last for ever.
///
/// # Errors
/// For what no motion can do: scaling by different factors along the axes.
pub fn motion(script: &[described::Motion], end: f64) -> Result<Motion, BuildError> {
    let movements = script.iter().map(|part| movement(part, end)).collect::<Result<Vec<_>, _>>()?;
    let motion = Motion { movements };
    motion.check().map_err(|error| BuildError::Script(error.to_string()))?;
    Ok(motion)
}

fn movement(part: &described::Motion, end: f64) -> Result<Movement, BuildError> {
    let always = (0.0, end.max(f64::MIN_POSITIVE) * 2.0);
    let span = |during: &Option<described::Interval>| during.map_or(always, |d| (d.start, d.end));
    let pivot = |center: &Option<Vector3<f64>>| center.map_or(Pivot::Center, Pivot::Point);
    Ok(match part {
        described::Motion::Translate(m) => {
            Movement::Translate { by: m.by, during: (m.during.start, m.during.end), ease: ease(&m.ease) }
        }
        described::Motion::Rotate(m) => Movement::Rotate {
            axis: m.axis.0,
            angle: m.angle,
            during: (m.during.start, m.during.end),
            about: pivot(&m.center),
            ease: ease(&m.ease),
        },
        described::Motion::Glide(m) => {
            let during = span(&m.during);
            Movement::Translate { by: m.velocity * (during.1 - during.0), during, ease: Ease::Linear }
        }
        described::Motion::Spin(m) => {
            let during = span(&m.during);
            let angle = m.rate * (during.1 - during.0);
            Movement::Rotate { axis: m.axis.0, angle, during, about: pivot(&m.center), ease: Ease::Linear }
        }
        described::Motion::Oscillate(m) => Movement::Oscillate {
            amplitude: m.amplitude,
            frequency: m.frequency,
            phase: m.phase,
            during: span(&m.during),
        },
        described::Motion::Scale(m) => Movement::Scale {
            factor: uniform(&m.factor)?,
            during: (m.during.start, m.during.end),
            about: pivot(&m.center),
            ease: ease(&m.ease),
        },
        described::Motion::Keyframes(m) => Movement::Keyframes {
            keys: m
                .poses
                .iter()
                .map(|pose| {
                    let scale = uniform(&pose.scale)?;
                    Ok(Key { time: pose.time, translation: pose.translate, rotation: pose.rotate, scale })
                })
                .collect::<Result<_, BuildError>>()?,
            interpolation: match &m.ease {
                described::Ease::Linear => Interpolation::Linear,
                _ => Interpolation::Smoothstep,
            },
            about: pivot(&m.center),
        },
    })
}

fn ease(ease: &described::Ease) -> Ease {
    match ease {
        described::Ease::Linear => Ease::Linear,
        described::Ease::Smooth => Ease::Smoothstep,
        described::Ease::Smoother => Ease::Smootherstep,
        described::Ease::Accelerate => Ease::QuadraticIn,
        described::Ease::Decelerate => Ease::QuadraticOut,
        described::Ease::Ramps(ramps) => Ease::Ramps { rise: ramps.rise, fall: ramps.fall },
    }
}

fn uniform(factor: &described::ScaleFactor) -> Result<f64, BuildError> {
    let f = factor.0;
    if f.x == f.y && f.y == f.z {
        Ok(f.x)
    } else {
        Err(BuildError::Script(format!(
            "scaling by ({}, {}, {}): distances stay exact only when the three factors are equal; give one number",
            f.x, f.y, f.z
        )))
    }
}
