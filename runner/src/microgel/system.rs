//! The samples of one scene as a [`System`].

use super::record;
use super::schedule::Schedule;
use crate::record::frame::Frame;
use crate::system::{Column, Element, Rejection, RejectionReason, StateError, StepLimit, System};
use granular::GranularError;
use granular::assembly::Assembly;
use granular::experiment::{MicrogelSettings, Progress, Rheometer, Summary};
use granular::model::ContactKind;
use granular::statistics::estimate;
use granular::stress::Row;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// Joules per metre (joules, for spheres) in one unit of energy of the library, µm² mg s⁻².
const ENERGY: f64 = 1e-18;

/// One sample of the ensemble.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Sample {
    /// The sample in its rheometer.
    pub rheometer: Rheometer,
    /// Why it can go no further.
    pub failure: Option<String>,
}

/// Everything that a step changes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct State {
    /// Steps that every sample has taken.
    pub done: u64,
    /// The samples, by ascending seed.
    pub samples: Vec<Sample>,
    /// Recorded rows of the first sample.
    pub table: Vec<Row>,
    /// Mass of all grains of the first sample at the start, in the library's unit.
    pub mass: f64,
}

/// Soft grains in the rheometer: one sample per seed, all in step with each other.
///
/// A sample that fails is left where it failed and reported; the run fails with the last one. What a failed step left behind
/// is not taken back: the state is that of the failure, and an earlier checkpoint is the last sound one.
pub struct MicrogelSystem {
    pub(super) state: State,
    schedule: Schedule,
    every: u64,
    refused: Option<Rejection>,
}

impl MicrogelSystem {
    /// Scatters the grains of all samples; `every` steps of the grains are one step of the record.
    ///
    /// # Errors
    /// When the settings are out of range.
    pub fn new(settings: &MicrogelSettings, every: u64) -> Result<MicrogelSystem, GranularError> {
        settings.check()?;
        let of = |seed| Rheometer::new(&MicrogelSettings { seed, ..settings.clone() });
        let samples: Result<Vec<Sample>, GranularError> = settings
            .seed_list()
            .into_par_iter()
            .map(|seed| of(seed).map(|rheometer| Sample { rheometer, failure: None }))
            .collect();
        let samples = samples?;
        let mass = samples.first().map_or(0.0, |sample| sample.rheometer.assembly().grains().mass.iter().sum());
        Ok(MicrogelSystem {
            state: State { done: 0, samples, table: Vec::new(), mass },
            schedule: Schedule::new(settings),
            every: every.max(1),
            refused: None,
        })
    }

    /// The times of all steps.
    #[must_use]
    pub fn schedule(&self) -> &Schedule {
        &self.schedule
    }

    fn first(&self) -> &Rheometer {
        &self.state.samples[0].rheometer
    }

    fn batch(&self) -> u64 {
        self.every.min(self.schedule.steps - self.state.done)
    }

    /// Results of all samples that have not failed, and the failures by seed.
    pub(super) fn summaries(&self) -> (Vec<Summary>, Vec<(u64, String)>) {
        let results: Vec<(u64, Result<Summary, String>)> = self
            .state
            .samples
            .par_iter()
            .map(|sample| {
                let seed = sample.rheometer.settings().seed;
                let result = match &sample.failure {
                    Some(reason) => Err(reason.clone()),
                    None => sample.rheometer.summary().map_err(|error| error.to_string()),
                };
                (seed, result)
            })
            .collect();
        let (mut runs, mut failed) = (Vec::new(), Vec::new());
        for (seed, result) in results {
            match result {
                Ok(summary) => runs.push(summary),
                Err(reason) => failed.push((seed, reason)),
            }
        }
        (runs, failed)
    }
}

