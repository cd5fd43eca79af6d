//! The microgel rheometer: exact moduli, reference trajectories, moduli of the original's parameter sets, demodulation, laws.

mod accuracy;
mod assembly;
mod contact_laws;
mod demodulation;
mod lattice_modulus;
mod oscillation;
mod reference;
mod spheres;
mod statistics;
mod two_grain;

use crate::case::Case;

/// All cases of the group.
#[must_use]
pub fn cases() -> Vec<Case> {
    vec![
        accuracy::FAULTS,
        accuracy::SIZE,
        accuracy::STEP,
        assembly::CASE,
        contact_laws::CASE,
        demodulation::CASE,
        demodulation::SYNTHETIC,
        lattice_modulus::CASE,
        oscillation::CASE,
        spheres::CASE,
        statistics::CASE,
        two_grain::COLLISION,
        two_grain::SLIDING,
        two_grain::TRAJECTORIES,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::run_case;

    #[test]
    fn every_case_passes_with_its_defaults() {
        for case in cases() {
            let result = run_case(&case, &[]).unwrap();
            println!("{:6.2} s {:36} {}", result.seconds, case.id, result.outcome.one_line());
            if let Some(reason) = result.outcome.skipped() {
                println!("       skipped: {reason}");
                continue;
            }
            assert!(result.outcome.passed(), "{}: {:?}", case.id, result.outcome.failures());
        }
    }

    #[test]
    fn other_parameters_keep_the_exact_cases_exact_and_bad_ones_are_refused() {
        for (case, name, value) in [
            (lattice_modulus::CASE, "mode", "compat"),
            (lattice_modulus::CASE, "tangential_ratio", "2.5"),
            (spheres::CASE, "tangential_ratio", "0"),
            (contact_laws::CASE, "plateau_slope", "0.5"),
            (contact_laws::CASE, "repulsion", "0.3"),
            (demodulation::SYNTHETIC, "drift", "-40"),
            (two_grain::COLLISION, "repulsion", "1"),
            (two_grain::SLIDING, "mu", "0.1"),
        ] {
            let result = run_case(&case, &[(name.into(), value.into())]).unwrap();
            assert!(result.outcome.passed(), "{} {name}={value}: {:?}", case.id, result.outcome.failures());
        }
        for (case, name, value) in [
            (oscillation::CASE, "mode", "sideways"),
            (oscillation::CASE, "packing", "0"),
            (oscillation::CASE, "seeds", "0"),
            (lattice_modulus::CASE, "rows", "5"),
            (statistics::CASE, "sets", "nothing"),
        ] {
            assert!(run_case(&case, &[(name.into(), value.into())]).is_err(), "{} {name}={value}", case.id);
        }
    }
}
