//! Bulk liquid in a world: particles, what they are made of, where they come from and go, and the solvers that move them.
//!
//! ```text
//! build      scene → state and set-up            planar     shapes and motions of a two-dimensional scene
//! solids     the solids of the scene as the liquid meets them
//! sources    stage 0: sources, drains, the domain            limits     the largest stable step and why
//! coupling   what strands do to the liquid, between the named steps of stage 6
//! finite     no number that is not finite leaves a stage      measure    columns and figures
//! estimate   how much of it there will be, without building it
//! picture    particles, slices and outlines for frames        probe      a point that is followed
//! ```
//!
//! A liquid lives in space or in a plane; [`LiquidState`] and [`LiquidWorld`] say which, and stages are written once for both.
//! Until the first particle exists the stages return at once and nothing is allocated.

pub mod build;
pub mod coupling;
pub mod estimate;
pub mod finite;
pub mod limits;
pub mod measure;
pub mod picture;
pub mod planar;
pub mod probe;
pub mod solids;
pub mod sources;

use mpm::deformation::PreviousStrain;
use mpm::{
    AdvectReport, DeformationReport, Ledger, LiquidError, LiquidGrid, LiquidMaterial, LiquidSettings, Particles,
    PlasticityReport, PressureReport, PressureSolver, ResampleReport, ResampleScratch, ShearReport, ShearSolver,
    SourceState, Vector, WeightsReport, particles_to_grid::TransferReport,
};
use particle_grid::GridError;
use serde::{Deserialize, Serialize};

use crate::system::{Element, Rejection, RejectionReason, StateError};
use coupling::Coupling;
use solids::Body;
use sources::{Domain, Drain, Source};

/// Everything of the liquid that changes and that a checkpoint holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum LiquidState {
    /// In the x–y plane, per metre of depth.
    Two(FlowState<2>),
    /// In space.
    Three(FlowState<3>),
}

/// The state of a liquid in `D` dimensions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FlowState<const D: usize> {
    /// The particles.
    pub particles: Particles<D>,
    /// What entered and left.
    pub ledger: Ledger<D>,
    /// What each source has emitted.
    pub sources: Vec<SourceState>,
    /// Steps taken with particles; it numbers their maintenance.
    pub steps: u64,
    /// Momentum that the pressure gave to the liquid since the start: what walls and strands answered, and what a free surface
    /// inside cells leaves over [N s].
    pub pressure_impulse: Vector<D>,
}

/// What the scene says about the liquid, and the solvers with their scratch: nothing here survives a step.
pub enum LiquidWorld {
    /// In the x–y plane.
    Two(Box<Flow<2>>),
    /// In space.
    Three(Box<Flow<3>>),
}

/// Set-up and solvers of a liquid in `D` dimensions.
pub struct Flow<const D: usize> {
    /// What particles are made of.
    pub materials: Vec<LiquidMaterial>,
    /// Names of the materials in the scene.
    pub names: Vec<String>,
    /// Settings of all stages.
    pub settings: LiquidSettings,
    /// Largest step that the scene allows [s].
    pub largest_step: f64,
    /// Gravity [m/s²].
    pub gravity: Vector<D>,
    /// Gravity and the liquid's own body force [m/s²].
    pub body: Vector<D>,
    /// Solids, in scene order.
    pub bodies: Vec<Body>,
    /// Where liquid flows in.
    pub sources: Vec<Source>,
    /// Where it disappears.
    pub drains: Vec<Drain>,
    /// The box outside which it disappears.
    pub domain: Option<Domain<D>>,
    /// The grid of the last step.
    pub grid: LiquidGrid<D>,
    /// Shear solve.
    pub shear: ShearSolver<D>,
    /// Pressure solve.
    pub pressure: PressureSolver<D>,
    /// What strands do to the liquid in this step.
    pub coupling: Coupling<D>,
    /// Elastic strains before the step, where the flow map needs them.
    pub previous: PreviousStrain<D>,
    /// Scratch of the maintenance of particles.
    pub maintenance: ResampleScratch<D>,
    /// Whether anything resists shear in this step.
    pub resists: bool,
    /// What the stages did in the last step.
    pub report: FlowReport,
    /// Seconds of the last step in the shear and pressure solves.
    pub seconds: [f64; 2],
    /// Planes of which frames show a cut: direction of the normal and place along it [m].
    pub slices: Vec<picture::Slice>,
    /// Points that are followed.
    pub probes: Vec<probe::PointProbe>,
}

