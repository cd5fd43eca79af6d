//! All state of a run of strands (and, stage by stage, of what touches them). Components are optional: what a scene does
//! not have is not here either.
//!
//! ```text
//! Scene ─► script, solids, strands ─► World { state (goes into checkpoints), setup (from the scene), scratch }
//! ```

pub mod contact;
pub mod dynamics;
pub mod film;
pub mod liquid;
pub mod measure;
pub mod picture;
pub mod probes;
pub mod script;
pub mod solids;
pub mod strands;
pub mod submersion;

use std::time::Instant;

use nalgebra::Vector3;
use rods::{Boundary, Loads, RodReport, RodSet, RodSettings, RodStepper};
use serde::{Deserialize, Serialize};

use crate::plan::Plan;
use crate::scene::Scene;
use crate::scene::expand::StrandGeometry;
use crate::scene::time::{Integrator as SceneIntegrator, RodHessian};
use crate::stages::Stage;
use contact::ContactWorld;
use contact::memory::ContactMemory;
use film::{FilmWorld, Films};
use liquid::{LiquidState, LiquidWorld};
use probes::Probe;
use solids::SceneSolid;
use strands::HeldPart;
use submersion::{Submersion, SubmersionState};

/// Why the world of a scene could not be built.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum BuildError {
    /// A strand cannot be made.
    #[error("strand {index} of strands[{group}]: {what}")]
    Strand {
        /// Group in the scene.
        group: usize,
        /// Strand in the group.
        index: usize,
        /// What is wrong.
        what: String,
    },
    /// A solid cannot be made.
    #[error("{name}: {what}")]
    Solid {
        /// Name of the solid.
        name: String,
        /// What is wrong.
        what: String,
    },
    /// A part of the liquid cannot be made.
    #[error("liquid, {name}: {what}")]
    Liquid {
        /// Which part.
        name: String,
        /// What is wrong.
        what: String,
    },
    /// A motion script cannot be followed.
    #[error("motion: {0}")]
    Script(String),
    /// A solver's settings are out of range.
    #[error("solver: {0}")]
    Solver(String),
    /// A rest shape in equilibrium could not be found.
    #[error("rest: Sagfree: {0}")]
    Sagfree(String),
    /// A probe points at nothing.
    #[error("output.probes[{index}]: {what}")]
    Probe {
        /// Place in the list.
        index: usize,
        /// What is wrong.
        what: String,
    },
}

/// The part of the world that changes, whole: a copy of it is a snapshot, its bytes are a checkpoint.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WorldState {
    /// Strands.
    pub rods: RodSet,
    /// What has gone in and out since the start.
    pub ledger: Ledger,
    /// What contact remembers; absent where nothing can touch.
    pub contact: Option<ContactMemory>,
    /// Films on the strands; absent where nothing can be wet.
    pub film: Option<Films>,
    /// Bulk liquid, if there is any.
    pub liquid: Option<LiquidState>,
    /// What strands remember of bulk liquid; absent where they cannot meet any.
    pub submersion: Option<SubmersionState>,
}

/// What has gone in and out since the start, for the defects of the record.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    /// Impulse of gravity, drag, holding forces and solids on the strands [N s].
    pub impulse: Vector3<f64>,
    /// Momentum at the start [N s].
    pub initial_momentum: Vector3<f64>,
    /// Largest sum of the magnitudes of all impulses, the scale of the momentum defect [N s].
    pub impulse_scale: f64,
}

/// Strands: what holds them and what steps them.
pub struct StrandWorld {
    /// Held parts, in scene order.
    pub held: Vec<HeldPart>,
    /// Boundary of the present step, filled by the drive.
    pub boundary: Boundary,
    /// Steps the rods.
    pub stepper: RodStepper,
    /// How the last rod solve went.
    pub report: RodReport,
    /// Friction coefficient per strand.
    pub friction: Vec<f64>,
    /// Group in the scene per strand.
    pub group: Vec<usize>,
    /// Force and torque that held each held part during the last step.
    pub reactions: Vec<Reaction>,
    /// Largest turn of an edge in one step [rad] before the step is refused; infinite for fixed steps, which the user chose.
    pub turn_limit: f64,
    velocities: Vec<Vector3<f64>>,
}

/// Force and torque (about the part's centre) that a clamp exerts on its strand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reaction {
    /// Force [N].
    pub force: Vector3<f64>,
    /// Torque [N m].
    pub torque: Vector3<f64>,
}

/// Everything of one run.
pub struct World {
    /// What changes.
    pub state: WorldState,
    kept: WorldState,
    /// Time of the state [s].
    pub time: f64,
    /// Gravity [m/s²].
    pub gravity: Vector3<f64>,
    /// Strands, if there are any.
    pub strands: Option<StrandWorld>,
    /// Contact, where something can touch.
    pub contact: Option<ContactWorld>,
    /// Films, where strands can be wet.
    pub film: Option<FilmWorld>,
    /// Bulk liquid, if there is any.
    pub liquid: Option<LiquidWorld>,
    /// Strands in bulk liquid, where they can meet any.
    pub submersion: Option<Submersion>,
    /// Solids.
    pub solids: Vec<SceneSolid>,
    /// What is followed step by step.
    pub probes: Vec<Probe>,
    extent: f64,
    stages: Vec<&'static Stage>,
    seconds: Vec<f64>,
}

