//! Segments of an experiment: what is prescribed, for how many steps.

use super::settings::{Experiment, MicrogelSettings, Oscillation};
use crate::demodulation::Window;
use crate::model::Mode;
use crate::preparation::schedule::step_sizes;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// One sine of the strain in absolute units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Wave {
    /// Strain amplitude [-].
    pub amplitude: f64,
    /// Frequency [Hz].
    pub frequency: f64,
}

/// What a segment prescribes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Drive {
    /// Strain as a sum of sines, between rests.
    Oscillation {
        /// Frequency, amplitude and periods of the first sine.
        window: Window,
        /// All sines, the first included.
        waves: Vec<Wave>,
    },
    /// Constant rate [1/s].
    Rate(f64),
    /// One step of rest, constant rate [1/s] for some steps, then rest.
    Step {
        /// Rate of the rise [1/s].
        rate: f64,
        /// Steps of the rise.
        rise: u64,
    },
    /// Shear stress [Pa] held by a plate of the given inertia and damping.
    Stress {
        /// Target [Pa].
        stress: f64,
        /// Inertia of the plate per volume [Pa s²].
        inertia: f64,
        /// Damping of the plate [Pa s].
        damping: f64,
    },
    /// Closing of the box [1/s] for the first steps, then rest.
    Closing {
        /// Height lost per initial height and second [1/s].
        rate: f64,
        /// Steps of the closing.
        steps: u64,
    },
}

/// One segment with its step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Segment {
    /// What is prescribed.
    pub drive: Drive,
    /// Number of steps.
    pub steps: u64,
    /// Step [s].
    pub dt: f64,
    /// Factor on peculiar velocities per step [-].
    pub damping: f64,
}

impl Segment {
    /// Shear rate of step `i` at segment time `t` [1/s]; `None` where the rate follows from the stress.
    pub fn rate(&self, i: u64, t: f64, mode: Mode) -> Option<f64> {
        match &self.drive {
            Drive::Oscillation { window: w, waves } => {
                let (f, h, step) = (w.frequency, self.dt, i as f64);
                if step < w.pre / (f * h) || step > (w.pre + w.periods) / (f * h) {
                    return Some(0.0);
                }
                Some(match mode {
                    Mode::Compat => waves
                        .iter()
                        .map(|v| {
                            v.amplitude * TAU * v.frequency * (TAU * (v.frequency * t - w.pre * v.frequency / f)).cos()
                        })
                        .sum(),
                    Mode::Physical => {
                        // The mean rate of the step, so that the strain lies on the sine; it starts and ends at zero.
                        let strain = |t: f64| {
                            let s = (t - w.pre / f).clamp(0.0, w.periods / f);
                            waves.iter().map(|v| v.amplitude * (TAU * v.frequency * s).sin()).sum::<f64>()
                        };
                        (strain(t + h) - strain(t)) / h
                    }
                })
            }
            Drive::Rate(rate) => Some(*rate),
            // the first step is one of rest: its stress is the sample's own
            Drive::Step { rate, rise } => Some(if (1..=*rise).contains(&i) { *rate } else { 0.0 }),
            Drive::Stress { .. } => None,
            Drive::Closing { .. } => Some(0.0),
        }
    }
}

/// Steps in a period of the fastest sine, at least, unless the published step or a factor of the user's says otherwise.
const STEPS_PER_PERIOD: f64 = 200.0;

fn oscillation(settings: &MicrogelSettings, o: &Oscillation) -> Segment {
    let tau = settings.model.constants().time;
    let f = o.relative_frequency / tau;
    let published = step_sizes(&settings.model, o.amplitude).dt;
    let mut dt = published * settings.step_factor();
    if settings.step_factor == 0.0 {
        // the factor that a mode takes by itself leaves fast sines enough steps
        let fastest = o.overtones.iter().fold(f, |most, tone| most.max(tone.relative_frequency / tau));
        dt = dt.min(1.0 / (STEPS_PER_PERIOD * fastest)).max(published);
    }
    let mut waves = vec![Wave { amplitude: o.amplitude, frequency: f }];
    waves.extend(o.overtones.iter().map(|t| Wave { amplitude: t.amplitude, frequency: t.relative_frequency / tau }));
    Segment {
        drive: Drive::Oscillation {
            window: Window {
                frequency: f,
                amplitude: o.amplitude,
                pre: o.pre_periods,
                periods: o.periods,
                post: o.post_periods,
            },
            waves,
        },
        steps: ((o.pre_periods + o.periods + o.post_periods) / f / dt) as u64,
        dt,
        damping: o.cool_factor.powf(f * dt),
    }
}

/// Writes the segments of an experiment.
pub(super) fn segments(settings: &MicrogelSettings) -> Vec<Segment> {
    let tau = settings.model.constants().time;
    let reference = Oscillation::default();
    let dt = step_sizes(&settings.model, settings.experiment.smallest_amplitude()).dt * settings.step_factor();
    let damping = reference.cool_factor.powf(reference.relative_frequency / tau * dt);
    let count = |time: f64| (time * tau / dt).ceil() as u64;
    let segment = |drive: Drive, steps: u64| Segment { drive, steps, dt, damping };
    match &settings.experiment {
        Experiment::Oscillation(o) => vec![oscillation(settings, o)],
        Experiment::AmplitudeSweep { amplitudes, base } => amplitudes
            .iter()
            .map(|&amplitude| oscillation(settings, &Oscillation { amplitude, ..base.clone() }))
            .collect(),
        Experiment::FrequencySweep { relative_frequencies, base } => relative_frequencies
            .iter()
            .map(|&relative_frequency| oscillation(settings, &Oscillation { relative_frequency, ..base.clone() }))
            .collect(),
        Experiment::SteadyShear { relative_rate, strain } | Experiment::StartUp { relative_rate, strain } => {
            vec![segment(Drive::Rate(relative_rate / tau), count(strain / relative_rate.abs()))]
        }
        Experiment::StepStrain { strain, rise, hold } => {
            let steps = count(*rise).max(1);
            vec![segment(Drive::Step { rate: strain / (steps as f64 * dt), rise: steps }, 1 + steps + count(*hold))]
        }
        Experiment::Creep { stress, duration, recovery } => {
            // A plate whose own oscillation against the modulus of the grains takes some forty characteristic times,
            // critically damped: slow against the grains, fast against creep.
            let modulus = settings.model.young_modulus;
            let inertia = modulus * (6.0 * tau) * (6.0 * tau);
            let damping = 2.0 * (modulus * inertia).sqrt() * 0.25;
            let held = |stress| Drive::Stress { stress, inertia, damping };
            vec![segment(held(*stress), count(*duration)), segment(held(0.0), count(*recovery))]
        }
        Experiment::Compression { strain, relative_rate, hold } => {
            let steps = count(strain / relative_rate);
            vec![segment(Drive::Closing { rate: strain / (steps as f64 * dt), steps }, steps + count(*hold))]
        }
    }
}
