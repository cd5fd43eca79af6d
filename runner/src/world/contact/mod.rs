//! Contact of the strands of a scene: settings, memory from step to step, scratch, figures for the record.
//!
//! ```text
//! mod     ── ContactWorld: settings from the scene, lists of the present step
//! cohesion── liquids of the films, what is wet in the present step
//! memory  ── what survives a step and goes into checkpoints: forces to start from, warnings, confirmations
//! record  ── columns, rows, picture
//! ```
//!
//! The algorithm is in `stages::mixture::contact`.

pub mod cohesion;
pub mod memory;
pub mod record;

use ::contact::block::Vec3;
use ::contact::detection::{Contact, DetectionSettings, Detector};
use ::contact::law::ContactState;
use ::contact::{ContactProblem, ContactSettings, SolverChoice};
use nalgebra::Vector3;
use rods::RodSet;

use super::Reaction;
use super::film::FilmWorld;
use crate::plan::Components;
use crate::scene::Scene;
use crate::scene::contact::{ContactFailure, ContactSolver};
use crate::scene::time::{Component, StepControl};
use cohesion::{CohesionWorld, Wetness};

/// A contact counts as held where free vertices carry less than this share of it on both sides: an impulse could move it
/// only by moving them a hundred times farther.
pub const HELD: f64 = 0.01;

/// Contact of a scene; absent where nothing can touch.
pub struct ContactWorld {
    /// Settings of the solvers.
    pub settings: ContactSettings,
    /// Settings of detection.
    pub detection: DetectionSettings,
    /// Strands meet solids.
    pub with_solids: bool,
    /// There is friction at all.
    pub with_friction: bool,
    /// How often the rods are linearised anew in one step, at least once.
    pub relinearisations: usize,
    /// A contact problem that is not solved rejects the step.
    pub rejects: bool,
    /// Every so many steps a second solver is asked.
    pub cross_check: Option<u64>,
    /// Cohesion, where strands can be wet.
    pub cohesion: Option<CohesionWorld>,
    /// Radii a vertex may move in one step; only without continuous detection, which needs no such limit.
    pub radii_per_step: Option<f64>,
    /// Largest radius of each edge, at its first vertex [m].
    pub edge_radius: Vec<f64>,
    /// Smallest radius of all [m].
    pub smallest_radius: f64,
    /// Every strand is round and of constant thickness: no radius depends on place or direction.
    pub uniform: bool,
    /// First vertex of each strand, as detection takes it.
    pub first_vertex: Vec<u32>,
    /// Lists of the present step.
    pub lists: Lists,
    /// How the last step went.
    pub report: StepFigures,
    /// Force and torque (about its centre) of the strands on each solid during the last step.
    pub on_solids: Vec<Reaction>,
    /// Force of the solids on the strands during the last step, with what the linear step leaves to the clamps [N].
    pub outside_force: Vector3<f64>,
    /// Sum of the magnitudes of the forces of the solids [N].
    pub outside_scale: f64,
    /// Seconds spent in detection, assembly and solve during the last step.
    pub seconds: [f64; 3],
    /// The first contact problem that was not solved, and the last one that rejected a step.
    pub unsolved: Option<ContactProblem>,
    /// Every so many steps the problem is kept.
    pub save_every: Option<u64>,
    /// Problems kept, by step.
    pub saved: Vec<(u64, ContactProblem)>,
}

