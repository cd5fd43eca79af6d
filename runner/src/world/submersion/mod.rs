//! Strands in bulk liquid: what they remember from step to step, and what they see of the liquid in the present one.
//!
//! ```text
//! mod     ── SubmersionState (in checkpoints), Submersion (settings, arrays of the present step)
//! near    ── particles around points
//! volume  ── shares of cells that strands take
//! measure ── columns, rows
//! ```
//!
//! The algorithm is in `stages::exchange` (capture, absorption, drops) and `stages::mixture::coupling` (volume fraction, drag,
//! pressure). A scene without liquid, or with liquid in a plane, has none of it.

pub mod measure;
pub mod near;
pub mod volume;

use constitutive::drag::{DragLaw, DragSettings};
use nalgebra::Vector3;
use rods::{Loads, RodSet};
use serde::{Deserialize, Serialize};

use super::BuildError;
use super::film::FilmWorld;
use super::liquid::{Flow, FlowState};
use crate::scene::Scene;
use crate::scene::time::{Component, CouplingSolver};
use crate::stages::mixture::coupling::InsideEdge;
use near::Neighbourhood;

/// Largest share of a cell that strands can take: circles packed densely.
pub const DENSEST: f64 = 0.906_899_682_117_108_9;

/// What strands remember of the liquid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SubmersionState {
    /// Whether each vertex was deeper than half a cell below the surface when last looked at.
    pub inside: Vec<bool>,
    /// Pressure gradient at each vertex in the last step [Pa/m].
    pub pressure_gradient: Vec<Vector3<f64>>,
    /// Acceleration of the liquid at each vertex by all but drag in the last step [m/s²]; none where it was not in the liquid.
    pub pull: Vec<Option<Vector3<f64>>>,
    /// Impulses between strands and liquid so far [N s].
    pub exchanged: ExchangedMomentum,
}

/// Momentum that strands got from the liquid so far, by what gave it [N s].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ExchangedMomentum {
    /// Drag.
    pub drag: Vector3<f64>,
    /// Pressure.
    pub pressure: Vector3<f64>,
    /// Liquid taken up, given back and shed.
    pub transfer: Vector3<f64>,
}

/// Strands in liquid: settings and the arrays of the present step, one entry per vertex.
pub struct Submersion {
    /// Drag law of each liquid of the films.
    pub drag: Vec<DragLaw>,
    /// Place of each film liquid among the liquids of the particles; none where it never becomes one.
    pub material: Vec<Option<u16>>,
    /// Drag acts.
    pub drags: bool,
    /// Strands take up liquid.
    pub captures: bool,
    /// Strands take room from the liquid.
    pub crowds: bool,
    /// The pressure of the liquid acts on strands.
    pub presses: bool,
    /// Drag stands inside the system of the faces, as in the reference code: momentum is then not conserved.
    pub drag_in_faces: bool,
    /// The transverse momentum of captured liquid is lost, as in the reference code.
    pub lose_transverse: bool,
    /// Height of the liquid's surface over each vertex, negative inside [m]; from the particles, for stage 1.
    pub level: Vec<f64>,
    /// Vertices in the liquid in this step.
    pub wet: Vec<usize>,
    /// Share of liquid around each of them.
    pub porosity: Vec<f64>,
    /// Volume ratio of the liquid around each of them.
    pub volume_ratio: Vec<f64>,
    /// Velocity of the liquid around each of them at the start of the step [m/s].
    pub start_velocity: Vec<Vector3<f64>>,
    /// Velocity that the liquid would have there at the end without drag [m/s].
    pub fluid_velocity: Vec<Vector3<f64>>,
    /// Velocity that the liquid around each of them loses per impulse [1/kg].
    pub recoil: Vec<f64>,
    /// Drag coefficient of every vertex [kg/s].
    pub coefficient: Vec<f64>,
    /// Velocity that the drag pulls every vertex towards [m/s].
    pub pulls_to: Vec<Vector3<f64>>,
    /// Impulse of drag on every vertex [N s].
    pub drag_impulse: Vec<Vector3<f64>>,
    /// Impulse of captured liquid on every vertex [N s].
    pub capture_impulse: Vec<Vector3<f64>>,
    /// Impulse on every vertex of the film that moves with the liquid [N s].
    pub film_impulse: Vec<Vector3<f64>>,
    /// All impulses on every vertex, those of the film's flow included [N s].
    pub impulse: Vec<Vector3<f64>>,
    /// Force of the pressure on every vertex [N].
    pub pressure_force: Vec<Vector3<f64>>,
    /// Whether the drag stands in the loads of the rods as a coefficient.
    pub coefficient_in_loads: bool,
    /// Vertices that stick to the liquid below its yield stress.
    pub stuck: usize,
    /// Mean and largest speed between vertices and the liquid around them at the end of the step [m/s].
    pub slip: [f64; 2],
    /// Iterations between strands and liquid.
    pub outer: CouplingSolver,
    /// How many were done in the last step.
    pub outer_iterations: usize,
    /// By how much the last one changed velocities, relative.
    pub outer_change: f64,
    /// Velocities of the strands in the iteration before [m/s].
    pub previous: Vec<Vector3<f64>>,
    /// Largest share of a cell that strands took.
    pub densest: f64,
    /// Particles around vertices.
    pub particles: Neighbourhood,
    /// Vertices around vertices.
    pub vertices: Neighbourhood,
    /// Edges whose film moves with the liquid in this step.
    pub inside_edges: Vec<InsideEdge>,
    /// Volume of the strand at every vertex [m³].
    pub volume: Vec<f64>,
    /// Vectors in passing.
    pub vectors: Vec<Vector3<f64>>,
}

