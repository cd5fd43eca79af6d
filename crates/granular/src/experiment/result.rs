//! What a finished run says: moduli, steady values, and whether to believe them.

use super::drive::Drive;
use super::figure::{Figure, figures};
use super::rheometer::{Rheometer, SampleFacts, Signal};
use super::settings::Experiment;
use crate::demodulation::{Demodulation, Drift, Window, demodulate};
use crate::error::GranularError;
use crate::model::{Dimension, Mode};
use serde::{Deserialize, Serialize};

/// Which shear stress is evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Measure {
    /// Overall tensor of the published method: without contacts across edges and with plates, over the full area.
    Overall,
    /// Surface force.
    Surface,
    /// All contacts along their image vectors.
    Bulk,
}

/// Verdict of a quality gate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum GateLevel {
    /// Within the aim.
    Good,
    /// Beyond the aim, within what is tolerable.
    Doubtful,
    /// Not to be believed.
    Missed,
}

/// One quality gate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Gate {
    /// Name.
    pub name: String,
    /// Measured value [-].
    pub value: f64,
    /// Aim [-].
    pub aim: f64,
    /// Verdict.
    pub level: GateLevel,
}

impl Gate {
    fn new(name: &str, value: f64, aim: f64, most: f64) -> Self {
        let level = if value <= aim {
            GateLevel::Good
        } else if value <= most {
            GateLevel::Doubtful
        } else {
            GateLevel::Missed
        };
        Self { name: name.into(), value, aim, level }
    }
}

/// Moduli of one sine by the three stress measures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Moduli {
    /// Strain amplitude [-].
    pub amplitude: f64,
    /// Frequency [Hz].
    pub frequency: f64,
    /// By the overall tensor.
    pub overall: Demodulation,
    /// By surface force.
    pub surface: Demodulation,
    /// By the bulk tensor.
    pub bulk: Demodulation,
}

/// Result of one segment.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SegmentResult {
    /// Moduli, one entry per sine; empty unless the segment oscillates.
    pub moduli: Vec<Moduli>,
    /// Mean shear stress of the last half of the segment [Pa]; headline measure.
    pub stress: f64,
    /// Standard deviation of it over the last half [Pa].
    pub stress_spread: f64,
    /// Shear stress of the first step [Pa]; headline measure.
    pub stress_before: f64,
    /// Mean shear rate of the last half [1/s].
    pub rate: f64,
    /// Largest magnitude of the shear stress [Pa] and the strain where it occurs [-].
    pub peak: [f64; 2],
    /// Strain at the end [-].
    pub strain: f64,
    /// Stress along the gradient at the end [Pa].
    pub normal_stress: f64,
    /// Stress along the gradient at the beginning [Pa].
    pub normal_stress_before: f64,
    /// Pressure at the end [Pa].
    pub pressure: f64,
    /// Quality gates.
    pub gates: Vec<Gate>,
}

/// Result of a finished run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Mode.
    pub mode: Mode,
    /// Seed.
    pub seed: u64,
    /// Facts of the sample.
    pub sample: SampleFacts,
    /// Contacts per grain at the end [-].
    pub coordination: f64,
    /// Share of slipping contacts over the experiment [-].
    pub slip_fraction: f64,
    /// Pressure of the overall tensor before the shear starts [Pa].
    pub pressure_before: f64,
    /// G′ by the headline measure of the mode (bulk in physical, overall in compat), first sine of the first segment [Pa];
    /// zero unless it oscillates.
    pub g_prime: f64,
    /// G″ by the headline measure [Pa].
    pub g_double_prime: f64,
    /// What the experiment is made for, unless it oscillates.
    pub figures: Vec<Figure>,
    /// Segments.
    pub segments: Vec<SegmentResult>,
    /// Steps taken, preparation included.
    pub steps: u64,
    /// Parts taken beyond them by the step guard.
    pub extra_steps: u64,
    /// Largest violation of the stress identities [-].
    pub identity_defect: f64,
}

impl Summary {
    /// True if no gate is missed.
    pub fn credible(&self) -> bool {
        self.segments.iter().flat_map(|s| &s.gates).all(|g| g.level != GateLevel::Missed)
    }
}

