//! Step sizes and the published order of preparation, written out as a program of operations.

use super::PreparationSettings;
use crate::assembly::Plates;
use crate::model::ModelSettings;
use serde::{Deserialize, Serialize};

/// One entry of the program; only `Run` and `Drive` take time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Operation {
    /// Sets the Coulomb coefficient.
    Friction(f64),
    /// Relaxes for a number of steps.
    Run {
        /// Number of steps.
        steps: u64,
        /// Step [s].
        dt: f64,
        /// Factor on velocities per step [-].
        damping: f64,
        /// Clears the forces of carried grains after each step.
        zero_forces: bool,
    },
    /// Subtracts the mean velocity.
    RemoveDrift,
    /// Links all contacts, cuts them into particles (again while too tall), removes and joins links.
    LinkAndCut,
    /// Engages the plates.
    Plates(Plates),
    /// Runs one segment of the experiment.
    Drive(usize),
}

/// Step sizes for a strain amplitude (spec of the published program).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StepSizes {
    /// Step of the measurement [s].
    pub dt: f64,
    /// Largest step of a damped relaxation [s].
    pub dt_max: f64,
}

/// Chooses the step of the measurement and the largest step of a relaxation.
///
/// One tenth of the characteristic time of a small grain, halved for each condition that makes motion finer: friction that slips,
/// small or large amplitudes.
pub fn step_sizes(model: &ModelSettings, amplitude: f64) -> StepSizes {
    let unit = model.constants().time / model.size_ratio;
    let (mu, c_nu, c_t, a) = (model.friction, model.relative_viscosity, model.tangential_ratio, amplitude);
    let finer = [mu <= 1.0 || c_t < 1.0, a <= 0.05, mu <= 0.1 || c_t < 0.1, a <= 0.005, a >= 0.5];
    let mut dt = 0.1 * unit;
    for _ in finer.iter().filter(|f| **f) {
        dt /= 2.0;
    }
    let mut dt_max = 0.25 * unit;
    if (c_nu <= 0.1 && mu < 0.1) || !(0.1..=5.0).contains(&c_t) {
        dt_max = 0.125 * unit;
    }
    if (c_nu < 0.01 && mu < 0.01) || c_t < 0.01 {
        dt_max = 0.04 * unit;
    }
    dt = dt.min(dt_max);
    if c_nu > 1.0 {
        dt_max /= c_nu;
    }
    StepSizes { dt, dt_max }
}

struct Writer<'a> {
    program: Vec<Operation>,
    model: &'a ModelSettings,
    dt: f64,
    scale: f64,
}

impl Writer<'_> {
    fn steps(&self, n: u64) -> u64 {
        (n as f64 * self.scale) as u64
    }

    fn run(&mut self, steps: u64, dt: f64, damping: f64, zero_forces: bool) {
        if steps > 0 {
            self.program.push(Operation::Run { steps, dt, damping, zero_forces });
        }
    }

    /// Free relaxation: without friction at large, strongly damped steps, then smaller ones; at last with friction.
    fn relax(&mut self, n: u64, dt_max: f64, friction: f64) {
        let n = self.steps(n);
        self.program.push(Operation::Friction(0.0));
        let (mut dt, mut damping) = (dt_max, 0.5);
        while dt > self.dt {
            self.run(n, dt, damping, false);
            dt /= 2.0;
            damping = (1.0 + damping) / 2.0;
            self.program.push(Operation::RemoveDrift);
        }
        self.run(n, self.dt, 1.0, false);
        self.program.push(Operation::Friction(friction));
        self.run(n, self.dt, 1.0, false);
    }
}

