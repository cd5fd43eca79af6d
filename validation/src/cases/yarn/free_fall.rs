//! Free fall of a yarn against the exact sum of the scheme.

use yarn::{YarnGroup, YarnShape};

use super::setup::{build, material, plane};
use crate::case::{Case, CaseError, Outcome, Param, Params};

/// Free fall.
pub const CASE: Case = Case {
    id: "yarn/free-fall",
    about: "A yarn in free fall follows x0 + v0 n dt + g dt² n(n+1)/2 and does not deform (exact solution of the time scheme).",
    params: &[Param::count("steps", 300, "steps"), Param::number("step", 1e-4, "s", "step size")],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    super::setup::alone(|| experiment(p))
}

fn experiment(p: &Params) -> Result<Outcome, CaseError> {
    let steps = p.count_in("steps", 1, 100_000)?;
    let dt = p.number_in("step", 1e-7, 1e-4)?;
    let velocity = [0.3, 0.1];
    let line = YarnShape::Line { from: vec![0.4, 0.7], to: vec![0.55, 0.7] };
    let mut settings = plane(material(0.05), vec![YarnGroup { velocity: velocity.to_vec(), ..YarnGroup::new(line) }]);
    settings.gravity = vec![0.0, -9.8];
    let mut system = build(&settings)?;
    let start = system.state().position.clone();
    for _ in 0..steps {
        system.advance(dt).map_err(CaseError::failed)?;
    }
    let n = steps as f64;
    let (mut off, mut strain) = (0.0f64, 0.0f64);
    for (i, x) in system.state().position.iter().enumerate() {
        off = off.max((x[0] - start[i][0] - velocity[0] * n * dt).abs());
        off = off.max((x[1] - start[i][1] - velocity[1] * n * dt + 9.8 * dt * dt * n * (n + 1.0) / 2.0).abs());
        let f = system.state().deformation[i];
        strain = strain.max((f - f.map(f64::round)).abs().max());
    }
    let mut out = Outcome::new();
    out.compare_absolute("position", off, 0.0, 1e-13 * n.max(10.0).sqrt() * 10.0);
    out.compare_absolute("strain", strain, 0.0, 1e-10);
    out.compare_absolute("momentum_defect", system.momentum_defect(), 0.0, 1e-12);
    Ok(out)
}
