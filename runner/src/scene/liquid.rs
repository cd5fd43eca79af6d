//! Bulk liquid: where it is, where it comes from and goes, and how it is computed.

use super::declare::{choice, section};
use super::motion::{Axis, Interval, Script};
use super::quantity::{above, at_least};
use super::solids::Volume;
use nalgebra::Vector3;

section! {
    /// Liquid that is there at the start.
    pub struct Tank {
        /// A liquid in `materials`.
        material: String = [required] () "";
        /// The shape it fills (outside the solids).
        shape: Volume = [required] () "";
        /// Velocity at the start.
        velocity: Vector3<f64> = [Vector3::zeros()] (Velocity) "";
        /// Angular velocity at the start, about the centre of the shape.
        spin: Vector3<f64> = [Vector3::zeros()] (AngularVelocity) "";
    }
}

section! {
    /// A shape from which liquid flows in.
    pub struct Source {
        /// Name, for records.
        name: Option<String> = [None] () "";
        /// A liquid in `materials`.
        material: String = [required] () "";
        /// The shape; it is kept full, and while liquid flows through it the grid keeps its velocity there, as a nozzle would.
        shape: Volume = [required] () "";
        /// Velocity of the liquid in it, in addition to that of the motion.
        velocity: Vector3<f64> = [required] (Velocity) "";
        /// When it flows; default: always.
        during: Option<Interval> = [None] (Time) "";
        /// Motion of the shape.
        motion: Script = [Script::still()] () "";
    }
}

section! {
    /// A shape in which liquid disappears (it is counted).
    pub struct Drain {
        /// Name, for records.
        name: Option<String> = [None] () "";
        /// The shape.
        shape: Volume = [required] () "";
        /// When; default: always.
        during: Option<Interval> = [None] (Time) "";
        /// Motion of the shape.
        motion: Script = [Script::still()] () "";
    }
}

choice! {
    /// The number of dimensions in which liquid moves.
    pub enum Dimensions {
        /// Space.
        Three;
        /// The x–y plane, one unit of length deep.
        Two;
    }
}

section! {
    /// A box outside which liquid is removed, or whose opposite sides are joined.
    pub struct Domain {
        /// Lowest corner.
        low: Vector3<f64> = [required] (Length) "";
        /// Highest corner.
        high: Vector3<f64> = [required] (Length) "";
        /// Directions in which what leaves on one side enters on the other: `X`, `Y`, `Z`.
        periodic: Vec<Axis> = [Vec::new()] () "The size in such a direction must be a whole number of cells.";
    }
}

choice! {
    /// How plastic flow is integrated over a step.
    pub enum FlowMap {
        /// Stress relaxed implicitly: first-order, never loses too much at large steps.
        Implicit;
        /// Elastic trial, then exact relaxation: loses stress when the step is long against relaxation.
        Split;
        /// Relaxation with the strain rate acting throughout.
        Forced;
    }
}

choice! {
    /// The matrix of the shear solve.
    pub enum ShearTangent {
        /// Symmetrised consistent tangent, with the safe one where it breaks down; iterated, at most four times, where the flow changes
        /// so much within a step that one linearisation could overshoot.
        Symmetric;
        /// Positive semidefinite always; iterated likewise.
        Safe;
        /// As `Symmetric` with up to twelve Newton iterations.
        Newton;
    }
}

choice! {
    /// Where the products of the shear solve take their material from.
    pub enum Operator {
        /// `Cells`, or `Particles` where elastic waves cross more than a cell in a step and `Cells` would not be stable.
        Automatic;
        /// From a few points in each cell, into which the particles are summed once per solve.
        Cells;
        /// From every particle every time: the reference, some tens of times slower.
        Particles;
    }
}

section! {
    /// The shear solve.
    pub struct ShearSolver {
        /// Where products take their material from.
        operator: Operator = [Operator::Automatic] () "";
        /// Matrix.
        tangent: ShearTangent = [ShearTangent::Symmetric] () "";
        /// Residual relative to the right-hand side.
        tolerance: f64 = [1e-6] (Number, above(0.0).up_to(0.1)) "";
        /// Iterations of the conjugate gradients.
        max_iterations: usize = [1000] (Number, at_least(1.0).up_to(1_000_000.0)) "";
    }
}

section! {
    /// The pressure solve.
    pub struct PressureSolver {
        /// Residual relative to the right-hand side.
        tolerance: f64 = [1e-8] (Number, above(0.0).up_to(0.1)) "Larger lets the volume drift.";
        /// Iterations of the conjugate gradients.
        max_iterations: usize = [1000] (Number, at_least(1.0).up_to(1_000_000.0)) "";
        /// Finds the pressure of the free motion before shear is solved for, so that walls do not drag on liquid at rest.
        prediction: bool = [true] () "Off saves a few pressure iterations; liquid that sticks to walls then creeps at up to g dt.";
        /// Projects once more at the end of the step.
        final_projection: bool = [false] () "";
    }
}

section! {
    /// Bulk liquid.
    pub struct Liquid {
        /// Size of a grid cell.
        cell: f64 = [required] (Length, above(0.0).up_to(100.0)) "Halving it costs eight times the memory and more than ten times the time.";
        /// Particles per full cell.
        particles_per_cell: usize = [64] (Number, at_least(1.0).up_to(4096.0)) "A power of the dimension (64 = 4³, 27, 8; 16 = 4² in two dimensions).";
        /// Dimensions.
        dimensions: Dimensions = [Dimensions::Three] () "";
        /// Box of the liquid; default: unbounded.
        domain: Option<Domain> = [None] () "";
        /// Liquid at the start.
        tanks: Vec<Tank> = [Vec::new()] () "";
        /// Where liquid flows in.
        sources: Vec<Source> = [Vec::new()] () "";
        /// Where liquid disappears.
        drains: Vec<Drain> = [Vec::new()] () "";
        /// Acceleration on the liquid only, in addition to gravity (drives a channel).
        body_force: Vector3<f64> = [Vector3::zeros()] (Acceleration) "";
        /// Integration of plastic flow.
        flow_map: FlowMap = [FlowMap::Implicit] () "";
        /// Shear solve.
        shear: ShearSolver = [blank] () "";
        /// Pressure solve.
        pressure: PressureSolver = [blank] () "";
        /// Fraction of the affine velocity lost per step.
        affine_damping: f64 = [0.0] (Number, at_least(0.0).up_to(1.0)) "For comparison with other codes; 0 is the model.";
        /// Fraction of the velocity lost per step.
        velocity_damping: f64 = [0.0] (Number, at_least(0.0).up_to(1.0)) "For comparison with other codes; 0 is the model.";
    }
}
