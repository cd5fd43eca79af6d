//! Cases of strands and bulk liquid together, each a small scene run whole.

mod drag;
mod exchange;
mod porous;
mod sink;
mod volume;

use crate::case::{Case, CaseError};
use crate::hard::SceneRun;

/// The cases of this group.
#[must_use]
pub fn cases() -> Vec<Case> {
    vec![
        drag::TWO_WAY,
        volume::VOLUME_FRACTION,
        exchange::WETTING_MASS,
        exchange::DIP_AND_PULL,
        sink::YIELD_STICK,
        sink::TERMINAL_VELOCITY,
        porous::HYDROSTATIC,
        porous::INCOMPRESSIBLE_LIMIT,
    ]
}

/// Runs a scene that has to come to its end.
fn whole(text: &str, name: &str) -> Result<SceneRun, CaseError> {
    let run = SceneRun::of(text, name, &[])?;
    if run.completed() == 1.0 { Ok(run) } else { Err(CaseError::Failed(format!("{name}: {:?}", run.ending))) }
}

/// Largest magnitude in a column.
fn largest(run: &SceneRun, name: &str) -> Result<f64, CaseError> {
    Ok(run.series.column(name)?.iter().fold(0.0, |most: f64, x| most.max(x.abs())))
}

/// Last value of a column.
fn last(run: &SceneRun, name: &str) -> Result<f64, CaseError> {
    run.series.column(name)?.last().copied().ok_or_else(|| CaseError::Failed("the series is empty".to_owned()))
}
