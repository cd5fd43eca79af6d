//! Steps 4 and 17: the rods' implicit solve without contact.

use rods::{Loads, RodError};

use crate::stages::Step;
use crate::system::{Element, Rejection, RejectionReason};
use crate::world::World;

/// Solves the rods' step as if nothing touched.
pub fn solve_free(world: &mut World, step: Step) -> Result<(), Rejection> {
    let World { strands: Some(strands), film, gravity, .. } = world else { return Ok(()) };
    let loads = film.as_ref().map_or(Loads::gravity(*gravity), |film| film.loads(*gravity));
    let rods = &world.state.rods;
    strands.report =
        strands.stepper.solve(rods, step.dt, &loads, &strands.boundary).map_err(|error| rejection(&error))?;
    if let Some((strand, vertex, turn)) = strands.turned_too_far(rods, step.dt) {
        let element = Some(Element::StrandVertex { strand, vertex });
        let detail = format!("an edge turned by {turn:.2} rad, {:.2} are allowed", strands.turn_limit);
        return Err(Rejection { stage: "mixture", reason: RejectionReason::TooLargeMotion, element, detail });
    }
    Ok(())
}

/// A rod error as a rejection that names its place.
pub fn rejection(error: &RodError) -> Rejection {
    let (reason, strand, vertex) = match error {
        RodError::NotConverged { strand, vertex, .. } => (RejectionReason::NotConverged, Some(*strand), *vertex),
        RodError::NonFinite { strand, vertex, .. } => (RejectionReason::NonFinite, Some(*strand), *vertex),
        RodError::Folded { strand, vertex } => (RejectionReason::TooLargeMotion, Some(*strand), *vertex),
        _ => (RejectionReason::Infeasible, None, 0),
    };
    let element = strand.map(|strand| Element::StrandVertex { strand, vertex });
    Rejection { stage: "mixture", reason, element, detail: error.to_string() }
}
