//! Every case with its default parameters: what passes here is what the documentation claims.

use rayon::prelude::*;

/// Cases that miss their target today, with the figure reached. They must fail: one that passes leaves this list.
const OPEN: &[(&str, &str)] = &[];

/// Runs all cases of a group, and tells every failure at once.
fn group(name: &str) {
    let prefix = format!("{name}/");
    let cases: Vec<_> = validation::cases::all().into_iter().filter(|case| case.id.starts_with(&prefix)).collect();
    assert!(!cases.is_empty(), "there are no cases in {name}");
    let failures: Vec<String> = cases
        .par_iter()
        .filter_map(|case| match validation::run_case(case, &[]) {
            Ok(result) if result.outcome.passed() => {
                if OPEN.iter().any(|(id, _)| *id == case.id) {
                    return Some(format!("{} passes now: take it off the list of open cases", case.id));
                }
                println!("ok {} in {:.2} s", case.id, result.seconds);
                None
            }
            Ok(result) => match result.outcome.skipped() {
                Some(reason) => {
                    println!("skipped {}: {reason}", case.id);
                    None
                }
                None => match OPEN.iter().find(|(id, _)| *id == case.id) {
                    Some((id, why)) => {
                        println!("open {id}: {why}");
                        None
                    }
                    None => Some(format!("{}: {}", case.id, result.outcome.failures().join("; "))),
                },
            },
            Err(error) => Some(format!("{}: {error}", case.id)),
        })
        .collect();
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
}

#[test]
fn hard_scenes_meet_their_pass_conditions() {
    group("hard");
}

#[test]
fn rods_agree_with_their_references() {
    group("rods");
}

#[test]
fn contacts_agree_with_their_references() {
    group("contact");
}

#[test]
fn strands_and_liquid_agree_with_their_references() {
    group("coupled");
}

#[test]
fn liquids_agree_with_their_references() {
    group("liquid");
}

#[test]
fn films_agree_with_their_references() {
    group("film");
}

#[test]
fn grains_agree_with_their_references() {
    group("granular");
}

#[test]
fn yarns_agree_with_their_references() {
    group("yarn");
}

#[test]
fn case_ids_are_distinct_and_their_defaults_are_accepted() {
    let cases = validation::cases::all();
    for pair in cases.windows(2) {
        assert_ne!(pair[0].id, pair[1].id);
    }
    for case in &cases {
        assert!(validation::Params::for_case(case, &[]).is_ok(), "{}", case.id);
        assert!(!case.about.is_empty(), "{}", case.id);
    }
}
