//! The liquid film on strands.

use super::declare::{choice, section};
use super::quantity::at_least;
use super::strands::Along;

choice! {
    /// What happens to the film at the two ends of a strand.
    pub enum FilmEnds {
        /// Closed where the end is clamped; at free ends liquid gathers in a reservoir, from which drops fall.
        Drip;
        /// Nothing passes at either end.
        Closed;
        /// Liquid leaves freely at both ends and is counted.
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
        ends: FilmEnds = [FilmEnds::Drip] () "";
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
        /// As an additional force, from the volumes that crossed the edges: conserves momentum.
        Force;
        /// As momentum carried over with those volumes: the same to round-off.
        Transfer;
        /// As printed in the paper, back-traced: does not conserve momentum.
        BackTraced;
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
        /// A bulge is steep where its cross-section, strand included, is this many times the mean of its neighbours'; inflow from both sides is then evened out.
        steepness: f64 = [10.0] (Number, at_least(2.0).up_to(1e9)) "Smaller smooths bulges more; 1e9: never.";
        /// Film heights below this many strand radii count as dry.
        dry_height: f64 = [1e-6] (Number, at_least(0.0).below(1e-3)) "";
        /// Diameter of the drops that fall from reservoirs where there is no bulk liquid; default: by the balance of weight and surface tension (Tate's law).
        drop_diameter: Option<f64> = [None] (Length, at_least(0.0).up_to(0.1)) "0: everything falls at once.";
    }
}
