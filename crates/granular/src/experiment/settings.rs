//! The `microgel` section of a scene.

use crate::assembly::Plates;
use crate::cell::Boundary;
use crate::demodulation::Drift;
use crate::error::{GranularError, require};
use crate::model::{Dimension, Mode, ModelSettings};
use crate::physical::Rules;
use crate::preparation::PreparationSettings;
use serde::{Deserialize, Serialize};

/// One sine of the strain.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tone {
    /// Strain amplitude [-].
    pub amplitude: f64,
    /// Frequency times the characteristic time [-].
    pub relative_frequency: f64,
}

/// Oscillatory shear.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Oscillation {
    /// Strain amplitude [-], above 0 … 100.
    pub amplitude: f64,
    /// Frequency times the characteristic time [-]; 0.025 gives 2240 steps per period at the default step.
    pub relative_frequency: f64,
    /// Further sines at the same time, such as a whole frequency sweep at once in the linear regime. Frequencies that are whole
    /// multiples of the first keep the tones apart.
    pub overtones: Vec<Tone>,
    /// Periods of rest before [-].
    pub pre_periods: f64,
    /// Periods of oscillation [-]; with two or more the first is left out of the evaluation.
    pub periods: f64,
    /// Periods of rest afterwards [-].
    pub post_periods: f64,
    /// Factor on peculiar velocities per period [-], above 0 … 1.
    pub cool_factor: f64,
}

impl Default for Oscillation {
    fn default() -> Self {
        Self {
            amplitude: 0.2,
            relative_frequency: 0.025,
            overtones: Vec::new(),
            pre_periods: 2.0,
            periods: 3.0,
            post_periods: 1.0,
            cool_factor: 0.5,
        }
    }
}

impl Oscillation {
    fn check(&self) -> Result<(), GranularError> {
        require("amplitude", self.amplitude, |v| v > 0.0 && v <= 100.0, "above 0 … 100")?;
        require("relative_frequency", self.relative_frequency, |v| v > 0.0 && v <= 0.25, "above 0 … 0.25")?;
        require("pre_periods", self.pre_periods, |v| (0.0..=1e4).contains(&v), "0 … 10000")?;
        require("periods", self.periods, |v| (0.5..=1e5).contains(&v), "0.5 … 100000")?;
        require("post_periods", self.post_periods, |v| (0.0..=1e4).contains(&v), "0 … 10000")?;
        require("cool_factor", self.cool_factor, |v| v > 0.0 && v <= 1.0, "above 0 … 1")?;
        for t in &self.overtones {
            require("overtone amplitude", t.amplitude, |v| v > 0.0 && v <= 100.0, "above 0 … 100")?;
            require("overtone frequency", t.relative_frequency, |v| v > 0.0 && v <= 0.25, "above 0 … 0.25")?;
        }
        Ok(())
    }
}

/// What is done to the sample. Times are in characteristic times `sqrt(m/k)`, rates in their inverse.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Experiment {
    /// Oscillatory shear at one amplitude.
    Oscillation(Oscillation),
    /// Oscillations of ascending or any other amplitudes, one after the other on the same sample.
    AmplitudeSweep {
        /// Amplitudes [-].
        amplitudes: Vec<f64>,
        /// Everything else.
        base: Oscillation,
    },
    /// Oscillations of several frequencies one after the other on the same sample.
    FrequencySweep {
        /// Frequencies times the characteristic time [-].
        relative_frequencies: Vec<f64>,
        /// Everything else.
        base: Oscillation,
    },
    /// Constant rate from rest up to a total strain; the summary averages the last half.
    SteadyShear {
        /// Rate times the characteristic time [-].
        relative_rate: f64,
        /// Total strain [-].
        strain: f64,
    },
    /// As steady shear; the summary reports the overshoot: peak stress and the strain where it occurs.
    StartUp {
        /// Rate times the characteristic time [-].
        relative_rate: f64,
        /// Total strain [-].
        strain: f64,
    },
    /// Sudden strain, then rest: relaxation of the stress.
    StepStrain {
        /// Strain [-].
        strain: f64,
        /// Duration of the rise [characteristic times].
        rise: f64,
        /// Rest afterwards [characteristic times].
        hold: f64,
    },
    /// Constant shear stress, then none: creep and recovery.
    Creep {
        /// Shear stress [Pa].
        stress: f64,
        /// Duration under stress [characteristic times].
        duration: f64,
        /// Duration without stress [characteristic times].
        recovery: f64,
    },
    /// The box closes along the gradient at a constant rate, then rests. Physical mode only.
    Compression {
        /// Height lost over the initial height [-], 0 … 0.9.
        strain: f64,
        /// Rate times the characteristic time [-].
        relative_rate: f64,
        /// Rest afterwards [characteristic times].
        hold: f64,
    },
}

impl Default for Experiment {
    fn default() -> Self {
        Self::Oscillation(Oscillation::default())
    }
}