impl Sample {
    /// Takes `steps` steps and keeps every `every`-th recorded row in `rows`.
    fn advance(&mut self, steps: u64, every: u64, rows: Option<&mut Vec<Row>>) -> Result<(), GranularError> {
        let mut unwanted = Vec::new();
        let rows = rows.unwrap_or(&mut unwanted);
        for _ in 0..steps {
            if let Progress::Recorded(row) = self.rheometer.advance()?
                && row.index % every == 0
            {
                rows.push(row);
            }
        }
        Ok(())
    }
}

fn rejection(error: &GranularError) -> Rejection {
    let (reason, element) = match error {
        GranularError::NonFinite { grain, .. } => (RejectionReason::NonFinite, Some(Element::Grain(*grain))),
        GranularError::StepTooLarge { .. } => (RejectionReason::TooLargeMotion, None),
        _ => (RejectionReason::Infeasible, None),
    };
    Rejection { stage: "grains", reason, element, detail: error.to_string() }
}

/// Contacts that stick and slip, and links.
fn count(assembly: &Assembly) -> [f64; 3] {
    let mut counts = [0.0; 3];
    for contact in assembly.contacts() {
        match contact.kind {
            ContactKind::Stick => counts[0] += 1.0,
            ContactKind::Slip => counts[1] += 1.0,
            ContactKind::Permanent => counts[2] += 1.0,
            ContactKind::Apart => {}
        }
    }
    counts
}

