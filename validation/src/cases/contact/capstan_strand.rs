//! A strand of rods around a bollard, run as a scene.

use crate::case::{Case, CaseError, Outcome, Param, Params};
use crate::hard::SceneRun;

/// Ratio of the clamp forces e^{νφ}.
pub const CASE: Case = Case {
    id: "contact/capstan-strand",
    about: "A thin strand drawn around a fixed cylinder, as a scene: ratio of the two clamps' forces e^{νφ}",
    params: &[
        Param::number("nu", 0.3, "1", "friction coefficient"),
        Param::number("angle", 180.0, "deg", "angle of wrap"),
        Param::count("vertices", 32, "edges on the cylinder"),
    ],
    run,
};

/// Radius of the cylinder and of the strand [m], length of the straight parts [m].
const CYLINDER: f64 = 0.02;
const STRAND: f64 = 1e-4;
const STRAIGHT: f64 = 0.03;

/// The scene: straight in, around, straight out; both ends are pulled taut, then all is drawn around.
fn scene(nu: f64, angle: f64, edges: usize) -> String {
    // the straight parts go on along the first and the last edge, so that all turning is at the vertices between them;
    // edges touch at their middles, so vertices lie a little outside
    let half = 0.5 * angle / (edges - 1) as f64;
    let radius = (CYLINDER + STRAND) / half.cos();
    let at = |i: f64| (radius * (2.0 * half * i).cos(), radius * (2.0 * half * i).sin());
    let spacing = 2.0 * radius * half.sin();
    let straight = (STRAIGHT / spacing).round().max(4.0) as usize;
    // directions out of the arc: along the first and last edge
    let way = |i: f64, sign: f64| {
        let a = 2.0 * half * i;
        (-sign * a.sin(), sign * a.cos())
    };
    let (into, out) = (way(0.5, -1.0), way(edges as f64 - 0.5, 1.0));
    let mut points = Vec::new();
    let (first, last) = (at(0.0), at(edges as f64));
    for k in (1..=straight).rev() {
        let d = spacing * k as f64;
        points.push((first.0 + into.0 * d, first.1 + into.1 * d));
    }
    points.extend((0..=edges).map(|i| at(i as f64)));
    for k in 1..=straight {
        let d = spacing * k as f64;
        points.push((last.0 + out.0 * d, last.1 + out.1 * d));
    }
    let list: Vec<String> = points.iter().map(|(x, y)| format!("[{x:e}, {y:e}, 0]")).collect();
    let length = spacing * (points.len() - 1) as f64;
    let taut = 0.005 * length;
    // enough to slide everywhere, also where the ratio is large
    let drawn = (2.0 * taut * (nu * angle).exp()).min(0.5 * STRAIGHT);
    let by = |way: (f64, f64), d: f64| format!("[{:e}, {:e}, 0]", way.0 * d, way.1 * d);
    format!(
        "Scene(
            units: Si, time: (end: 0.2, step: Fixed(1e-3)), gravity: [0, 0, 0],
            materials: {{ \"string\": Fibre(density: 1000, young_modulus: 1e8, poisson_ratio: 0.4, viscosity: 1e4) }},
            strands: [(material: \"string\", radius: {STRAND:e}, friction: {nu:e}, shape: Polyline([{}]),
                clamp: [
                    First(2, motion: [Translate(by: {}, during: (0, 0.05)), Translate(by: {}, during: (0.05, 0.2))]),
                    Last(2, motion: [Translate(by: {}, during: (0, 0.05)), Translate(by: {}, during: (0.05, 0.2))]),
                ])],
            solids: [(name: \"bollard\", shape: Cylinder(center: [0, 0, 0], axis: Z, radius: {CYLINDER:e}, half_length: 0.02), friction: {nu:e})],
            contact: (tolerance: 1e-8),
            output: (frames: Never, checkpoint: Never),
        )",
        list.join(", "),
        by(into, taut),
        by(into, -drawn),
        by(out, taut),
        by(out, drawn),
    )
}

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let nu = p.number_in("nu", 0.0, 1.0)?;
    let angle = p.number_in("angle", 30.0, 270.0)?.to_radians();
    let edges = p.count_in("vertices", 8, 200)?;
    let run = SceneRun::of(&scene(nu, angle, edges), "capstan-strand.ron", &[])?;
    let size = |name: &str| -> Result<Vec<f64>, CaseError> {
        let force = run.series.vector(name)?;
        Ok(force.iter().map(|f| (f[0] * f[0] + f[1] * f[1] + f[2] * f[2]).sqrt()).collect())
    };
    let (low, high) = (size("clamp0_force")?, size("clamp1_force")?);
    // the last quarter: all of it slides, and vertices have passed the ends of the arc
    let from = low.len() - low.len() / 4;
    let mean = |x: &[f64]| x[from..].iter().sum::<f64>() / (x.len() - from) as f64;
    let mut out = Outcome::new();
    out.measure("completed", run.completed(), |x| x == 1.0, "the run comes to its end");
    out.compare("tension_ratio", mean(&high) / mean(&low), (nu * angle).exp(), 0.02);
    let defect = run.series.column("momentum_defect")?.iter().copied().fold(0.0, f64::max);
    out.measure("momentum_defect", defect, |x| x <= 1e-9, "momentum balances to round-off");
    out.info("contacts", run.series.column("contacts")?.last().copied().unwrap_or(0.0));
    out.info("warnings", run.series.column("contact_warnings")?.last().copied().unwrap_or(0.0));
    Ok(out)
}
