//! The numbers that experiments without oscillation are made for.
//!
//! Moduli belong to oscillations ([`Moduli`](super::Moduli)); every other experiment has figures of its own, so that an
//! ensemble can state them with error bars and two ensembles can be compared.

use super::result::SegmentResult;
use super::settings::Experiment;
use serde::{Deserialize, Serialize};

/// One number of a finished experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Figure {
    /// Name, as in records.
    pub name: String,
    /// Unit; `1` for pure numbers.
    pub unit: String,
    /// Value.
    pub value: f64,
}

/// Figures of an experiment, by the headline stress; none for oscillations and for what is not finished.
pub(super) fn figures(experiment: &Experiment, segments: &[SegmentResult]) -> Vec<Figure> {
    let Some(first) = segments.first() else { return Vec::new() };
    let figure = |name: &str, unit: &str, value: f64| Figure { name: name.into(), unit: unit.into(), value };
    match experiment {
        Experiment::Oscillation(_) | Experiment::AmplitudeSweep { .. } | Experiment::FrequencySweep { .. } => {
            Vec::new()
        }
        Experiment::SteadyShear { .. } => vec![
            figure("shear_stress", "Pa", first.stress),
            figure("viscosity", "Pa s", first.stress / first.rate),
            figure("normal_stress", "Pa", first.normal_stress),
        ],
        Experiment::StartUp { .. } => vec![
            figure("peak_stress", "Pa", first.peak[0]),
            figure("peak_strain", "1", first.peak[1]),
            figure("shear_stress", "Pa", first.stress),
            figure("overshoot", "1", first.peak[0] / first.stress),
        ],
        // a sample has a residual stress of its own, that of the first step, which is one of rest
        Experiment::StepStrain { strain, .. } => vec![
            figure("residual_stress", "Pa", first.stress_before),
            figure("peak_modulus", "Pa", (first.peak[0] - first.stress_before) / strain),
            figure("relaxation_modulus", "Pa", (first.stress - first.stress_before) / strain),
        ],
        Experiment::Creep { stress, .. } => {
            let mut list = vec![
                figure("creep_strain", "1", first.strain),
                figure("creep_rate", "1/s", first.rate),
                figure("compliance", "1/Pa", first.strain / stress),
            ];
            // what it gives back is elastic, wherever the sample comes to rest
            if let Some(rest) = segments.get(1) {
                list.push(figure("recovered_strain", "1", first.strain - rest.strain));
                list.push(figure("elastic_modulus", "Pa", stress / (first.strain - rest.strain)));
            }
            list
        }
        Experiment::Compression { strain, .. } => vec![
            figure("normal_stress", "Pa", first.normal_stress),
            figure("normal_stress_change", "Pa", first.normal_stress - first.normal_stress_before),
            figure("compression_modulus", "Pa", (first.normal_stress - first.normal_stress_before) / strain),
            figure("pressure", "Pa", first.pressure),
        ],
    }
    .into_iter()
    .filter(|figure| figure.value.is_finite())
    .collect()
}
