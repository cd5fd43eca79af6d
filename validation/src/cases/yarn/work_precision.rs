//! Implicit against explicit steps at equal error.

use geometry::Motion;
use yarn::YarnMaterial;
use yarn::settings::{Drive, ImplicitSettings, Integrator};

use super::setup::{CELL, SEGMENT, build, material, plane, polyline, processor_seconds};
use crate::case::{Case, CaseError, Curve, Outcome, Param, Params, Table};

/// Work and precision.
pub const CASE: Case = Case {
    id: "yarn/work-precision",
    about: "A stiff taut string, struck: error of the end position against the time spent, explicit and implicit, from a fine explicit run.",
    params: &[
        Param::number("stretch_modulus", 1e5, "Pa", "stretch modulus"),
        Param::number("time", 0.004, "s", "simulated time"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    super::setup::alone(|| experiment(p))
}

fn experiment(p: &Params) -> Result<Outcome, CaseError> {
    let modulus = p.number_in("stretch_modulus", 1000.0, 1e7)?;
    let time = p.number_in("time", 0.001, 1.0)?;
    let scene = |integrator| {
        // A string stretched by 2 % between held ends, struck in its first mode: always taut, so that it does not buckle.
        let mode = |i: usize| (std::f64::consts::PI * i as f64 / 24.0).sin();
        let points = (0..25).map(|i| vec![0.4 + i as f64 * SEGMENT, 0.5]).collect();
        let velocities = (0..25).map(|i| vec![0.0, 2.0 * mode(i)]).collect();
        let mut settings = plane(
            YarnMaterial { stretch_modulus: modulus, ..material(0.05) },
            vec![polyline(points, vec![SEGMENT / 1.02; 24], velocities)],
        );
        settings.drives = [0, -1].map(|vertex| Drive { yarn: 0, vertex, motion: Motion::default() }).to_vec();
        settings.step.integrator = integrator;
        settings
    };
    let run = |integrator: Integrator, steps: usize| {
        let mut system = build(&scene(integrator))?;
        // The fastest of three: the first pays for cold caches.
        let (start, mut best) = (system.state().clone(), f64::INFINITY);
        for _ in 0..3 {
            system.set_state(start.clone()).map_err(CaseError::failed)?;
            let begun = processor_seconds();
            for _ in 0..steps {
                system.advance(time / steps as f64).map_err(CaseError::failed)?;
            }
            best = best.min(processor_seconds() - begun);
        }
        Ok::<_, CaseError>((system.state().position.clone(), best))
    };
    let limit = build(&scene(Integrator::Explicit))?.tightest_limit().map_or(1e-4, |l| l.seconds);
    let base = (time / limit).ceil() as usize;
    let (exact, _) = run(Integrator::Explicit, 4 * base)?;
    let error =
        |x: &[nalgebra::SVector<f64, 2>]| x.iter().zip(&exact).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max) / CELL;
    let mut out = Outcome::new();
    let (mut explicit, mut implicit) = (Vec::new(), Vec::new());
    let mut rows = Vec::new();
    let mut row = |name: &str, steps: usize, seconds: f64, error: f64| {
        rows.push(vec![name.to_owned(), steps.to_string(), format!("{:.2}", 1e3 * seconds), format!("{error:.2e}")]);
    };
    for factor in [1, 2] {
        let (x, seconds) = run(Integrator::Explicit, factor * base)?;
        row("explicit", factor * base, seconds, error(&x));
        explicit.push([seconds, error(&x)]);
    }
    let mut coarse = usize::MAX;
    for share in [64, 32, 16, 8] {
        let steps = (base / share).max(4);
        let integrator = Integrator::Implicit(ImplicitSettings { max_cg: 500, ..ImplicitSettings::default() });
        let (x, seconds) = run(integrator, steps)?;
        row("implicit", steps, seconds, error(&x));
        implicit.push([seconds, error(&x)]);
        coarse = coarse.min(steps);
    }
    out.measure(
        "implicit_error_falls",
        implicit[0][1] / implicit[3][1],
        |ratio| ratio > 2.0,
        "the implicit error falls at least by 2 over a step smaller by 8",
    );
    out.measure("implicit_error_fine", implicit[3][1], |e| e < 0.2, "below 0.2 cells at eight times the explicit step");
    out.info("explicit_steps", base as f64);
    out.info("coarsest_implicit_steps", coarse as f64);
    out.table(Table {
        title: "Work and precision".to_owned(),
        columns: ["step", "steps", "processor time [ms]", "error [cells]"].map(str::to_owned).to_vec(),
        rows,
    });
    out.curve(Curve {
        title: format!("Stiff yarn, k = {modulus:.0e} Pa: error against time"),
        x_label: "time spent [s]".to_owned(),
        y_label: "largest position error [cells]".to_owned(),
        log_x: true,
        log_y: true,
        series: vec![("explicit".to_owned(), explicit), ("implicit".to_owned(), implicit)],
    });
    Ok(out)
}
