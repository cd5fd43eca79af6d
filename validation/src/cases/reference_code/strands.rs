//! Trajectories of strands beside those that the C++ code gave, and beside ours with smaller steps.

use super::follow::{Followed, How, Refusal, distance, follow};
use super::recorded::{Recorded, folder};
use crate::case::{Case, CaseError, Curve, Outcome, Param, Params, Table};

const PARAMS: &[Param] = &[
    Param::flag("parity", true, "scripts replayed step by step, film laws as printed"),
    Param::count("refine", 8, "steps per step of the original in the refined run"),
    Param::number("until", 10.0, "s", "when to stop; at most the end of the recording"),
];

/// A strand on a rotating sphere.
pub const CRAZY_ROTATION: Case = Case {
    id: "reference-code/crazy-rotation",
    about: "A strand held on a sphere that is thrown up and turned: its points beside those recorded from the C++ code and \
            beside our own with smaller steps. Skipped where the recordings are absent.",
    params: PARAMS,
    run: |params| compare(params, "rod_stability/crazy_rotation.xml", "crazy_rotation", 0.2),
};

/// Two crossed strands.
pub const STRAND_PULLING: Case = Case {
    id: "reference-code/strand-pulling",
    about: "Two crossed strands pulled against each other, contact and no liquid, beside the recording from the C++ code. \
            Skipped where it is absent.",
    params: PARAMS,
    run: |params| compare(params, "rod_stability/strand_pulling.xml", "strand_pulling", 0.05),
};

/// A strand with film, bent and released.
pub const BEND_RELEASE: Case = Case {
    id: "reference-code/bend-release",
    about: "A strand with a film of cream, bent at both ends and released at one, beside the recording from the C++ code. \
            Skipped where it is absent.",
    params: PARAMS,
    run: |params| compare(params, "rod_stability/strand_bend_release.xml", "strand_bend_release_long", 0.2),
};

/// A heavy film on a light strand.
pub const INCLINE: Case = Case {
    id: "reference-code/incline-cream",
    about: "A strand that carries 390 times its mass in cream swings down, beside the recording from the C++ code. Skipped \
            where it is absent.",
    params: PARAMS,
    run: |params| compare(params, "incline_45_deg/flow_cream_45_deg.xml", "incline_cream", 0.5),
};

/// Compares the points of all strands; `tolerance` is the largest mean distance in strand lengths.
fn compare(params: &Params, scene: &str, name: &str, tolerance: f64) -> Result<Outcome, CaseError> {
    let mut out = Outcome::new();
    let folder = match folder() {
        Ok(folder) => folder,
        Err(why) => {
            out.skip(why);
            return Ok(out);
        }
    };
    let recorded = Recorded::read(&folder.join(format!("{name}_strands.csv"))).map_err(CaseError::Failed)?;
    let last = recorded.column("time").iter().copied().fold(0.0, f64::max);
    let until = params.positive("until")?.min(last);
    let how = How { parity: params.flag("parity")?, refine: 1, until, steps: u64::MAX, keep: true };
    let xml = folder.join("scenes").join(scene);
    let refine = params.count_in("refine", 1, 1000)?;
    let (plain, fine) = match (follow(&xml, how), follow(&xml, How { refine, ..how })) {
        (Ok(plain), Ok(fine)) => (plain, fine),
        (Err(Refusal::Skip(why)), _) | (_, Err(Refusal::Skip(why))) => {
            out.skip(why);
            return Ok(out);
        }
        (Err(Refusal::Error(error)), _) | (_, Err(Refusal::Error(error))) => return Err(error),
    };
    let [mut held, mut apart, mut own, mut theirs, mut largest] = [0.0_f64; 5];
    let mut count = 0.0;
    let mut rows = Vec::new();
    for (strand, (path, fine_path)) in plain.strands.iter().zip(&fine.strands).enumerate() {
        let times: Vec<f64> = recorded.times_of(strand).into_iter().filter(|t| *t <= until * (1.0 + 1e-9)).collect();
        let length = path.length;
        let root = recorded.point_of(strand, "root");
        for (time, theirs) in times.iter().zip(&root) {
            held = held.max(distance(&plain.at(&path.root, *time), theirs) / length);
        }
        for (point, ours, finer) in [("mid", &path.mid, &fine_path.mid), ("tip", &path.tip, &fine_path.tip)] {
            let reference = recorded.point_of(strand, point);
            for (k, &time) in times.iter().enumerate() {
                let (a, b) = (plain.at(ours, time), fine.at(finer, time));
                let distances =
                    [distance(&a, &reference[k]), distance(&a, &b), distance(&b, &reference[k])].map(|d| d / length);
                apart += distances[0];
                own += distances[1];
                theirs += distances[2];
                largest = largest.max(distances[0]);
                count += 1.0;
                let eighth = (times.len() / 8).max(1);
                if k % eighth == 0 || k + 1 == times.len() {
                    let mut row = vec![format!("{strand}"), point.to_owned(), format!("{time:.3}")];
                    row.extend(distances.map(|d| format!("{:.4}", d)));
                    rows.push(row);
                }
            }
            let height = |at: &dyn Fn(usize) -> f64| times.iter().enumerate().map(|(k, t)| [*t, at(k)]).collect();
            out.curve(Curve {
                title: format!("{name}: height of the {point} of strand {strand}"),
                x_label: "time [s]".to_owned(),
                y_label: "y [m]".to_owned(),
                log_x: false,
                log_y: false,
                series: vec![
                    ("C++ code".to_owned(), height(&|k| reference[k][1])),
                    ("ours, same step".to_owned(), height(&|k| plain.at(ours, times[k])[1])),
                    (format!("ours, step / {refine}"), height(&|k| fine.at(finer, times[k])[1])),
                ],
            });
        }
    }
    let mean = |sum: f64| sum / f64::max(count, 1.0);
    out.measure(
        "held_vertices",
        held,
        |x| x < 1e-6 || !how.parity,
        "held vertices go where theirs go, in strand lengths",
    );
    out.measure(
        "mean_distance",
        mean(apart),
        |x| x < tolerance,
        &format!("mean distance from the recording below {tolerance} strand lengths"),
    );
    out.info("largest_distance", largest);
    out.info("own_step_error", mean(own));
    out.info("distance_of_refined", mean(theirs));
    costs(&mut out, &plain, &fine);
    out.table(Table {
        title: format!("{name}: distances in strand lengths"),
        columns: ["strand", "point", "time [s]", "ours – C++", "ours – refined", "refined – C++"]
            .map(str::to_owned)
            .to_vec(),
        rows,
    });
    Ok(out)
}

fn costs(out: &mut Outcome, plain: &Followed, fine: &Followed) {
    out.info("rejected_steps", plain.steps[1] as f64);
    out.info("cpu_seconds", plain.cpu);
    out.info("cpu_seconds_refined", fine.cpu);
}
