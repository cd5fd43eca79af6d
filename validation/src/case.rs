//! A case is a small experiment: parameters in, measured values beside their references out.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::{Map, Value};

/// One validation case: what it verifies, what may be changed, and how it is run.
#[derive(Clone, Copy)]
pub struct Case {
    /// Identity, `group/name`.
    pub id: &'static str,
    /// One sentence: what it verifies and where the reference comes from.
    pub about: &'static str,
    /// Parameters with their defaults; `--set name=value` changes any of them.
    pub params: &'static [Param],
    /// Runs the experiment for the given parameters, recomputing the reference for them.
    pub run: fn(&Params) -> Result<Outcome, CaseError>,
}

/// A parameter of a case.
#[derive(Clone, Copy, Debug)]
pub struct Param {
    /// Name for `--set`.
    pub name: &'static str,
    /// Value when not set.
    pub default: ParamDefault,
    /// Unit, `1` for pure numbers.
    pub unit: &'static str,
    /// Meaning, in a few words.
    pub meaning: &'static str,
}

/// The default value and with it the type of a parameter.
#[derive(Clone, Copy, Debug)]
pub enum ParamDefault {
    /// A finite real number.
    Number(f64),
    /// A non-negative whole number.
    Count(usize),
    /// A word.
    Text(&'static str),
    /// Yes or no.
    Flag(bool),
}

/// As it would be written after `--set name=`.
impl std::fmt::Display for ParamDefault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            ParamDefault::Number(x) => write!(f, "{x:?}"),
            ParamDefault::Count(n) => write!(f, "{n}"),
            ParamDefault::Text(t) => f.write_str(t),
            ParamDefault::Flag(b) => write!(f, "{b}"),
        }
    }
}

impl Param {
    /// A real parameter.
    #[must_use]
    pub const fn number(name: &'static str, default: f64, unit: &'static str, meaning: &'static str) -> Param {
        Param { name, default: ParamDefault::Number(default), unit, meaning }
    }

    /// A whole-number parameter.
    #[must_use]
    pub const fn count(name: &'static str, default: usize, meaning: &'static str) -> Param {
        Param { name, default: ParamDefault::Count(default), unit: "1", meaning }
    }

    /// A text parameter.
    #[must_use]
    pub const fn text(name: &'static str, default: &'static str, meaning: &'static str) -> Param {
        Param { name, default: ParamDefault::Text(default), unit: "1", meaning }
    }

    /// A yes-or-no parameter.
    #[must_use]
    pub const fn flag(name: &'static str, default: bool, meaning: &'static str) -> Param {
        Param { name, default: ParamDefault::Flag(default), unit: "1", meaning }
    }
}

/// Why a case could not be run. A case that ran and missed its tolerance is not an error.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    /// No case of that name.
    #[error("no validation case is called `{asked}`{}", nearest.as_ref().map(|n| format!("; did you mean `{n}`?")).unwrap_or_default())]
    UnknownCase {
        /// The name asked for.
        asked: String,
        /// The nearest name there is.
        nearest: Option<String>,
    },
    /// The case has no such parameter.
    #[error("case `{case}` has no parameter `{asked}`; it has: {known}")]
    UnknownParam {
        /// The case.
        case: String,
        /// The name asked for.
        asked: String,
        /// The names there are.
        known: String,
    },
    /// A parameter has the wrong type or is out of range.
    #[error("parameter `{name}` = {value}: expected {expected}")]
    BadParam {
        /// Parameter name.
        name: String,
        /// Value given.
        value: String,
        /// What would be accepted.
        expected: String,
    },
    /// A solver or a scene failed inside the case.
    #[error("the case could not be completed: {0}")]
    Failed(String),
}

impl CaseError {
    /// Wraps any error of a crate under test.
    pub fn failed(error: impl std::fmt::Display) -> CaseError {
        CaseError::Failed(error.to_string())
    }
}

#[derive(Clone, Debug, PartialEq)]
enum ParamValue {
    Number(f64),
    Count(usize),
    Text(String),
    Flag(bool),
}

/// The parameter values of one run of a case.
#[derive(Clone, Debug)]
pub struct Params {
    values: BTreeMap<&'static str, ParamValue>,
}

