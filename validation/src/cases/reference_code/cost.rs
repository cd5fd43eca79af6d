//! Processor time per step beside that of the C++ code, one thread each.

use super::follow::{How, Refusal, follow};
use super::recorded::folder;
use crate::case::{Case, CaseError, Outcome, Param, Params, Table};

/// Scene, processor seconds per step of the C++ code (one thread, good to about 20 %) and the number of particles at which
/// they were measured, factor wanted.
const SCENES: [(&str, f64, f64, Option<f64>); 6] = [
    ("rod_stability/crazy_rotation.xml", 0.0102, 0.0, None),
    ("rod_stability/strand_pulling.xml", 0.0017, 0.0, None),
    ("rod_stability/strand_bend_release.xml", 0.061, 0.0, Some(100.0)),
    ("incline_45_deg/flow_cream_45_deg.xml", 0.030, 0.0, Some(100.0)),
    ("liquid_only/cream.xml", 0.076, 1000.0, Some(20.0)),
    ("drag/default_strand_cream.xml", 0.487, 3746.0, Some(20.0)),
];

/// Processor seconds per step of the C++ code against the number of particles, in a falling stream; the first is extrapolated.
const STREAM: [(f64, f64); 6] =
    [(0.0, 0.025), (500.0, 0.051), (1000.0, 0.076), (2000.0, 0.129), (5000.0, 0.310), (10_000.0, 0.670)];

/// The C++ code's cost of a scene with liquid at this mean number of particles: what was measured at another number, moved
/// along its cost of a stream.
fn at_count(measured: f64, count: f64, mean: f64) -> f64 {
    let stream = |count: f64| {
        let next = STREAM.iter().position(|(n, _)| *n >= count).unwrap_or(STREAM.len() - 1).max(1);
        let ((n0, s0), (n1, s1)) = (STREAM[next - 1], STREAM[next]);
        s0 + (s1 - s0) * (count - n0) / (n1 - n0)
    };
    measured + stream(mean) - stream(count)
}

/// Cost of the imported scenes.
pub const COST: Case = Case {
    id: "reference-code/cost",
    about: "Processor seconds per step of imported scenes on one thread beside those of the C++ code. Scenes that this version \
            cannot run are listed as such; skipped where the scenes are absent.",
    params: &[
        Param::count("steps", 100, "steps of each scene"),
        Param::count("repeats", 3, "runs of each scene; the fastest counts"),
    ],
    run,
};

fn run(params: &Params) -> Result<Outcome, CaseError> {
    let mut out = Outcome::new();
    let folder = match folder() {
        Ok(folder) => folder,
        Err(why) => {
            out.skip(why);
            return Ok(out);
        }
    };
    let steps = params.count_in("steps", 1, 1_000_000)? as u64;
    let repeats = params.count_in("repeats", 1, 100)?;
    let mut rows = Vec::new();
    for (scene, measured, count, wanted) in SCENES {
        let how = How { parity: false, refine: 1, until: f64::INFINITY, steps, keep: count > 0.0 };
        let mut best = f64::INFINITY;
        let mut particles = 0.0;
        let mut refused = None;
        for _ in 0..repeats {
            match follow(&folder.join("scenes").join(scene), how) {
                Ok(followed) => {
                    best = best.min(followed.cpu / followed.steps[0].max(1) as f64);
                    let rows = followed.liquid.len().max(1) as f64;
                    particles = followed.liquid.iter().map(|row| row[2]).sum::<f64>() / rows;
                }
                Err(Refusal::Skip(why)) => {
                    refused = Some(why);
                    break;
                }
                Err(Refusal::Error(error)) => return Err(CaseError::Failed(format!("{scene}: {error}"))),
            }
        }
        if let Some(why) = refused {
            out.note(format!("{scene}: {why}"));
            rows.push(vec![
                scene.to_owned(),
                "–".to_owned(),
                format!("{measured}"),
                "–".to_owned(),
                "–".to_owned(),
                String::new(),
            ]);
            continue;
        }
        let theirs = if count > 0.0 { at_count(measured, count, particles) } else { measured };
        let factor = theirs / best;
        let name = scene.rsplit('/').next().unwrap_or(scene).trim_end_matches(".xml");
        match wanted {
            Some(wanted) => out.measure(name, factor, |x| x >= wanted, &format!("at least {wanted} times faster")),
            None => out.measure(name, factor, |x| x >= 1.0, "not slower"),
        }
        let goal = wanted.map_or(String::new(), |wanted| format!("{wanted}"));
        rows.push(vec![
            scene.to_owned(),
            format!("{:.0}", particles + 0.0),
            format!("{theirs:.4}"),
            format!("{best:.2e}"),
            format!("{factor:.0}"),
            goal,
        ]);
    }
    let columns =
        ["scene", "particles (mean)", "C++ [s/step]", "ours [s/step]", "factor", "wanted"].map(str::to_owned).to_vec();
    out.table(Table { title: "processor time per step, one thread".to_owned(), columns, rows });
    Ok(out)
}
