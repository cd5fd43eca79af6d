//! A block of parallel yarns on an incline.

use geometry::{Motion, ShapeDescription, Vector3};
use yarn::settings::ObstacleSettings;
use yarn::{YarnGroup, YarnShape};

use super::setup::{CELL, build, material, plane};
use crate::case::{Case, CaseError, Outcome, Param, Params, Table};

/// Incline.
pub const CASE: Case = Case {
    id: "yarn/incline",
    about: "A block of parallel yarns on an incline rests below the friction angle and accelerates with g (sin θ − c_f cos θ) above it (Coulomb).",
    params: &[
        Param::number("friction", 0.3, "1", "Coulomb coefficient of the yarns and of the incline"),
        Param::number("angle", 30.0, "degrees", "slope of the incline"),
        Param::count("layers", 3, "yarns in the block"),
    ],
    run,
};

const GRAVITY: f64 = 9.8;

fn run(p: &Params) -> Result<Outcome, CaseError> {
    super::setup::alone(|| experiment(p))
}

fn experiment(p: &Params) -> Result<Outcome, CaseError> {
    let friction = p.number_in("friction", 0.0, 2.0)?;
    let angle = p.number_in("angle", 0.0, 80.0)?.to_radians();
    let layers = p.count_in("layers", 1, 20)?;
    let mut out = Outcome::new();
    let (acceleration, speed) = slide(friction, angle, layers)?;
    let exact = GRAVITY * (angle.sin() - friction * angle.cos());
    if exact > 0.0 {
        out.compare("acceleration", acceleration, exact, 0.02);
    } else {
        out.compare_absolute("acceleration", acceleration, 0.0, 0.002 * GRAVITY);
        out.compare_absolute("speed", speed, 0.0, 0.01);
    }
    let mut rows = Vec::new();
    let (mut worst, mut at_one) = (0.0f64, 0.0f64);
    for c in [0.05f64, 0.1, 0.2, 0.5, 1.0] {
        for (name, slope) in [("above", c.atan() + 0.15), ("below", c.atan() - 0.04)] {
            let (measured, _) = slide(c, slope, layers)?;
            let exact = (GRAVITY * (slope.sin() - c * slope.cos())).max(0.0);
            if exact > 0.0 {
                let error = (slope.tan() - measured / (GRAVITY * slope.cos()) - c).abs() / c;
                if c < 1.0 {
                    worst = worst.max(error);
                } else {
                    at_one = error;
                }
            }
            rows.push(vec![
                format!("{c}"),
                name.to_owned(),
                format!("{measured:.4}"),
                format!("{exact:.4}"),
                // The coefficient that the measured acceleration means.
                format!("{:.4}", slope.tan() - measured / (GRAVITY * slope.cos())),
            ]);
        }
    }
    out.compare_absolute("largest_error_to_one_half", worst, 0.0, 0.02);
    out.compare_absolute("error_at_one", at_one, 0.0, 0.1);
    out.table(Table {
        title: "Acceleration over friction".to_owned(),
        columns: ["friction", "slope", "measured m/s²", "exact m/s²", "apparent coefficient"]
            .map(str::to_owned)
            .to_vec(),
        rows,
    });
    Ok(out)
}

/// Acceleration down the slope over the second half of the run, and the speed at its end.
fn slide(friction: f64, angle: f64, layers: usize) -> Result<(f64, f64), CaseError> {
    let lines = YarnShape::Lines {
        from: vec![0.3, 0.5 + 0.5 * CELL],
        to: vec![0.3 + 10.0 * CELL, 0.5 + 0.5 * CELL],
        count: layers,
        step: vec![0.0, CELL],
    };
    let mut settings = plane(material(friction), vec![YarnGroup::new(lines)]);
    settings.gravity = vec![GRAVITY * angle.sin(), -GRAVITY * angle.cos()];
    settings.obstacles = vec![ObstacleSettings {
        shape: ShapeDescription::HalfSpace { point: Vector3::new(0.0, 0.5, 0.0), normal: Vector3::y() },
        motion: Motion::default(),
        friction,
        restitution: 0.0,
    }];
    let mut system = build(&settings)?;
    let mass = system.model().total_mass();
    let (dt, steps) = (1e-4, 1600);
    let mut half = 0.0;
    for step in 0..steps {
        if step == steps / 2 {
            half = system.momentum().linear[0] / mass;
        }
        system.advance(dt).map_err(CaseError::failed)?;
    }
    let end = system.momentum().linear[0] / mass;
    Ok(((end - half) / (0.5 * dt * f64::from(steps)), end))
}