impl Params {
    /// Defaults of the case with the overrides applied.
    ///
    /// # Errors
    /// Unknown names and values of the wrong type are refused.
    pub fn for_case(case: &Case, overrides: &[(String, String)]) -> Result<Params, CaseError> {
        let mut values = BTreeMap::new();
        for param in case.params {
            let value = match param.default {
                ParamDefault::Number(x) => ParamValue::Number(x),
                ParamDefault::Count(n) => ParamValue::Count(n),
                ParamDefault::Text(t) => ParamValue::Text(t.to_owned()),
                ParamDefault::Flag(b) => ParamValue::Flag(b),
            };
            values.insert(param.name, value);
        }
        for (name, text) in overrides {
            let Some(param) = case.params.iter().find(|param| param.name == name) else {
                let known: Vec<_> = case.params.iter().map(|param| param.name).collect();
                return Err(CaseError::UnknownParam {
                    case: case.id.to_owned(),
                    asked: name.clone(),
                    known: if known.is_empty() { "none".to_owned() } else { known.join(", ") },
                });
            };
            values.insert(param.name, parse(param, text)?);
        }
        Ok(Params { values })
    }

    fn value(&self, name: &str) -> Result<&ParamValue, CaseError> {
        self.values
            .get(name)
            .ok_or_else(|| CaseError::Failed(format!("the case does not declare a parameter `{name}`")))
    }

    /// A real parameter.
    ///
    /// # Errors
    /// If the case does not declare it as a number.
    pub fn number(&self, name: &str) -> Result<f64, CaseError> {
        match self.value(name)? {
            ParamValue::Number(x) => Ok(*x),
            ParamValue::Count(n) => Ok(*n as f64),
            other => Err(bad(name, &format!("{other:?}"), "a number")),
        }
    }

    /// A real parameter within an inclusive range.
    ///
    /// # Errors
    /// Names the range when the value lies outside.
    pub fn number_in(&self, name: &str, low: f64, high: f64) -> Result<f64, CaseError> {
        let x = self.number(name)?;
        if x >= low && x <= high {
            Ok(x)
        } else {
            Err(bad(name, &x.to_string(), &format!("a number from {low} to {high}")))
        }
    }

    /// A real parameter above zero.
    ///
    /// # Errors
    /// When it is zero or negative.
    pub fn positive(&self, name: &str) -> Result<f64, CaseError> {
        let x = self.number(name)?;
        if x > 0.0 { Ok(x) } else { Err(bad(name, &x.to_string(), "a number above 0")) }
    }

    /// A whole-number parameter.
    ///
    /// # Errors
    /// If the case does not declare it as a count.
    pub fn count(&self, name: &str) -> Result<usize, CaseError> {
        match self.value(name)? {
            ParamValue::Count(n) => Ok(*n),
            other => Err(bad(name, &format!("{other:?}"), "a whole number")),
        }
    }

    /// A whole-number parameter within an inclusive range.
    ///
    /// # Errors
    /// Names the range when the value lies outside.
    pub fn count_in(&self, name: &str, low: usize, high: usize) -> Result<usize, CaseError> {
        let n = self.count(name)?;
        if (low..=high).contains(&n) {
            Ok(n)
        } else {
            Err(bad(name, &n.to_string(), &format!("a whole number from {low} to {high}")))
        }
    }

    /// A text parameter.
    ///
    /// # Errors
    /// If the case does not declare it as text.
    pub fn text(&self, name: &str) -> Result<&str, CaseError> {
        match self.value(name)? {
            ParamValue::Text(t) => Ok(t),
            other => Err(bad(name, &format!("{other:?}"), "a word")),
        }
    }

    /// A yes-or-no parameter.
    ///
    /// # Errors
    /// If the case does not declare it as a flag.
    pub fn flag(&self, name: &str) -> Result<bool, CaseError> {
        match self.value(name)? {
            ParamValue::Flag(b) => Ok(*b),
            other => Err(bad(name, &format!("{other:?}"), "true or false")),
        }
    }

    /// An error about a parameter, for checks that need more than a range.
    #[must_use]
    pub fn reject(&self, name: &str, expected: &str) -> CaseError {
        let value = self.values.get(name).map_or_else(|| "?".to_owned(), |value| json_of(value).to_string());
        bad(name, &value, expected)
    }

    /// The parameters as a JSON object, in name order.
    #[must_use]
    pub fn to_json(&self) -> Map<String, Value> {
        self.values.iter().map(|(name, value)| ((*name).to_owned(), json_of(value))).collect()
    }
}

fn json_of(value: &ParamValue) -> Value {
    match value {
        ParamValue::Number(x) => Value::from(*x),
        ParamValue::Count(n) => Value::from(*n),
        ParamValue::Text(t) => Value::from(t.clone()),
        ParamValue::Flag(b) => Value::from(*b),
    }
}

