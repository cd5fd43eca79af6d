//! Elastic rods: shapes, motion, onsets of instability, and error against cost.

mod buckling;
mod cantilever;
mod motion;
mod reference;
mod setup;
mod work_precision;

use crate::case::Case;

/// The cases of this group.
#[must_use]
pub fn cases() -> Vec<Case> {
    vec![
        cantilever::HEAVY,
        cantilever::TIP_LOAD,
        cantilever::TAPERED,
        motion::VIBRATION,
        motion::HANGING,
        motion::FREE_FALL,
        motion::SPIN,
        motion::HELIX,
        buckling::EULER,
        buckling::SELF_WEIGHT,
        buckling::LATERAL,
        buckling::MICHELL,
        buckling::TWISTED,
        buckling::BEND_TWIST,
        work_precision::WORK_PRECISION,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::run_case;

    fn failures(cases: &[(Case, &[(&str, &str)])]) -> Vec<String> {
        let mut bad = Vec::new();
        for (case, set) in cases {
            let set: Vec<(String, String)> = set.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned())).collect();
            match run_case(case, &set) {
                Ok(result) => {
                    println!("{}", result.to_json());
                    bad.extend(result.outcome.failures().into_iter().map(|f| format!("{} {set:?}: {f}", case.id)));
                }
                Err(error) => bad.push(format!("{} {set:?}: {error}", case.id)),
            }
        }
        bad
    }

    /// Every case passes with its defaults.
    #[test]
    fn all_cases_pass_with_their_defaults() {
        let all: Vec<(Case, &[(&str, &str)])> = cases().into_iter().map(|c| (c, &[] as &[(&str, &str)])).collect();
        let bad = failures(&all);
        assert!(bad.is_empty(), "{}", bad.join("\n"));
    }

    /// Other parameters, other references: the cases still pass.
    #[test]
    fn cases_pass_with_other_parameters() {
        let bad = failures(&[
            (cantilever::HEAVY, &[("gamma", "35"), ("vertices", "121")]),
            (cantilever::HEAVY, &[("gamma", "300"), ("vertices", "61")]),
            (cantilever::HEAVY, &[("gamma", "0.05"), ("vertices", "17")]),
            (cantilever::TIP_LOAD, &[("alpha", "20")]),
            (cantilever::TAPERED, &[("alpha", "3"), ("ratio", "0.2")]),
            (motion::VIBRATION, &[("vertices", "21"), ("viscosity", "1e6")]),
            (motion::HANGING, &[("young_modulus", "1e6"), ("vertices", "2")]),
            (motion::FREE_FALL, &[("step", "0.01"), ("vertices", "7")]),
            (motion::SPIN, &[("turns_per_second", "20"), ("step", "2e-4"), ("steps", "300")]),
            (motion::HELIX, &[("radius", "0.02"), ("pitch", "0.03"), ("turns", "3"), ("vertices", "61")]),
            (buckling::EULER, &[("length", "0.1"), ("vertices", "21")]),
            (buckling::MICHELL, &[("poisson_ratio", "0"), ("vertices", "49")]),
            (buckling::TWISTED, &[("tension", "100"), ("vertices", "41")]),
        ]);
        assert!(bad.is_empty(), "{}", bad.join("\n"));
    }

    /// Parameters that make no sense are refused with the range, not run.
    #[test]
    fn senseless_parameters_are_refused() {
        for (case, name, value) in [
            (cantilever::HEAVY, "gamma", "-1"),
            (cantilever::HEAVY, "vertices", "3"),
            (motion::VIBRATION, "radius", "1"),
            (buckling::TWISTED, "tension", "3000"),
            (motion::SPIN, "step", "1"),
        ] {
            let set = [(name.to_owned(), value.to_owned())];
            assert!(matches!(run_case(&case, &set), Err(crate::CaseError::BadParam { .. })), "{name} = {value}");
        }
    }
}
