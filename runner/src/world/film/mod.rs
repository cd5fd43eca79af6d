//! Films on the strands of a scene: what changes, what they see of their strands, what they add to them.
//!
//! ```text
//! mod     ── Films (state, ledger), FilmWorld (solver, slices of the strands, mass and impulse given to the rods)
//! build   ── from the scene
//! measure ── columns, rows, summary
//! picture ── fields on strands, films as tubes
//! ```
//!
//! The algorithm is in `stages::exchange` (stage 1), `stages::mixture::film` (stage 6) and `stages::film_plasticity`
//! (stage 11). Films know no grid: a scene with films alone pays for films alone.

pub(crate) mod build;
pub mod measure;
pub mod picture;

use nalgebra::Vector3;
use rods::{Loads, RodSet};
use serde::{Deserialize, Serialize};
use surface_flow::inertia::InertiaForm;
use surface_flow::{FilmReport, FilmSolver, FilmState, StrandSlices, film_height};

use crate::scene::presets::LiquidProperties;

/// The films and what has come and gone: the part that goes into checkpoints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Films {
    /// The films of all strands, in the order of the strands; those without a film are dry.
    pub state: FilmState,
    /// What has come and gone since the start.
    pub ledger: FilmLedger,
}

/// Liquid that came to the films and left them since the start [kg].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FilmLedger {
    /// On the strands at the start.
    pub initial: f64,
    /// Fallen in drops that are followed no further.
    pub dripped: f64,
    /// Fallen in drops that became liquid particles.
    pub shed: f64,
    /// Taken up from bulk liquid.
    pub captured: f64,
    /// Given back to bulk liquid.
    pub absorbed: f64,
}

impl Films {
    /// Copies another state into memory that is there already.
    pub fn copy_from(&mut self, other: &Films) {
        self.state.area.clone_from(&other.state.area);
        self.state.log_strain.clone_from(&other.state.log_strain);
        self.state.velocity.clone_from(&other.state.velocity);
        self.state.reservoir.clone_from(&other.state.reservoir);
        self.state.ends.clone_from(&other.state.ends);
        self.ledger = other.ledger;
    }
}

/// Films of a run: settings from the scene and the arrays of the present step.
pub struct FilmWorld {
    /// Steps the films.
    pub solver: FilmSolver,
    /// Names of the liquids.
    pub names: Vec<String>,
    /// The liquids.
    pub liquids: Vec<LiquidProperties>,
    /// Place in `liquids` of each strand's film.
    pub liquid_of: Vec<u32>,
    /// Density of each strand's film [kg/m³].
    pub density: Vec<f64>,
    /// Films are carried along.
    pub advects: bool,
    /// Inertia on the strands, unless it is off.
    pub inertia: Option<InertiaForm>,
    /// Reservoirs drip.
    pub drips: bool,
    /// Volume from which drops fall at both ends of each strand, where there is no bulk liquid [m³].
    pub drop_volume: Vec<[f64; 2]>,
    /// Rest length of each edge [m]: films are counted along the strand as it was made, so their volume is exact.
    pub edge_length: Vec<f64>,
    /// Unit tangent of each edge at the start of the step.
    pub tangent: Vec<Vector3<f64>>,
    /// Acceleration of each vertex over the step [m/s²].
    pub acceleration: Vec<Vector3<f64>>,
    /// Mass of film and reservoirs that moves with each vertex [kg].
    pub mass: Vec<f64>,
    /// The same before films were carried along in this step [kg].
    pub mass_before: Vec<f64>,
    /// Height at each vertex [m].
    pub height: Vec<f64>,
    /// Impulse of the flow on each vertex in this step [N s].
    pub impulse: Vec<Vector3<f64>>,
    /// Torque of the flow on each edge in this step [N m].
    pub torque: Vec<f64>,
    /// How the last step went.
    pub report: FilmReport,
    /// What changed hands in the last step.
    pub exchanged: Exchanged,
    spin: Vec<f64>,
}

