//! `viscose validate [CASE…]`: measured values beside their references.

use std::path::PathBuf;

use clap::Args;
use miette::IntoDiagnostic;
use validation::{Case, CaseResult};

use super::Exit;
use crate::out::say;

/// Arguments of `viscose validate`.
#[derive(Args)]
pub struct Validate {
    /// Cases to run, by id or group (`rods`, `rods/helix`) [default: all].
    pub cases: Vec<String>,
    /// List the cases with their parameters instead of running them.
    #[arg(long)]
    pub list: bool,
    /// Change a parameter; the reference is recomputed for it.
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub set: Vec<String>,
    /// Print one JSON object a case.
    #[arg(long)]
    pub json: bool,
    /// Also write a page with tables and figures of every case.
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// Threads to use [default: all cores].
    #[arg(long)]
    pub threads: Option<usize>,
}

impl Validate {
    /// Runs or lists the cases.
    pub fn run(self) -> miette::Result<Exit> {
        super::run::set_threads(self.threads)?;
        let cases = self.chosen()?;
        if self.list {
            for case in &cases {
                say!("{}\n    {}", case.id, case.about);
                for param in case.params {
                    let unit = if param.unit == "1" { String::new() } else { format!(" [{}]", param.unit) };
                    say!("    --set {}={}{unit}  {}", param.name, param.default, param.meaning);
                }
            }
            return Ok(Exit::Done);
        }
        let overrides = overrides(&self.set)?;
        if !overrides.is_empty() && cases.len() > 1 {
            return Err(miette::miette!(
                help = "name one case: `viscose validate rods/cantilever-heavy --set gamma=20`",
                "--set changes the parameters of one case, and {} were chosen",
                cases.len()
            ));
        }
        let mut results = Vec::new();
        let mut failed = 0;
        for case in &cases {
            match validation::run_case(case, &overrides) {
                Ok(result) => {
                    failed += usize::from(!result.outcome.passed() && result.outcome.skipped().is_none());
                    self.show(&result);
                    results.push(result);
                }
                Err(error @ (validation::CaseError::UnknownParam { .. } | validation::CaseError::BadParam { .. })) => {
                    return Err(error).into_diagnostic();
                }
                Err(error) => {
                    failed += 1;
                    if self.json {
                        say!("{}", serde_json::json!({ "case": case.id, "error": error.to_string(), "pass": false }));
                    } else {
                        say!("FAIL {:32} {error}", case.id);
                    }
                }
            }
        }
        if let Some(path) = &self.report {
            validation::report::write(&results, path).into_diagnostic()?;
        }
        let skipped = results.iter().filter(|r| r.outcome.skipped().is_some()).count();
        if !self.json {
            say!(
                "{} cases: {} passed, {failed} failed, {skipped} skipped",
                cases.len(),
                cases.len() - failed - skipped
            );
        }
        Ok(if failed == 0 { Exit::Done } else { Exit::Failed })
    }

    fn chosen(&self) -> miette::Result<Vec<Case>> {
        let all = validation::cases::all();
        if self.cases.is_empty() {
            return Ok(all);
        }
        let mut chosen = Vec::new();
        for name in &self.cases {
            let group = format!("{}/", name.trim_end_matches('/'));
            let members: Vec<Case> = all.iter().filter(|case| case.id.starts_with(&group)).copied().collect();
            if members.is_empty() {
                chosen.push(validation::run::find(name).into_diagnostic()?);
            } else {
                chosen.extend(members);
            }
        }
        Ok(chosen)
    }

    fn show(&self, result: &CaseResult) {
        if self.json {
            say!("{}", result.to_json());
            return;
        }
        if let Some(reason) = result.outcome.skipped() {
            say!("skip {:32} {reason}", result.case);
            return;
        }
        let verdict = if result.outcome.passed() { "ok  " } else { "FAIL" };
        say!("{verdict} {:32} {:7.2} s  {}", result.case, result.seconds, result.outcome.one_line());
        for failure in result.outcome.failures() {
            say!("       {failure}");
        }
    }
}

fn overrides(set: &[String]) -> miette::Result<Vec<(String, String)>> {
    let split =
        |text: &String| text.split_once('=').map(|(name, value)| (name.trim().to_owned(), value.trim().to_owned()));
    set.iter().map(|text| split(text).ok_or_else(|| miette::miette!("--set {text}: expected NAME=VALUE"))).collect()
}
