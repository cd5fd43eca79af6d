//! What there is to say of a material: its class, both readings, its flow curve, as data and as text for a terminal.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use crate::error::RheologyError;
use crate::flow_curve::{FlowClass, FlowCurve};
use crate::liquid_law::LawSettings;
use crate::presets::Liquid;
use crate::viscometer::TensorReference;

/// A point of a flow curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FlowCurvePoint {
    /// Shear rate [1/s].
    pub rate: f64,
    /// Shear stress `τ_s + K γ̇ⁿ` [Pa].
    pub shear_stress: f64,
    /// Apparent viscosity [Pa·s].
    pub viscosity: f64,
    /// Shear stress `σ_xy` [Pa] of the whole model in steady shear, with the elastic strain its own shear modulus allows;
    /// none where no steady state was found.
    pub model_stress: Option<f64>,
}

/// A material in numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MaterialSummary {
    /// Name it was asked for by.
    pub name: String,
    /// All its parameters.
    pub liquid: Liquid,
    /// How it flows.
    pub class: FlowClass,
    /// Whether it counts as compressible.
    pub compressible: bool,
    /// Its flow curve as a rheometer reads it.
    pub rheometer: FlowCurve,
    /// Its flow curve as the model reads it.
    pub j2: FlowCurve,
    /// Elastic shear strain at yield `τ_s/μ`; none without shear modulus.
    pub yield_strain: Option<f64>,
    /// Speed of sound [m/s].
    pub sound_speed: f64,
    /// The flow curve over the rates asked for.
    pub flow_curve: Vec<FlowCurvePoint>,
}

/// `count` shear rates from `low` to `high` [1/s], evenly spaced in the logarithm.
#[must_use]
pub fn logarithmic_rates(low: f64, high: f64, count: usize) -> Vec<f64> {
    let last = count.max(2) - 1;
    (0..=last).map(|i| low * (high / low).powf(i as f64 / last as f64)).collect()
}

/// Describes a liquid, with its flow curve at the given rates [1/s].
///
/// # Errors
/// [`RheologyError::Parameter`] if a parameter lies outside its range.
pub fn describe(name: &str, liquid: &Liquid, rates: &[f64]) -> Result<MaterialSummary, RheologyError> {
    liquid.check()?;
    let law = liquid.law(LawSettings::default())?;
    let reference = TensorReference::new(&law);
    let flow_curve = rates
        .iter()
        .map(|&rate| FlowCurvePoint {
            rate,
            shear_stress: liquid.flow.shear_stress(rate),
            viscosity: liquid.flow.viscosity(rate),
            model_stress: reference.steady(rate).ok().filter(|s| s.2 < 1e-6).map(|s| s.0),
        })
        .collect();
    Ok(MaterialSummary {
        name: name.to_owned(),
        class: liquid.flow.class(),
        compressible: liquid.is_compressible(),
        rheometer: liquid.flow.read_as(crate::RheologyReading::Rheometer),
        j2: liquid.flow.read_as(crate::RheologyReading::J2),
        yield_strain: (liquid.shear_modulus > 0.0).then(|| liquid.flow.rheometer().0 / liquid.shear_modulus),
        sound_speed: law.volume.sound_speed(liquid.density),
        flow_curve,
        liquid: liquid.clone(),
    })
}

impl MaterialSummary {
    /// The summary as text: parameters, then the flow curve as a table.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = String::new();
        let compressible = if self.compressible { "compressible" } else { "incompressible" };
        let _ = writeln!(out, "{}: {}, {compressible}", self.name, self.class.name());
        let (tau, k, n) = self.rheometer.raw();
        let (tau_y, eta, _) = self.j2.raw();
        let _ = writeln!(out, "  density                {:>12.5} kg/m3", self.liquid.density);
        let _ = writeln!(out, "  bulk modulus           {:>12.4e} Pa", self.liquid.bulk_modulus);
        let _ = writeln!(out, "  shear modulus          {:>12.5} Pa", self.liquid.shear_modulus);
        let _ = writeln!(out, "  index                  {n:>12.5}");
        let _ = writeln!(out, "  rheometer: yield stress{tau:>12.5} Pa, consistency {k:.5} Pa s^n");
        let _ = writeln!(out, "  J2 model:  yield stress{tau_y:>12.5} Pa, consistency {eta:.5} Pa s^n");
        if let Some(strain) = self.yield_strain {
            let _ = writeln!(out, "  yield strain           {strain:>12.5}");
        }
        let _ = writeln!(out, "  speed of sound         {:>12.3} m/s", self.sound_speed);
        let _ = writeln!(out, "\n  rate [1/s]    stress [Pa]   viscosity [Pa s]  model stress [Pa]");
        for p in &self.flow_curve {
            let model = p.model_stress.map_or_else(|| "-".to_owned(), |s| format!("{s:.5e}"));
            let _ = writeln!(out, "  {:<12.4e}  {:<12.5e}  {:<16.5e}  {model}", p.rate, p.shear_stress, p.viscosity);
        }
        out
    }

    /// The flow curve as a log–log plot of characters, `width` by `height`: `o` stress, `·` viscosity.
    #[must_use]
    pub fn plot(&self, width: usize, height: usize) -> String {
        let stress: Vec<(f64, f64)> = self.flow_curve.iter().map(|p| (p.rate, p.shear_stress)).collect();
        let viscosity: Vec<(f64, f64)> = self.flow_curve.iter().map(|p| (p.rate, p.viscosity)).collect();
        log_plot(&[('·', &viscosity), ('o', &stress)], width, height)
    }
}

