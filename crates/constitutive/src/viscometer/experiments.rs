//! The experiments, marched with the particle update.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

use crate::error::{RheologyError, require};
use crate::liquid_law::HerschelBulkley;
use crate::material_point::MaterialPoint;

/// State of the sample at one time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// Time [s].
    pub time: f64,
    /// Shear strain imposed so far.
    pub strain: f64,
    /// Shear stress `σ_xy` [Pa].
    pub shear_stress: f64,
    /// Norm of the stress deviator over √2 [Pa]: the shear stress of a state without normal stresses.
    pub stress_norm: f64,
    /// First normal stress difference `σ_xx − σ_yy` [Pa].
    pub normal_difference: f64,
}

/// Steady shear reached at a given step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SteadyShear {
    /// Norm of the stress deviator over √2 [Pa].
    pub stress_norm: f64,
    /// Shear stress `σ_xy` [Pa].
    pub shear_stress: f64,
    /// First normal stress difference [Pa].
    pub normal_difference: f64,
    /// Steps marched.
    pub steps: usize,
    /// Whether the stress stopped changing.
    pub steady: bool,
}

/// Creep under constant shear stress.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Creep {
    /// The course of the experiment; the first sample is the instantaneous elastic answer.
    pub samples: Vec<Sample>,
    /// Shear rate over the last step [1/s].
    pub final_rate: f64,
}

/// Oscillation of the strain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Oscillation {
    /// Storage modulus G' of the last cycle [Pa].
    pub storage_modulus: f64,
    /// Loss modulus G'' of the last cycle [Pa].
    pub loss_modulus: f64,
    /// The last cycle.
    pub samples: Vec<Sample>,
}

/// A rheometer holding one material point of a liquid.
#[derive(Clone, Copy, Debug)]
pub struct Viscometer<'a> {
    law: &'a HerschelBulkley,
}

/// Largest number of steps of one experiment.
const MAX_STEPS: usize = 20_000_000;

impl<'a> Viscometer<'a> {
    /// A rheometer for the given law.
    #[must_use]
    pub fn new(law: &'a HerschelBulkley) -> Self {
        Viscometer { law }
    }

    fn shear_step(&self, point: &mut MaterialPoint<3>, strain: f64, dt: f64) -> Result<(), RheologyError> {
        let mut f = Matrix3::identity();
        f[(0, 1)] = strain;
        point.advance(self.law, &f, dt).map(|_| ())
    }

    fn sample(&self, point: &MaterialPoint<3>, time: f64, strain: f64, rate: f64) -> Sample {
        let viscous = self.law.newtonian_viscosity * rate;
        let stress = self.law.shear_stress(&point.elastic_strain);
        Sample {
            time,
            strain,
            shear_stress: stress[(0, 1)] + viscous,
            stress_norm: if self.law.is_shear_elastic() { stress.norm() / 2f64.sqrt() } else { viscous.abs() },
            normal_difference: stress[(0, 0)] - stress[(1, 1)],
        }
    }

    /// Strain over which the stress builds up and forgets: elastic strain at the steady stress plus `n Φ/μ`.
    #[must_use]
    pub fn memory_strain(&self, rate: f64) -> f64 {
        let flow = &self.law.flow;
        let stress = flow.stress_at(rate.abs() / 2f64.sqrt());
        let excess = stress - flow.yield_norm();
        (stress + flow.index() * excess) / self.law.shear_modulus
    }