/// Memory that is used again every step.
#[derive(Default)]
pub struct Lists {
    /// Broad phase and its memory.
    pub detector: Detector,
    /// What detection found.
    pub found: Vec<Contact>,
    /// Dry contacts in view that stay open by themselves, without a part in the problem.
    pub spare: Vec<Contact>,
    /// Contacts of the step, in a fixed order.
    pub active: Vec<Contact>,
    /// How many of them, from the first on, the last round has solved for.
    pub solved: usize,
    /// Impulse of each in its basis [N s].
    pub impulses: Vec<Vec3>,
    /// What each does.
    pub states: Vec<ContactState>,
    /// The liquid at each.
    pub wet: Vec<Wetness>,
    /// How far each contact of the step gives way to others that push against it.
    pub yielding: Vec<Yielding>,
    /// Part of each impulse by which the liquid resists sliding [N s].
    pub flow: Vec<Vec3>,
    /// Bridges of liquid that only pull, whatever the contacts do: they have no part in the problem.
    pub loose: Vec<LooseBridge>,
    /// Edges of last step's bridges, sorted: as often as they have bridges.
    pub shared: Vec<(u32, u32)>,
    /// How far the liquid of each edge can reach, at its first vertex [m]; empty where nothing is wet.
    pub reach: Vec<f64>,
    /// Height of the film on each edge where it is highest, at its first vertex [m]; empty where nothing is wet.
    pub height: Vec<f64>,
    /// Positions at the start of the step [m].
    pub start: Vec<Vec3>,
    /// Positions at its end under the present solution [m].
    pub end: Vec<Vec3>,
    /// How far the last impulses moved the end of each vertex [m].
    pub moved: Vec<f64>,
    /// Displacement at the end that velocities do not account for [m]; empty unless the integrator is a two-step one.
    pub drift: Vec<Vector3<f64>>,
    /// Velocity per freedom, four a vertex.
    pub velocity: Vec<f64>,
    /// Vertices that the boundary holds.
    pub held: Vec<bool>,
    /// Impulse per vertex [N s].
    pub per_vertex: Vec<Vector3<f64>>,
    /// Vectors in passing.
    pub vectors: Vec<Vector3<f64>>,
}

impl Lists {
    /// Takes a contact into the problem, so far without impulse.
    pub fn pose(&mut self, contact: Contact) {
        self.pose_wet(contact, Wetness::default(), [0.0; 3]);
    }

    /// Takes a contact into the problem with the liquid at it and the impulse that it has had so far.
    pub fn pose_wet(&mut self, contact: Contact, wet: Wetness, impulse: Vec3) {
        self.active.push(contact);
        self.impulses.push(impulse);
        self.states.push(ContactState::Open);
        self.yielding.push(Yielding::No);
        self.wet.push(wet);
        self.flow.push([0.0; 3]);
    }

    /// All contacts that have an impulse, posed or not, with it.
    pub fn acting(&self) -> impl Iterator<Item = (&Contact, Vec3)> {
        let posed = self.active.iter().zip(self.impulses.iter().copied());
        posed.chain(self.loose.iter().map(|bridge| (&bridge.contact, bridge.impulse())))
    }
}

/// A bridge of liquid over an open gap that the strands do not close: it pulls with all its force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LooseBridge {
    /// Where it is.
    pub contact: Contact,
    /// The liquid there.
    pub wet: Wetness,
    /// Its pull [N s].
    pub pull: f64,
}

impl LooseBridge {
    /// Its impulse in the basis of the contact [N s].
    #[must_use]
    pub fn impulse(&self) -> Vec3 {
        [-self.pull, 0.0, 0.0]
    }
}

/// How far a contact gives way, for the rest of a step, to others that ask for the contrary.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Yielding {
    /// Not at all.
    #[default]
    No,
    /// It no longer pushes its overlap apart; the law is the same.
    Still,
    /// It is soft: the law is broken, and the step warns.
    Soft,
}

/// Figures of one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepFigures {
    /// Contacts posed: all that the free motion or the impulses would close.
    pub contacts: usize,
    /// Without impulse.
    pub open: usize,
    /// Sticking.
    pub sticking: usize,
    /// Sliding.
    pub slipping: usize,
    /// Held by cohesion.
    pub cohesive: usize,
    /// Joined by a bridge of liquid.
    pub bridges: usize,
    /// Contacts dropped because both sides are held.
    pub held: usize,
    /// Iterations of all contact solvers.
    pub iterations: usize,
    /// Contact problems solved (more than one where contacts were added or the rods linearised anew).
    pub rounds: usize,
    /// Natural-map residual of the last problem, relative.
    pub residual: f64,
    /// Deepest overlap at the start of the step [m].
    pub worst_penetration: f64,
}

