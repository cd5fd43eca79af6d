//! Reference trajectories of the independent implementation.

use serde_json::Value;
use yarn::scenes::two_yarns;

use super::setup::build;
use crate::case::{Case, CaseError, Outcome, Param, Params};

/// Reference trajectories.
pub const CASE: Case = Case {
    id: "yarn/reference",
    about: "Two yarns, three circles and an attractor for 200 steps, against an independent implementation, with the corrected or the printed law.",
    params: &[Param::text("law", "corrected", "corrected or printed")],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    super::setup::alone(|| experiment(p))
}

fn experiment(p: &Params) -> Result<Outcome, CaseError> {
    let (printed, text) = match p.text("law")? {
        "corrected" => (false, include_str!("../../../data/yarn/two_yarns_200.json")),
        "printed" => (true, include_str!("../../../data/yarn/two_yarns_200_printed.json")),
        _ => return Err(p.reject("law", "`corrected` or `printed`")),
    };
    let document: Value = serde_json::from_str(text).map_err(CaseError::failed)?;
    let mut system = build(&two_yarns(printed))?;
    let mut out = Outcome::new();
    let (mut step, mut position, mut velocity) = (0, 0.0f64, 0.0f64);
    for snapshot in document["snapshots"].as_array().map_or(&[][..], Vec::as_slice) {
        while step < snapshot["step"].as_u64().unwrap_or(0) {
            system.advance(1e-4).map_err(CaseError::failed)?;
            step += 1;
        }
        position = position.max(difference(&snapshot["x2"], &system.state().position));
        velocity = velocity.max(difference(&snapshot["v2"], &system.state().velocity));
    }
    out.compare_absolute("position", position, 0.0, 1e-10);
    out.compare_absolute("velocity", velocity, 0.0, 1e-10);
    out.measure("steps", step as f64, |n| n == 200.0, "the data reach step 200");
    Ok(out)
}

/// Largest difference between stored vectors (yarn, vertex, component) and ours; NaN where the counts differ.
fn difference(stored: &Value, ours: &[nalgebra::SVector<f64, 2>]) -> f64 {
    let flat: Vec<f64> = stored
        .as_array()
        .into_iter()
        .flatten()
        .flat_map(|yarn| yarn.as_array().into_iter().flatten())
        .flat_map(|vertex| vertex.as_array().into_iter().flatten())
        .filter_map(Value::as_f64)
        .collect();
    if flat.len() != 2 * ours.len() {
        return f64::NAN;
    }
    flat.iter().zip(ours.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
