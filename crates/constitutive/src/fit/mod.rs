//! Yield stress, consistency and index from a measured flow curve.
//!
//! ```text
//! rates, stresses ── start (index scanned, linear least squares) ──► Levenberg–Marquardt on ln σ, outliers weighted down
//!                 ──► covariance ──► confidence intervals; the simplest model that explains the data is chosen
//! ```

mod minimise;
mod student;

use serde::{Deserialize, Serialize};

use crate::error::RheologyError;
use crate::flow_curve::FlowCurve;
use minimise::Minimum;
pub use student::student_quantile;

/// Which parameters are free.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum FlowModel {
    /// `σ = K γ̇`.
    Newtonian,
    /// `σ = K γ̇ⁿ`.
    PowerLaw,
    /// `σ = τ_s + K γ̇`.
    Bingham,
    /// `σ = τ_s + K γ̇ⁿ`.
    HerschelBulkley,
}

impl FlowModel {
    /// All models, the simplest first.
    pub const ALL: [FlowModel; 4] =
        [FlowModel::Newtonian, FlowModel::PowerLaw, FlowModel::Bingham, FlowModel::HerschelBulkley];

    /// The name used in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            FlowModel::Newtonian => "Newtonian",
            FlowModel::PowerLaw => "power law",
            FlowModel::Bingham => "Bingham",
            FlowModel::HerschelBulkley => "Herschel-Bulkley",
        }
    }

    /// Whether yield stress, consistency and index are free.
    fn free(self) -> [bool; 3] {
        match self {
            FlowModel::Newtonian => [false, true, false],
            FlowModel::PowerLaw => [false, true, true],
            FlowModel::Bingham => [true, true, false],
            FlowModel::HerschelBulkley => [true, true, true],
        }
    }

    fn parameters(self) -> usize {
        self.free().iter().filter(|f| **f).count()
    }
}

/// Choices of a fit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FitSettings {
    /// Model to fit; none: the one with the lowest corrected Akaike criterion.
    pub model: Option<FlowModel>,
    /// Weight points down whose residual is far out (Huber's rule). Default on.
    pub robust: bool,
    /// Confidence level of the intervals, 0.5 to 0.999. Default 0.95.
    pub confidence: f64,
}

impl Default for FitSettings {
    fn default() -> Self {
        FitSettings { model: None, robust: true, confidence: 0.95 }
    }
}

/// A fitted parameter with its confidence interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Best value.
    pub value: f64,
    /// Lower end of the confidence interval; equal to the value where the model fixes it.
    pub low: f64,
    /// Upper end of the confidence interval; none where the data leave no degree of freedom to judge by.
    pub high: Option<f64>,
    /// Whether the model leaves it free.
    pub fitted: bool,
}

/// How well one model explains the data.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// The model.
    pub model: FlowModel,
    /// Root mean square of `ln(measured/model)`, a relative error.
    pub rms: f64,
    /// Corrected Akaike criterion; lower is better. None where there are too few points.
    pub criterion: Option<f64>,
}

/// A point of the data beside the fit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FitPoint {
    /// Shear rate [1/s].
    pub rate: f64,
    /// Measured stress [Pa].
    pub measured: f64,
    /// Stress of the fitted model [Pa].
    pub fitted: f64,
    /// `measured/fitted − 1`.
    pub relative_error: f64,
    /// Weight between 0 and 1; below 0.5 the point counts as an outlier.
    pub weight: f64,
}

/// A fitted flow curve, in the rheometer's reading.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FlowCurveFit {
    /// The model chosen or asked for.
    pub model: FlowModel,
    /// Yield stress τ_s [Pa].
    pub yield_stress: Estimate,
    /// Consistency K [Pa·sⁿ].
    pub consistency: Estimate,
    /// Flow index n.
    pub index: Estimate,
    /// Confidence level of the intervals.
    pub confidence: f64,
    /// Root mean square of `ln(measured/model)`.
    pub rms: f64,
    /// Iterations of the minimisation.
    pub iterations: usize,
    /// Whether the minimisation converged.
    pub converged: bool,
    /// Every model that could be tried, the simplest first.
    pub candidates: Vec<Candidate>,
    /// The data beside the fit.
    pub points: Vec<FitPoint>,
}

impl FlowCurveFit {
    /// The fitted liquid.
    #[must_use]
    pub fn flow_curve(&self) -> FlowCurve {
        FlowCurve::Rheometer {
            yield_stress: self.yield_stress.value,
            consistency: self.consistency.value,
            index: self.index.value,
        }
    }

    /// Number of points weighted below one half.
    #[must_use]
    pub fn outliers(&self) -> usize {
        self.points.iter().filter(|p| p.weight < 0.5).count()
    }
}

