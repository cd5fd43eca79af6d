//! What a looser tolerance does to the end of a run.

use crate::case::{Case, CaseError, Curve, Outcome, Param, Params, Table};
use contact::families::Bodies;
use contact::{ContactSettings, solve};
use std::time::Instant;

/// Error of the end state against the tolerance.
pub const CASE: Case = Case {
    id: "contact/tolerance",
    about: "A wall of boxes shaken for a hundred steps: error of the end displacement against the contact tolerance, which sets the default",
    params: &[
        Param::count("boxes", 3, "boxes along and up"),
        Param::count("steps", 60, "time steps of 10 ms"),
        Param::number("nu", 0.5, "1", "friction coefficient"),
    ],
    run,
};

/// Displacements of all boxes after the run, with fixed contact geometry (small motions), seconds and unconverged steps.
fn shaken(n: usize, steps: usize, nu: f64, tolerance: f64) -> (Vec<f64>, f64, usize) {
    let mut s = Bodies::default();
    for j in 0..n {
        for i in 0..n {
            let b = s.add([1.1 * i as f64, 0.0, j as f64 + 0.5], 1.0, [1.0 / 6.0; 3]);
            let below = (j > 0).then(|| b - n);
            for dx in [-0.5, 0.5] {
                for dy in [-0.5, 0.5] {
                    s.touch(b, below, [1.1 * i as f64 + dx, dy, j as f64], [0.0, 0.0, 1.0], nu);
                }
            }
        }
    }
    let dt = 0.01;
    let settings = ContactSettings { tolerance, ..ContactSettings::default() };
    let mut moved = vec![0.0; 6 * n * n];
    let mut warm: Option<Vec<[f64; 3]>> = None;
    let mut missed = 0;
    let begin = Instant::now();
    for step in 0..steps {
        let t = step as f64 * dt;
        s.accelerate([8.0 * (7.0 * t).sin(), 3.0 * (11.0 * t).cos(), -9.81 + 4.0 * (13.0 * t).sin()], dt);
        let problem = s.problem();
        let solution = solve(&problem, warm.as_deref(), &settings);
        missed += usize::from(!solution.report.status().is_converged());
        s.apply(&solution.impulses);
        for (m, v) in moved.iter_mut().zip(s.velocity.iter().flatten()) {
            *m += dt * v;
        }
        warm = Some(solution.impulses);
    }
    (moved, begin.elapsed().as_secs_f64(), missed)
}

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let n = p.count_in("boxes", 1, 12)?;
    let steps = p.count_in("steps", 1, 10_000)?;
    let nu = p.number_in("nu", 0.0, 2.0)?;
    let (reference, ..) = shaken(n, steps, nu, 1e-12);
    let size = reference.iter().map(|v| v * v).sum::<f64>().sqrt();
    let mut out = Outcome::new();
    let mut rows = Vec::new();
    let mut points = Vec::new();
    let mut at_default = f64::NAN;
    for e in [2, 3, 4, 5, 6, 7, 8, 9, 10] {
        let tolerance = 10f64.powi(-e);
        let (end, seconds, missed) = shaken(n, steps, nu, tolerance);
        let error = end.iter().zip(&reference).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt() / size.max(1e-300);
        if e == 8 {
            at_default = error;
        }
        points.push([tolerance, error.max(1e-16)]);
        rows.push(vec![format!("1e-{e}"), format!("{error:.2e}"), format!("{:.2}", 1e3 * seconds), missed.to_string()]);
    }
    out.measure(
        "error_at_default",
        at_default,
        |v| v < 1e-5,
        "the end state no longer depends on the default tolerance 1e-8",
    );
    out.table(Table {
        title: "End state against tolerance".into(),
        columns: ["tolerance", "relative error of the end state", "time [ms]", "steps not converged"]
            .map(String::from)
            .to_vec(),
        rows,
    });
    out.curve(Curve {
        title: "Error of the end state".into(),
        x_label: "contact tolerance [1]".into(),
        y_label: "relative error [1]".into(),
        log_x: true,
        log_y: true,
        series: vec![("end displacement".into(), points)],
    });
    Ok(out)
}
