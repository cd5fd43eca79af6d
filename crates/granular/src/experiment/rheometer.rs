//! The state machine of one sample: every call does one time step, and everything between calls can be saved.

use super::drive::{Drive, Segment};
use super::program::program;
use super::settings::MicrogelSettings;
use crate::assembly::{Assembly, Plates};
use crate::cell::Cell;
use crate::error::GranularError;
use crate::model::{ContactKind, Dimension, Mode};
use crate::preparation::links::{direct_links, join_isolated, particles, remove_links, tallest};
use crate::preparation::schedule::Operation;
use crate::preparation::{Cut, cut_into_particles, random_packing};
use crate::random::Random;
use crate::spheres::{SphereSample, random_balls};
use crate::stress::Row;
use serde::{Deserialize, Serialize};

/// What one call of [`Rheometer::advance`] did.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(clippy::large_enum_variant)]
pub enum Progress {
    /// A step of the preparation.
    Prepared,
    /// A recorded step of the experiment.
    Recorded(Row),
    /// Nothing: the program has ended.
    Finished,
}

/// Signals of one segment, one entry per recorded step.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Signal {
    /// Time since the start of the segment [s].
    pub time: Vec<f64>,
    /// Shear strain since the start of the experiment [-].
    pub strain: Vec<f64>,
    /// Shear rate [1/s].
    pub rate: Vec<f64>,
    /// Compressive strain [-].
    pub compression: Vec<f64>,
    /// Shear stress by surface force [Pa].
    pub surface: Vec<f64>,
    /// Shear stress of the overall tensor [Pa].
    pub overall: Vec<f64>,
    /// Shear stress of the bulk tensor, all contacts included [Pa].
    pub bulk: Vec<f64>,
    /// Pressure of the overall tensor [Pa].
    pub pressure: Vec<f64>,
    /// Normal stress along the gradient, bulk tensor [Pa].
    pub normal: Vec<f64>,
}

/// Facts of a prepared sample.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct SampleFacts {
    /// Realised packing [-].
    pub packing: f64,
    /// Permanent links.
    pub links: usize,
    /// Particles.
    pub particles: usize,
    /// Fraction of links removed [-].
    pub removed_fraction: f64,
    /// Links added to grains left alone.
    pub joined: usize,
    /// Attempts at cutting.
    pub attempts: usize,
}

/// A sample in the rheometer, from the random packing to the last step.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Rheometer {
    pub(super) settings: MicrogelSettings,
    pub(super) assembly: Assembly,
    pub(super) random: Random,
    pub(super) program: Vec<Operation>,
    pub(super) segments: Vec<Segment>,
    pub(super) cursor: usize,
    /// Steps done of the operation at the cursor.
    pub(super) done: u64,
    pub(super) segment_time: f64,
    pub(super) experiment_time: f64,
    pub(super) signals: Vec<Signal>,
    pub(super) facts: SampleFacts,
    pub(super) recorded: u64,
    pub(super) steps: u64,
    pub(super) worst_identity: f64,
    pub(super) slip_sum: f64,
    pub(super) contact_sum: f64,
    pub(super) last_stress: f64,
    pub(super) initial_height: f64,
    pub(super) last_row: Row,
    plates_on: bool,
}

impl Rheometer {
    /// Scatters the grains of a sample and writes its program; no step is taken yet.
    ///
    /// # Errors
    /// [`GranularError`] if a setting is out of range.
    pub fn new(settings: &MicrogelSettings) -> Result<Self, GranularError> {
        settings.check()?;
        let mut random = Random::new(settings.seed);
        if settings.model.dimension == Dimension::Three {
            return Self::of_spheres(settings, random);
        }
        let grains = random_packing(&settings.model, settings.mode, &mut random);
        let mut cell = Cell::new(settings.model.width, settings.model.height);
        cell.boundary = settings.boundary;
        let model = settings.model.contact_model();
        let packing = grains.packing(cell.area());
        let assembly = Assembly::new(settings.mode, &grains, cell, model, settings.rules, settings.seed)?;
        Self::with_assembly(settings, assembly, random, packing)
    }

