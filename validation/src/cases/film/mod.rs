//! Cases of the film on a strand.

mod conservation;
mod drain;
mod incline;
mod inertia;
mod strain;
mod strand;
mod stretch;

use crate::case::Case;

/// The cases of this group.
#[must_use]
pub fn cases() -> Vec<Case> {
    vec![conservation::CASE, drain::CASE, incline::CASE, inertia::CASE, strain::CASE, stretch::CASE]
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
        }
    }

    #[test]
    fn cases_answer_other_parameters() {
        let run = |id: &str, set: &[(&str, &str)]| {
            let case = super::cases().into_iter().find(|c| c.id == id).unwrap();
            let set: Vec<(String, String)> = set.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned())).collect();
            let result = run_case(&case, &set).unwrap();
            assert!(result.outcome.passed(), "{id} {set:?}: {:?}", result.outcome.failures());
            result.outcome
        };
        // tabulated mean speeds of plane films at 45 degrees
        for (material, height, speed) in [
            ("drilling-mud", "5e-4", 6.61428e-3),
            ("shaving-cream", "0.02655", 2.56773e-3),
            ("milk-chocolate", "5.257e-3", 1.4038e-2),
            ("oyster-sauce", "5e-4", 5.55185e-4),
        ] {
            let out = run("film/incline", &[("material", material), ("height", height)]);
            assert!((out.measured("mean_speed").unwrap() / speed - 1.0).abs() < 1e-3, "{material}");
        }
        for material in ["water", "acrylic-paint", "milk-cream", "mayonnaise"] {
            run(
                "film/incline",
                &[("material", material), ("height", "2e-4"), ("angle", "80"), ("slip_length", "1e-6")],
            );
        }
        run("film/incline", &[("material", "oyster-sauce"), ("height", "1e-4")]);
        run("film/incline", &[("law", "paper"), ("height", "2e-3")]);
        run("film/stretch", &[("yield_stress", "5"), ("index", "0.5"), ("rate", "-3")]);
        run("film/strain", &[("c0", "-1.5"), ("rate", "-8"), ("steps", "13")]);
        run("film/conservation", &[("material", "shaving-cream"), ("time", "1"), ("advection", "semi-lagrangian")]);
        run("film/drain", &[("height", "3e-5"), ("ahead", "0.5")]);
        run("film/inertia", &[("vertices", "30")]);
    }
}