impl Signal {
    /// Shear stress by one measure [Pa].
    pub fn stress(&self, measure: Measure) -> &[f64] {
        match measure {
            Measure::Overall => &self.overall,
            Measure::Surface => &self.surface,
            Measure::Bulk => &self.bulk,
        }
    }

    /// Lissajous curve: `[strain, stress]` of each recorded step, strain counted from the start of the segment.
    pub fn lissajous(&self, measure: Measure) -> Vec<[f64; 2]> {
        let zero = self.strain.first().copied().unwrap_or(0.0);
        self.strain.iter().zip(self.stress(measure)).map(|(g, s)| [g - zero, *s]).collect()
    }
}

impl Rheometer {
    /// Headline measure of the mode.
    pub fn headline(&self) -> Measure {
        match self.settings.mode {
            Mode::Physical => Measure::Bulk,
            Mode::Compat => Measure::Overall,
        }
    }

    /// Demodulates one sine of an oscillating segment.
    ///
    /// # Errors
    /// [`GranularError::Signal`] if the segment does not oscillate or is unfinished beyond use.
    pub fn moduli(
        &self,
        segment: usize,
        wave: usize,
        measure: Measure,
        drift: Drift,
    ) -> Result<Demodulation, GranularError> {
        let (Some(signal), Some(s)) = (self.signals.get(segment), self.segments.get(segment)) else {
            return Err(GranularError::Signal("no such segment"));
        };
        let Drive::Oscillation { window, waves } = &s.drive else {
            return Err(GranularError::Signal("the segment does not oscillate"));
        };
        let v = waves.get(wave).ok_or(GranularError::Signal("no such sine"))?;
        let ratio = v.frequency / window.frequency;
        let w = Window {
            frequency: v.frequency,
            amplitude: v.amplitude,
            pre: window.pre * ratio,
            periods: window.periods * ratio,
            post: window.post * ratio,
        };
        demodulate(&signal.time, signal.stress(measure), &w, drift)
    }

    /// Evaluates what has been recorded.
    ///
    /// # Errors
    /// [`GranularError::Signal`] if an oscillating segment is too short.
    pub fn summary(&self) -> Result<Summary, GranularError> {
        let headline = self.headline();
        let mut results = Vec::new();
        for (k, (segment, signal)) in self.segments.iter().zip(&self.signals).enumerate() {
            if signal.time.is_empty() {
                continue;
            }
            results.push(self.evaluate(k, segment, signal, headline)?);
        }
        let finished = self.signals.len() == self.segments.len()
            && self
                .segments
                .iter()
                .zip(&self.signals)
                .all(|(segment, signal)| signal.time.len() as u64 == segment.steps);
        let first = results.first().and_then(|r| r.moduli.first());
        let value = |f: fn(&Demodulation) -> f64| first.map_or(0.0, |m| f(pick(m, headline)));
        let before = self.signals.first().map_or(0.0, |s| {
            let rest = s.rate.iter().take_while(|r| **r == 0.0).count().clamp(1, s.pressure.len().max(1));
            s.pressure.iter().take(rest).sum::<f64>() / rest as f64
        });
        let extra_steps = match &self.assembly {
            crate::assembly::Assembly::Undirected(s) => s.counters().1,
            crate::assembly::Assembly::Spheres(s) => s.extra_steps,
            crate::assembly::Assembly::Directed(_) => 0,
        };
        Ok(Summary {
            mode: self.settings.mode,
            seed: self.settings.seed,
            sample: self.facts,
            coordination: self.coordination(),
            slip_fraction: self.slip_sum / self.contact_sum.max(1.0),
            pressure_before: before,
            g_prime: value(|d| d.g_prime),
            g_double_prime: value(|d| d.g_double_prime),
            figures: if finished { figures(&self.settings.experiment, &results) } else { Vec::new() },
            segments: results,
            steps: self.steps,
            extra_steps,
            identity_defect: self.worst_identity,
        })
    }

