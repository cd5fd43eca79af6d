//! From the scene, in SI, to the settings of the library, in µm, mg and s.

use crate::scene::Scene;
use crate::scene::microgel::{
    BoxEdges, CompressionLaw, ContactRules, Cutting, DriftRule, GrainRules, GrainShape, GrainSizes, LinkTension,
    Microgel, MicrogelExperiment, Oscillation, PlateRule, Preparation, StepGuard,
};
use granular::GranularError;
use granular::assembly::Plates;
use granular::cell::Boundary;
use granular::demodulation::Drift;
use granular::experiment::{Experiment, MicrogelSettings, Oscillation as OscillationSettings, Tone};
use granular::law::{CentralLaw, Table, Tension};
use granular::model::{Dimension, Mode, ModelSettings, Radii};
use granular::physical::{Lever, Rules, SlipRule, StepGuard as Guard};
use granular::preparation::{Cut, PreparationSettings};

/// Micrometres per metre.
pub(super) const MICROMETRES: f64 = 1e6;

/// The library's settings of a scene with a `microgel` section; checked.
///
/// # Errors
/// When a setting is out of range or two of them do not fit together.
pub fn settings(scene: &Scene, microgel: &Microgel) -> Result<MicrogelSettings, GranularError> {
    let settings = MicrogelSettings {
        mode: match microgel.mode {
            GrainRules::Physical => Mode::Physical,
            GrainRules::Compat => Mode::Compat,
        },
        seed: scene.seed,
        seeds: microgel.seeds,
        model: model(microgel)?,
        preparation: preparation(&microgel.preparation),
        boundary: match microgel.edges {
            BoxEdges::LeesEdwards => Boundary::LeesEdwards,
            BoxEdges::Periodic => Boundary::Periodic,
            BoxEdges::Open => Boundary::Open,
            BoxEdges::Walls => Boundary::Walls,
        },
        plates: microgel.plates.as_ref().map(|rule| match rule {
            PlateRule::Off => Plates::None,
            PlateRule::Fixed => Plates::Fixed,
            PlateRule::Band => Plates::Band,
        }),
        rules: rules(&microgel.rules),
        experiment: experiment(&microgel.experiment),
        drift: microgel.drift.as_ref().map(|rule| match rule {
            DriftRule::Subtract => Drift::Subtract,
            DriftRule::Double => Drift::Double,
            DriftRule::Keep => Drift::Keep,
        }),
        step_factor: microgel.step_factor.unwrap_or(0.0), // 0: the mode's own
        // energies are taken from the state where a row needs them
        record_energy: false,
    };
    settings.check()?;
    Ok(settings)
}

fn model(microgel: &Microgel) -> Result<ModelSettings, GranularError> {
    let law = match &microgel.law {
        CompressionLaw::Linear => CentralLaw::Blend { repulsion: 0.0 },
        CompressionLaw::Divergent => CentralLaw::Blend { repulsion: 1.0 },
        CompressionLaw::Blend(repulsion) => CentralLaw::Blend { repulsion: *repulsion },
        CompressionLaw::Plateau(law) => {
            CentralLaw::Plateau { repulsion: law.repulsion, begin: law.begin, end: law.end, slope: law.slope }
        }
        CompressionLaw::Hertz(law) => CentralLaw::Hertz { coefficient: law.coefficient },
        CompressionLaw::Table(table) => {
            CentralLaw::Tabulated(Table::new(table.compression.clone(), table.force.clone())?)
        }
    };
    Ok(ModelSettings {
        dimension: match microgel.shape {
            GrainShape::Discs => Dimension::Two,
            GrainShape::Spheres => Dimension::Three,
        },
        grains: microgel.grains,
        width: microgel.width * MICROMETRES,
        height: microgel.height * MICROMETRES,
        depth: microgel.depth.map_or(0.0, |depth| depth * MICROMETRES),
        packing: microgel.packing,
        young_modulus: microgel.young_modulus,
        density: microgel.density,
        size_ratio: microgel.size_ratio,
        radii: match microgel.sizes {
            GrainSizes::ExactHalf => Radii::ExactHalf,
            GrainSizes::Random => Radii::Random,
        },
        friction: microgel.friction,
        relative_viscosity: microgel.relative_viscosity,
        tangential_ratio: microgel.tangential_ratio,
        law,
        tension: match microgel.tension {
            LinkTension::Linear => Tension::Linear,
            LinkTension::Saturating(strain) => Tension::Saturating { strain },
        },
        reinforcement_central: microgel.reinforcement_central,
        reinforcement_tangential: microgel.reinforcement_tangential,
        keep_viscosity: microgel.keep_viscosity,
    })
}

