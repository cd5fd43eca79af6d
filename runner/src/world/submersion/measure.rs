//! Figures of strands in liquid for the record.

use super::{Submersion, SubmersionState};
use crate::system::Column;

const AXES: [&str; 3] = ["x", "y", "z"];

/// Columns of strands in liquid.
pub fn columns(submersion: &Submersion, columns: &mut Vec<Column>) {
    columns.push(Column::new("submerged_vertices", "1", "vertices in the liquid"));
    columns.push(Column::new("submerged_stuck", "1", "of these, those that stick to it below its yield stress"));
    columns.push(Column::new(
        "slip_mean",
        "m/s",
        "mean speed between vertices in the liquid and the liquid around them",
    ));
    columns.push(Column::new("slip_max", "m/s", "largest speed between a vertex and the liquid around it"));
    if submersion.outer.iterations > 1 {
        columns.push(Column::new("outer_iterations", "1", "solves of strands and liquid against each other"));
        columns.push(Column::new("outer_change", "1", "change of velocities by the last of them, relative"));
    }
    columns.push(Column::new("solid_fraction_max", "1", "largest share of a cell that strands take"));
    for (name, meaning) in [
        ("drag_impulse", "momentum that strands got from the liquid by drag so far"),
        ("pressure_impulse", "momentum that strands got from the liquid by pressure so far"),
        ("transfer_impulse", "momentum that strands got with liquid taken up, given back and shed so far"),
    ] {
        for axis in AXES {
            columns.push(Column::new(format!("{name}_{axis}"), "N s", meaning));
        }
    }
}

/// Values of those columns.
pub fn row(submersion: &Submersion, state: &SubmersionState, out: &mut Vec<f64>) {
    out.extend([submersion.wet.len() as f64, submersion.stuck as f64]);
    out.extend(submersion.slip);
    if submersion.outer.iterations > 1 {
        out.extend([submersion.outer_iterations as f64, submersion.outer_change]);
    }
    out.push(submersion.densest);
    let exchanged = &state.exchanged;
    for sum in [exchanged.drag, exchanged.pressure, exchanged.transfer] {
        out.extend(sum.iter());
    }
}
