//! What steps and diagnostics report.

use nalgebra::SVector;
use serde::{Deserialize, Serialize};

/// Momentum that entered and left the yarns since the start [N s].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Ledger<const D: usize> {
    /// Momentum at the start.
    pub initial: SVector<f64, D>,
    /// From gravity and the attractor.
    pub body: SVector<f64, D>,
    /// From walls, obstacles and pins.
    pub boundary: SVector<f64, D>,
    /// From driven vertices.
    pub driven: SVector<f64, D>,
    /// From forces on nodes without mass, which no particle feels.
    pub lost: SVector<f64, D>,
    /// Largest sum of the magnitudes of all momenta that there has been, the scale of the defect.
    pub scale: f64,
}

impl<const D: usize> Default for Ledger<D> {
    fn default() -> Self {
        let zero = SVector::zeros();
        Self { initial: zero, body: zero, boundary: zero, driven: zero, lost: zero, scale: 0.0 }
    }
}

/// A limit of the step and who sets it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepLimit {
    /// Largest step [s].
    pub seconds: f64,
    /// Why.
    pub reason: &'static str,
}

/// What one call of `advance` did.
#[derive(Clone, Debug, PartialEq)]
pub struct StepReport<const D: usize> {
    /// Steps that the call was divided into.
    pub substeps: usize,
    /// The limit that decided, where it was divided.
    pub divided_by: Option<StepLimit>,
    /// Newton iterations, all sub-steps together (0 for explicit steps).
    pub newton_iterations: usize,
    /// Conjugate-gradient iterations, all sub-steps together.
    pub cg_iterations: usize,
    /// Largest relative residual of the implicit solves.
    pub residual: f64,
    /// Quadrature points whose section was lifted to the smallest stretch, all sub-steps together.
    pub clamped: usize,
    /// Largest depth at which a vertex was found inside an obstacle [m].
    pub depth: f64,
    /// Mean force of the yarns on each obstacle over the call [N].
    pub obstacle_force: Vec<SVector<f64, D>>,
    /// Mean force of the yarns on each pin [N].
    pub pin_force: Vec<SVector<f64, D>>,
    /// Mean force of each driven vertex on its drive [N].
    pub drive_force: Vec<SVector<f64, D>>,
    /// Mean force on the walls [N].
    pub wall_force: SVector<f64, D>,
    /// Nodes that carried momentum but no mass in the last sub-step.
    pub massless_nodes: usize,
}

/// Energies of the whole system [J].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Energy {
    /// Kinetic, the affine parts included.
    pub kinetic: f64,
    /// Of stretch, shear and contact together.
    pub elastic: f64,
    /// Of stretch along the yarns.
    pub stretch: f64,
    /// Of shear between fibres.
    pub shear: f64,
    /// Of bending.
    pub bending: f64,
    /// Potential of gravity about the origin.
    pub gravity: f64,
}

impl Energy {
    /// Of contact: compression and change of shape of the cross-sections.
    #[must_use]
    pub fn contact(&self) -> f64 {
        self.elastic - self.stretch - self.shear
    }

    /// Sum of all parts [J].
    #[must_use]
    pub fn total(&self) -> f64 {
        self.kinetic + self.elastic + self.bending + self.gravity
    }
}

/// Linear and angular momentum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Momentum<const D: usize> {
    /// Linear [N s].
    pub linear: SVector<f64, D>,
    /// Angular about the origin [N m s]; the only component stands last in 2-D.
    pub angular: [f64; 3],
}

/// What the yarns look like: plain arrays, one entry per vertex.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct YarnFrameData {
    /// First vertex of each yarn, and the number of vertices at the end.
    pub yarn_start: Vec<usize>,
    /// Stable number of each vertex.
    pub id: Vec<u64>,
    /// Yarn of each vertex.
    pub yarn: Vec<u32>,
    /// Positions [m]; z is zero in 2-D.
    pub position: Vec<[f64; 3]>,
    /// Velocities [m/s].
    pub velocity: Vec<[f64; 3]>,
    /// Tension [N], negative in compression: mean of the segments that meet.
    pub tension: Vec<f64>,
    /// Pressure of the cross-section, positive in compression [Pa].
    pub pressure: Vec<f64>,
    /// Sliding between fibres since the start [m].
    pub slip: Vec<f64>,
    /// Tension of the segment that starts at the vertex [N]; zero at the last vertex of a yarn, as the next two.
    pub segment_tension: Vec<f64>,
    /// Pressure of its cross-section [Pa].
    pub segment_pressure: Vec<f64>,
    /// Sliding in it since the start [m].
    pub segment_slip: Vec<f64>,
    /// Diameter (width in 2-D) for pictures [m].
    pub width: Vec<f64>,
}