fn preparation(preparation: &Preparation) -> PreparationSettings {
    PreparationSettings {
        links: preparation.links,
        cut: match &preparation.cut {
            Cutting::Uncut => Cut::None,
            Cutting::Voronoi(cut) => Cut::Voronoi { points: cut.points, edge_fuzziness: cut.edge_fuzziness },
            Cutting::Lines(cut) => Cut::Lines { count: cut.count, avoid_horizontal: cut.avoid_horizontal.to_degrees() },
        },
        cut_top_bottom: preparation.cut_top_bottom,
        avoid_tall: preparation.avoid_tall,
        remove_links: preparation.remove_links,
        relaxation: preparation.relaxation,
    }
}

fn rules(rules: &ContactRules) -> Rules {
    Rules {
        slip: if rules.reset_on_slip { SlipRule::Reset } else { SlipRule::KeepAtLimit },
        lever: if rules.radius_as_lever { Lever::Radius } else { Lever::Consistent },
        viscous_attraction: rules.viscous_attraction,
        damp_to_flow_spin: rules.damp_to_flow_spin,
        guard: match rules.guard {
            StepGuard::Off => Guard::Off,
            StepGuard::SubStep(most) => Guard::SubStep(most),
            StepGuard::Refuse => Guard::Refuse,
        },
        guard_fraction: rules.guard_fraction,
        skin: rules.skin,
    }
}

fn oscillation(oscillation: &Oscillation) -> OscillationSettings {
    let tone = |sine: &crate::scene::microgel::Sine| Tone {
        amplitude: sine.amplitude,
        relative_frequency: sine.relative_frequency,
    };
    OscillationSettings {
        amplitude: oscillation.amplitude,
        relative_frequency: oscillation.relative_frequency,
        overtones: oscillation.overtones.iter().map(tone).collect(),
        pre_periods: oscillation.pre_periods,
        periods: oscillation.periods,
        post_periods: oscillation.post_periods,
        cool_factor: oscillation.cool_factor,
    }
}

fn experiment(experiment: &MicrogelExperiment) -> Experiment {
    match experiment {
        MicrogelExperiment::Oscillation(one) => Experiment::Oscillation(oscillation(one)),
        MicrogelExperiment::AmplitudeSweep(sweep) => {
            Experiment::AmplitudeSweep { amplitudes: sweep.amplitudes.clone(), base: oscillation(&sweep.base) }
        }
        MicrogelExperiment::FrequencySweep(sweep) => Experiment::FrequencySweep {
            relative_frequencies: sweep.relative_frequencies.clone(),
            base: oscillation(&sweep.base),
        },
        MicrogelExperiment::SteadyShear(ramp) => {
            Experiment::SteadyShear { relative_rate: ramp.relative_rate, strain: ramp.strain }
        }
        MicrogelExperiment::StartUp(ramp) => {
            Experiment::StartUp { relative_rate: ramp.relative_rate, strain: ramp.strain }
        }
        MicrogelExperiment::StepStrain(step) => {
            Experiment::StepStrain { strain: step.strain, rise: step.rise, hold: step.hold }
        }
        MicrogelExperiment::Creep(creep) => {
            Experiment::Creep { stress: creep.stress, duration: creep.duration, recovery: creep.recovery }
        }
        MicrogelExperiment::Compression(closing) => {
            Experiment::Compression { strain: closing.strain, relative_rate: closing.relative_rate, hold: closing.hold }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::scene::load_str;

    /// A scene that says nothing runs what the library calls its default, to the last bit.
    #[test]
    fn an_empty_section_is_the_default_of_the_library() {
        let text = "Scene(units: Si, seed: 7, microgel: (experiment: Oscillation()))";
        let scene = load_str(text, "test.ron", &[]).unwrap().scene;
        let found = super::settings(&scene, scene.microgel.as_ref().unwrap()).unwrap();
        let library = granular::experiment::MicrogelSettings { seed: 7, seeds: 1, ..Default::default() };
        assert_eq!(found, library);
    }

    #[test]
    fn a_scene_in_other_units_is_the_same_sample() {
        let si = "Scene(units: Si, microgel: (young_modulus: 9000, density: 60, width: 4e-4, \
                  experiment: Creep(stress: 100)))";
        let cgs = "Scene(units: Cgs, microgel: (young_modulus: 90000, density: 0.06, width: 4e-2, height: 5e-2, \
                   experiment: Creep(stress: 1000)))";
        let of = |text| {
            let scene = load_str(text, "test.ron", &[]).unwrap().scene;
            super::settings(&scene, scene.microgel.as_ref().unwrap()).unwrap()
        };
        assert_eq!(of(si), of(cgs));
    }
}
