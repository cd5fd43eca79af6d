//! The falling stream beside what the C++ code gave.

use super::follow::{How, Refusal, follow};
use super::recorded::{Recorded, folder};
use crate::case::{Case, CaseError, Curve, Outcome, Param, Params};

/// A stream of cream falls.
pub const LIQUID_CREAM: Case = Case {
    id: "reference-code/liquid-cream",
    about: "A stream of shaving cream falls: front and mean height beside the recording from the C++ code, whose source gives \
            1.6 times as much, because the stream carries its liquid off; ours holds it back as a nozzle does, and falls later. \
            Skipped where it is absent.",
    params: &[Param::number("until", 0.19, "s", "when to stop; the recorded front reaches the pad at 0.195 s")],
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
    let until = params.number_in("until", 1e-3, 0.209)?;
    let recorded = Recorded::read(&folder.join("liquid_cream_global.csv")).map_err(CaseError::Failed)?;
    let how = How { parity: false, refine: 1, until, steps: u64::MAX, keep: true };
    let ours = match follow(&folder.join("scenes/liquid_only/cream.xml"), how) {
        Ok(ours) => ours,
        Err(Refusal::Skip(why)) => {
            out.skip(why);
            return Ok(out);
        }
        Err(Refusal::Error(error)) => return Err(error),
    };
    let times: Vec<f64> = recorded.column("time").iter().copied().filter(|t| *t <= until).collect();
    let (front, mean) = (recorded.length("min_y"), recorded.length("com_y"));
    let (mut front_error, mut mean_error) = (0.0_f64, 0.0_f64);
    let fallen = front.get(times.len().saturating_sub(1)).copied().unwrap_or(f64::NAN).abs();
    for (k, &time) in times.iter().enumerate() {
        let at = ours.at(&ours.liquid, time);
        front_error = front_error.max((at[0] - front[k]).abs() / fallen);
        mean_error = mean_error.max((at[1] - mean[k]).abs() / fallen);
    }
    out.measure("front", front_error, |x| x < 0.08, "front within 8 % of the way it falls");
    out.measure("mean_height", mean_error, |x| x < 0.05, "mean height within 5 % of that way");
    out.info("particles", ours.liquid.last().map_or(0.0, |row| row[2]));
    out.info(
        "recorded_particles",
        recorded.column("n_particles").get(times.len().saturating_sub(1)).copied().unwrap_or(0.0),
    );
    out.info("steps", ours.steps[0] as f64);
    out.info("cpu_seconds", ours.cpu);
    let series = |values: &dyn Fn(usize) -> f64| times.iter().enumerate().map(|(k, t)| [*t, values(k)]).collect();
    out.curve(Curve {
        title: "falling stream".to_owned(),
        x_label: "time [s]".to_owned(),
        y_label: "y [m]".to_owned(),
        log_x: false,
        log_y: false,
        series: vec![
            ("front, C++ code".to_owned(), series(&|k| front[k])),
            ("front, ours".to_owned(), series(&|k| ours.at(&ours.liquid, times[k])[0])),
            ("mean, C++ code".to_owned(), series(&|k| mean[k])),
            ("mean, ours".to_owned(), series(&|k| ours.at(&ours.liquid, times[k])[1])),
        ],
    });
    Ok(out)
}
