//! Cases of one material point of liquid and of the drag law: no grid, no particles.

mod drag_curves;
mod drag_sphere;
mod flow_curve_vs_step;
mod liquid_choice;
mod recovery;
mod relaxation;
mod return_map;
mod rotation;
mod semigroup;
mod tearing;
mod viscometer_startup;
mod viscometer_steady;

use crate::case::Case;

/// The cases of this group.
#[must_use]
pub fn cases() -> Vec<Case> {
    vec![
        drag_curves::CASE,
        drag_sphere::CASE,
        flow_curve_vs_step::CASE,
        recovery::CASE,
        relaxation::CASE,
        return_map::CASE,
        rotation::CASE,
        semigroup::CASE,
        tearing::CASE,
        viscometer_startup::CASE,
        viscometer_steady::CASE,
    ]
}

#[cfg(test)]
mod tests {
    use crate::run::run_case;

    #[test]
    fn every_case_passes_with_its_defaults() {
        for case in super::cases() {
            let result = run_case(&case, &[]).unwrap();
            println!("{} {:.2} s {}", case.id, result.seconds, result.to_json());
            assert!(result.outcome.passed(), "{}: {:?}", case.id, result.outcome.failures());
            assert!(result.seconds < 20.0, "{} took {} s", case.id, result.seconds);
        }
    }

    #[test]
    fn cases_answer_other_parameters() {
        let run = |id: &str, set: &[(&str, &str)]| {
            let case = super::cases().into_iter().find(|c| c.id == id).unwrap();
            let set: Vec<(String, String)> = set.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned())).collect();
            let result = run_case(&case, &set).unwrap();
            assert!(result.outcome.passed(), "{id} {set:?}: {:?}", result.outcome.failures());
        };
        for material in ["water", "drilling-mud", "milk-cream", "mayonnaise"] {
            run("liquid/viscometer-steady", &[("material", material), ("rate", "3")]);
            run("liquid/viscometer-startup", &[("material", material), ("rate", "5"), ("time", "0.02")]);
        }
        run("liquid/viscometer-steady", &[("tau_s", "7"), ("k", "2"), ("n", "1.4"), ("rate", "12")]);
        run("liquid/viscometer-steady", &[("tau_s", "0"), ("k", "0.3"), ("n", "0.4"), ("rate", "200"), ("mu", "50")]);
        run("liquid/return-map", &[("index", "1"), ("dt", "0.01")]);
        run("liquid/return-map", &[("index", "2.5"), ("dt", "0.3"), ("consistency", "5")]);
        run("liquid/drag-sphere", &[("diameter", "1e-4")]);
        run("liquid/recovery", &[("recovery_time", "0.3"), ("steps", "7")]);
        run("liquid/tearing", &[("material", "drilling-mud"), ("rate", "3")]);
        run("liquid/rotation", &[("angle", "200"), ("steps", "3")]);
        run("liquid/relaxation", &[("material", "milk-chocolate"), ("time", "0.2")]);
    }
}
