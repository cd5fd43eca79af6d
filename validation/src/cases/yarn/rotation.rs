//! A turned set-up against the set-up turned.

use super::setup::{CELL, material, observed_order, order_curve, plane, polyline};
use crate::case::{Case, CaseError, Outcome, Param, Params};

/// Rotation.
pub const CASE: Case = Case {
    id: "yarn/rotation",
    about: "A smooth stretching and bending yarn turned by an angle: quarter turns change nothing, others only the grid's error, of second order.",
    params: &[
        Param::number("rotation", 37.0, "degrees", "angle of the turned run"),
        Param::count("cells", 12, "length of the yarn in cells on the coarse grid"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    super::setup::alone(|| experiment(p))
}

fn experiment(p: &Params) -> Result<Outcome, CaseError> {
    let rotation = p.number_in("rotation", -360.0, 360.0)?;
    let cells = p.count_in("cells", 8, 100)?;
    let mut out = Outcome::new();
    let (quarter, _) = difference(cells, 90.0)?;
    out.compare_absolute("quarter_turn", quarter, 0.0, 1e-12);
    let (coarse, moved) = difference(cells, rotation)?;
    out.info("difference_coarse", coarse / moved);
    if coarse > 1e-11 {
        let mut points = vec![[1.0 / cells as f64, coarse / moved]];
        for finer in [3 * cells / 2, 2 * cells, 3 * cells] {
            let (off, moved) = difference(finer, rotation)?;
            points.push([1.0 / finer as f64, off / moved]);
        }
        out.info("difference_finest", points[3][1]);
        let order = observed_order(&points);
        out.measure("order", order, |o| o > 1.8, "observed order of the difference over four resolutions above 1.8");
        out.curve(order_curve("Turned run", "cell over length", "difference over motion", &points, 2.0));
    }
    Ok(out)
}

/// Largest distance between the turned run and the run turned after a fixed time, and the largest motion [m].
fn difference(cells: usize, rotation: f64) -> Result<(f64, f64), CaseError> {
    let length = 12.0 * CELL;
    let n = 2 * cells + 1;
    let (s, c) = rotation.to_radians().sin_cos();
    let run = |s: f64, c: f64| {
        let (mut points, mut velocities) = (Vec::new(), Vec::new());
        for i in 0..n {
            let t = i as f64 / (n - 1) as f64 - 0.5;
            let x = length * t;
            // A stretching wave, a swing and a slow bend, all smooth on the coarse grid.
            let v = [1.0 + 1.5 * (std::f64::consts::PI * t).sin(), 0.5 + 2.0 * (1.0 - 12.0 * t * t)];
            points.push(vec![0.5 + c * x, 0.5 + s * x]);
            velocities.push(vec![c * v[0] - s * v[1], s * v[0] + c * v[1]]);
        }
        let mut settings = plane(material(0.05), vec![polyline(points, vec![], velocities)]);
        settings.cell = length / cells as f64;
        // Width and mass must not change with the grid.
        settings.materials.insert("yarn".to_owned(), yarn::YarnMaterial { width: Some(0.5 * CELL), ..material(0.05) });
        let mut system = super::setup::build(&settings)?;
        // The same fixed step on both grids, so that only the grid differs.
        for _ in 0..100 {
            system.advance(4e-5).map_err(CaseError::failed)?;
        }
        Ok::<_, CaseError>(system.state().position.clone())
    };
    let (straight, turned) = (run(0.0, 1.0)?, run(s, c)?);
    let (mut off, mut moved) = (0.0f64, 0.0f64);
    for (i, (a, b)) in straight.iter().zip(&turned).enumerate() {
        let back = [c * (b[0] - 0.5) + s * (b[1] - 0.5) + 0.5, c * (b[1] - 0.5) - s * (b[0] - 0.5) + 0.5];
        off = off.max((a[0] - back[0]).hypot(a[1] - back[1]));
        let x = length * (i as f64 / (n - 1) as f64 - 0.5);
        moved = moved.max((a[0] - 0.5 - x).hypot(a[1] - 0.5));
    }
    Ok((off, moved))
}
