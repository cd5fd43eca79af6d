//! Runs a case and turns what it found into a verdict and one line of JSON.

use std::time::Instant;

use serde_json::{Map, Value};

use crate::case::{Case, CaseError, Outcome, Params};
use crate::cases;

/// A finished case.
#[derive(Clone, Debug)]
pub struct CaseResult {
    /// The case's id.
    pub case: &'static str,
    /// Parameters as run.
    pub params: Map<String, Value>,
    /// What it found.
    pub outcome: Outcome,
    /// Wall-clock seconds.
    pub seconds: f64,
}

impl CaseResult {
    /// The line of the contract for `viscose validate --json`.
    #[must_use]
    pub fn to_json(&self) -> Value {
        let mut json = Map::new();
        json.insert("case".into(), Value::from(self.case));
        json.insert("params".into(), Value::Object(self.params.clone()));
        json.extend(self.outcome.to_json());
        json.insert("seconds".into(), Value::from(self.seconds));
        if self.outcome.skipped().is_none() {
            json.insert("pass".into(), Value::from(self.outcome.passed()));
        }
        Value::Object(json)
    }
}

/// Finds a case by its id.
///
/// # Errors
/// Names the nearest id when there is none of that name.
pub fn find(id: &str) -> Result<Case, CaseError> {
    let all = cases::all();
    all.iter().find(|case| case.id == id).copied().ok_or_else(|| {
        let nearest = all.iter().map(|case| (edit_distance(case.id, id), case.id)).min();
        let nearest = nearest.filter(|(distance, _)| *distance <= id.len() / 2).map(|(_, name)| name.to_owned());
        CaseError::UnknownCase { asked: id.to_owned(), nearest }
    })
}

/// Runs one case with overrides.
///
/// # Errors
/// Unknown or bad parameters, or a failure inside the case.
pub fn run_case(case: &Case, overrides: &[(String, String)]) -> Result<CaseResult, CaseError> {
    let params = Params::for_case(case, overrides)?;
    let start = Instant::now();
    // Inside the pool: from outside it every parallel loop would be handed over and waited for.
    let outcome = rayon::scope(|_| (case.run)(&params))?;
    Ok(CaseResult { case: case.id, params: params.to_json(), outcome, seconds: start.elapsed().as_secs_f64() })
}

fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, cb) in b.iter().enumerate() {
            let substituted = diagonal + usize::from(ca != *cb);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(row[j] + 1).min(row[j + 1] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Param;

    fn probe(params: &Params) -> Result<Outcome, CaseError> {
        let mut out = Outcome::new();
        out.compare("value", params.positive("x")?, 2.0, 1e-9);
        Ok(out)
    }

    const PROBE: Case =
        Case { id: "test/probe", about: "", params: &[Param::number("x", 2.0, "m", "a length")], run: probe };

    #[test]
    fn defaults_pass_and_a_changed_value_fails_with_its_error() {
        assert!(run_case(&PROBE, &[]).unwrap().outcome.passed());
        let result = run_case(&PROBE, &[("x".into(), "3".into())]).unwrap();
        assert!(!result.outcome.passed());
        let json = result.to_json();
        assert_eq!(json["pass"], Value::Bool(false));
        assert_eq!(json["error"]["value"], Value::from(0.5));
    }

    #[test]
    fn unknown_names_and_bad_values_are_refused() {
        let refused =
            |name: &str, value: &str| run_case(&PROBE, &[(name.into(), value.into())]).unwrap_err().to_string();
        assert!(refused("y", "1").contains("it has: x"));
        assert!(refused("x", "NaN").contains("finite number [m]"));
        assert!(refused("x", "-1").contains("above 0"));
    }

    #[test]
    fn a_non_finite_measure_never_passes() {
        let mut out = Outcome::new();
        out.compare("value", f64::NAN, 1.0, 1e9);
        assert!(!out.passed());
        let mut out = Outcome::new();
        out.measure("value", f64::NAN, |_| true, "always");
        assert!(!out.passed());
    }

    #[test]
    fn edit_distance_counts_single_changes() {
        assert_eq!(edit_distance("rods/spin", "rods/spin"), 0);
        assert_eq!(edit_distance("rods/spni", "rods/spin"), 2);
        assert_eq!(edit_distance("", "abc"), 3);
    }
}
