//! Frequency of longitudinal standing waves.

use super::setup::{CELL, SEGMENT, build, material, observed_order, order_curve, plane, polyline};
use crate::case::{Case, CaseError, Outcome, Param, Params};

/// Axial mode.
pub const CASE: Case = Case {
    id: "yarn/axial-mode",
    about: "Standing longitudinal wave of a free yarn: frequency against n c/2L with c = √(k/ρ), second order in the cell, in any direction.",
    params: &[
        Param::count("cells", 20, "length of the yarn in cells"),
        Param::count("mode", 1, "half waves along the yarn"),
        Param::number("rotation", 0.0, "degrees", "direction of the yarn"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    super::setup::alone(|| experiment(p))
}

fn experiment(p: &Params) -> Result<Outcome, CaseError> {
    let cells = p.count_in("cells", 6, 400)?;
    let mode = p.count_in("mode", 1, cells / 6)?;
    let rotation = p.number_in("rotation", -360.0, 360.0)?;
    let (ratio, kept) = frequency_ratio(cells, mode, rotation)?;
    let mut points = vec![[1.0 / cells as f64, (1.0 - ratio).abs()]];
    for finer in [3 * cells / 2, 2 * cells, 3 * cells] {
        points.push([1.0 / finer as f64, (1.0 - frequency_ratio(finer, mode, rotation)?.0).abs()]);
    }
    let mut out = Outcome::new();
    let resolution = (mode as f64 / cells as f64).powi(2);
    out.compare("frequency_ratio", ratio, 1.0, 1.6 * resolution);
    let order = observed_order(&points);
    out.measure(
        "order",
        order,
        |o| o > 1.8,
        "observed order over this and 1.5, 2 and 3 times the resolution above 1.8",
    );
    out.info("amplitude_after_two_periods", kept);
    out.curve(order_curve("Axial mode", "cell over length", "error of the frequency", &points, 2.0));
    Ok(out)
}

/// Measured frequency over the exact one, and the share of the amplitude left after two periods.
fn frequency_ratio(cells: usize, mode: usize, rotation: f64) -> Result<(f64, f64), CaseError> {
    let n = 2 * cells + 1;
    let length = cells as f64 * CELL;
    let (s, c) = rotation.to_radians().sin_cos();
    let shape: Vec<f64> =
        (0..n).map(|i| (mode as f64 * std::f64::consts::PI * i as f64 / (n - 1) as f64).cos()).collect();
    let points = (0..n)
        .map(|i| {
            let along = (i as f64 - 0.5 * (n - 1) as f64) * SEGMENT;
            vec![0.5 + along * c, 0.5 + along * s]
        })
        .collect();
    let velocities = shape.iter().map(|a| vec![0.05 * a * c, 0.05 * a * s]).collect();
    let mut settings = plane(material(0.05), vec![polyline(points, vec![], velocities)]);
    settings.plastic = false;
    let mut system = build(&settings)?;
    let period = 2.0 * length / 1000f64.sqrt() / mode as f64;
    let dt = 5e-5;
    let mut amplitude = Vec::new();
    let project = |system: &yarn::YarnSystem<2>| {
        system.state().velocity.iter().zip(&shape).map(|(v, a)| (v[0] * c + v[1] * s) * a).sum::<f64>() / n as f64
    };
    let start = project(&system);
    while (amplitude.len() as f64) * dt < 2.2 * period {
        system.advance(dt).map_err(CaseError::failed)?;
        amplitude.push(project(&system));
    }
    let crossings: Vec<f64> = amplitude
        .windows(2)
        .enumerate()
        .filter(|(_, w)| w[0] > 0.0 && w[1] <= 0.0)
        .map(|(i, w)| i as f64 + w[0] / (w[0] - w[1]))
        .collect();
    if crossings.len() < 2 {
        return Err(CaseError::failed("the wave did not swing twice"));
    }
    let kept = amplitude[(1.9 * period / dt) as usize..].iter().fold(0.0f64, |a, b| a.max(b.abs())) / start;
    Ok((period / ((crossings[1] - crossings[0]) * dt), kept))
}
