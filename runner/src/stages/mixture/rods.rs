//! Steps 4 and 17: the rods' implicit solve without contact.

use rods::{Loads, RodError, RodReport, RodSet};

use crate::stages::Step;
use crate::system::{Element, Rejection, RejectionReason};
use crate::world::{StrandWorld, World};

/// Solves the rods' step as if nothing touched.
pub fn solve_free(world: &mut World, step: Step) -> Result<(), Rejection> {
    let World { strands: Some(strands), film, submersion, gravity, .. } = world else { return Ok(()) };
    let loads = film.as_ref().map_or(Loads::gravity(*gravity), |film| film.loads(*gravity));
    let loads = submersion.as_ref().map_or(loads, |submersion| submersion.add_to(loads));
    strands.report = solve(strands, &world.state.rods, step.dt, &loads)?;
    Ok(())
}

/// Solves the rods' step under the given loads.
pub fn solve(strands: &mut StrandWorld, rods: &RodSet, dt: f64, loads: &Loads<'_>) -> Result<RodReport, Rejection> {
    let report = strands.stepper.solve(rods, dt, loads, &strands.boundary).map_err(|error| rejection(&error))?;
    if let Some((strand, vertex, turn)) = strands.turned_too_far(rods, dt) {
        let element = Some(Element::StrandVertex { strand, vertex });
        let detail = format!("an edge turned by {turn:.2} rad, {:.2} are allowed", strands.turn_limit);
        return Err(Rejection { stage: "mixture", reason: RejectionReason::TooLargeMotion, element, detail });
    }
    Ok(report)
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