    /// Steady shear at the rate `rate` [1/s], marched from rest with the step `dt` [s] until the stress stands still.
    ///
    /// # Errors
    /// [`RheologyError::Parameter`] for a rate or step that is not positive; [`RheologyError::Deformation`] for a step too
    /// large to shear by.
    pub fn steady_shear(&self, rate: f64, dt: f64) -> Result<SteadyShear, RheologyError> {
        require("shear rate", rate, rate > 0.0, "finite, above 0 1/s")?;
        require("step", dt, dt > 0.0, "finite, above 0 s")?;
        let mut point = MaterialPoint::default();
        if !self.law.is_shear_elastic() {
            let s = self.sample(&point, 0.0, 0.0, rate);
            let steady = SteadyShear {
                stress_norm: s.stress_norm,
                shear_stress: s.shear_stress,
                normal_difference: 0.0,
                steps: 0,
                steady: true,
            };
            return Ok(steady);
        }
        // look at the stress once per tenth of the memory: three quiet looks in a row end the experiment
        let memory = self.memory_strain(rate);
        let look = ((0.1 * memory / (rate * dt)).ceil() as usize).max(1);
        let (mut last, mut quiet, mut steps, mut strain) = (f64::NAN, 0, 0, 0.0);
        while steps < MAX_STEPS && quiet < 3 {
            for _ in 0..look {
                self.shear_step(&mut point, rate * dt, dt)?;
            }
            steps += look;
            strain += look as f64 * rate * dt;
            let now = self.law.shear_stress_norm(&point.elastic_strain);
            quiet = if (now - last).abs() <= 1e-9 * now && strain > 3.0 * memory { quiet + 1 } else { 0 };
            last = now;
            point.deformation_gradient = Matrix3::identity();
        }
        let s = self.sample(&point, steps as f64 * dt, strain, rate);
        Ok(SteadyShear {
            stress_norm: s.stress_norm,
            shear_stress: s.shear_stress,
            normal_difference: s.normal_difference,
            steps,
            steady: quiet >= 3,
        })
    }

    /// Start-up of shear: from rest at the rate `rate` [1/s] for `time` [s] in `steps` equal steps; one sample a step, the
    /// state of rest first.
    ///
    /// # Errors
    /// As [`Self::steady_shear`].
    pub fn start_up(&self, rate: f64, time: f64, steps: usize) -> Result<Vec<Sample>, RheologyError> {
        require("time", time, time > 0.0, "finite, above 0 s")?;
        require("shear rate", rate, true, "finite")?;
        let (mut point, dt) = (MaterialPoint::default(), time / steps.max(1) as f64);
        let mut out = vec![self.sample(&point, 0.0, 0.0, 0.0)];
        for k in 1..=steps {
            self.shear_step(&mut point, rate * dt, dt)?;
            out.push(self.sample(&point, k as f64 * dt, k as f64 * rate * dt, rate));
        }
        Ok(out)
    }

    /// Stress at the end of [`Self::start_up`], without keeping its course.
    ///
    /// # Errors
    /// As [`Self::steady_shear`].
    pub fn start_up_end(&self, rate: f64, time: f64, steps: usize) -> Result<Sample, RheologyError> {
        let (mut point, dt) = (MaterialPoint::default(), time / steps.max(1) as f64);
        for _ in 0..steps {
            self.shear_step(&mut point, rate * dt, dt)?;
        }
        Ok(self.sample(&point, time, rate * time, rate))
    }

    /// Relaxation after a sudden shear strain: elastic to `strain` at once, then at rest for `time` [s] in `steps` steps.
    ///
    /// # Errors
    /// [`RheologyError::Parameter`] unless time is positive.
    pub fn relaxation(&self, strain: f64, time: f64, steps: usize) -> Result<Vec<Sample>, RheologyError> {
        require("time", time, time > 0.0, "finite, above 0 s")?;
        let mut point = MaterialPoint::default();
        self.shear_step(&mut point, strain, 0.0)?;
        let dt = time / steps.max(1) as f64;
        let mut out = vec![self.sample(&point, 0.0, strain, 0.0)];
        for k in 1..=steps {
            self.shear_step(&mut point, 0.0, dt)?;
            out.push(self.sample(&point, k as f64 * dt, strain, 0.0));
        }
        Ok(out)
    }