impl SubmersionState {
    /// Nothing known yet.
    #[must_use]
    pub fn new(vertices: usize) -> SubmersionState {
        SubmersionState {
            inside: vec![false; vertices],
            pressure_gradient: vec![Vector3::zeros(); vertices],
            pull: vec![None; vertices],
            exchanged: ExchangedMomentum::default(),
        }
    }

    /// Copies another state into memory that is there already.
    pub fn copy_from(&mut self, other: &SubmersionState) {
        self.inside.clone_from(&other.inside);
        self.pressure_gradient.clone_from(&other.pressure_gradient);
        self.pull.clone_from(&other.pull);
        self.exchanged = other.exchanged;
    }
}

impl Submersion {
    /// Strands in the liquid of a scene; `names` are the liquids of the particles.
    ///
    /// # Errors
    /// When a liquid has no drag law.
    pub fn build(scene: &Scene, film: &FilmWorld, names: &[String], rods: &RodSet) -> Result<Submersion, BuildError> {
        let refuse = |error: constitutive::RheologyError| BuildError::Solver(format!("drag: {error}"));
        let law = |liquid: &constitutive::Liquid| DragLaw::new(liquid.density, &liquid.flow, DragSettings::default());
        let drag = film.liquids.iter().map(law).collect::<Result<_, _>>().map_err(refuse)?;
        let place = |name: &String| names.iter().position(|known| known == name).map(|at| at as u16);
        let on = |component: Component| !scene.is_disabled(&component);
        let n = rods.vertex_count();
        let zeros = || vec![Vector3::zeros(); n];
        Ok(Submersion {
            drag,
            material: film.names.iter().map(place).collect(),
            drags: on(Component::Drag),
            captures: on(Component::Capture),
            crowds: on(Component::VolumeFraction),
            presses: on(Component::Pressure),
            drag_in_faces: scene.parity.drag_in_faces,
            lose_transverse: scene.parity.lose_transverse,
            level: vec![f64::INFINITY; n],
            wet: Vec::new(),
            porosity: vec![1.0; n],
            volume_ratio: vec![1.0; n],
            start_velocity: zeros(),
            fluid_velocity: zeros(),
            recoil: vec![0.0; n],
            coefficient: vec![0.0; n],
            pulls_to: zeros(),
            drag_impulse: zeros(),
            capture_impulse: zeros(),
            film_impulse: zeros(),
            impulse: zeros(),
            pressure_force: zeros(),
            coefficient_in_loads: false,
            stuck: 0,
            slip: [0.0; 2],
            outer: scene.solver.coupling.clone(),
            outer_iterations: 0,
            outer_change: 0.0,
            previous: Vec::new(),
            densest: 0.0,
            particles: Neighbourhood::default(),
            vertices: Neighbourhood::default(),
            inside_edges: Vec::new(),
            volume: vertex_volumes(rods),
            vectors: Vec::new(),
        })
    }

