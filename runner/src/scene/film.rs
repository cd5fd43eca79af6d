//! The liquid film on strands.

use super::declare::{choice, section};
use super::quantity::{above, at_least};
use super::strands::Along;

choice! {
    /// What happens to the film at the two ends of a strand.
    pub enum FilmEnds {
        /// Nothing passes; liquid gathers in a reservoir at the end, from which drops fall.
        Closed;
        /// Liquid leaves freely and is counted.
        Open;
    }
}

section! {
    /// The film on the strands of a group.
    pub struct StrandFilm {
        /// A liquid in `materials`; default: the only one there is.
        material: Option<String> = [None] () "";
        /// Height at the start.
        height: Along = [Along::Constant(0.0)] (Length, at_least(0.0).up_to(0.1)) "";
        /// Navier slip length on the strand.
        slip_length: f64 = [2e-6] (Length, at_least(0.0).up_to(0.1)) "More slip lets thin films run faster.";
        /// At the ends.
        ends: FilmEnds = [FilmEnds::Closed] () "";
    }
}

choice! {
    /// How the film's friction on the strand follows from its velocity.
    pub enum WallLaw {
        /// Exact for a plane film of a yield-stress fluid.
        Lubrication;
        /// As printed in the paper: stops too early for yield-stress fluids; for comparison with it.
        Paper;
    }
}

choice! {
    /// How the film is carried along.
    pub enum FilmAdvection {
        /// Finite volumes: conserves and stays positive.
        Conservative;
        /// Back-traced values, then rescaled; for comparison with the reference code.
        SemiLagrangian;
    }
}

choice! {
    /// The form of the inertia that a flowing film adds to its strand.
    pub enum FlowInertia {
        /// As an additional force.
        Force;
        /// As momentum carried over.
        Transfer;
    }
}

section! {
    /// How films are computed.
    pub struct FilmModel {
        /// Friction on the strand.
        wall: WallLaw = [WallLaw::Lubrication] () "";
        /// Transport.
        advection: FilmAdvection = [FilmAdvection::Conservative] () "";
        /// Inertia on the strand.
        inertia: FlowInertia = [FlowInertia::Force] () "";
        /// Largest slope of the film surface.
        steepness: f64 = [1.0] (Number, above(0.0).up_to(100.0)) "Smaller smooths bulges more.";
        /// Film heights below this many strand radii count as dry.
        dry_height: f64 = [1e-6] (Number, at_least(0.0).below(1.0)) "";
        /// A strand's film drips where its height exceeds this many strand radii; default: by the balance of weight and surface tension.
        drip_height: Option<f64> = [None] (Number, above(0.0)) "";
    }
}
