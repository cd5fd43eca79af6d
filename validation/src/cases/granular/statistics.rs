//! All parameter sets of the original's table, compared with one correction for the number of comparisons.

use super::oscillation::reference_sets;
use crate::case::{Case, CaseError, Outcome, Param, Params, Table};
use granular::experiment::run_ensemble;
use granular::model::Mode;
use granular::statistics::holm;

/// Case.
pub const CASE: Case = Case {
    id: "granular/statistics",
    about: "Mean G′ and G″ of the original's parameter sets in compat mode agree with its means: Welch's test, Holm-corrected over \
            all comparisons made, at one per cent.",
    params: &[
        Param::text("sets", "quick", "quick (the two cheapest), all, or the beginning of set names"),
        Param::count("seeds", 3, "samples per set; at least 2"),
        Param::count("first_seed", 1, "seed of the first sample"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let seeds = p.count_in("seeds", 2, 10_000)? as u32;
    let first = p.count("first_seed")? as u64;
    let which = p.text("sets")?.to_owned();
    let chosen: Vec<_> = reference_sets()
        .into_iter()
        .filter(|s| match which.as_str() {
            "all" => true,
            "quick" => s.set.mu == 1.0,
            prefix => s.name.starts_with(prefix),
        })
        .collect();
    if chosen.is_empty() {
        return Err(p.reject("sets", "quick, all, or the beginning of a set's name such as L_mu001"));
    }
    let (mut rows, mut probabilities) = (Vec::new(), Vec::new());
    for set in &chosen {
        let s = set.set.settings(Mode::Compat, seeds, first);
        let e = run_ensemble(&s, |_| {}).map_err(CaseError::failed)?;
        let tests = set.compare(&e);
        for (name, reference, here, test) in
            [("G′", set.g_prime, e.g_prime, tests[0]), ("G″", set.g_double_prime, e.g_double_prime, tests[1])]
        {
            probabilities.push(test.p);
            rows.push(vec![
                set.name.clone(),
                name.to_owned(),
                format!("{:.1} ± {:.1} (n {})", reference.mean, reference.sd, reference.count),
                format!("{:.1} ± {:.1} (n {})", here.mean, here.sd, here.count),
            ]);
        }
    }
    let corrected = holm(&probabilities);
    let least = corrected.iter().fold(1.0f64, |m, v| m.min(*v));
    for (row, (p, c)) in rows.iter_mut().zip(probabilities.iter().zip(&corrected)) {
        row.push(format!("{p:.3}"));
        row.push(format!("{c:.3}"));
    }
    let mut out = Outcome::new();
    out.measure("least_corrected_p", least, |v| v > 0.01, "no Holm-corrected probability below one per cent");
    out.info("comparisons", corrected.len() as f64);
    out.table(Table {
        title: "Moduli beside the original's [Pa]".into(),
        columns: ["set", "modulus", "original", "here", "p", "p corrected"].map(String::from).to_vec(),
        rows,
    });
    Ok(out)
}
