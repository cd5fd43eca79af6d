//! Many samples of one recipe in parallel: means with error bars, and the comparison of two recipes.

use super::result::Summary;
use super::rheometer::Rheometer;
use super::settings::MicrogelSettings;
use crate::error::GranularError;
use crate::statistics::{Estimate, Welch, estimate, welch};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Results of all seeds, in the order of the seeds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ensemble {
    /// One summary per seed that finished.
    pub runs: Vec<Summary>,
    /// Seeds that failed, with the reason.
    pub failed: Vec<(u64, String)>,
    /// G′ by the headline measure [Pa].
    pub g_prime: Estimate,
    /// G″ by the headline measure [Pa].
    pub g_double_prime: Estimate,
}

/// A figure over all samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FigureEstimate {
    /// Name, as in records.
    pub name: String,
    /// Unit; `1` for pure numbers.
    pub unit: String,
    /// Mean over the samples with its uncertainty.
    pub estimate: Estimate,
}

/// Figures over all samples that have them, in the order of the first; none for oscillations.
pub fn figures(runs: &[Summary]) -> Vec<FigureEstimate> {
    let Some(first) = runs.first() else { return Vec::new() };
    let of = |name: &str| -> Vec<f64> {
        runs.iter()
            .flat_map(|run| &run.figures)
            .filter(|figure| figure.name == name)
            .map(|figure| figure.value)
            .collect()
    };
    first
        .figures
        .iter()
        .map(|f| FigureEstimate { name: f.name.clone(), unit: f.unit.clone(), estimate: estimate(&of(&f.name)) })
        .collect()
}

impl Ensemble {
    /// Gathers finished runs.
    pub fn new(runs: Vec<Summary>, failed: Vec<(u64, String)>) -> Self {
        let values = |f: fn(&Summary) -> f64| runs.iter().map(f).collect::<Vec<f64>>();
        let (p, q) = (values(|s| s.g_prime), values(|s| s.g_double_prime));
        Self { g_prime: estimate(&p), g_double_prime: estimate(&q), runs, failed }
    }

    /// Estimate of any figure of the runs.
    pub fn estimate(&self, figure: impl Fn(&Summary) -> f64) -> Estimate {
        estimate(&self.runs.iter().map(figure).collect::<Vec<f64>>())
    }

    /// Welch's test of G′ and G″ against another ensemble.
    pub fn compare(&self, other: &Self) -> [Welch; 2] {
        [welch(&self.g_prime, &other.g_prime), welch(&self.g_double_prime, &other.g_double_prime)]
    }
}

/// Runs all seeds of the settings in parallel; `done` hears of each finished seed, in any order.
///
/// The results do not depend on the number of threads. A failed seed is reported, not fatal.
///
/// # Errors
/// [`GranularError`] if the settings themselves are inadmissible.
pub fn run_ensemble(settings: &MicrogelSettings, done: impl Fn(u64) + Sync) -> Result<Ensemble, GranularError> {
    settings.check()?;
    let one = |seed: u64| -> Result<Summary, GranularError> {
        let mut rheometer = Rheometer::new(&MicrogelSettings { seed, ..settings.clone() })?;
        rheometer.run(|_| {})?;
        rheometer.summary()
    };
    let results: Vec<(u64, Result<Summary, GranularError>)> = settings
        .seed_list()
        .into_par_iter()
        .map(|seed| {
            let result = one(seed);
            done(seed);
            (seed, result)
        })
        .collect();
    let (mut runs, mut failed) = (Vec::new(), Vec::new());
    for (seed, result) in results {
        match result {
            Ok(summary) => runs.push(summary),
            Err(error) => failed.push((seed, error.to_string())),
        }
    }
    Ok(Ensemble::new(runs, failed))
}
