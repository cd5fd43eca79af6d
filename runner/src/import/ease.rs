//! The speed of the original's scripts at a time: three ways to distribute a motion.

use super::original::scripts::{Progress, Script};

/// Speed of a script at time `t` \[s\] (per second, in the unit of `total`); `travelled` is what its steps add up to so far.
///
/// - `total`: displacement, angle or logarithm of a factor over the whole script
/// - `dt`: step \[s\]
#[must_use]
pub fn speed(script: &Script, total: f64, t: f64, dt: f64, travelled: f64) -> f64 {
    let [start, end] = script.during;
    if t < start || t > end {
        return 0.0;
    }
    let [rise, fall] = script.ramps;
    match &script.progress {
        Progress::Cubic => cubic(t, script.during, rise, fall, total),
        Progress::Cosine(amplitude, frequency) => {
            let turn = std::f64::consts::TAU * frequency;
            let place = |time: f64| (amplitude * (turn * time).cos(), -amplitude * turn * (turn * time).sin());
            let (since, left) = (t - start, end - t);
            if since < rise {
                hermite_speed((0.0, 0.0), place(rise), since, rise)
            } else if left < fall {
                hermite_speed(place(end - start - fall), (0.0, 0.0), fall - left, fall)
            } else {
                place(since).1
            }
        }
        Progress::Path(places, distance) => (interpolate(places, (t - start) / distance) - travelled) / dt,
    }
}

/// Speed that rises as `3w² − 2w³`, stays, and falls likewise.
fn cubic(t: f64, [start, end]: [f64; 2], rise: f64, fall: f64, total: f64) -> f64 {
    let full = 2.0 * total / (2.0 * (end - start) - rise - fall);
    let (since, left) = (t - start, end - t);
    let ramp = |w: f64| w * w * (3.0 - 2.0 * w);
    if since < rise {
        full * ramp(since / rise)
    } else if left < fall {
        full * ramp(left / fall)
    } else {
        full
    }
}

/// Speed on the cubic between two places with given speeds, `time` after the first; `span` is the time between them.
fn hermite_speed((p0, v0): (f64, f64), (p1, v1): (f64, f64), time: f64, span: f64) -> f64 {
    let w = time / span;
    6.0 * w * (1.0 - w) * (p1 - p0) / span + v0 * (1.0 - w) * (1.0 - 3.0 * w) + v1 * w * (3.0 * w - 2.0)
}

/// The polynomial through six neighbouring places; the first and last place go on for ever.
fn interpolate(places: &[f64], at: f64) -> f64 {
    let base = at.floor().clamp(0.0, 1e9);
    let w = at - base;
    #[allow(clippy::cast_possible_truncation)]
    let place = |offset: i64| {
        let last = places.len() as i64 - 1;
        places[usize::try_from((base as i64 + offset).clamp(0, last)).unwrap_or(0)]
    };
    let mut sum = 0.0;
    for i in -2..=3_i64 {
        let mut weight = 1.0;
        for j in -2..=3_i64 {
            if i != j {
                #[allow(clippy::cast_precision_loss)]
                let (i, j) = (i as f64, j as f64);
                weight *= (w - j) / (i - j);
            }
        }
        sum += weight * place(i);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::document::Sited;
    use crate::import::original::scripts::Kind;
    use crate::scene::tree::Span;

    fn script(progress: Progress, ramps: [f64; 2]) -> Script {
        Script {
            span: Span::NONE,
            kind: Kind::Translate,
            progress,
            vector: [1.0, 0.0, 0.0],
            angle: 0.0,
            origin: None,
            during: [0.5, 2.0],
            ramps,
            group: Sited::made(0),
            mask: 0,
            global: false,
        }
    }

    /// Midpoint sum of the speed.
    fn travel(script: &Script, total: f64) -> f64 {
        let n = 200_000;
        let h = 1.5 / f64::from(n);
        (0..n).map(|i| speed(script, total, 0.5 + (f64::from(i) + 0.5) * h, h, 0.0) * h).sum()
    }

    #[test]
    fn a_cubic_script_goes_all_the_way() {
        for ramps in [[0.5, 0.5], [0.1, 0.9], [0.75, 0.75], [0.0, 0.3]] {
            let travelled = travel(&script(Progress::Cubic, ramps), -8.0);
            assert!((travelled + 8.0).abs() < 1e-4, "{ramps:?}: {travelled}");
        }
        assert_eq!(speed(&script(Progress::Cubic, [0.5; 2]), 1.0, 0.4, 0.1, 0.0), 0.0);
        assert_eq!(speed(&script(Progress::Cubic, [0.5; 2]), 1.0, 1.2, 0.1, 0.0), 1.0);
        // two fifths into a ramp of a script that travels 8 in 0.3 s: 0.352 of the full speed of 40
        let mut early = script(Progress::Cubic, [0.1; 2]);
        early.during = [0.0, 0.3];
        assert!((speed(&early, 8.0, 0.04, 0.02, 0.0) - 14.08).abs() < 1e-12);
    }

    #[test]
    fn a_cosine_script_comes_back_and_has_no_jumps() {
        let swing = script(Progress::Cosine(2.0, 3.0), [0.2, 0.3]);
        assert!(travel(&swing, 0.0).abs() < 1e-6);
        for corner in [0.7, 1.7, 0.5, 2.0] {
            let (before, after) =
                (speed(&swing, 0.0, corner - 1e-9, 0.1, 0.0), speed(&swing, 0.0, corner + 1e-9, 0.1, 0.0));
            assert!((before - after).abs() < 1e-4, "{corner}: {before} {after}");
        }
    }

    #[test]
    fn a_path_passes_its_places() {
        let places: Vec<f64> = (0..12).map(|i| (f64::from(i) * 0.3).sin()).collect();
        for (i, place) in places.iter().enumerate() {
            assert!((interpolate(&places, i as f64) - place).abs() < 1e-12);
        }
        assert!((interpolate(&places, 5.4) - (5.4_f64 * 0.3).sin()).abs() < 1e-5);
        let path = script(Progress::Path(places.clone(), 0.1), [0.0; 2]);
        assert!((speed(&path, 0.0, 0.9, 0.01, 0.25) - (places[4] - 0.25) / 0.01).abs() < 1e-9);
    }
}
