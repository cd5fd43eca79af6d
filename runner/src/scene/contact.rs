//! Frictional contact of strands with each other and with solids.

use super::declare::{choice, section};
use super::quantity::{above, at_least};

choice! {
    /// The solver of the contact problem.
    pub enum ContactSolver {
        /// Starts with the cheapest and hands over by measured progress.
        Auto;
        /// Block Gauss–Seidel with an exact local solver.
        GaussSeidel;
        /// Nonsmooth Newton on all contacts at once.
        Newton;
        /// Alternating directions with one reused factorisation.
        Admm;
    }
}

choice! {
    /// What to do when a contact problem is not solved to its tolerance.
    pub enum ContactFailure {
        /// Take the best iterate, record a warning, go on.
        Continue;
        /// Reject the step (it is halved); stop after six.
        Reject;
    }
}

section! {
    /// How contacts are found.
    pub struct Detection {
        /// Looks along the whole motion of a step, so that fast strands do not pass through each other.
        continuous: bool = [true] () "";
        /// Contacts are kept in view within this many radii beyond touching.
        margin: f64 = [0.5] (Number, at_least(0.0).up_to(10.0)) "";
        /// Most contacts per edge; the deepest are kept.
        max_per_edge: usize = [6] (Number, at_least(1.0).up_to(64.0)) "";
        /// Edges of one strand that are nearer than this many radii along it do not touch each other.
        self_distance: f64 = [4.0] (Number, at_least(1.0).up_to(1e6)) "";
    }
}

section! {
    /// Frictional contact. Active as soon as the scene has more than one strand, or strands and solids.
    pub struct Contact {
        /// Solver.
        solver: ContactSolver = [ContactSolver::Auto] () "";
        /// Natural-map residual, relative.
        tolerance: f64 = [1e-6] (Number, above(0.0).up_to(0.1)) "Smaller is slower; see the figure of error against tolerance.";
        /// Iterations of Gauss–Seidel and ADMM (Newton takes a twentieth).
        max_iterations: usize = [2000] (Number, at_least(1.0).up_to(10_000_000.0)) "";
        /// How often the strands' forces are linearised anew within one step.
        relinearisations: usize = [1] (Number, at_least(1.0).up_to(100.0)) "More for large motions under contact; each costs a rod and a contact solve.";
        /// Contact between strands.
        strand_strand: bool = [true] () "";
        /// Contact of strands with solids.
        strand_solid: bool = [true] () "";
        /// Wet contacts also resist sliding as the liquid between them flows (a Herschel–Bulkley law beside Coulomb's).
        wet_friction: bool = [false] () "The elastic stress of the film may then count twice.";
        /// Detection.
        detection: Detection = [blank] () "";
        /// When the tolerance is not reached.
        on_failure: ContactFailure = [ContactFailure::Continue] () "";
        /// Leaves the contact problem of every so many steps in the run's folder, as `contact-problem-STEP.ron`.
        save_every: Option<u64> = [None] (Number, above(0.0)) "Large: some megabytes for a thousand contacts. `viscose contact` solves them.";
    }
}