    /// Creep under the shear stress `stress` [Pa] for `time` [s] in `steps` steps: each step finds the strain that gives the
    /// stress.
    ///
    /// # Errors
    /// [`RheologyError::Parameter`] for a liquid without shear modulus or a stress or time that is not positive;
    /// [`RheologyError::Deformation`] where no strain of one step reaches the stress.
    pub fn creep(&self, stress: f64, time: f64, steps: usize) -> Result<Creep, RheologyError> {
        require("shear modulus", self.law.shear_modulus, self.law.is_shear_elastic(), "above 0 Pa for creep")?;
        require("shear stress", stress, stress > 0.0, "finite, above 0 Pa")?;
        require("time", time, time > 0.0, "finite, above 0 s")?;
        let dt = time / steps.max(1) as f64;
        let mut point = MaterialPoint::default();
        let mut strain = self.load_to(&mut point, stress, 0.0)?;
        let mut samples = vec![self.sample(&point, 0.0, strain, 0.0)];
        let mut final_rate = 0.0;
        for k in 1..=steps {
            let increment = self.load_to(&mut point, stress, dt)?;
            strain += increment;
            final_rate = increment / dt;
            samples.push(self.sample(&point, k as f64 * dt, strain, final_rate));
        }
        Ok(Creep { samples, final_rate })
    }

    /// Shears the point so that `σ_xy = stress` after `dt`; returns the strain taken.
    fn load_to(&self, point: &mut MaterialPoint<3>, stress: f64, dt: f64) -> Result<f64, RheologyError> {
        let after = |strain: f64| -> Result<(MaterialPoint<3>, f64), RheologyError> {
            let mut trial = *point;
            self.shear_step(&mut trial, strain, dt)?;
            let miss = self.law.shear_stress(&trial.elastic_strain)[(0, 1)] - stress;
            Ok((trial, miss))
        };
        let unit = stress / self.law.shear_modulus;
        let (mut low, mut high) = (0.0, unit);
        let (mut low_miss, mut high_miss) = (after(low)?.1, after(high)?.1);
        if low_miss > 0.0 {
            (high, high_miss) = (low, low_miss);
            low = -unit;
            low_miss = after(low)?.1;
        }
        while high_miss < 0.0 {
            if high > 1e8 {
                return Err(RheologyError::Deformation { determinant: f64::INFINITY });
            }
            (low, low_miss) = (high, high_miss);
            high *= 4.0;
            high_miss = after(high)?.1;
        }
        // regula falsi with the Illinois rule
        let mut best = after(high)?;
        let mut taken = high;
        for _ in 0..200 {
            if best.1.abs() <= 1e-13 * stress || (high - low) <= 1e-16 * (low.abs() + high.abs()) {
                break;
            }
            taken = (low * high_miss - high * low_miss) / (high_miss - low_miss);
            best = after(taken)?;
            if best.1 > 0.0 {
                (high, high_miss) = (taken, best.1);
                low_miss *= 0.5;
            } else {
                (low, low_miss) = (taken, best.1);
                high_miss *= 0.5;
            }
        }
        *point = best.0;
        Ok(taken)
    }