    /// Takes the room of the strands from the liquid that is there at the start: a tank filled around them holds that much less.
    pub fn make_room(&self, rods: &RodSet, flow: &Flow<3>, fluid: &mut FlowState<3>) {
        if !self.crowds || fluid.particles.is_empty() {
            return;
        }
        let lattice = flow.grid.lattice();
        let cell = lattice.dx.powi(3);
        let mut near = Neighbourhood::default();
        near.gather(lattice, rods.position.iter().copied(), &fluid.particles.position);
        let mut share = vec![0.0; fluid.particles.len()];
        for (x, volume) in rods.position.iter().zip(&self.volume) {
            near.around(lattice, x, &fluid.particles.position, |n| share[n.index] += n.weight * volume / cell);
        }
        let particles = &mut fluid.particles;
        for (p, share) in share.into_iter().enumerate().filter(|(_, share)| *share > 0.0) {
            let left = 1.0 - share.min(DENSEST);
            particles.rest_volume[p] *= left;
            particles.mass[p] *= left;
        }
        fluid.ledger = mpm::Ledger::open(&particles.totals(&flow.materials, lattice.dx));
    }

    /// Forgets the exchange of the step before.
    pub fn begin(&mut self) {
        for list in
            [&mut self.drag_impulse, &mut self.capture_impulse, &mut self.film_impulse, &mut self.pressure_force]
        {
            list.fill(Vector3::zeros());
        }
        self.coefficient.fill(0.0);
        self.recoil.fill(0.0);
        self.slip = [0.0; 2];
        (self.outer_iterations, self.outer_change) = (1, 0.0);
        self.coefficient_in_loads = false;
        self.stuck = 0;
        self.inside_edges.clear();
    }

    /// Adds up the impulses of film, capture and drag.
    pub fn add_up(&mut self, film: Option<&FilmWorld>) {
        let flow = film.filter(|film| film.inertia.is_some()).map(|film| film.impulse.as_slice());
        for (v, sum) in self.impulse.iter_mut().enumerate() {
            let taken = self.capture_impulse[v] + self.film_impulse[v];
            *sum = taken + self.drag_impulse[v] + flow.map_or(Vector3::zeros(), |flow| flow[v]);
        }
    }

    /// Adds what the liquid does to the loads of the rods.
    #[must_use]
    pub fn add_to<'a>(&'a self, loads: Loads<'a>) -> Loads<'a> {
        let coefficient = self.coefficient_in_loads;
        Loads {
            force: Some(&self.pressure_force),
            impulse: Some(&self.impulse),
            drag: coefficient.then_some(self.coefficient.as_slice()),
            fluid_velocity: coefficient.then_some(self.pulls_to.as_slice()),
            ..loads
        }
    }
}

/// Volume of the strand that belongs to each vertex [m³].
fn vertex_volumes(rods: &RodSet) -> Vec<f64> {
    let one = |strand: usize, i: usize| {
        let [a, b] = rods.radius[rods.first_vertex[strand] + i];
        std::f64::consts::PI * a * b * rods.vertex_length(strand, i)
    };
    (0..rods.strand_count()).flat_map(|s| (0..rods.vertices(s).len()).map(move |i| one(s, i))).collect()
}

/// Unit tangent at a vertex: of its only edge at the ends, the mean of both inside.
#[must_use]
pub fn vertex_tangent(rods: &RodSet, strand: usize, i: usize) -> Vector3<f64> {
    let last = rods.edges(strand).len() - 1;
    let (before, after) = (rods.tangent(strand, i.saturating_sub(1).min(last)).0, rods.tangent(strand, i.min(last)).0);
    (before + after).try_normalize(0.0).unwrap_or(after)
}
