//! Time span, step control, and how the rods' equations are solved.

use super::declare::{choice, section};
use super::quantity::{above, at_least};
use std::f64::consts::PI;

/// Default of the largest turn of an edge in one step: 6°, chosen from error against cost (docs/decisions/rod-step.md).
const TURN: f64 = PI / 30.0;

section! {
    /// Steps as large as every active component allows.
    pub struct AdaptiveStep {
        /// Largest step.
        max: f64 = [required] (Time, above(0.0)) "The error of the time integration follows it.";
        /// Smallest step; below it the run stops with an error. Default: a millionth of `max`.
        min: Option<f64> = [None] (Time, above(0.0)) "";
        /// Cells a liquid particle, or radii a strand vertex under contact, may cross in one step.
        cfl: f64 = [1.0] (Number, above(0.0).up_to(10.0)) "Above 1 faster and less exact.";
        /// Largest deformation of a liquid particle in one step (norm of the velocity gradient times the step).
        deformation: f64 = [0.5] (Number, above(0.0).up_to(1.0)) "";
        /// Largest turn of an edge in one step.
        turn: f64 = [TURN] (Angle, above(0.0).up_to(PI)) "Smaller is more accurate (the default for a few per cent, see docs/decisions/rod-step.md); a step that turned twice as far, and more than 30°, is repeated.";
        /// How fast the step may grow again after a rejected one.
        growth: f64 = [1.5] (Number, at_least(1.0).up_to(10.0)) "";
    }
}

choice! {
    /// How the step is chosen. A rejected step is repeated with half the size, at most six times.
    pub enum StepControl {
        /// Always the same.
        Fixed(f64) (Time, above(0.0));
        /// As large as is sound.
        Adaptive(AdaptiveStep) ();
    }
}

choice! {
    /// The time integrator of the strands.
    pub enum Integrator {
        /// First order, damps; never gains energy.
        ImplicitEuler;
        /// Second order, damps high frequencies only.
        Bdf2;
        /// Second order, conserves.
        ImplicitMidpoint;
    }
}

section! {
    /// The time span of the run.
    pub struct TimeSpan {
        /// When it ends; it starts at 0.
        end: f64 = [required] (Time, above(0.0)) "";
        /// Step control.
        step: StepControl = [required] () "";
        /// Time integrator of the strands.
        integrator: Integrator = [Integrator::ImplicitEuler] () "";
    }
}

impl TimeSpan {
    /// No time span: none was written.
    #[must_use]
    pub fn left_open() -> TimeSpan {
        TimeSpan { end: 0.0, step: StepControl::Fixed(0.0), integrator: Integrator::ImplicitEuler }
    }

    /// Whether none was written.
    #[must_use]
    pub fn is_left_open(&self) -> bool {
        self.end == 0.0
    }
}

choice! {
    /// The matrix of the rods' Newton iteration.
    pub enum RodHessian {
        /// The exact one while it is positive definite, then ever safer ones.
        Auto;
        /// Always exact, shifted where it is indefinite.
        Exact;
        /// Each element projected to be positive semidefinite.
        Projected;
        /// Without the second derivatives of the strains.
        GaussNewton;
    }
}

section! {
    /// How the rods' equations are solved.
    pub struct RodSolver {
        /// Residual at which Newton stops, relative to the scale of the problem.
        tolerance: f64 = [1e-8] (Number, at_least(1e-12).up_to(1e-3)) "Smaller costs an iteration or two more.";
        /// Newton iterations after which the step is rejected.
        max_iterations: usize = [100] (Number, at_least(1.0).up_to(10_000.0)) "Four are usual; snaps and releases take dozens.";
        /// Matrix.
        hessian: RodHessian = [RodHessian::Auto] () "";
    }
}

section! {
    /// How strands and bulk liquid are solved against each other.
    pub struct CouplingSolver {
        /// How often strands and liquid are solved in a step, at most.
        iterations: usize = [1] (Number, at_least(1.0).up_to(1000.0)) "1: one after the other, what the liquid's stress answers is felt one step later. More cost a shear and a pressure solve each; strands that fill half of a cell or hang in a stiff liquid need them.";
        /// Change of velocities at which it is enough, relative to the largest velocity.
        tolerance: f64 = [1e-3] (Number, above(0.0).up_to(1.0)) "";
    }
}

section! {
    /// Solvers.
    pub struct Solver {
        /// Of the rods.
        rods: RodSolver = [blank] () "";
        /// Of strands and liquid together.
        coupling: CouplingSolver = [blank] () "";
    }
}

choice! {
    /// A component that can be switched off.
    pub enum Component {
        /// Transport of liquid particles.
        Advection;
        /// The liquid's pressure.
        Pressure;
        /// Splitting, merging and relaxing particles.
        Resampling;
        /// The liquid's shear stress.
        Shear;
        /// The liquid's plastic flow.
        PlasticFlow;
        /// Varying compressibility.
        Compressibility;
        /// Contact between strands and of strands with solids.
        StrandContact;
        /// Capillary bridges.
        Cohesion;
        /// Friction in contacts.
        Friction;
        /// Transport of films.
        FilmAdvection;
        /// Shear stress in films.
        FilmShear;
        /// Plastic flow in films.
        FilmPlasticFlow;
        /// Inertia of films on their strands.
        FlowInertia;
        /// Capture of liquid by strands.
        Capture;
        /// Drag between strands and liquid.
        Drag;
        /// Dripping.
        Dripping;
        /// Varying volume fraction of liquid among strands.
        VolumeFraction;
    }
}