    /// Oscillation `γ = amplitude sin(ωt)` with `frequency` [Hz] for `cycles` cycles of `steps_per_cycle` steps; moduli are
    /// the first harmonics of the last cycle.
    ///
    /// # Errors
    /// [`RheologyError::Parameter`] for a frequency that is not positive.
    pub fn oscillation(
        &self,
        amplitude: f64,
        frequency: f64,
        cycles: usize,
        steps_per_cycle: usize,
    ) -> Result<Oscillation, RheologyError> {
        require("frequency", frequency, frequency > 0.0, "finite, above 0 Hz")?;
        let (cycles, per_cycle) = (cycles.max(1), steps_per_cycle.max(8));
        let dt = 1.0 / (frequency * per_cycle as f64);
        let phase = |k: usize| std::f64::consts::TAU * (k % per_cycle) as f64 / per_cycle as f64;
        let mut point = MaterialPoint::default();
        let mut samples = Vec::with_capacity(per_cycle);
        let (mut storage, mut loss) = (0.0, 0.0);
        for k in 1..=cycles * per_cycle {
            let strain = amplitude * phase(k).sin();
            let increment = strain - amplitude * phase(k - 1).sin();
            self.shear_step(&mut point, increment, dt)?;
            if k > (cycles - 1) * per_cycle {
                let sample = self.sample(&point, k as f64 * dt, strain, increment / dt);
                storage += sample.shear_stress * phase(k).sin();
                loss += sample.shear_stress * phase(k).cos();
                samples.push(sample);
            }
        }
        let scale = 2.0 / (per_cycle as f64 * amplitude);
        Ok(Oscillation { storage_modulus: scale * storage, loss_modulus: scale * loss, samples })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow_curve::FlowCurve;
    use crate::liquid_law::LawSettings;
    use crate::presets::Liquid;

    fn maxwell() -> HerschelBulkley {
        let curve = FlowCurve::Rheometer { yield_stress: 0.0, consistency: 0.5, index: 1.0 };
        HerschelBulkley::new(1e6, 100.0, &curve, LawSettings::default()).unwrap()
    }

    #[test]
    fn start_up_of_a_maxwell_liquid() {
        let law = maxwell();
        let end = Viscometer::new(&law).start_up_end(1.0, 5e-3, 4000).unwrap();
        approx::assert_relative_eq!(end.shear_stress, 0.316_060, max_relative = 1e-3);
    }

    #[test]
    fn relaxation_does_not_depend_on_the_number_of_steps_with_the_exact_map() {
        let settings = LawSettings {
            flow_map: crate::FlowMap::Exact,
            determinant: crate::DeterminantPolicy::Trace,
            ..LawSettings::default()
        };
        let law = Liquid::preset("drilling-mud").unwrap().law(settings).unwrap();
        let ends: Vec<f64> = [1, 10]
            .iter()
            .map(|&n| Viscometer::new(&law).relaxation(0.05, 0.01, n).unwrap().last().unwrap().stress_norm)
            .collect();
        // the trace policy renormalises between steps: equal up to the square of the strain
        approx::assert_relative_eq!(ends[0], ends[1], max_relative = 2e-3);
    }

    #[test]
    fn creep_holds_below_yield_and_flows_above_at_the_rate_of_the_flow_curve() {
        let curve = FlowCurve::Rheometer { yield_stress: 10.0, consistency: 2.0, index: 0.5 };
        let law = HerschelBulkley::new(1e6, 1e5, &curve, LawSettings::default()).unwrap();
        let meter = Viscometer::new(&law);
        let held = meter.creep(9.5, 1.0, 20).unwrap();
        assert!(held.final_rate.abs() < 1e-12);
        approx::assert_relative_eq!(held.samples[20].strain, 9.5e-5, max_relative = 1e-6);
        let flowing = meter.creep(14.0, 0.01, 1000).unwrap();
        approx::assert_relative_eq!(flowing.final_rate, 4.0, max_relative = 1e-3);
        assert!(meter.creep(-1.0, 1.0, 5).is_err());
    }

    #[test]
    fn oscillation_of_a_maxwell_liquid_has_its_moduli() {
        let law = maxwell();
        // relaxation time K/μ = 5 ms; at ω = 200/s both moduli are μ/2
        let out = Viscometer::new(&law).oscillation(1e-3, 200.0 / std::f64::consts::TAU, 4, 4000).unwrap();
        approx::assert_relative_eq!(out.storage_modulus, 50.0, max_relative = 2e-3);
        approx::assert_relative_eq!(out.loss_modulus, 50.0, max_relative = 2e-3);
    }

    #[test]
    fn steady_shear_follows_the_flow_curve_of_a_stiff_liquid() {
        let curve = FlowCurve::Rheometer { yield_stress: 18.4, consistency: 17.8, index: 0.22 };
        let law = HerschelBulkley::new(1e6, 5e4, &curve, LawSettings::default()).unwrap();
        let out = Viscometer::new(&law).steady_shear(10.0, 1e-6).unwrap();
        assert!(out.steady);
        approx::assert_relative_eq!(out.stress_norm, curve.shear_stress(10.0), max_relative = 5e-4);
        let water = Liquid::preset("water").unwrap().law(LawSettings::default()).unwrap();
        let stress = Viscometer::new(&water).steady_shear(100.0, 1e-3).unwrap().shear_stress;
        approx::assert_relative_eq!(stress, 0.089, max_relative = 1e-14);
    }
}