/// Fits a flow curve to measured shear rates [1/s] and shear stresses [Pa].
///
/// Residuals are `ln(σ/σ_model)`, so relative errors count alike over all decades. Intervals are `value ± t s` of the
/// linearised problem with Student's t; the consistency's is taken on its logarithm. A yield stress that the data do not
/// support ends at 0 with an interval that begins there.
///
/// # Errors
/// [`RheologyError::Data`] if the arrays differ in length, hold a value that is not finite and positive, fewer points than
/// the model asked for has parameters, or a single shear rate only.
pub fn fit_flow_curve(rates: &[f64], stresses: &[f64], settings: &FitSettings) -> Result<FlowCurveFit, RheologyError> {
    if rates.len() != stresses.len() {
        let message = format!("{} rates but {} stresses", rates.len(), stresses.len());
        return Err(RheologyError::Data(message));
    }
    if let Some(i) = rates.iter().zip(stresses).position(|(r, s)| !(*r > 0.0 && *s > 0.0 && (r * s).is_finite())) {
        let message = format!("point {} ({}, {}) is not finite and positive", i + 1, rates[i], stresses[i]);
        return Err(RheologyError::Data(message));
    }
    if !(0.5..=0.999).contains(&settings.confidence) {
        let message = format!("confidence {} is not between 0.5 and 0.999", settings.confidence);
        return Err(RheologyError::Data(message));
    }
    let mut distinct = rates.to_vec();
    distinct.sort_by(f64::total_cmp);
    distinct.dedup_by(|a, b| (*a / *b - 1.0).abs() < 1e-9);
    let wanted: Vec<FlowModel> = match settings.model {
        Some(model) => vec![model],
        None => FlowModel::ALL.to_vec(),
    };
    let possible: Vec<FlowModel> = wanted.into_iter().filter(|m| m.parameters() <= distinct.len()).collect();
    if possible.is_empty() || (settings.model.is_none() && distinct.len() < 2) {
        let message = format!("{} distinct shear rates are too few", distinct.len());
        return Err(RheologyError::Data(message));
    }
    let minima: Vec<Minimum> =
        possible.iter().map(|m| minimise::minimise(rates, stresses, m.free(), settings.robust)).collect();
    let count = rates.len() as f64;
    let candidates: Vec<Candidate> = possible
        .iter()
        .zip(&minima)
        .map(|(model, minimum)| {
            let k = model.parameters() as f64 + 1.0; // and the variance
            let variance = (minimum.cost / count).max(1e-20);
            let criterion =
                (count > k + 1.0).then(|| count * variance.ln() + 2.0 * k + 2.0 * k * (k + 1.0) / (count - k - 1.0));
            Candidate { model: *model, rms: minimum.rms, criterion }
        })
        .collect();
    // with too few points for the criterion: the richest model that was possible
    let chosen = (0..candidates.len())
        .filter(|i| candidates[*i].criterion.is_some())
        .min_by(|a, b| candidates[*a].criterion.unwrap_or(0.0).total_cmp(&candidates[*b].criterion.unwrap_or(0.0)))
        .unwrap_or(candidates.len() - 1);
    Ok(assemble(rates, stresses, settings, possible[chosen], &minima[chosen], candidates))
}

/// Turns a minimum into estimates.
fn assemble(
    rates: &[f64],
    stresses: &[f64],
    settings: &FitSettings,
    model: FlowModel,
    minimum: &Minimum,
    candidates: Vec<Candidate>,
) -> FlowCurveFit {
    let free = model.free();
    let freedom = rates.len() as i64 - model.parameters() as i64;
    let t = (freedom > 0).then(|| student_quantile(0.5 + 0.5 * settings.confidence, freedom as usize));
    let [yield_stress, ln_consistency, index] = minimum.parameters;
    let half = |k: usize| t.map(|t| t * minimum.standard_error[k]);
    let estimate = |k: usize, value: f64, map: &dyn Fn(f64) -> f64| {
        if !free[k] {
            return Estimate { value: map(value), low: map(value), high: Some(map(value)), fitted: false };
        }
        let low = half(k).map_or(f64::NEG_INFINITY, |h| value - h);
        Estimate { value: map(value), low: map(low).max(0.0), high: half(k).map(|h| map(value + h)), fitted: true }
    };
    let same = |x: f64| x;
    let points = (0..rates.len())
        .map(|i| {
            let fitted = yield_stress + (ln_consistency + index * rates[i].ln()).exp();
            FitPoint {
                rate: rates[i],
                measured: stresses[i],
                fitted,
                relative_error: stresses[i] / fitted - 1.0,
                weight: minimum.weights[i],
            }
        })
        .collect();
    FlowCurveFit {
        model,
        yield_stress: estimate(0, yield_stress, &same),
        consistency: estimate(1, ln_consistency, &f64::exp),
        index: estimate(2, index, &same),
        confidence: settings.confidence,
        rms: minimum.rms,
        iterations: minimum.iterations,
        converged: minimum.converged,
        candidates,
        points,
    }
}

#[cfg(test)]
mod tests;
