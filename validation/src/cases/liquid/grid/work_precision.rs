//! What accuracy costs: the channel over everything that can be turned, and the drift of the volume over the tolerance of the pressure.

use mpm::{HalfSpace, LiquidSettings, Vector};
use particle_grid::Lattice;

use super::channel;
use super::setup::{self, GRAVITY, Run, alone, processor_seconds};
use crate::case::{Case, CaseError, Curve, Outcome, Param, Params, Table};

pub const CASE: Case = Case {
    id: "liquid/work-precision",
    about: "Error of the channel profile against processor seconds over cells, particles per cell, step, shear tangent, Newton \
            iterations, operator and tolerance of the shear solve: one is varied at a time about the base. The defaults must lie on the \
            flat part of their curves.",
    params: &[
        Param::text("material", "shaving-cream", "name of the liquid"),
        Param::count("cells", 16, "cells across the channel of the base"),
        Param::number("dt", 1e-3, "s", "step of the base"),
        Param::number("time", 0.1, "s", "time of every run"),
        Param::number("stiffening", 1.0, "1", "factor on the shear modulus"),
    ],
    run: |p| alone(|| run(p)),
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let (cells, dt) = (p.count_in("cells", 8, 64)?, p.positive("dt")?);
    let material = p.text("material")?.to_owned();
    let base = [
        ("material", material.clone()),
        ("cells", cells.to_string()),
        ("dt", format!("{dt:e}")),
        ("time", format!("{:e}", p.positive("time")?)),
        ("stiffening", format!("{:e}", p.positive("stiffening")?)),
    ];
    let one = |name: &str, value: &str| -> Result<(f64, f64, f64), CaseError> {
        let mut sets: Vec<(String, String)> = base.iter().map(|(n, v)| ((*n).to_owned(), v.clone())).collect();
        sets.retain(|(n, _)| n != name);
        if !name.is_empty() {
            sets.push((name.to_owned(), value.to_owned()));
        }
        let params = Params::for_case(&channel::CASE, &sets)?;
        let start = processor_seconds();
        let outcome = (channel::CASE.run)(&params)?;
        let seconds = processor_seconds() - start;
        let of = |what: &str| outcome.value(what).unwrap_or(f64::NAN);
        Ok((of("profile_error"), seconds, of("shear_iterations") / of("steps")))
    };
    let texts = |list: &[&str]| list.iter().map(|t| (*t).to_owned()).collect::<Vec<_>>();
    let variants = [
        ("cells", texts(&[&(cells / 2).to_string(), &cells.to_string(), &(2 * cells).to_string()])),
        ("per_axis", texts(&["2", "3", "4"])),
        ("dt", [4.0, 2.0, 1.0, 0.5, 0.25].iter().map(|f| format!("{:e}", f * dt)).collect()),
        ("tangent", texts(&["symmetric", "definite", "secant"])),
        ("newton", texts(&["1", "2", "4", "8"])),
        ("operator", texts(&["automatic", "quadrature", "particles"])),
        ("tolerance", texts(&["1e-2", "1e-3", "1e-4", "1e-6", "1e-8"])),
    ];
    let mut out = Outcome::new();
    let (reference, _, _) = one("", "")?;
    let mut rows = Vec::new();
    let mut series = Vec::new();
    for (name, values) in variants {
        let mut points = Vec::new();
        for value in values {
            let (error, seconds, iterations) = match one(name, &value) {
                Ok(found) => found,
                Err(error) => {
                    rows.push(vec![name.to_owned(), value, format!("{error}"), String::new(), String::new()]);
                    continue;
                }
            };
            rows.push(vec![
                name.to_owned(),
                value.clone(),
                format!("{:.3} %", 100.0 * error),
                format!("{seconds:.2}"),
                format!("{iterations:.1}"),
            ]);
            points.push([seconds, error]);
            if name == "tolerance" && value == "1e-8" {
                let why = "the default tolerance of the shear solve costs no accuracy (within a twentieth)";
                out.measure("tolerance_effect", (error / reference - 1.0).abs(), |x| x <= 0.05, why);
            }
            if name == "newton" && value == "8" {
                let why = "more Newton iterations than the default gain nothing (within a tenth)";
                out.measure("newton_effect", (error / reference - 1.0).abs(), |x| x <= 0.1, why);
            }
            if name == "cells" && value == (2 * cells).to_string() {
                let why = "twice the cells: at least first order";
                out.measure("order_in_cells", (reference / error).log2(), |x| x >= 1.0, why);
            }
        }
        series.push((name.to_owned(), points));
    }
    out.info("profile_error", reference);
    out.table(Table {
        title: format!("channel, {material}: one setting varied at a time"),
        columns: ["varied", "value", "profile error", "CPU [s]", "iterations per step"].map(String::from).to_vec(),
        rows,
    });
    out.curve(Curve {
        title: "profile error against processor time".into(),
        x_label: "processor time [s]".into(),
        y_label: "profile error".into(),
        log_x: true,
        log_y: true,
        series,
    });
    Ok(out)
}