/// Liquid that changed hands in one step [kg].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Exchanged {
    /// Fell in drops.
    pub dripped: f64,
    /// Taken up from bulk liquid.
    pub captured: f64,
    /// Given back to bulk liquid.
    pub absorbed: f64,
}

impl FilmWorld {
    /// Takes over tangents at the start of a step.
    pub fn look_at(&mut self, rods: &RodSet) {
        for strand in 0..rods.strand_count() {
            let edges = rods.edges(strand);
            let first = edges.start;
            for edge in edges {
                self.tangent[edge] = rods.tangent(strand, edge - first).0;
            }
        }
    }

    /// Mass and height of the films as they are now; reservoirs ride on the vertices at the ends.
    pub fn weigh(&mut self, films: &FilmState, rods: &RodSet) {
        for strand in 0..films.strands() {
            let (vertices, edges) = (films.vertices(strand), films.edges(strand));
            let (density, first, last) = (self.density[strand], vertices.start, vertices.end - 1);
            for (i, v) in vertices.clone().enumerate() {
                let before = if i > 0 { self.edge_length[edges.start + i - 1] } else { 0.0 };
                let after = if v < last { self.edge_length[edges.start + i] } else { 0.0 };
                self.mass[v] = density * films.area[v] * 0.5 * (before + after);
                self.height[v] = film_height(films.area[v], rods.radius[v][0] + rods.radius[v][1]);
            }
            let [root, tip] = films.reservoir[strand];
            self.mass[first] += density * root;
            self.mass[last] += density * tip;
        }
    }

    /// What the films add to the loads of the rods.
    #[must_use]
    pub fn loads(&self, gravity: Vector3<f64>) -> Loads<'_> {
        Loads {
            gravity,
            impulse: self.inertia.map(|_| self.impulse.as_slice()),
            torque: self.inertia.map(|_| self.torque.as_slice()),
            film_mass: Some(&self.mass),
            film_height: Some(&self.height),
            ..Loads::default()
        }
    }

    /// Mass of films and reservoirs [kg].
    #[must_use]
    pub fn liquid_mass(&self, films: &FilmState) -> f64 {
        let strands = (0..films.strands()).map(|s| self.density[s] * films.volume(s, &self.edge_length));
        numerics::reduce::compensated_sum(strands)
    }

    /// The solver with what it sees of the strands, and the arrays of the rods' loads.
    pub fn parts<'a>(&'a mut self, rods: &'a RodSet) -> (&'a mut FilmSolver, StrandSlices<'a>) {
        let view = StrandSlices {
            edge_length: &self.edge_length,
            tangent: &self.tangent,
            semi_axes: &rods.radius,
            acceleration: &self.acceleration,
        };
        (&mut self.solver, view)
    }

    /// Impulses and torques of the flow of this step on the strands.
    ///
    /// # Errors
    /// When the arrays do not fit, which would be a mistake of the program.
    pub fn find_inertia(
        &mut self,
        films: &FilmState,
        rods: &RodSet,
        form: InertiaForm,
        dt: f64,
    ) -> Result<(), surface_flow::FilmError> {
        let view = StrandSlices {
            edge_length: &self.edge_length,
            tangent: &self.tangent,
            semi_axes: &rods.radius,
            acceleration: &self.acceleration,
        };
        let crossed = self.solver.crossed_volume();
        surface_flow::inertia::impulses(
            form,
            films,
            view,
            crossed,
            &rods.velocity,
            &self.density,
            dt,
            &mut self.impulse,
        )?;
        if form == InertiaForm::Flux {
            // this form stands beside the mass before the step, the rods have the mass after it
            for (v, impulse) in self.impulse.iter_mut().enumerate() {
                *impulse += rods.velocity[v] * (self.mass_before[v] - self.mass[v]);
            }
        }
        self.spin.clone_from(&rods.twist_rate);
        surface_flow::inertia::twist_impulses(films, view, &self.spin, &self.density, dt, &mut self.torque)?;
        self.torque.iter_mut().for_each(|torque| *torque /= dt);
        Ok(())
    }
}