impl World {
    /// Builds the world of a scene.
    ///
    /// # Errors
    /// When a part cannot be built; the message names it.
    pub fn build(scene: &Scene, plan: &Plan, geometry: &[StrandGeometry]) -> Result<World, BuildError> {
        let built = strands::build(scene, geometry)?;
        let solids = solids::build(scene)?;
        let (film, films) = film::build::build(scene, &plan.components, &built.rods, geometry)?.unzip();
        let contact = ContactWorld::build(scene, &plan.components, &built.rods, film.as_ref());
        let memory = contact.as_ref().map(|_| ContactMemory::default());
        let (mut flowing, liquid) = liquid::build::build(scene, &solids)?.unzip();
        let submersion = match (&film, &liquid) {
            (Some(film), Some(LiquidWorld::Three(flow))) => {
                Some(Submersion::build(scene, film, &flow.names, &built.rods)?)
            }
            _ => None,
        };
        if let (Some(submersion), Some(LiquidState::Three(fluid)), Some(LiquidWorld::Three(flow))) =
            (&submersion, &mut flowing, &liquid)
        {
            submersion.make_room(&built.rods, flow, fluid);
        }
        let mut state = WorldState {
            ledger: Ledger::default(),
            contact: memory,
            film: films,
            liquid: flowing,
            submersion: submersion.as_ref().map(|_| SubmersionState::new(built.rods.vertex_count())),
            rods: built.rods,
        };
        let strands = if geometry.is_empty() {
            None
        } else {
            let stepper =
                RodStepper::new(rod_settings(scene)).map_err(|error| BuildError::Solver(error.to_string()))?;
            let strands = StrandWorld {
                reactions: vec![Reaction::default(); built.held.len()],
                held: built.held,
                boundary: Boundary::default(),
                stepper,
                report: RodReport::EMPTY,
                friction: built.friction,
                group: built.group,
                turn_limit: turn_limit(scene),
                velocities: Vec::new(),
            };
            strands.start_held_parts(&mut state.rods);
            Some(strands)
        };
        let probes = probes::build(scene, &state.rods)?;
        let stages: Vec<&'static Stage> = plan.active().collect();
        let loads = film.as_ref().map_or(Loads::default(), |film| film.loads(Vector3::zeros()));
        state.ledger.initial_momentum = state.rods.momentum(&loads).linear;
        Ok(World {
            extent: picture::extent(&state.rods, scene),
            kept: state.clone(),
            state,
            time: 0.0,
            gravity: scene.gravity,
            strands,
            contact,
            film,
            liquid,
            submersion,
            solids,
            probes,
            seconds: vec![0.0; stages.len()],
            stages,
        })
    }

    /// Gravity and the films, as the rods feel them.
    #[must_use]
    pub fn loads(&self) -> Loads<'_> {
        self.film.as_ref().map_or(Loads::gravity(self.gravity), |film| film.loads(self.gravity))
    }

    fn run_stages(&mut self, step: crate::stages::Step) -> Result<(), crate::system::Rejection> {
        for place in 0..self.stages.len() {
            let stage = self.stages[place];
            let start = Instant::now();
            // the plan refuses scenes that need a stage without a function
            let result = stage.run.map_or(Ok(()), |run| run(self, step));
            self.seconds[place] = start.elapsed().as_secs_f64();
            result?;
        }
        Ok(())
    }
}

/// A step is chosen for the velocities before it; a step in which the strands gained speed so fast that an edge turned by
/// more than this part of the chosen turn too much is repeated.
const TURN_SLACK: f64 = 2.0;

/// Turn of an edge in one step \[rad\] that is never too much: a curl that is let go turns its tip this far in any step that
/// can be taken, and the implicit step is sound there.
const SOUND_TURN: f64 = std::f64::consts::FRAC_PI_6;

fn turn_limit(scene: &Scene) -> f64 {
    match &scene.time.step {
        crate::scene::time::StepControl::Adaptive(adaptive) => (TURN_SLACK * adaptive.turn).max(SOUND_TURN),
        crate::scene::time::StepControl::Fixed(_) => f64::INFINITY,
    }
}

fn rod_settings(scene: &Scene) -> RodSettings {
    let solver = &scene.solver.rods;
    let max_turn = match &scene.time.step {
        crate::scene::time::StepControl::Adaptive(adaptive) => adaptive.turn,
        crate::scene::time::StepControl::Fixed(_) => RodSettings::default().max_turn,
    };
    RodSettings {
        integrator: match scene.time.integrator {
            SceneIntegrator::ImplicitEuler => rods::Integrator::ImplicitEuler,
            SceneIntegrator::Bdf2 => rods::Integrator::Bdf2,
            SceneIntegrator::ImplicitMidpoint => rods::Integrator::ImplicitMidpoint,
        },
        hessian: match solver.hessian {
            RodHessian::Auto | RodHessian::Exact => rods::HessianMode::Exact,
            RodHessian::Projected => rods::HessianMode::ElementProjected,
            RodHessian::GaussNewton => rods::HessianMode::GaussNewton,
        },
        tolerance: solver.tolerance,
        max_iterations: solver.max_iterations,
        max_turn,
        ..RodSettings::default()
    }
}