impl Experiment {
    /// The strain amplitude that decides step sizes and preparation: the smallest of a sweep.
    pub fn smallest_amplitude(&self) -> f64 {
        match self {
            Self::Oscillation(o) => o.amplitude,
            Self::AmplitudeSweep { amplitudes, .. } => amplitudes.iter().fold(f64::MAX, |m, &a| m.min(a)),
            Self::FrequencySweep { base, .. } => base.amplitude,
            Self::SteadyShear { strain, .. } | Self::StartUp { strain, .. } | Self::StepStrain { strain, .. } => {
                strain.abs().min(0.2)
            }
            Self::Creep { .. } | Self::Compression { .. } => 0.2,
        }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// [`GranularError::Setting`] naming the first field out of range.
    pub fn check(&self) -> Result<(), GranularError> {
        match self {
            Self::Oscillation(o) => o.check(),
            Self::AmplitudeSweep { amplitudes, base } => {
                require("amplitudes", amplitudes.len() as f64, |n| n > 0.0, "at least one")?;
                amplitudes.iter().try_for_each(|&amplitude| Oscillation { amplitude, ..base.clone() }.check())
            }
            Self::FrequencySweep { relative_frequencies, base } => {
                require("relative_frequencies", relative_frequencies.len() as f64, |n| n > 0.0, "at least one")?;
                relative_frequencies
                    .iter()
                    .try_for_each(|&relative_frequency| Oscillation { relative_frequency, ..base.clone() }.check())
            }
            Self::SteadyShear { relative_rate, strain } | Self::StartUp { relative_rate, strain } => {
                require("relative_rate", *relative_rate, |v| v != 0.0 && v.abs() <= 1.0, "-1 … 1 without 0")?;
                require("strain", *strain, |v| v > 0.0 && v <= 1e4, "above 0 … 10000")
            }
            Self::StepStrain { strain, rise, hold } => {
                require("strain", *strain, |v| v != 0.0 && v.abs() <= 100.0, "-100 … 100 without 0")?;
                require("rise", *rise, |v| v > 0.0, "positive")?;
                require("hold", *hold, |v| v >= 0.0, "not negative")
            }
            Self::Creep { stress, duration, recovery } => {
                require("stress", *stress, |v| v != 0.0, "not 0")?;
                require("duration", *duration, |v| v > 0.0, "positive")?;
                require("recovery", *recovery, |v| v >= 0.0, "not negative")
            }
            Self::Compression { strain, relative_rate, hold } => {
                require("strain", *strain, |v| v > 0.0 && v <= 0.9, "above 0 … 0.9")?;
                require("relative_rate", *relative_rate, |v| v > 0.0 && v <= 1.0, "above 0 … 1")?;
                require("hold", *hold, |v| v >= 0.0, "not negative")
            }
        }
    }
}

/// The whole `microgel` section of a scene.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MicrogelSettings {
    /// Physical rules (default) or those of the published program.
    pub mode: Mode,
    /// Seed of everything random in the preparation.
    pub seed: u64,
    /// Number of samples with successive seeds; 0 and 1 give a single one. Error bars shrink with its root, cost grows with it.
    pub seeds: u32,
    /// Grains, material, box.
    pub model: ModelSettings,
    /// Packing, links, particles.
    pub preparation: PreparationSettings,
    /// How the box ends.
    pub boundary: Boundary,
    /// How the edges are carried; by default none in physical mode, a capturing band in compat mode.
    pub plates: Option<Plates>,
    /// Rules of the physical mode.
    pub rules: Rules,
    /// What is done to the sample.
    pub experiment: Experiment,
    /// Drift correction of the moduli; by default subtracted in physical mode, doubled in compat mode.
    pub drift: Option<Drift>,
    /// Factor on the published time step of the measurement [-], 0 … 1000. 0 takes the mode's own: 1 in compat mode, 4 in
    /// physical mode, where G′ then differs by less than 0.1 % from half the published step (validation case
    /// `granular/step-error`), but not fewer than 200 steps in a period. The guard of the rules cuts steps that come out too large.
    pub step_factor: f64,
    /// Records the elastic energy with each row, at about the cost of a tenth of a step.
    pub record_energy: bool,
}

impl MicrogelSettings {
    /// Plates in use.
    pub fn plates(&self) -> Plates {
        self.plates.unwrap_or(match self.mode {
            Mode::Physical => Plates::None,
            Mode::Compat => Plates::Band,
        })
    }

    /// Drift correction in use.
    pub fn drift(&self) -> Drift {
        self.drift.unwrap_or(match self.mode {
            Mode::Physical => Drift::Subtract,
            Mode::Compat => Drift::Double,
        })
    }

    /// Step factor in use.
    pub fn step_factor(&self) -> f64 {
        match self.mode {
            _ if self.step_factor > 0.0 => self.step_factor,
            Mode::Compat => 1.0,
            Mode::Physical => 4.0,
        }
    }

    /// Seeds of the ensemble.
    pub fn seed_list(&self) -> Vec<u64> {
        (0..u64::from(self.seeds.max(1))).map(|k| self.seed.wrapping_add(k)).collect()
    }

    /// Checks every field and their combinations.
    ///
    /// # Errors
    /// [`GranularError::Setting`] or [`GranularError::State`] naming what is wrong.
    pub fn check(&self) -> Result<(), GranularError> {
        self.model.check()?;
        self.preparation.check()?;
        self.experiment.check()?;
        require("step_factor", self.step_factor, |v| (0.0..=1000.0).contains(&v), "0 … 1000")?;
        if self.model.dimension == Dimension::Three {
            if self.mode == Mode::Compat || self.plates() != Plates::None || !self.boundary.periodic_y() {
                return Err(GranularError::State(
                    "spheres need the physical mode, no plates and a periodic or Lees–Edwards box".into(),
                ));
            }
            if matches!(self.experiment, Experiment::Compression { .. }) {
                return Err(GranularError::State("compression is for discs only".into()));
            }
        }
        if self.mode == Mode::Compat && self.boundary != Boundary::LeesEdwards {
            return Err(GranularError::State("the compat mode knows the Lees–Edwards box only".into()));
        }
        if matches!(self.boundary, Boundary::Periodic | Boundary::Open)
            && !matches!(self.experiment, Experiment::Compression { .. })
        {
            return Err(GranularError::State("only Lees–Edwards and walled boxes can be sheared".into()));
        }
        if self.mode == Mode::Compat && matches!(self.experiment, Experiment::Compression { .. }) {
            return Err(GranularError::State("compression needs the physical mode".into()));
        }
        Ok(())
    }
}
