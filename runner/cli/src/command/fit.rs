//! `viscose fit FLOWCURVE.csv`: yield stress, consistency and index from rheometer data.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use constitutive::fit::{Estimate, FitSettings, FlowModel, fit_flow_curve};
use miette::{IntoDiagnostic, WrapErr};

use super::Exit;
use crate::out::say;

/// Arguments of `viscose fit`.
#[derive(Args)]
pub struct Fit {
    /// Table of shear rate [1/s] and shear stress [Pa], comma-separated; a header line is skipped, other columns are ignored.
    pub file: PathBuf,
    /// Model [default: the one the data support best].
    #[arg(long)]
    pub model: Option<Model>,
    /// Confidence level of the intervals.
    #[arg(long, default_value_t = 0.95)]
    pub confidence: f64,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

/// A flow model.
#[derive(Clone, Copy, ValueEnum)]
pub enum Model {
    Newtonian,
    PowerLaw,
    Bingham,
    HerschelBulkley,
}

impl Fit {
    /// Fits the data.
    pub fn run(self) -> miette::Result<Exit> {
        let (rates, stresses) = read(&self.file)?;
        let model = self.model.map(|model| match model {
            Model::Newtonian => FlowModel::Newtonian,
            Model::PowerLaw => FlowModel::PowerLaw,
            Model::Bingham => FlowModel::Bingham,
            Model::HerschelBulkley => FlowModel::HerschelBulkley,
        });
        let settings = FitSettings { model, confidence: self.confidence, ..FitSettings::default() };
        let fit = fit_flow_curve(&rates, &stresses, &settings)
            .into_diagnostic()
            .wrap_err_with(|| self.file.display().to_string())?;
        if self.json {
            say!("{}", serde_json::to_string(&fit).into_diagnostic()?);
            return Ok(Exit::Done);
        }
        say!("{} ({} points, {} outliers)", fit.model.name(), fit.points.len(), fit.outliers());
        let show = |name: &str, estimate: &Estimate, unit: &str| {
            let interval = match (estimate.fitted, estimate.high) {
                (false, _) => "fixed by the model".to_owned(),
                (true, Some(high)) => {
                    format!("{:.0} % interval {:.6} to {high:.6}", 100.0 * fit.confidence, estimate.low)
                }
                (true, None) => "too few points for an interval".to_owned(),
            };
            say!("  {name:14} {:>12.6} {unit:7} {interval}", estimate.value);
        };
        show("yield stress", &fit.yield_stress, "Pa");
        show("consistency", &fit.consistency, "Pa·sⁿ");
        show("index", &fit.index, "");
        say!("  relative error {:>12.3e}  (root mean square)", fit.rms);
        say!(
            "in a scene: flow: Rheometer(yield_stress: {:.6}, consistency: {:.6}, index: {:.6})",
            fit.yield_stress.value,
            fit.consistency.value,
            fit.index.value
        );
        Ok(Exit::Done)
    }
}

/// Two columns of numbers; lines that begin with `#` and one header line are skipped.
fn read(path: &std::path::Path) -> miette::Result<(Vec<f64>, Vec<f64>)> {
    let text = std::fs::read_to_string(path).into_diagnostic().wrap_err_with(|| path.display().to_string())?;
    let (mut rates, mut stresses) = (Vec::new(), Vec::new());
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let mut cells = line.split([',', ';', '\t']).map(|cell| cell.trim().parse::<f64>());
        match (cells.next(), cells.next()) {
            (Some(Ok(rate)), Some(Ok(stress))) => {
                rates.push(rate);
                stresses.push(stress);
            }
            _ if rates.is_empty() && index < 3 => {} // header
            _ => {
                return Err(miette::miette!(
                    help = "each line needs a shear rate [1/s] and a shear stress [Pa], such as `0.1, 23.5`",
                    "{}:{}: `{line}` does not start with two numbers",
                    path.display(),
                    index + 1
                ));
            }
        }
    }
    Ok((rates, stresses))
}