fn bad(name: &str, value: &str, expected: &str) -> CaseError {
    CaseError::BadParam { name: name.to_owned(), value: value.to_owned(), expected: expected.to_owned() }
}

fn parse(param: &Param, text: &str) -> Result<ParamValue, CaseError> {
    match param.default {
        ParamDefault::Number(_) => match text.parse::<f64>() {
            Ok(x) if x.is_finite() => Ok(ParamValue::Number(x)),
            _ => Err(bad(param.name, text, &format!("a finite number [{}]", param.unit))),
        },
        ParamDefault::Count(_) => {
            let whole = text.parse::<usize>().ok().or_else(|| {
                let x = text.parse::<f64>().ok()?;
                (x >= 0.0 && x.fract() == 0.0 && x < 1e15).then_some(x as usize)
            });
            whole.map(ParamValue::Count).ok_or_else(|| bad(param.name, text, "a non-negative whole number"))
        }
        ParamDefault::Text(_) => Ok(ParamValue::Text(text.trim_matches('"').to_owned())),
        ParamDefault::Flag(_) => {
            text.parse::<bool>().map(ParamValue::Flag).map_err(|_| bad(param.name, text, "true or false"))
        }
    }
}

/// A small table shown in the report.
#[derive(Clone, Debug, Serialize)]
pub struct Table {
    /// Heading.
    pub title: String,
    /// Column headings with units.
    pub columns: Vec<String>,
    /// Rows, already formatted.
    pub rows: Vec<Vec<String>>,
}

/// A figure shown in the report: several named series over one pair of axes.
#[derive(Clone, Debug, Serialize)]
pub struct Curve {
    /// Heading.
    pub title: String,
    /// Horizontal axis, with unit.
    pub x_label: String,
    /// Vertical axis, with unit.
    pub y_label: String,
    /// Logarithmic horizontal axis.
    pub log_x: bool,
    /// Logarithmic vertical axis.
    pub log_y: bool,
    /// Series: name and points.
    pub series: Vec<(String, Vec<[f64; 2]>)>,
}

#[derive(Clone, Debug)]
struct Measure {
    name: String,
    measured: f64,
    reference: Option<f64>,
    error: Option<f64>,
    tolerance: Option<f64>,
    absolute: bool,
    pass: bool,
    why: Option<String>,
}

/// What one run of a case found.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    measures: Vec<Measure>,
    skipped: Option<String>,
    /// Tables for the report.
    pub tables: Vec<Table>,
    /// Figures for the report.
    pub curves: Vec<Curve>,
    /// Remarks for the report.
    pub notes: Vec<String>,
}

impl Outcome {
    /// An outcome without measures.
    #[must_use]
    pub fn new() -> Outcome {
        Outcome::default()
    }

    /// A measured value beside its reference; the error is relative, absolute where the reference is zero.
    pub fn compare(&mut self, name: &str, measured: f64, reference: f64, tolerance: f64) {
        let absolute = reference == 0.0;
        let scale = if absolute { 1.0 } else { reference.abs() };
        self.push_compared(name, measured, reference, (measured - reference).abs() / scale, tolerance, absolute);
    }

    /// A measured value beside its reference, judged by the absolute difference.
    pub fn compare_absolute(&mut self, name: &str, measured: f64, reference: f64, tolerance: f64) {
        self.push_compared(name, measured, reference, (measured - reference).abs(), tolerance, true);
    }

    fn push_compared(&mut self, name: &str, measured: f64, reference: f64, error: f64, tolerance: f64, absolute: bool) {
        self.measures.push(Measure {
            name: name.to_owned(),
            measured,
            reference: Some(reference),
            error: Some(error),
            tolerance: Some(tolerance),
            absolute,
            pass: error <= tolerance, // false for NaN
            why: None,
        });
    }

    /// A value without a reference: passes when the condition holds; `why` states the condition in words.
    pub fn measure(&mut self, name: &str, measured: f64, condition: impl FnOnce(f64) -> bool, why: &str) {
        let pass = measured.is_finite() && condition(measured);
        self.measures.push(Measure {
            name: name.to_owned(),
            measured,
            reference: None,
            error: None,
            tolerance: None,
            absolute: false,
            pass,
            why: Some(why.to_owned()),
        });
    }

    /// A value that is only reported.
    pub fn info(&mut self, name: &str, measured: f64) {
        self.measures.push(Measure {
            name: name.to_owned(),
            measured,
            reference: None,
            error: None,
            tolerance: None,
            absolute: false,
            pass: true,
            why: None,
        });
    }

