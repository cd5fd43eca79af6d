//! A yarn pulled over a round post.

use geometry::{Ease, Motion, ShapeDescription, Vector3, motion::Movement};
use yarn::YarnMaterial;
use yarn::diagnostics::tension;
use yarn::settings::{Drive, ImplicitSettings, Integrator, ObstacleSettings};

use super::setup::{CELL, SEGMENT, build, material, plane, polyline};
use crate::case::{Case, CaseError, Outcome, Param, Params};

/// Capstan.
pub const CASE: Case = Case {
    id: "yarn/capstan",
    about: "A yarn held at one end and drawn over a fixed post: tensions of the free ends against Euler's T₂/T₁ = exp(μ φ); first order in cell over radius.",
    params: &[
        Param::number("friction", 0.3, "1", "Coulomb coefficient of the post"),
        Param::number("wrap", 180.0, "degrees", "angle of contact"),
        Param::number("radius", 20.0, "cells", "radius of the post"),
        Param::number("time", 0.25, "s", "time of the draw"),
        Param::count("steps", 1000, "implicit steps"),
        Param::number("strain", 0.02, "1", "strain at the held end when friction is mobilised everywhere"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    super::setup::alone(|| experiment(p))
}

fn experiment(p: &Params) -> Result<Outcome, CaseError> {
    let friction = p.number_in("friction", 0.0, 1.0)?;
    let wrap = p.number_in("wrap", 30.0, 180.0)?.to_radians();
    let radius = p.number_in("radius", 4.0, 80.0)?;
    let strain = p.number_in("strain", 1e-4, 0.2)?;
    let time = p.number_in("time", 0.01, 100.0)?;
    let steps = p.count_in("steps", 20, 1_000_000)?;
    let draw = |radius| draw(friction, wrap, radius, strain, time, steps);
    let (coarse, fine) = (draw(0.5 * radius)?, draw(radius)?);
    let apparent = |tensions: (f64, f64)| (tensions.1 / tensions.0).ln() / wrap;
    let (half, whole) = (apparent(coarse), apparent(fine));
    let mut out = Outcome::new();
    out.compare("tension_ratio", fine.1 / fine.0, (friction * wrap).exp(), 0.05);
    // The nodes that the post holds lie under the yarn, by most of a cell: friction has the shorter lever.
    let extrapolated = 2.0 * whole - half;
    out.compare_absolute("extrapolated_friction", extrapolated, friction, 0.01 + 0.03 * friction);
    out.info("apparent_friction", whole);
    out.info("apparent_friction_half_radius", half);
    out.info("lever_in_cells", radius * (1.0 - whole / friction.max(1e-9)));
    out.info("held_tension", fine.0);
    out.info("drawn_tension", fine.1);
    Ok(out)
}

/// Mean tensions of the held and of the drawn end in the last quarter [N/m]; `radius` in cells.
fn draw(friction: f64, wrap: f64, radius: f64, strain: f64, time: f64, steps: usize) -> Result<(f64, f64), CaseError> {
    let radius = radius * CELL;
    let free = 8.0 * CELL;
    // The yarn's own friction is larger than the post's: otherwise it shears inside instead of sliding on the post.
    // From the held end up, over the post, and down to the drawn end; starts just off the surface.
    let reach = radius + 0.5 * CELL;
    let half = 0.5 * wrap;
    let arc = reach * wrap;
    let total = 2.0 * free + arc;
    let n = (total / SEGMENT).round() as usize + 1;
    let place = |s: f64| {
        // Angle from the top, positive to the right.
        let along = (s - free).clamp(0.0, arc);
        let angle = -half + along / reach;
        let rest = if s < free { s - free } else { (s - free - arc).max(0.0) };
        let (sin, cos) = angle.sin_cos();
        vec![0.5 + reach * sin + rest * cos, 0.5 + reach * cos - rest * sin]
    };
    let points: Vec<Vec<f64>> = (0..n).map(|i| place(total * i as f64 / (n - 1) as f64)).collect();
    // Stretched by 2 % at the held end when friction is mobilised everywhere; slow against the waves.
    let growth = (friction * wrap).exp();
    let draw = strain * (free * (1.0 + growth) + arc * (growth + 1.0) * 0.5);
    let (sin, cos) = half.sin_cos();
    let pull =
        Movement::Translate { by: Vector3::new(cos * draw, -sin * draw, 0.0), during: (0.0, time), ease: Ease::Linear };
    let mut settings =
        plane(YarnMaterial { stretch_modulus: 4000.0, ..material(3.0) }, vec![polyline(points, vec![], vec![])]);
    settings.obstacles = vec![ObstacleSettings {
        shape: ShapeDescription::Sphere { center: Vector3::new(0.5, 0.5, 0.0), radius },
        motion: Motion::default(),
        friction,
        restitution: 0.0,
    }];
    settings.drives = vec![
        Drive { yarn: 0, vertex: 0, motion: Motion::default() },
        Drive { yarn: 0, vertex: -1, motion: Motion { movements: vec![pull] } },
    ];
    // Explicit steps are worse at slow sliding: the momentum that yarns bring round the curved rows of nodes each step is no longer small
    // against what the tension brings.
    settings.step.integrator = Integrator::Implicit(ImplicitSettings { max_newton: 60, ..ImplicitSettings::default() });
    let mut system = build(&settings)?;
    let dt = time / steps as f64;
    let (mut held, mut drawn, mut count) = (0.0, 0.0, 0.0);
    let clear = (3.0 * CELL / SEGMENT) as usize;
    let span = (free / SEGMENT) as usize;
    for step in 0..steps {
        system.advance(dt).map_err(CaseError::failed)?;
        // A thousandth per step damps the waves of the start within a few transits.
        for v in &mut system.state_mut().velocity {
            *v *= 1.0 - 20.0 * dt;
        }
        if step * 4 > steps * 3 && step % 10 == 0 {
            let mean = |from: usize, to: usize| {
                (from..to).map(|i| tension(system.model(), system.state(), i)).sum::<f64>() / (to - from) as f64
            };
            held += mean(2, span - clear);
            drawn += mean(n - 1 - span + clear, n - 3);
            count += 1.0;
        }
    }
    Ok((held / count, drawn / count))
}