/// What the stages of the liquid did in the last step; everything is zero while there are no particles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FlowReport {
    /// Maintenance of particles.
    pub resample: ResampleReport,
    /// Blocks and mass on the grid.
    pub transfer: TransferReport,
    /// Solids and free surface.
    pub weights: WeightsReport,
    /// Torn particles.
    pub torn: usize,
    /// Pressure of the free motion, where it was predicted.
    pub prediction: Option<PressureReport>,
    /// First shear solve.
    pub shear: Option<ShearReport>,
    /// Pressure.
    pub pressure: Option<PressureReport>,
    /// Second shear solve.
    pub shear_again: Option<ShearReport>,
    /// Final projection.
    pub projection: Option<PressureReport>,
    /// Largest rate at which liquid and strands in a cell changed their common volume with the final velocities [1/s].
    pub mixture_divergence: f64,
    /// Momentum that particles took from the grid in excess of what was there, relative to the sum of magnitudes.
    pub transfer_defect: f64,
    /// Particles in no liquid cell whose volume had to be set to that of no pressure.
    pub released: usize,
    /// Deformation of the particles.
    pub deformation: DeformationReport,
    /// Advection.
    pub advect: AdvectReport,
    /// Plastic flow.
    pub plasticity: PlasticityReport,
}

/// Runs the same code for a liquid in the plane and in space; `Ok(())` where there is none.
macro_rules! in_its_dimension {
    ($world:expr, |$flow:ident, $state:ident| $work:expr) => {
        match (&mut $world.liquid, &mut $world.state.liquid) {
            (
                Some($crate::world::liquid::LiquidWorld::Two($flow)),
                Some($crate::world::liquid::LiquidState::Two($state)),
            ) => $work,
            (
                Some($crate::world::liquid::LiquidWorld::Three($flow)),
                Some($crate::world::liquid::LiquidState::Three($state)),
            ) => $work,
            _ => Ok(()),
        }
    };
}
pub(crate) use in_its_dimension;

/// Looks at a liquid in the plane or in space; the default where there is none.
macro_rules! seen_in_its_dimension {
    ($world:expr, $default:expr, |$flow:ident, $state:ident| $work:expr) => {
        match (&$world.liquid, &$world.state.liquid) {
            (
                Some($crate::world::liquid::LiquidWorld::Two($flow)),
                Some($crate::world::liquid::LiquidState::Two($state)),
            ) => $work,
            (
                Some($crate::world::liquid::LiquidWorld::Three($flow)),
                Some($crate::world::liquid::LiquidState::Three($state)),
            ) => $work,
            _ => $default,
        }
    };
}
pub(crate) use seen_in_its_dimension;

impl LiquidState {
    /// Number of particles.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            LiquidState::Two(state) => state.particles.len(),
            LiquidState::Three(state) => state.particles.len(),
        }
    }

    /// Whether there are none yet, or none any more.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Copies another state into memory that is there already.
    pub fn copy_from(&mut self, other: &LiquidState) {
        match (self, other) {
            (LiquidState::Two(to), LiquidState::Two(from)) => to.copy_from(from),
            (LiquidState::Three(to), LiquidState::Three(from)) => to.copy_from(from),
            (to, from) => to.clone_from(from),
        }
    }

    /// Whether a saved state can go on in this scene.
    ///
    /// # Errors
    /// Says what does not fit.
    pub fn accepts(&self, saved: &LiquidState) -> Result<(), StateError> {
        match (self, saved) {
            (LiquidState::Two(here), LiquidState::Two(saved)) => here.accepts(saved),
            (LiquidState::Three(here), LiquidState::Three(saved)) => here.accepts(saved),
            _ => Err(StateError("it holds liquid in another number of dimensions".to_owned())),
        }
    }
}

impl<const D: usize> FlowState<D> {
    fn copy_from(&mut self, other: &FlowState<D>) {
        let (to, from) = (&mut self.particles, &other.particles);
        to.position.clone_from(&from.position);
        to.velocity.clone_from(&from.velocity);
        to.affine.clone_from(&from.affine);
        to.mass.clone_from(&from.mass);
        to.rest_volume.clone_from(&from.rest_volume);
        to.volume_ratio.clone_from(&from.volume_ratio);
        to.elastic_strain.clone_from(&from.elastic_strain);
        to.deformation_gradient.clone_from(&from.deformation_gradient);
        to.material.clone_from(&from.material);
        to.flags.clone_from(&from.flags);
        to.id.clone_from(&from.id);
        to.next_id = from.next_id;
        to.carried = from.carried;
        self.ledger = other.ledger;
        self.sources.clone_from(&other.sources);
        self.steps = other.steps;
        self.pressure_impulse = other.pressure_impulse;
    }

