//! Ease curves: progress of a movement against time, both in `[0, 1]`.

use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// How a movement gains and loses speed. All curves go from 0 to 1 and never overshoot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Ease {
    /// Constant speed: jumps of velocity at both ends.
    #[default]
    Linear,
    /// `u²`: starts from rest.
    QuadraticIn,
    /// Ends at rest.
    QuadraticOut,
    /// Starts and ends at rest with constant acceleration in each half.
    QuadraticInOut,
    /// `u³`: starts from rest.
    CubicIn,
    /// Ends at rest.
    CubicOut,
    /// Starts and ends at rest.
    CubicInOut,
    /// `(1 - cos πu)/2`: starts and ends at rest, half a period of a harmonic movement.
    Sine,
    /// `3u² - 2u³`: starts and ends at rest, linear acceleration.
    Smoothstep,
    /// `6u⁵ - 15u⁴ + 10u³`: starts and ends without velocity and without acceleration.
    Smootherstep,
    /// Constant acceleration over the first fraction, constant speed, constant deceleration over the last, each `ramp` of the whole.
    Trapezoid {
        /// Share of the time spent accelerating, and again decelerating; in `(0, 0.5]`.
        ramp: f64,
    },
    /// Speed that rises as `3w² - 2w³` over the first fraction, stays, and falls likewise over the last: no jump of
    /// acceleration at the ends.
    Ramps {
        /// Share of the time in which speed rises; 0 or more.
        rise: f64,
        /// Share of the time in which it falls; 0 or more, both together at most 1.
        fall: f64,
    },
}

impl Ease {
    /// Every curve without parameters, for tables and tests.
    pub const PLAIN: [Ease; 10] = [
        Ease::Linear,
        Ease::QuadraticIn,
        Ease::QuadraticOut,
        Ease::QuadraticInOut,
        Ease::CubicIn,
        Ease::CubicOut,
        Ease::CubicInOut,
        Ease::Sine,
        Ease::Smoothstep,
        Ease::Smootherstep,
    ];

    /// Progress and its rate at `u`; outside `[0, 1]` progress is clamped and the rate is zero.
    #[must_use]
    pub fn evaluate(self, u: f64) -> (f64, f64) {
        if u < 0.0 {
            return (0.0, 0.0);
        }
        if u >= 1.0 {
            return (1.0, 0.0);
        }
        let w = 1.0 - u;
        match self {
            Ease::Linear => (u, 1.0),
            Ease::QuadraticIn => (u * u, 2.0 * u),
            Ease::QuadraticOut => (1.0 - w * w, 2.0 * w),
            Ease::QuadraticInOut if u < 0.5 => (2.0 * u * u, 4.0 * u),
            Ease::QuadraticInOut => (1.0 - 2.0 * w * w, 4.0 * w),
            Ease::CubicIn => (u * u * u, 3.0 * u * u),
            Ease::CubicOut => (1.0 - w * w * w, 3.0 * w * w),
            Ease::CubicInOut if u < 0.5 => (4.0 * u * u * u, 12.0 * u * u),
            Ease::CubicInOut => (1.0 - 4.0 * w * w * w, 12.0 * w * w),
            Ease::Sine => (0.5 * (1.0 - (PI * u).cos()), 0.5 * PI * (PI * u).sin()),
            Ease::Smoothstep => (u * u * (3.0 - 2.0 * u), 6.0 * u * w),
            Ease::Smootherstep => (u * u * u * (10.0 + u * (6.0 * u - 15.0)), 30.0 * u * u * w * w),
            Ease::Trapezoid { ramp } => {
                // Speed of the flat part from the area under the trapezoid being one.
                let speed = 1.0 / (1.0 - ramp);
                if u < ramp {
                    (0.5 * speed * u * u / ramp, speed * u / ramp)
                } else if w < ramp {
                    (1.0 - 0.5 * speed * w * w / ramp, speed * w / ramp)
                } else {
                    (speed * (u - 0.5 * ramp), speed)
                }
            }
            Ease::Ramps { rise, fall } => {
                let speed = 1.0 / (1.0 - 0.5 * (rise + fall));
                // A ramp covers half of what full speed would; within it, the integral of `3w² - 2w³`.
                if u < rise {
                    let r = u / rise;
                    (speed * rise * r * r * r * (1.0 - 0.5 * r), speed * r * r * (3.0 - 2.0 * r))
                } else if w < fall {
                    let r = w / fall;
                    (1.0 - speed * fall * r * r * r * (1.0 - 0.5 * r), speed * r * r * (3.0 - 2.0 * r))
                } else {
                    (speed * (u - 0.5 * rise), speed)
                }
            }
        }
    }

    /// Whether the parameters are in range.
    #[must_use]
    pub fn is_valid(self) -> bool {
        match self {
            Ease::Trapezoid { ramp } => ramp > 0.0 && ramp <= 0.5,
            // shares that are thirds, tenths and so on may add up to a little more than one
            Ease::Ramps { rise, fall } => rise >= 0.0 && fall >= 0.0 && rise + fall <= 1.0 + 1e-12,
            _ => true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_start_at_zero_end_at_one_rise_and_match_their_rate() {
        let ramps = [0.5, 0.25, 0.01].map(|ramp| Ease::Trapezoid { ramp });
        let smooth = [(1.0 / 3.0, 1.0 / 3.0), (0.5, 0.5), (0.1, 0.7), (0.3, 0.01), (0.2, 0.8)]
            .map(|(rise, fall)| Ease::Ramps { rise, fall });
        for ease in Ease::PLAIN.into_iter().chain(ramps).chain(smooth) {
            assert!(ease.is_valid());
            assert_eq!(ease.evaluate(0.0).0, 0.0);
            assert_eq!(ease.evaluate(1.0), (1.0, 0.0));
            assert!((ease.evaluate(1.0 - 1e-12).0 - 1.0).abs() < 1e-11, "{ease:?}");
            let mut last = 0.0;
            for i in 1..400 {
                let u = f64::from(i) / 400.0 + 1e-4;
                let h = 1e-6;
                let (value, rate) = ease.evaluate(u);
                let difference = (ease.evaluate(u + h).0 - ease.evaluate(u - h).0) / (2.0 * h);
                assert!((difference - rate).abs() < 2e-4, "{ease:?} at {u}: {rate} against {difference}");
                assert!(value >= last, "{ease:?} falls at {u}");
                last = value;
            }
        }
    }
}
