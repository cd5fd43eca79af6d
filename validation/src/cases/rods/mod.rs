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

    /// Every case passes with its defaults.
    #[test]
    fn all_cases_pass_with_their_defaults() {
        let only = std::env::var("RODS_CASE").unwrap_or_default();
        let set: Vec<(String, String)> = std::env::var("RODS_SET").unwrap_or_default().split(',').filter_map(|s| s.split_once('=')).map(|(a, b)| (a.into(), b.into())).collect();
        let mut bad = Vec::new();
        for case in cases().iter().filter(|c| c.id.contains(&only)) {
            match run_case(case, &set) {
                Ok(result) => {
                    println!("{:8.2} s  {}", result.seconds, result.to_json());
                    for table in &result.outcome.tables {
                        println!("{}: {}", table.title, table.columns.join(" | "));
                        table.rows.iter().for_each(|row| println!("    {}", row.join(" | ")));
                    }
                    bad.extend(result.outcome.failures().into_iter().map(|f| format!("{}: {f}", case.id)));
                }
                Err(error) => bad.push(format!("{}: {error}", case.id)),
            }
        }
        assert!(bad.is_empty(), "{}", bad.join("\n"));
    }
}