    fn of_spheres(settings: &MicrogelSettings, mut random: Random) -> Result<Self, GranularError> {
        let m = &settings.model;
        let balls = random_balls(m, &mut random);
        let mut cell = Cell::new(m.width, m.height);
        cell.boundary = settings.boundary;
        let volume = |r: f64| 4.0 / 3.0 * std::f64::consts::PI * r * r * r;
        let packing = balls.iter().map(|b| volume(b.radius)).sum::<f64>() / (cell.area() * m.depth());
        let sample = SphereSample::new(balls, cell, m.depth(), m.contact_model(), settings.rules)?;
        Self::with_assembly(settings, Assembly::Spheres(Box::new(sample)), random, packing)
    }

    fn with_assembly(
        settings: &MicrogelSettings,
        assembly: Assembly,
        random: Random,
        packing: f64,
    ) -> Result<Self, GranularError> {
        let (program, segments) = program(settings);
        Ok(Self {
            settings: settings.clone(),
            initial_height: assembly.cell().height,
            assembly,
            random,
            program,
            signals: vec![Signal::default(); segments.len()],
            segments,
            cursor: 0,
            done: 0,
            segment_time: 0.0,
            experiment_time: 0.0,
            facts: SampleFacts { packing, ..SampleFacts::default() },
            recorded: 0,
            steps: 0,
            worst_identity: 0.0,
            slip_sum: 0.0,
            contact_sum: 0.0,
            last_stress: 0.0,
            last_row: Row::default(),
            plates_on: false,
        })
    }

    /// Settings of the run.
    pub fn settings(&self) -> &MicrogelSettings {
        &self.settings
    }

    /// The sample.
    pub fn assembly(&self) -> &Assembly {
        &self.assembly
    }

    /// Segments of the experiment.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// Recorded signals, one per segment.
    pub fn signals(&self) -> &[Signal] {
        &self.signals
    }

    /// Facts of the prepared sample.
    pub fn facts(&self) -> &SampleFacts {
        &self.facts
    }

    /// Last recorded row.
    pub fn last_row(&self) -> &Row {
        &self.last_row
    }

    /// Steps taken and steps of the whole program.
    pub fn progress(&self) -> (u64, u64) {
        let total = self
            .program
            .iter()
            .map(|o| match o {
                Operation::Run { steps, .. } => *steps,
                Operation::Drive(k) => self.segments[*k].steps,
                _ => 0,
            })
            .sum();
        (self.steps, total)
    }

    /// True while the sample is being prepared.
    pub fn preparing(&self) -> bool {
        !matches!(self.program.get(self.cursor), Some(Operation::Drive(_)) | None)
    }

    /// Takes one time step, with the operations before it that take no time.
    ///
    /// # Errors
    /// [`GranularError`] naming what failed, where and when; the state is then that of the failure.
    pub fn advance(&mut self) -> Result<Progress, GranularError> {
        loop {
            let Some(&operation) = self.program.get(self.cursor) else { return Ok(Progress::Finished) };
            match operation {
                Operation::Run { steps, dt, damping, zero_forces } if self.done < steps => {
                    self.assembly.advance(dt, damping, zero_forces, false)?;
                    self.done += 1;
                    self.steps += 1;
                    return Ok(Progress::Prepared);
                }
                Operation::Drive(k) if self.done < self.segments[k].steps => {
                    return self.drive(k).map(Progress::Recorded);
                }
                Operation::Run { .. } | Operation::Drive(_) => {
                    self.done = 0;
                    self.segment_time = 0.0;
                }
                Operation::Friction(mu) => self.assembly.model_mut().friction = mu,
                Operation::RemoveDrift => self.assembly.remove_drift(),
                Operation::LinkAndCut => self.link_and_cut()?,
                Operation::Plates(plates) => {
                    self.assembly.set_plates(plates)?;
                    self.plates_on = plates == Plates::Band;
                    self.count_particles();
                }
            }
            self.cursor += 1;
        }
    }

    /// Runs to the end, handing each recorded row to `record`.
    ///
    /// # Errors
    /// See [`Self::advance`].
    pub fn run(&mut self, mut record: impl FnMut(&Row)) -> Result<(), GranularError> {
        loop {
            match self.advance()? {
                Progress::Finished => return Ok(()),
                Progress::Recorded(row) => record(&row),
                Progress::Prepared => {}
            }
        }
    }

