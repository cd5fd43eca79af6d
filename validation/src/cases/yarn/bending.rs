//! Energy of bending at small and large angles.

use yarn::YarnMaterial;
use yarn::settings::Bending;

use super::setup::{CELL, build, material, plane, polyline};
use crate::case::{Case, CaseError, Outcome, Param, Params, Table};

/// Bending.
pub const CASE: Case = Case {
    id: "yarn/bending",
    about: "A yarn bent to an arc: the rod has B L/2R² (second order in the segment, E ∝ θ²), the note's spring has no stiffness at small angles (E ∝ θ⁴).",
    params: &[
        Param::count("segments", 16, "segments of the arc"),
        Param::number("angle", 60.0, "degrees", "turn of the whole arc"),
    ],
    run,
};

/// Energy of a yarn of 12 cells bent to an arc of `angle` [J/m]; the rest lengths are the chords.
fn energy(bending: Bending, segments: usize, angle: f64) -> Result<f64, CaseError> {
    let length = 12.0 * CELL;
    let radius = length / angle;
    let points = (0..=segments)
        .map(|i| {
            let turn = angle * (i as f64 / segments as f64 - 0.5);
            vec![0.5 + radius * turn.sin(), 0.5 + radius * (turn.cos() - 1.0)]
        })
        .collect();
    let mut settings = plane(YarnMaterial { bending, ..material(0.05) }, vec![polyline(points, vec![], vec![])]);
    // Long segments are fine: nothing is stepped.
    settings.cell = 12.0 * CELL / segments as f64;
    Ok(build(&settings)?.energy().bending)
}

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let segments = p.count_in("segments", 4, 10_000)?;
    let angle = p.number_in("angle", 1.0, 300.0)?.to_radians();
    let stiffness = 1e-4;
    let rod = Bending::Rod { stiffness: Some(stiffness) };
    let spring = Bending::Spring { stiffness: Some(1.0) };
    // Inner vertices see all of the arc but half a segment at each end.
    let inner = |n: usize| (n as f64 - 1.0) / n as f64;
    let exact = |n: usize| 0.5 * stiffness * angle * angle / (12.0 * CELL) * inner(n);
    let error = |n: usize| Ok::<f64, CaseError>((energy(rod, n, angle)? / exact(n) - 1.0).abs());
    let (coarse, fine) = (error(segments)?, error(2 * segments)?);
    let mut out = Outcome::new();
    let turn = angle / segments as f64;
    out.compare_absolute("rod_energy", coarse, 0.0, 0.5 * turn * turn);
    out.measure("order", (coarse / fine).log2(), |o| o > 1.8, "observed order in the segment above 1.8");
    let mut rows = Vec::new();
    for (name, law, wanted) in [("rod", rod, 2.0), ("spring", spring, 4.0)] {
        let small = energy(law, segments, 0.02)?;
        let power = (energy(law, segments, 0.04)? / small).log2();
        out.compare_absolute(&format!("{name}_power"), power, wanted, 0.02);
        rows.push(vec![name.to_owned(), format!("{power:.4}"), format!("{:.3e}", energy(law, segments, angle)?)]);
    }
    out.table(Table {
        title: "Energy of an arc".to_owned(),
        columns: ["law", "power of the angle when it is small", "energy at the angle asked for [J/m]"]
            .map(str::to_owned)
            .to_vec(),
        rows,
    });
    Ok(out)
}