    /// The value of a measure, if there is one of that name.
    #[must_use]
    pub fn value(&self, name: &str) -> Option<f64> {
        self.measures.iter().find(|measure| measure.name == name).map(|measure| measure.measured)
    }

    /// Adds a table to the report.
    pub fn table(&mut self, table: Table) {
        self.tables.push(table);
    }

    /// Adds a figure to the report.
    pub fn curve(&mut self, curve: Curve) {
        self.curves.push(curve);
    }

    /// Adds a remark to the report.
    pub fn note(&mut self, text: impl Into<String>) {
        self.notes.push(text.into());
    }

    /// Marks the case as skipped: it neither passes nor fails.
    pub fn skip(&mut self, reason: impl Into<String>) {
        self.skipped = Some(reason.into());
    }

    /// The reason it was skipped.
    #[must_use]
    pub fn skipped(&self) -> Option<&str> {
        self.skipped.as_deref()
    }

    /// Whether every measure met its tolerance or condition, and there was at least one that could fail.
    #[must_use]
    pub fn passed(&self) -> bool {
        let judged = self.measures.iter().any(|m| m.reference.is_some() || m.why.is_some());
        self.skipped.is_none() && judged && self.measures.iter().all(|m| m.pass)
    }

    /// The measured value of that name.
    #[must_use]
    pub fn measured(&self, name: &str) -> Option<f64> {
        self.measures.iter().find(|m| m.name == name).map(|m| m.measured)
    }

    /// The measured values in one line, errors in brackets where there is a reference.
    #[must_use]
    pub fn one_line(&self) -> String {
        let show = |m: &Measure| match m.error {
            Some(error) => format!("{} {:.6e} ({error:.1e})", m.name, m.measured),
            None => format!("{} {:.6e}", m.name, m.measured),
        };
        let shown: Vec<String> = self.measures.iter().take(4).map(show).collect();
        let more = self.measures.len().saturating_sub(4);
        if more > 0 { format!("{}, and {more} more", shown.join(", ")) } else { shown.join(", ") }
    }

    /// One line for each measure that missed.
    #[must_use]
    pub fn failures(&self) -> Vec<String> {
        let describe = |m: &Measure| match (m.reference, m.error, m.tolerance, &m.why) {
            (Some(r), Some(e), Some(t), _) => {
                format!("{} = {:e}, reference {r:e}, error {e:.3e} > {t:.1e}", m.name, m.measured)
            }
            (_, _, _, Some(why)) => format!("{} = {:e}: expected {why}", m.name, m.measured),
            _ => format!("{} = {:e}", m.name, m.measured),
        };
        self.measures.iter().filter(|m| !m.pass).map(describe).collect()
    }

    /// The JSON object of the contract: measured, reference, error, tolerance, absolute, why, skipped.
    #[must_use]
    pub fn to_json(&self) -> Map<String, Value> {
        let number = |x: f64| if x.is_finite() { Value::from(x) } else { Value::from(x.to_string()) };
        let pick = |f: &dyn Fn(&Measure) -> Option<f64>| -> Value {
            let map: Map<String, Value> =
                self.measures.iter().filter_map(|m| f(m).map(|x| (m.name.clone(), number(x)))).collect();
            if map.is_empty() { Value::Null } else { Value::Object(map) }
        };
        let mut json = Map::new();
        json.insert("measured".into(), pick(&|m| Some(m.measured)));
        json.insert("reference".into(), pick(&|m| m.reference));
        json.insert("error".into(), pick(&|m| m.error));
        json.insert("tolerance".into(), pick(&|m| m.tolerance));
        let compared: Vec<_> = self.measures.iter().filter(|m| m.reference.is_some()).collect();
        if !compared.is_empty() && compared.iter().all(|m| m.absolute) {
            json.insert("absolute".into(), Value::Bool(true));
        } else if compared.iter().any(|m| m.absolute) {
            let names = compared.iter().filter(|m| m.absolute).map(|m| Value::from(m.name.clone())).collect();
            json.insert("absolute".into(), Value::Array(names));
        }
        let why: Vec<String> =
            self.measures.iter().filter_map(|m| m.why.as_ref().map(|why| format!("{}: {why}", m.name))).collect();
        if !why.is_empty() {
            json.insert("why".into(), Value::from(why.join("; ")));
        }
        if let Some(reason) = &self.skipped {
            json.insert("skipped".into(), Value::from(reason.clone()));
        }
        json
    }
}