    fn drive(&mut self, k: usize) -> Result<Row, GranularError> {
        let segment = self.segments[k].clone();
        let (i, t, dt) = (self.done, self.segment_time, segment.dt);
        if self.plates_on {
            self.assembly.capture();
        }
        match (segment.rate(i, t, self.settings.mode), &segment.drive) {
            (Some(rate), Drive::Closing { rate: closing, steps }) => {
                self.assembly.set_rate(rate);
                if let Assembly::Undirected(s) = &mut self.assembly {
                    // Constant speed of the edge: the rate grows as the height shrinks.
                    let speed = if i < *steps { closing * self.initial_height / s.cell().height } else { 0.0 };
                    s.set_closing(speed);
                }
            }
            (Some(rate), _) => self.assembly.set_rate(rate),
            (None, Drive::Stress { stress, inertia, damping }) => {
                let rate = self.assembly.cell().rate;
                let pushed = rate + dt / inertia * (stress - self.last_stress);
                self.assembly.set_rate(pushed / (1.0 + dt * damping / inertia));
            }
            (None, _) => {}
        }
        let cell = *self.assembly.cell();
        let elastic_energy = match &self.assembly {
            Assembly::Undirected(s) if self.settings.record_energy => s.elastic_energy(),
            _ => 0.0,
        };
        let report = self.assembly.advance(dt, segment.damping, true, true)?;
        let row = Row {
            index: self.recorded,
            time: self.experiment_time,
            strain: cell.strain,
            rate: cell.rate,
            compression: 1.0 - cell.height / self.initial_height,
            stress: report.stress,
            contacts: report.contacts,
            slipping: report.slipping,
            kinetic_energy: report.kinetic_energy,
            elastic_energy,
        };
        let s = &mut self.signals[k];
        s.time.push(t);
        s.strain.push(row.strain);
        s.rate.push(row.rate);
        s.compression.push(row.compression);
        s.surface.push(row.surface_stress());
        s.overall.push(row.overall_stress());
        s.bulk.push(row.stress.bulk.shear());
        s.pressure.push(row.stress.overall.pressure());
        s.normal.push(row.stress.bulk.0[3]);
        self.last_stress = match self.settings.mode {
            Mode::Physical => row.stress.bulk.shear(),
            Mode::Compat => row.overall_stress(),
        };
        self.worst_identity = self.worst_identity.max(row.stress.identity_defect());
        self.slip_sum += f64::from(row.slipping);
        self.contact_sum += f64::from(row.contacts);
        self.last_row = row;
        self.segment_time += dt;
        self.experiment_time += dt;
        self.recorded += 1;
        self.done += 1;
        self.steps += 1;
        Ok(row)
    }

    fn link_and_cut(&mut self) -> Result<(), GranularError> {
        const ATTEMPTS: usize = 1000;
        let p = self.settings.preparation.clone();
        let height = self.assembly.cell().height;
        let avoid = p.avoid_tall
            && match p.cut {
                Cut::Voronoi { points, .. } => points >= 2,
                Cut::Lines { count, .. } => count > 0,
                Cut::None => false,
            };
        for attempt in 1.. {
            self.assembly.link_all();
            cut_into_particles(&mut self.assembly, &p.cut, p.cut_top_bottom, &mut self.random);
            let grains = self.assembly.grains();
            let (labels, count) = particles(grains.len(), &direct_links(&self.assembly));
            if !avoid || tallest(&grains, &labels, count) <= 0.9 * height {
                self.facts.attempts = attempt;
                break;
            }
            if attempt == ATTEMPTS {
                return Err(GranularError::Cutting { attempts: ATTEMPTS });
            }
        }
        self.facts.removed_fraction = remove_links(&mut self.assembly, p.remove_links, &mut self.random);
        self.facts.joined = join_isolated(&mut self.assembly, &mut self.random);
        Ok(())
    }

    fn count_particles(&mut self) {
        self.facts.links = self.assembly.links().len();
        self.facts.particles = particles(self.assembly.len(), &direct_links(&self.assembly)).1;
    }

    /// Drops the lists of possible partners, so that the next step searches all pairs anew; changes cost, not results.
    pub fn forget_candidates(&mut self) {
        match &mut self.assembly {
            Assembly::Directed(s) => s.forget_candidates(),
            Assembly::Undirected(s) => s.valid = false,
            Assembly::Spheres(s) => s.valid = false,
        }
    }

    /// Contacts per grain, links included.
    pub fn coordination(&self) -> f64 {
        let touching = self.assembly.contacts().iter().filter(|c| c.kind != ContactKind::Apart).count();
        2.0 * touching as f64 / self.assembly.len() as f64
    }
}
