//! The yarn system: settings, model, state, and `advance`.

use std::path::Path;
use std::sync::OnceLock;

use nalgebra::SVector;
use particle_grid::Lattice;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::boundary::Boundary;
use crate::diagnostics;
use crate::error::{YarnError, YarnWarning};
use crate::limits::{Rates, rates, rates_and_forces, step_limits};
use crate::model::YarnModel;
use crate::report::{Energy, Momentum, StepLimit, StepReport, YarnFrameData};
use crate::settings::{Integrator, OversizedStep, YarnSettings, gravity};
use crate::state::YarnState;
use crate::step::{Scratch, Setting, step};

/// Below this number of vertices a step takes less time than sharing it out.
const SMALL: usize = 3000;

thread_local! {
    /// One helper thread for each calling thread, so that independent runs do not wait for each other.
    static ALONE: Option<ThreadPool> = ThreadPoolBuilder::new().num_threads(1).build().ok();
}

/// Runs `work` on one thread, without handing pieces of it to others; results do not depend on it.
fn alone<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    if rayon::current_thread_index().is_some() && rayon::current_num_threads() == 1 {
        return work();
    }
    ALONE.with(|pool| match pool {
        Some(pool) => pool.install(work),
        None => work(),
    })
}

/// Yarns in `D` dimensions.
///
/// The state is a plain value: clone it to keep it, give it back to take a step back or to resume; nothing else carries
/// memory from step to step, so a resumed run gives the same bytes.
#[derive(Clone, Debug)]
pub struct YarnSystem<const D: usize> {
    settings: YarnSettings,
    model: YarnModel<D>,
    boundary: Boundary<D>,
    gravity: SVector<f64, D>,
    state: YarnState<D>,
    warnings: Vec<YarnWarning>,
    scratch: Scratch<D>,
    /// What limits the next step, once somebody has asked for it.
    rates: OnceLock<Rates>,
    /// The forces in `scratch` are those of the present state.
    evaluated: bool,
}

impl<const D: usize> YarnSystem<D> {
    /// Builds the system at time zero; files named in the settings are looked up from `base`.
    ///
    /// # Errors
    /// The first setting that is wrong, or the first vertex that starts outside the domain.
    pub fn build(settings: &YarnSettings, base: &Path) -> Result<Self, YarnError> {
        compiled::build(settings, base)
    }

    fn build_any(settings: &YarnSettings, base: &Path) -> Result<Self, YarnError> {
        if settings.dimension != D {
            return Err(YarnError::setting(
                "dimension",
                format!("the system has {D}, the settings {}", settings.dimension),
            ));
        }
        settings.check()?;
        let (model, mut state, mut warnings) = YarnModel::build(settings)?;
        let boundary = Boundary::build(settings, &model, &state, base, &mut warnings)?;
        let mut lattice = Lattice::<D>::new(settings.cell);
        if let Some(walls) = &boundary.walls {
            lattice.origin = walls.low;
            if let Some(i) = state.position.iter().position(|x| !walls.contains(x)) {
                let (yarn, vertex) = model.locate(i);
                let position = state.position[i].iter().copied().collect();
                return Err(YarnError::LeftDomain { yarn, vertex, step: 0, position });
            }
        }
        state.ledger.initial = diagnostics::momentum(&model, &state).linear;
        let gravity = gravity(settings)?;
        let mut scratch = Scratch::new(lattice);
        scratch.transfer.rebuild(&model, &state.position)?;
        Ok(Self {
            settings: settings.clone(),
            model,
            boundary,
            gravity,
            state,
            warnings,
            scratch,
            rates: OnceLock::new(),
            evaluated: false,
        })
    }

    /// Settings as built.
    #[must_use]
    pub fn settings(&self) -> &YarnSettings {
        &self.settings
    }

    /// Topology, masses, materials.
    #[must_use]
    pub fn model(&self) -> &YarnModel<D> {
        &self.model
    }

    /// The present state.
    #[must_use]
    pub fn state(&self) -> &YarnState<D> {
        &self.state
    }

    /// The present state, to be changed by the caller (initial velocities, damping between steps).
    pub fn state_mut(&mut self) -> &mut YarnState<D> {
        self.forget();
        &mut self.state
    }

    /// Sets the time [s] at which scripts are followed: a caller with a clock of its own keeps them in step.
    pub fn set_time(&mut self, time: f64) {
        self.state.time = time;
    }

    /// Replaces the state by one of the same scene.
    ///
    /// # Errors
    /// Where the arrays do not fit the scene or hold numbers that are not finite.
    pub fn set_state(&mut self, state: YarnState<D>) -> Result<(), YarnError> {
        compiled::set_state(self, state)
    }