impl ContactWorld {
    /// Contact as a scene asks for it; `None` where nothing can touch.
    #[must_use]
    pub fn build(
        scene: &Scene,
        components: &Components,
        rods: &RodSet,
        film: Option<&FilmWorld>,
    ) -> Option<ContactWorld> {
        if !components.contact {
            return None;
        }
        let asked = &scene.contact;
        let settings = ContactSettings {
            solver: match asked.solver {
                ContactSolver::Auto => SolverChoice::Auto,
                ContactSolver::GaussSeidel => SolverChoice::GaussSeidel,
                ContactSolver::Newton => SolverChoice::Newton,
                ContactSolver::Admm => SolverChoice::Admm,
            },
            tolerance: asked.tolerance,
            max_sweeps: asked.max_iterations,
            max_newton_iterations: asked.max_iterations.div_ceil(20),
            max_admm_iterations: asked.max_iterations,
            ..ContactSettings::default()
        };
        let detection = DetectionSettings {
            proximity: asked.detection.margin,
            max_per_edge: asked.detection.max_per_edge,
            // the scene counts radii, detection sums of two
            self_exclusion: 0.5 * asked.detection.self_distance,
            continuous: asked.detection.continuous,
            strand_strand: components.strand_pairs,
        };
        let cfl = match &scene.time.step {
            StepControl::Adaptive(adaptive) => adaptive.cfl,
            StepControl::Fixed(_) => 1.0,
        };
        let largest = |v: usize| rods.radius[v][0].max(rods.radius[v][1]);
        let mut edge_radius = vec![0.0; rods.vertex_count()];
        let mut uniform = true;
        for strand in 0..rods.strand_count() {
            let vertices = rods.vertices(strand);
            let first = rods.radius[vertices.start];
            uniform &= rods.radius[vertices.clone()].iter().all(|r| *r == first && r[0] == r[1]);
            for v in vertices.start..vertices.end - 1 {
                edge_radius[v] = largest(v).max(largest(v + 1));
            }
            edge_radius[vertices.end - 1] = largest(vertices.end - 1);
        }
        Some(ContactWorld {
            settings,
            detection,
            with_solids: asked.strand_solid && !scene.solids.is_empty(),
            with_friction: !scene.is_disabled(&Component::Friction),
            relinearisations: asked.relinearisations.max(1),
            rejects: asked.on_failure == ContactFailure::Reject,
            cross_check: scene.cross_check,
            cohesion: CohesionWorld::build(scene, components, film),
            radii_per_step: (!detection.continuous).then_some(cfl),
            smallest_radius: rods.radius.iter().flatten().copied().fold(f64::INFINITY, f64::min),
            edge_radius,
            uniform,
            first_vertex: rods.first_vertex.iter().map(|v| *v as u32).collect(),
            lists: Lists::default(),
            report: StepFigures::default(),
            on_solids: vec![Reaction::default(); scene.solids.len()],
            outside_force: Vector3::zeros(),
            outside_scale: 0.0,
            seconds: [0.0; 3],
            unsolved: None,
            save_every: asked.save_every,
            saved: Vec::new(),
        })
    }

    /// Whether a step can be too long for contact, and the largest that is not [s].
    #[must_use]
    pub fn step_limit(&self, rods: &RodSet) -> Option<f64> {
        let radii = self.radii_per_step?;
        let speed = rods.velocity.iter().map(Vector3::norm).fold(0.0, f64::max);
        (speed > 0.0).then(|| radii * self.smallest_radius / speed)
    }
}