impl System for MicrogelSystem {
    fn kind(&self) -> &'static str {
        "microgel"
    }

    fn columns(&self) -> Vec<Column> {
        let mut columns = vec![
            Column::new("phase", "1", "0 while the sample is prepared, then the segment of the experiment"),
            Column::new("measured_steps", "1", "steps of the measurement so far"),
            Column::new("strain", "1", "shear strain"),
            Column::new("shear_rate", "1/s", "shear rate"),
            Column::new("compression", "1", "height lost over initial height"),
            Column::new("shear_stress_surface", "Pa", "by the forces on the surface"),
            Column::new("shear_stress_overall", "Pa", "by the overall tensor"),
            Column::new("shear_stress_bulk", "Pa", "by all contacts along their images"),
        ];
        for (name, meaning) in [("overall", "overall tensor"), ("bulk", "tensor of all contacts")] {
            for place in ["xx", "xy", "yx", "yy"] {
                columns.push(Column::new(format!("stress_{name}_{place}"), "Pa", meaning));
            }
        }
        columns.extend([
            Column::new("pressure", "Pa", "of the overall tensor"),
            Column::new("contacts_stick", "1", "contacts held by friction"),
            Column::new("contacts_slip", "1", "contacts at the Coulomb limit"),
            Column::new("links", "1", "permanent links"),
            Column::new("kinetic_energy", "J/m", "against the shear flow (spheres: J)"),
            Column::new("elastic_energy", "J/m", "of contacts and links (discs in physical mode)"),
            Column::new("stress_identity_defect", "1", "violation of the identities of the stress tensors, relative"),
        ]);
        if self.state.samples.len() > 1 {
            columns.push(Column::new("samples", "1", "samples that have not failed"));
            columns.push(Column::new("shear_stress_mean", "Pa", "headline measure, mean over the samples"));
            columns.push(Column::new("shear_stress_sd", "Pa", "its standard deviation over the samples"));
        }
        columns
    }

    fn row(&self, out: &mut Vec<f64>) {
        let first = self.first();
        let row = first.last_row();
        let assembly = first.assembly();
        out.extend([
            self.schedule.phase(self.state.done.saturating_sub(1)) as f64,
            self.state.done.saturating_sub(self.schedule.prepared) as f64,
            row.strain,
            row.rate,
            row.compression,
            row.surface_stress(),
            row.overall_stress(),
            row.stress.bulk.shear(),
        ]);
        out.extend(row.stress.overall.0);
        out.extend(row.stress.bulk.0);
        out.push(row.stress.overall.pressure());
        out.extend(count(assembly));
        let kinetic = if first.preparing() {
            assembly.grains().kinetic_energy(0.0, 0.5 * assembly.cell().height)
        } else {
            row.kinetic_energy
        };
        let elastic = match assembly {
            Assembly::Undirected(sample) => sample.elastic_energy(),
            Assembly::Directed(_) | Assembly::Spheres(_) => 0.0,
        };
        out.extend([kinetic * ENERGY, elastic * ENERGY, row.stress.identity_defect()]);
        if self.state.samples.len() > 1 {
            let stresses: Vec<f64> = self
                .state
                .samples
                .iter()
                .filter(|sample| sample.failure.is_none())
                .map(|sample| record::headline_stress(&sample.rheometer))
                .collect();
            let mean = estimate(&stresses);
            out.extend([stresses.len() as f64, mean.mean, mean.sd]);
        }
    }

    fn step_limits(&self) -> Vec<StepLimit> {
        let done = self.state.done;
        let seconds = self.schedule.time(done + self.batch()) - self.schedule.time(done);
        let reason = if self.first().preparing() { "grains: preparation" } else { "grains: measurement" };
        vec![StepLimit { seconds, reason }]
    }

    fn snapshot(&mut self) {}

    fn restore(&mut self) {}

    fn advance(&mut self, _time: f64, _dt: f64) -> Result<(), Rejection> {
        if let Some(refused) = &self.refused {
            return Err(refused.clone());
        }
        let (steps, every) = (self.batch(), self.every);
        let State { samples, table, .. } = &mut self.state;
        let Some((first, others)) = samples.split_first_mut() else { return Ok(()) };
        let advance = |sample: &mut Sample, rows: Option<&mut Vec<Row>>| -> Option<Rejection> {
            if sample.failure.is_some() {
                return None;
            }
            let error = sample.advance(steps, every, rows).err()?;
            sample.failure = Some(error.to_string());
            Some(rejection(&error))
        };
        let (of_first, of_others) = rayon::join(
            || advance(first, Some(table)),
            || others.par_iter_mut().filter_map(|sample| advance(sample, None)).collect::<Vec<_>>(),
        );
        if self.state.samples.iter().all(|sample| sample.failure.is_some()) {
            let last = of_first.or_else(|| of_others.into_iter().next());
            let refused = last.unwrap_or_else(|| Rejection {
                stage: "grains",
                reason: RejectionReason::Infeasible,
                element: None,
                detail: self.state.samples[0].failure.clone().unwrap_or_default(),
            });
            self.refused = Some(refused.clone());
            return Err(refused);
        }
        self.state.done += steps;
        Ok(())
    }

    fn iterations(&self) -> usize {
        usize::try_from(self.every).unwrap_or(usize::MAX)
    }

    fn stage_seconds(&self) -> Vec<(&'static str, f64)> {
        Vec::new()
    }

    fn frame(&self, step: u64, time: f64) -> Frame {
        super::picture::frame(self.first(), step, time)
    }

    fn save(&self) -> Result<Vec<u8>, StateError> {
        postcard::to_stdvec(&self.state).map_err(StateError::from_display)
    }

    fn load(&mut self, bytes: &[u8]) -> Result<(), StateError> {
        let state: State = postcard::from_bytes(bytes).map_err(StateError::from_display)?;
        let recipe = |state: &State| -> Vec<MicrogelSettings> {
            state.samples.iter().map(|sample| sample.rheometer.settings().clone()).collect()
        };
        if recipe(&state) != recipe(&self.state) {
            return Err(StateError("it holds samples of another recipe, which cannot be changed on the way".into()));
        }
        self.state = state;
        self.refused = None;
        Ok(())
    }

    fn summary(&self) -> Map<String, Value> {
        record::summary(self)
    }

    fn finished(&self) -> bool {
        self.state.done >= self.schedule.steps
    }

    fn final_files(&self) -> Vec<(String, Vec<u8>)> {
        vec![
            ("microgel.csv".to_owned(), record::table(&self.state.table)),
            ("rheology.json".to_owned(), record::rheology(self)),
        ]
    }
}