    fn evaluate(
        &self,
        k: usize,
        segment: &super::drive::Segment,
        signal: &Signal,
        headline: Measure,
    ) -> Result<SegmentResult, GranularError> {
        let stress = signal.stress(headline);
        let n = stress.len();
        let half = &stress[n / 2..];
        let mean = half.iter().sum::<f64>() / half.len() as f64;
        let spread = (half.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / half.len() as f64).sqrt();
        let rates = &signal.rate[n / 2..];
        let peak = (0..n).fold([0.0f64, 0.0], |m, i| {
            if stress[i].abs() > m[0].abs() { [stress[i], signal.strain[i] - signal.strain[0]] } else { m }
        });
        let mut result = SegmentResult {
            stress: mean,
            stress_spread: spread,
            stress_before: stress[0],
            rate: rates.iter().sum::<f64>() / rates.len() as f64,
            peak,
            strain: signal.strain[n - 1],
            normal_stress: signal.normal[n - 1],
            normal_stress_before: signal.normal[0],
            pressure: signal.pressure[n - 1],
            ..SegmentResult::default()
        };
        let complete = n as u64 == segment.steps;
        if let (Drive::Oscillation { waves, .. }, true) = (&segment.drive, complete) {
            for (w, wave) in waves.iter().enumerate() {
                let of = |m| self.moduli(k, w, m, self.settings.drift());
                result.moduli.push(Moduli {
                    amplitude: wave.amplitude,
                    frequency: wave.frequency,
                    overall: of(Measure::Overall)?,
                    surface: of(Measure::Surface)?,
                    bulk: of(Measure::Bulk)?,
                });
            }
        }
        if let Some(m) = result.moduli.first() {
            let d = pick(m, headline);
            let expected = d.magnitude() * m.amplitude.abs();
            let (overall, surface) = (m.overall.magnitude(), m.surface.magnitude());
            let duration = signal.time[n - 1] - signal.time[0];
            result.gates.push(Gate::new("baseline", 0.5 * d.baseline_range / expected, 0.1, 0.3));
            result.gates.push(Gate::new("two measures", (surface / overall - 1.0).abs(), 0.1, 0.3));
            result.gates.push(Gate::new("drift", d.drift.abs() * duration / expected, 0.1, 0.5));
        }
        if let Drive::Oscillation { waves, .. } = &segment.drive {
            let fastest = waves.iter().fold(0.0f64, |m, w| m.max(w.frequency));
            result.gates.push(Gate::new("steps per period", 100.0 * fastest * segment.dt, 1.0, 3.0));
        }
        if let crate::assembly::Assembly::Directed(s) = &self.assembly {
            // Beyond half of the box the nearest image of the partner is another grain's place.
            result.gates.push(Gate::new("link length", s.longest_link(), 0.8, 0.99));
        }
        let fastest = signal.rate.iter().fold(0.0f64, |m, r| m.max(r.abs()));
        // Mass in kg/m over pressure in Pa gives s²; of spheres the mass per diameter.
        let c = self.settings.model.constants();
        let per_depth = match self.settings.model.dimension {
            Dimension::Two => c.mass * 1e-6,
            Dimension::Three => c.mass * 1e-6 / (2.0 * c.mean_radius * 1e-6),
        };
        let inertia = fastest * (per_depth / result.pressure.abs().max(1e-9)).sqrt();
        result.gates.push(Gate::new("inertia number", inertia, 0.1, 1.0));
        result.gates.push(Gate::new("stress identities", self.worst_identity, 1e-9, 1e-6));
        if matches!(self.settings.experiment, Experiment::Creep { .. }) {
            let Drive::Stress { stress: target, .. } = segment.drive else { return Ok(result) };
            let scale = target.abs().max(1e-3 * self.settings.model.young_modulus);
            result.gates.push(Gate::new("stress held", (mean - target).abs() / scale, 0.05, 0.2));
        }
        Ok(result)
    }
}

fn pick(m: &Moduli, measure: Measure) -> &Demodulation {
    match measure {
        Measure::Overall => &m.overall,
        Measure::Surface => &m.surface,
        Measure::Bulk => &m.bulk,
    }
}