/// Several series of positive points as a log–log plot of characters; later series cover earlier ones.
#[must_use]
pub fn log_plot(series: &[(char, &[(f64, f64)])], width: usize, height: usize) -> String {
    let (width, height) = (width.max(20), height.max(6));
    let points = || series.iter().flat_map(|(_, points)| points.iter()).filter(|(x, y)| *x > 0.0 && *y > 0.0);
    let range = |pick: fn(&(f64, f64)) -> f64| {
        let (low, high) = points()
            .map(|p| pick(p).log10())
            .filter(|v| v.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        if low < high { (low, high) } else { (low - 0.5, high + 0.5) }
    };
    if points().next().is_none() {
        return String::new();
    }
    let ((x0, x1), (y0, y1)) = (range(|p| p.0), range(|p| p.1));
    let mut grid = vec![vec![' '; width]; height];
    for (mark, points) in series {
        for (x, y) in points.iter().filter(|(x, y)| *x > 0.0 && *y > 0.0) {
            let column = ((x.log10() - x0) / (x1 - x0) * (width - 1) as f64).round() as usize;
            let row = ((y1 - y.log10()) / (y1 - y0) * (height - 1) as f64).round() as usize;
            grid[row.min(height - 1)][column.min(width - 1)] = *mark;
        }
    }
    let mut out = String::new();
    for (row, line) in grid.iter().enumerate() {
        let value = 10f64.powf(y1 - (y1 - y0) * row as f64 / (height - 1) as f64);
        let label =
            if row == 0 || row == height - 1 || row == height / 2 { format!("{value:>10.2e}") } else { " ".repeat(10) };
        let _ = writeln!(out, "{label} |{}", line.iter().collect::<String>().trim_end());
    }
    let _ = writeln!(out, "{} +{}", " ".repeat(10), "-".repeat(width));
    let (left, right) = (format!("{:.2e}", 10f64.powf(x0)), format!("{:.2e}", 10f64.powf(x1)));
    let gap = width.saturating_sub(left.len() + right.len());
    let _ = writeln!(out, "{}{left}{}{right}  1/s", " ".repeat(12), " ".repeat(gap));
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::presets::LIQUID_NAMES;

    #[test]
    fn every_material_can_be_described_tabled_and_plotted() {
        let rates = logarithmic_rates(1e-2, 1e3, 11);
        for name in LIQUID_NAMES {
            let summary = describe(name, &Liquid::preset(name).unwrap(), &rates).unwrap();
            assert!(summary.flow_curve.windows(2).all(|w| w[1].shear_stress > w[0].shear_stress));
            assert!(summary.flow_curve.iter().all(|p| p.model_stress.is_some()), "{name}: {:?}", summary.flow_curve);
            let (text, plot) = (summary.text(), summary.plot(60, 16));
            assert!(text.contains(summary.class.name()) && text.lines().count() > 18);
            assert!(plot.contains('o') && plot.lines().count() == 18);
            // what the law gives in steady shear is the curve but for elastic strain
            for p in &summary.flow_curve {
                let model = p.model_stress.unwrap();
                let small = summary.liquid.shear_modulus == 0.0 || p.shear_stress < 0.1 * summary.liquid.shear_modulus;
                assert!(model < 1.001 * p.shear_stress && (!small || model > 0.97 * p.shear_stress), "{name} {p:?}");
            }
        }
    }
}