/// How far the volume of still, then sloshing water drifts.
pub const VOLUME_DRIFT: Case = Case {
    id: "liquid/volume-drift",
    about: "A dam breaks in a closed tank: volume that liquid cells cover, after it has come to half its height, over the tolerance of the \
            pressure solve, and the largest divergence left. The default must lie where tightening changes nothing.",
    params: &[
        Param::count("cells", 16, "cells along the width of the column"),
        Param::count("steps", 150, "steps of 2 ms at most"),
    ],
    run: |p| alone(|| volume_drift(p)),
};

fn volume_drift(p: &Params) -> Result<Outcome, CaseError> {
    let cells = p.count_in("cells", 4, 64)?;
    let steps = p.count_in("steps", 1, 10_000)?;
    let a = 0.05;
    let dx = a / cells as f64;
    let water = constitutive::Liquid::preset("water").map_err(CaseError::failed)?;
    let materials = vec![setup::material(&water)?];
    let lattice = Lattice::<2>::new(dx);
    let wall = |x: f64, y: f64, nx: f64, ny: f64| HalfSpace {
        point: Vector::<2>::new(x, y),
        normal: Vector::<2>::new(nx, ny),
        stick: 0.0,
    };
    let walls = [wall(0.0, 0.0, 0.0, 1.0), wall(0.0, 0.0, 1.0, 0.0), wall(2.0 * a, 0.0, -1.0, 0.0)];
    let settings = LiquidSettings { particles_per_axis: 3, ..LiquidSettings::default() };
    let go = |tolerance: f64| -> Result<(f64, f64, f64, f64), CaseError> {
        let particles =
            setup::region(&lattice, 3, Vector::<2>::zeros(), Vector::<2>::new(a, 2.0 * a), |_| true, &materials);
        let mut settings = settings;
        settings.pressure.multigrid.tolerance = tolerance;
        let body = Vector::<2>::new(0.0, -GRAVITY);
        let mut run = Run::new(lattice, particles, materials.clone(), &walls, body, settings);
        let covered = |run: &Run<'_, 2, HalfSpace<2>>| {
            let grid = &run.stepper.grid;
            // Area by the smoothed share of cells, over which particles that overlap do not count twice.
            grid.cell.liquid_fraction.iter().zip(&grid.cell.kernel_open).map(|(f, k)| (f / k).min(1.0) * k).sum::<f64>()
                * dx
                * dx
        };
        let mut first = None;
        let (mut iterations, start) = (0, processor_seconds());
        for _ in 0..steps {
            let step = run.allowed(2e-3);
            let report = run.step(step)?;
            iterations += report.pressure.map_or(0, |r| r.multigrid.solve.iterations)
                + report.prediction.map_or(0, |r| r.multigrid.solve.iterations);
            first.get_or_insert_with(|| covered(&run));
        }
        let seconds = processor_seconds() - start;
        let drift = covered(&run) / first.unwrap_or(1.0) - 1.0;
        Ok((drift, iterations as f64 / steps as f64, seconds, run.time))
    };
    let mut out = Outcome::new();
    let mut rows = Vec::new();
    let (mut points, mut drifts) = (Vec::new(), Vec::new());
    for tolerance in [1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10] {
        let (drift, iterations, seconds, time) = go(tolerance)?;
        rows.push(vec![
            format!("{tolerance:.0e}"),
            format!("{:.3} %", 100.0 * drift),
            format!("{iterations:.1}"),
            format!("{seconds:.2}"),
            format!("{time:.3}"),
        ]);
        points.push([tolerance, drift.abs()]);
        drifts.push(drift);
    }
    let tightest = drifts[drifts.len() - 1];
    let default = drifts[drifts.len() - 2];
    let why = "the default tolerance drifts as the tightest does, within half a thousandth of the volume";
    out.measure("drift_by_tolerance", (default - tightest).abs(), |d| d <= 5e-4, why);
    out.measure("drift", default.abs(), |d| d <= 0.05, "of the volume covered: what the method itself loses");
    out.table(Table {
        title: "volume covered against the tolerance of the pressure".into(),
        columns: ["tolerance", "drift", "iterations per step", "CPU [s]", "time [s]"].map(String::from).to_vec(),
        rows,
    });
    out.curve(Curve {
        title: "drift of the volume".into(),
        x_label: "tolerance of the pressure solve".into(),
        y_label: "share of the volume".into(),
        log_x: true,
        log_y: true,
        series: vec![("dam break".into(), points)],
    });
    Ok(out)
}
