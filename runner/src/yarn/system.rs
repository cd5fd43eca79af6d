//! The yarns of one scene as a [`System`].

use std::path::Path;
use std::time::Instant;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use yarn::{StepReport, YarnError, YarnState, YarnSystem};

use super::record::{self, Record};
use super::settings::{SettingsError, settings};
use crate::record::frame::Frame;
use crate::scene::Scene;
use crate::scene::yarn::Yarns;
use crate::system::{Column, Element, Rejection, RejectionReason, StateError, StepLimit, System};

/// What has been counted since the start; it is part of the checkpoint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Totals {
    /// Steps of the library.
    pub substeps: u64,
    /// Steps that had to be divided.
    pub divided: u64,
    /// Cross-sections that were lifted to the smallest stretch.
    pub flattened: u64,
    /// Newton iterations.
    pub newton: u64,
    /// Conjugate-gradient iterations.
    pub cg: u64,
    /// Largest depth of a vertex inside a solid [m].
    pub depth: f64,
    /// Energy at the start [J].
    pub first_energy: f64,
}

/// Everything that a step changes.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Saved<const D: usize> {
    state: YarnState<D>,
    totals: Totals,
}

/// Yarns in the plane or in space under the common stepper.
pub struct YarnScene<const D: usize> {
    pub(super) system: YarnSystem<D>,
    pub(super) totals: Totals,
    pub(super) report: Option<StepReport<D>>,
    pub(super) record: Record,
    /// A yarn has left the domain: smaller steps would only come nearer to where it does.
    refused: Option<Rejection>,
    kept: YarnState<D>,
    kept_totals: Totals,
    seconds: f64,
}

/// The yarns of a scene, in as many dimensions as it says.
///
/// # Errors
/// The first thing that is wrong.
pub fn system(scene: &Scene, section: &Yarns) -> Result<Box<dyn System>, SettingsError> {
    let settings = settings(scene, section)?;
    Ok(if settings.dimension == 2 {
        Box::new(YarnScene::<2>::build(scene, section, &settings)?)
    } else {
        Box::new(YarnScene::<3>::build(scene, section, &settings)?)
    })
}

impl<const D: usize> YarnScene<D> {
    fn build(scene: &Scene, section: &Yarns, settings: &yarn::YarnSettings) -> Result<Self, SettingsError> {
        let system = YarnSystem::<D>::build(settings, Path::new(""))?;
        let record = Record::new(scene, section, &system, settings)?;
        let kept = system.state().clone();
        let totals = Totals { first_energy: system.energy().total(), ..Totals::default() };
        Ok(Self { system, totals, report: None, record, refused: None, kept, kept_totals: totals, seconds: 0.0 })
    }

    /// The yarns themselves.
    #[must_use]
    pub fn yarns(&self) -> &YarnSystem<D> {
        &self.system
    }
}

fn rejection(error: &YarnError) -> Rejection {
    let vertex = |yarn: &usize, vertex: &usize| Some(Element::YarnVertex { yarn: *yarn, vertex: *vertex });
    let (stage, reason, element) = match error {
        YarnError::NonFinite { yarn, vertex: v, .. } => ("yarn: motion", RejectionReason::NonFinite, vertex(yarn, v)),
        YarnError::LeftDomain { yarn, vertex: v, .. } => ("yarn: motion", RejectionReason::Infeasible, vertex(yarn, v)),
        YarnError::StepTooLarge { .. } => ("yarn: step", RejectionReason::TooLargeMotion, None),
        YarnError::NotConverged { .. } => ("yarn: implicit solve", RejectionReason::NotConverged, None),
        YarnError::Grid(_) => ("yarn: grid", RejectionReason::Infeasible, None),
        YarnError::Setting { .. } => ("yarn: settings", RejectionReason::Infeasible, None),
    };
    Rejection { stage, reason, element, detail: error.to_string() }
}

impl<const D: usize> System for YarnScene<D> {
    fn kind(&self) -> &'static str {
        "yarn"
    }

    fn columns(&self) -> Vec<Column> {
        self.record.columns(D)
    }

    fn row(&self, out: &mut Vec<f64>) {
        self.record.row(self, out);
    }

    fn step_limits(&self) -> Vec<StepLimit> {
        let limits = self.system.step_limits().into_iter();
        limits.map(|limit| StepLimit { seconds: limit.seconds, reason: limit.reason }).collect()
    }

    fn snapshot(&mut self) {
        self.kept.clone_from(self.system.state());
        self.kept_totals = self.totals;
    }

    fn restore(&mut self) {
        // The state that was kept is one of this scene and sound: it was accepted.
        let _ = self.system.set_state(self.kept.clone());
        self.totals = self.kept_totals;
    }

    fn advance(&mut self, time: f64, dt: f64) -> Result<(), Rejection> {
        if let Some(refused) = &self.refused {
            return Err(refused.clone());
        }
        let start = Instant::now();
        self.system.set_time(time);
        let report = match self.system.advance(dt) {
            Ok(report) => report,
            Err(error) => {
                let refused = rejection(&error);
                if matches!(error, YarnError::LeftDomain { .. }) {
                    self.refused = Some(refused.clone());
                }
                return Err(refused);
            }
        };
        let totals = &mut self.totals;
        totals.substeps += report.substeps as u64;
        totals.divided += u64::from(report.divided_by.is_some());
        totals.flattened += report.clamped as u64;
        totals.newton += report.newton_iterations as u64;
        totals.cg += report.cg_iterations as u64;
        totals.depth = totals.depth.max(report.depth);
        self.report = Some(report);
        self.seconds = start.elapsed().as_secs_f64();
        Ok(())
    }

    fn is_small(&self) -> bool {
        self.system.is_small()
    }

    fn iterations(&self) -> usize {
        self.report.as_ref().map_or(0, |report| report.cg_iterations.max(report.substeps))
    }

    fn stage_seconds(&self) -> Vec<(&'static str, f64)> {
        vec![("yarn", self.seconds)]
    }

    fn frame(&self, step: u64, time: f64) -> Frame {
        super::picture::frame(&self.system, self.record.extent, step, time)
    }

    fn save(&self) -> Result<Vec<u8>, StateError> {
        let saved = Saved { state: self.system.state().clone(), totals: self.totals };
        postcard::to_stdvec(&saved).map_err(StateError::from_display)
    }

    fn load(&mut self, bytes: &[u8]) -> Result<(), StateError> {
        let saved: Saved<D> = postcard::from_bytes(bytes).map_err(StateError::from_display)?;
        self.system.set_state(saved.state).map_err(StateError::from_display)?;
        self.totals = saved.totals;
        self.refused = None;
        Ok(())
    }

    fn summary(&self) -> Map<String, Value> {
        record::summary(self)
    }
}