    fn accepts(&self, saved: &FlowState<D>) -> Result<(), StateError> {
        saved.particles.check().map_err(StateError::from_display)?;
        if saved.particles.carried != self.particles.carried {
            return Err(StateError("its liquids carry other quantities than those of the scene".to_owned()));
        }
        if saved.sources.len() != self.sources.len() {
            let (there, here) = (saved.sources.len(), self.sources.len());
            return Err(StateError(format!("it knows {there} sources of liquid, the scene has {here}")));
        }
        Ok(())
    }
}

impl LiquidWorld {
    /// What the stages did in the last step.
    #[must_use]
    pub fn report(&self) -> FlowReport {
        match self {
            LiquidWorld::Two(flow) => flow.report,
            LiquidWorld::Three(flow) => flow.report,
        }
    }

    /// Iterations of all solves of the last step together.
    #[must_use]
    pub fn iterations(&self) -> usize {
        match self {
            LiquidWorld::Two(flow) => flow.report.iterations(),
            LiquidWorld::Three(flow) => flow.report.iterations(),
        }
    }

    /// Seconds of the last step in the shear and pressure solves.
    #[must_use]
    pub fn seconds(&self) -> [f64; 2] {
        match self {
            LiquidWorld::Two(flow) => flow.seconds,
            LiquidWorld::Three(flow) => flow.seconds,
        }
    }
}

impl FlowReport {
    /// Adds the solves of an earlier pass through the same step.
    pub fn add(&mut self, before: &FlowReport) {
        for (now, then) in [(&mut self.shear, before.shear), (&mut self.shear_again, before.shear_again)] {
            if let (Some(now), Some(then)) = (now, then) {
                now.solve = then.solve.combined(now.solve);
                now.newton_iterations += then.newton_iterations;
            }
        }
        for (now, then) in [(&mut self.pressure, before.pressure), (&mut self.projection, before.projection)] {
            if let (Some(now), Some(then)) = (now, then) {
                now.multigrid.solve = then.multigrid.solve.combined(now.multigrid.solve);
            }
        }
    }

    /// Iterations of all solves together.
    #[must_use]
    pub fn iterations(&self) -> usize {
        let shear = [self.shear, self.shear_again].into_iter().flatten().map(|r| r.solve.iterations);
        let pressure = [self.prediction, self.pressure, self.projection]
            .into_iter()
            .flatten()
            .map(|r| r.multigrid.solve.iterations);
        shear.chain(pressure).sum()
    }
}

/// An error of a stage as a rejection that names its place; `ids` are the identities of the particles in their order.
#[must_use]
pub fn rejection(stage: &'static str, error: &LiquidError, ids: &[u64]) -> Rejection {
    let at = |particle: usize| ids.get(particle).map(|id| Element::Particle(*id));
    let (reason, element) = match error {
        LiquidError::Grid(GridError::NonFinite { particle }) => (RejectionReason::NonFinite, at(*particle)),
        LiquidError::Grid(GridError::TooFar { particle } | GridError::OutsidePeriod { particle, .. }) => {
            (RejectionReason::TooLargeMotion, at(*particle))
        }
        LiquidError::Deformation { id, .. } => (RejectionReason::TooLargeMotion, Some(Element::Particle(*id))),
        LiquidError::NonFinite { .. } => (RejectionReason::NonFinite, None),
        LiquidError::Material { id, .. } => (RejectionReason::Infeasible, Some(Element::Particle(*id))),
        _ => (RejectionReason::Infeasible, None),
    };
    Rejection { stage, reason, element, detail: error.to_string() }
}

/// A point of `D` dimensions in space; in the plane the third coordinate is zero.
#[inline]
#[must_use]
pub fn lift<const D: usize>(x: &Vector<D>) -> Vector<3> {
    Vector::<3>::from_fn(|k, _| if k < D { x[k] } else { 0.0 })
}

/// A point of space in `D` dimensions; in the plane the third coordinate is dropped.
#[inline]
#[must_use]
pub fn lower<const D: usize>(x: &Vector<3>) -> Vector<D> {
    Vector::<D>::from_fn(|k, _| x[k])
}