    fn set_state_any(&mut self, state: YarnState<D>) -> Result<(), YarnError> {
        let n = self.model.len();
        let fits = [
            state.position.len(),
            state.velocity.len(),
            state.affine.len(),
            state.quadrature_affine.len(),
            state.deformation.len(),
            state.slip.len(),
        ];
        if fits.iter().any(|&len| len != n) {
            return Err(YarnError::setting(
                "state",
                format!("has arrays of {fits:?} entries, the scene has {n} vertices"),
            ));
        }
        if let Some(i) = state.first_non_finite() {
            let (yarn, vertex) = self.model.locate(i);
            return Err(YarnError::NonFinite { yarn, vertex, quantity: "state", step: state.step });
        }
        self.state = state;
        self.forget();
        Ok(())
    }

    /// Things allowed that a user should know of.
    #[must_use]
    pub fn warnings(&self) -> &[YarnWarning] {
        &self.warnings
    }

    /// All limits of the present step.
    #[must_use]
    pub fn step_limits(&self) -> Vec<StepLimit> {
        compiled::step_limits(self)
    }

    fn step_limits_any(&self) -> Vec<StepLimit> {
        step_limits(&self.settings, *self.rates(), &self.boundary, &self.state)
    }

    /// Nothing that was computed of the state holds any longer.
    fn forget(&mut self) {
        self.rates.take();
        self.evaluated = false;
    }

    /// Gathers limits and forces of the present state, in one pass where both are wanted.
    fn evaluate(&mut self) {
        if self.settings.step.integrator != Integrator::Explicit {
            self.rates();
        } else if !self.evaluated {
            let rates = rates_and_forces(&self.settings, &self.model, &self.state, &mut self.scratch.forces);
            self.rates = OnceLock::from(rates);
            self.evaluated = true;
        }
    }

    fn rates(&self) -> &Rates {
        self.rates.get_or_init(|| rates(&self.settings, &self.model, &self.state))
    }

    /// Whether the system is so small that its steps are taken on one thread. A caller that already is on a pool of one thread saves
    /// handing every step over.
    #[must_use]
    pub fn is_small(&self) -> bool {
        self.model.len() < SMALL
    }

    /// The tightest limit, where there is one.
    #[must_use]
    pub fn tightest_limit(&self) -> Option<StepLimit> {
        self.step_limits().into_iter().min_by(|a, b| a.seconds.total_cmp(&b.seconds))
    }

    /// Advances by `dt` [s]; a step beyond the limits is divided or refused as the settings say.
    ///
    /// # Errors
    /// A step too large, a vertex that left the domain, a number that stopped being finite, a solve that did not converge.
    /// The state is then undefined (keep a clone to go back to), except after [`YarnError::StepTooLarge`] of an undivided step.
    pub fn advance(&mut self, dt: f64) -> Result<StepReport<D>, YarnError> {
        compiled::advance(self, dt)
    }

    fn advance_any(&mut self, dt: f64) -> Result<StepReport<D>, YarnError> {
        if self.is_small() { alone(|| self.advance_here(dt)) } else { self.advance_here(dt) }
    }

