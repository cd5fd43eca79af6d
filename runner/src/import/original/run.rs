//! Time span, step, gravity and grid: `duration`, `integrator`, `simplegravity`, `bucketinfo`.

use super::{Element, Number, Sited};
use crate::import::notes::Heading;
use crate::scene::error::ProblemKind;

/// Time, gravity and grid of the original [CGS].
pub struct Run {
    /// What the file says of itself.
    pub description: Option<String>,
    /// When it ends [s].
    pub end: Number,
    /// Step [s].
    pub step: Number,
    /// Cells that a liquid particle may cross before a step is cut in parts.
    pub cfl: Number,
    /// Gravity [cm/s²].
    pub gravity: Sited<[f64; 3]>,
    /// Size of a grid cell [cm].
    pub cell: Number,
}

impl Run {
    /// Reads them.
    #[must_use]
    pub fn read(root: &Element<'_, '_>) -> Run {
        let document = root.document();
        let description = root.child("description").and_then(|element| element.text("text"));
        let required = |name: &str, attribute: &str, meaning: &str| {
            let Some(element) = root.child(name) else {
                let message = format!("the scene has no <{name}>");
                let help = format!("add `<{name} {attribute}=\"…\"/>`: {meaning}");
                document.problem(ProblemKind::MissingField, root.span(), message, help);
                return Sited::made(f64::NAN);
            };
            if element.text(attribute).is_none() {
                let message = format!("<{name}> has no attribute `{attribute}`");
                document.problem(ProblemKind::MissingField, element.span(), message, format!("add it: {meaning}"));
                return Sited::made(f64::NAN);
            }
            match element.number(attribute) {
                Some(number) if number.value > 0.0 => number,
                Some(number) => {
                    let message = format!("`{attribute}` of <{name}> must be above 0, found {}", number.value);
                    document.problem(ProblemKind::OutOfRange, number.span, message, meaning);
                    Sited::made(f64::NAN)
                }
                None => Sited::made(f64::NAN),
            }
        };
        let end = required("duration", "time", "when the run ends [s]");
        let step = required("integrator", "dt", "the step [s]");
        let cfl = root.child("integrator").and_then(|element| element.number("cfl")).unwrap_or(Sited::made(1.0));
        let gravity = match root.child("simplegravity") {
            Some(element) => element.vector_of(["fx", "fy", "fz"], [0.0; 3]),
            None => {
                document.assumed("simplegravity", "all components", 0.0);
                Sited::made([0.0; 3])
            }
        };
        Run {
            description: description.map(|text| text.value.split_whitespace().collect::<Vec<_>>().join(" ")),
            end,
            step,
            cfl,
            gravity,
            cell: cell(root),
        }
    }
}

fn cell(root: &Element<'_, '_>) -> Number {
    let document = root.document();
    let Some(element) = root.child("bucketinfo") else {
        document.assumed("bucketinfo", "size / numcells", 1.0);
        return Sited::made(1.0);
    };
    let size = element.number("size").unwrap_or(Sited::made(5.0));
    let cells = element.integer("numcells").unwrap_or(Sited::made(5));
    if cells.value < 1 || size.value.is_nan() || size.value <= 0.0 {
        let message = format!("{} cells in a bucket of {} cm", cells.value, size.value);
        let span = if cells.value < 1 { cells.span } else { size.span };
        document.problem(ProblemKind::OutOfRange, span, message, "both must be above 0");
        return Sited::made(1.0);
    }
    if cells.value != 4 {
        let what = format!("bucketinfo: numcells = {}", cells.value);
        document.note(Heading::Machinery, cells.span, what, "only the size of a cell, size / numcells, matters here");
    }
    #[allow(clippy::cast_precision_loss)]
    size.map(|size| size / cells.value as f64)
}