/// Writes the program from the random packing to the sample at rest in the rheometer.
///
/// `cycle_damping` is the factor per step of the measurement, `plates` how the edges are carried from here on.
pub fn preparation(
    model: &ModelSettings,
    settings: &PreparationSettings,
    amplitude: f64,
    cycle_damping: f64,
    plates: Plates,
) -> Vec<Operation> {
    let StepSizes { dt, mut dt_max } = step_sizes(model, amplitude);
    let (mu, c_nu, c_t, a) = (model.friction, model.relative_viscosity, model.tangential_ratio, amplitude);
    let unit = model.constants().time / model.size_ratio;
    let (kc, kt) = (model.reinforcement_central, model.reinforcement_tangential);
    let plain = kc == 1.0;
    let mut w = Writer { program: Vec::new(), model, dt, scale: settings.relaxation };

    let mut first = if c_nu <= 0.1 { 0.2 * unit } else { 0.25 * unit };
    if model.packing > 2.0 {
        first /= 2.0;
    }
    let n = if plain { 300 } else { 100 };
    w.relax(n, first, mu);
    if a <= 0.01 || c_t < 0.1 {
        w.relax(n, first, mu);
    }
    let n = if plain { 200 } else { 100 };
    w.relax(n, dt_max, mu);
    for smaller in [0.01, 0.001] {
        if a <= smaller && plain {
            w.relax(n, dt_max, mu);
        }
    }

    if settings.links {
        w.program.push(Operation::LinkAndCut);
        dt_max = dt_max.min(2.0 * dt);
        if c_t > 5.0 {
            dt_max /= 2.0;
        }
        w.relax(300, dt_max, mu);
        if a < 0.1 {
            w.relax(150, dt_max, 0.0);
            w.relax(150, dt_max, mu);
        }
        for smaller in [0.01, 0.001, 0.0001] {
            if a <= smaller {
                w.relax(100, dt_max, mu);
                w.relax(100, dt_max, 0.0);
                w.relax(100, dt_max, mu);
            }
        }
        if a <= 0.001 && (kt != 1.0 || kc != 1.0) {
            dt_max /= 3.0;
            w.relax(200, dt_max, mu);
            w.relax(200, dt_max, 0.0);
            w.relax(200, dt_max, mu);
        }
        w.program.push(Operation::Friction(w.model.friction));
    }

    w.program.push(Operation::Plates(plates));
    let mut factor = 1.0;
    for (holds, by) in [
        (mu <= 0.1, 1.5),
        (mu <= 0.01, 2.0),
        (mu <= 0.001, 2.0),
        (a <= 0.01, 1.0 - (a.log10() + 2.0)),
        (a <= 0.005, 2.0),
        (c_nu <= 0.1, 2.0),
    ] {
        if holds {
            factor *= by;
        }
    }
    let n = w.steps(25 * factor as u64);
    let (mut h, mut damping) = (dt_max, 0.5);
    while h > dt {
        w.run(n / 2, h, damping, false);
        h /= 2.0;
        damping = (1.0 + damping) / 2.0;
    }
    w.run(2 * n, dt, 0.98, false);
    w.run(n, dt, cycle_damping, true);
    w.program
}

/// Steps taken by the `Run` entries of a program.
pub fn steps(program: &[Operation]) -> u64 {
    program.iter().map(|o| if let Operation::Run { steps, .. } = o { *steps } else { 0 }).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps of preparation of the reference runs: total minus recorded, and the step itself.
    #[test]
    fn step_counts_equal_those_of_the_reference_runs() {
        for (links, mu, amplitude, packing, dt, prepared) in [
            (true, 0.01, 0.2, 1.5, 1.1263984473304288e-07, 17364 - 13439),
            (true, 0.01, 0.05, 1.5, 5.631992236652144e-08, 32204 - 26879),
            (true, 0.01, 0.2, 1.2, 1.0074813991924221e-07, 17364 - 13439),
            (true, 0.1, 0.2, 1.5, 1.1263984473304288e-07, 17301 - 13439),
            (true, 1.0, 0.2, 1.5, 2.2527968946608576e-07, 9994 - 6719),
            (false, 0.01, 0.2, 1.5, 1.1263984473304288e-07, 16614 - 13439),
            (false, 0.01, 0.2, 1.8, 1.2339076766833414e-07, 16614 - 13439),
            (false, 0.01, 1.0, 1.5, 5.631992236652144e-08, 30629 - 26879),
            (false, 1.0, 0.2, 1.5, 2.2527968946608576e-07, 9144 - 6719),
        ] {
            let model = ModelSettings { friction: mu, packing, ..ModelSettings::default() };
            let settings = PreparationSettings { links, ..PreparationSettings::default() };
            let program = preparation(&model, &settings, amplitude, 0.999, Plates::Band);
            assert_eq!(steps(&program), prepared, "links {links} mu {mu} amplitude {amplitude}");
            assert!((step_sizes(&model, amplitude).dt / dt - 1.0).abs() < 1e-14);
        }
    }
}