    fn advance_here(&mut self, dt: f64) -> Result<StepReport<D>, YarnError> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(YarnError::setting("dt", format!("must be positive and finite, is {dt}")));
        }
        let mut report = self.empty_report();
        let mut done = 0.0;
        loop {
            let left = dt - done;
            self.evaluate();
            let limit = self.tightest_limit();
            let pieces = limit.map_or(1, |limit| (left / limit.seconds * (1.0 - 1e-12)).ceil().max(1.0) as usize);
            if let Some(limit) = limit
                && pieces > 1
            {
                let steps = self.settings.step;
                let total = report.substeps + pieces;
                if steps.oversized == OversizedStep::Refuse || total > steps.max_substeps {
                    return Err(YarnError::StepTooLarge {
                        dt,
                        limit: limit.seconds,
                        reason: limit.reason,
                        substeps: total,
                        allowed: if steps.oversized == OversizedStep::Refuse { 1 } else { steps.max_substeps },
                    });
                }
                if report.divided_by.is_none_or(|d| limit.seconds < d.seconds) {
                    report.divided_by = Some(limit);
                }
            }
            let h = if pieces == 1 { left } else { left / pieces as f64 };
            self.substep(h, &mut report)?;
            done += h;
            if pieces == 1 {
                break;
            }
        }
        for force in report
            .obstacle_force
            .iter_mut()
            .chain(&mut report.pin_force)
            .chain(&mut report.drive_force)
            .chain(std::iter::once(&mut report.wall_force))
        {
            *force /= -dt;
        }
        let momentum = diagnostics::size_of_momentum(&self.model, &self.state);
        let ledger = &mut self.state.ledger;
        ledger.scale = ledger.scale.max(momentum).max(ledger.initial.norm());
        // The next step will want them; here they are gathered on the threads that are at work anyway.
        self.evaluate();
        Ok(report)
    }

    fn substep(&mut self, dt: f64, report: &mut StepReport<D>) -> Result<(), YarnError> {
        let evaluated = self.evaluated;
        self.forget();
        let setting =
            Setting { settings: &self.settings, model: &self.model, boundary: &self.boundary, gravity: self.gravity };
        let outcome = step(&setting, &mut self.state, &mut self.scratch, dt, evaluated)?;
        report.substeps += 1;
        report.newton_iterations += outcome.solve.newton;
        report.cg_iterations += outcome.solve.cg;
        report.residual = report.residual.max(outcome.solve.residual);
        report.clamped += outcome.clamped;
        report.depth = report.depth.max(outcome.depth);
        report.massless_nodes = outcome.impulses.massless;
        report.wall_force += outcome.impulses.walls;
        for (sum, impulse) in report.obstacle_force.iter_mut().zip(&outcome.impulses.obstacles) {
            *sum += impulse;
        }
        for (sum, impulse) in report.pin_force.iter_mut().zip(&outcome.impulses.pins) {
            *sum += impulse;
        }
        for (sum, impulse) in report.drive_force.iter_mut().zip(&outcome.drives) {
            *sum += impulse;
        }
        Ok(())
    }

    fn empty_report(&self) -> StepReport<D> {
        let zero = SVector::zeros();
        StepReport {
            substeps: 0,
            divided_by: None,
            newton_iterations: 0,
            cg_iterations: 0,
            residual: 0.0,
            clamped: 0,
            depth: 0.0,
            obstacle_force: vec![zero; self.boundary.obstacles.len()],
            pin_force: vec![zero; self.boundary.pins.len()],
            drive_force: vec![zero; self.boundary.drives.len()],
            wall_force: zero,
            massless_nodes: 0,
        }
    }

    /// Energies [J].
    #[must_use]
    pub fn energy(&self) -> Energy {
        compiled::energy(self)
    }

    fn energy_any(&self) -> Energy {
        diagnostics::energy(&self.model, &self.state, &self.gravity)
    }

    /// Linear and angular momentum.
    #[must_use]
    pub fn momentum(&self) -> Momentum<D> {
        compiled::momentum(self)
    }

    fn momentum_any(&self) -> Momentum<D> {
        diagnostics::momentum(&self.model, &self.state)
    }

    /// Momentum that the ledger does not account for, relative to the largest sum of the magnitudes of momenta there has been.
    #[must_use]
    pub fn momentum_defect(&self) -> f64 {
        let ledger = &self.state.ledger;
        let expected = ledger.initial + ledger.body + ledger.boundary + ledger.driven + ledger.lost;
        let defect = (self.momentum().linear - expected).norm();
        let scale = ledger.scale.max(ledger.body.norm()).max(ledger.boundary.norm());
        if scale > 0.0 { defect / scale } else { defect }
    }

    /// Positions, velocities, tension, pressure and slip as plain arrays.
    #[must_use]
    pub fn frame_data(&self) -> YarnFrameData {
        compiled::frame_data(self)
    }

    fn frame_data_any(&self) -> YarnFrameData {
        diagnostics::frame_data(&self.model, &self.state)
    }

    /// Obstacles as built, in scene order, for pictures.
    pub fn obstacles(&self) -> impl Iterator<Item = &geometry::MovingSolid> {
        self.boundary.obstacles.iter().map(|o| o.solid())
    }
}

numerics::compile_here! {
    mod compiled {
        fn build(settings: &YarnSettings, base: &Path) -> Result<YarnSystem<D>, YarnError> = YarnSystem::build_any;
        fn set_state(this: &mut YarnSystem<D>, state: YarnState<D>) -> Result<(), YarnError> = YarnSystem::set_state_any;
        fn step_limits(this: &YarnSystem<D>) -> Vec<StepLimit> = YarnSystem::step_limits_any;
        fn advance(this: &mut YarnSystem<D>, dt: f64) -> Result<StepReport<D>, YarnError> = YarnSystem::advance_any;
        fn energy(this: &YarnSystem<D>) -> Energy = YarnSystem::energy_any;
        fn momentum(this: &YarnSystem<D>) -> Momentum<D> = YarnSystem::momentum_any;
        fn frame_data(this: &YarnSystem<D>) -> YarnFrameData = YarnSystem::frame_data_any;
    }
}
