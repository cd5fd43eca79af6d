//! A yarn pulled out from between two others under load.

use geometry::{Ease, Motion, ShapeDescription, Vector3, motion::Movement};
use std::path::Path;

use yarn::settings::{Drive, ImplicitSettings, Integrator, ObstacleSettings};
use yarn::{YarnGroup, YarnMaterial, YarnShape, YarnSystem};

use super::setup::{CELL, material, plane};
use crate::case::{Case, CaseError, Outcome, Param, Params, Table};

/// Pull-out.
pub const CASE: Case = Case {
    id: "yarn/crossed-pull",
    about: "A yarn drawn slowly out from between two yarns that plates press with load N: pull-out force against 2 c_f N (Coulomb on both sides).",
    params: &[
        Param::number("friction", 0.3, "1", "Coulomb coefficient between the yarns"),
        Param::count("dimension", 2, "2: three parallel yarns; 3: three layers, the outer two across the drawn one"),
        Param::number(
            "section_friction",
            3.0,
            "1",
            "in space: Coulomb coefficient against a change of shape of the cross-section",
        ),
        Param::number("time", 0.24, "s", "time of the experiment"),
        Param::flag("sweep", false, "measure coefficients from 0.05 to 1 as well"),
        Param::number("compression", 0.01, "1", "share by which the plates close"),
        Param::number("implicit_step", 0.0, "s", "implicit steps of this length; 0: explicit steps"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    super::setup::alone(|| experiment(p))
}

fn experiment(p: &Params) -> Result<Outcome, CaseError> {
    let friction = p.number_in("friction", 0.01, 2.0)?;
    let compression = p.number_in("compression", 0.005, 0.3)?;
    let dimension = p.count_in("dimension", 2, 3)?;
    let mut out = Outcome::new();
    let section = p.number_in("section_friction", 0.0, 10.0)?;
    let time = p.number_in("time", 0.1, 10.0)?;
    let implicit = p.number_in("implicit_step", 0.0, 0.01)?;
    let pull = |friction: f64, compression: f64| {
        let set = Set { friction, compression, section, time, implicit };
        if dimension == 2 { pull::<2>(&set) } else { pull::<3>(&set) }
    };
    let (force, load) = pull(friction, compression)?;
    out.compare("pull_out_force", force, 2.0 * friction * load, 0.05);
    out.info("load", load);
    if p.flag("sweep")? {
        let mut rows = Vec::new();
        let mut worst = 0.0f64;
        for c in [0.05, 0.1, 0.2, 0.5, 1.0] {
            let (force, load) = pull(c, compression)?;
            let apparent = force / (2.0 * load);
            worst = worst.max((apparent / c - 1.0).abs());
            rows.push(vec![
                format!("{c}"),
                format!("{apparent:.4}"),
                format!("{:+.2} %", 100.0 * (apparent / c - 1.0)),
            ]);
        }
        out.info("largest_error_of_the_sweep", worst);
        out.table(Table {
            title: "Friction measured by pull-out".to_owned(),
            columns: ["coefficient asked for", "measured", "error"].map(str::to_owned).to_vec(),
            rows,
        });
    }
    Ok(out)
}

/// What is pulled, and how.
struct Set {
    friction: f64,
    compression: f64,
    section: f64,
    time: f64,
    /// Implicit step [s], or zero.
    implicit: f64,
}

/// Mean force of the pull in its last quarter, and mean load of a plate [N/m; N in space].
fn pull<const D: usize>(set: &Set) -> Result<(f64, f64), CaseError> {
    let Set { friction, compression, section, time, implicit } = *set;
    let point = |x: f64, y: f64, z: f64| {
        let place = [0.5 + x * CELL, 0.5 + y * CELL, 0.5 + z * CELL];
        place[..D].to_vec()
    };
    let lines = |from, to, count, step: [f64; 3]| {
        let step = step.map(|s| s * CELL)[..D].to_vec();
        YarnGroup::new(YarnShape::Lines { from, to, count, step })
    };
    // In space a single crossing would not do: the outer yarns are near enough to press on each other beside it.
    let outer = |y: f64| {
        if D == 2 {
            lines(point(-8.0, y, 0.0), point(8.0, y, 0.0), 1, [0.0; 3])
        } else {
            lines(point(-8.0, y, -3.0), point(-8.0, y, 3.0), 17, [1.0, 0.0, 0.0])
        }
    };
    let drawn = if D == 2 { 1 } else { 7 };
    let first_drawn = if D == 2 { 1 } else { 17 };
    let side = 0.5 * (drawn as f64 - 1.0);
    let middle = lines(point(-9.0, 0.0, -side), point(10.0, 0.0, -side), drawn, [0.0, 0.0, 1.0]);
    let mut settings = plane(
        YarnMaterial { stretch_modulus: 1e4, section_friction: Some(section), ..material(friction) },
        vec![outer(-1.0), middle, outer(1.0)],
    );
    settings.dimension = D;
    // Plates that the outer yarns cannot slide on, closing from both sides.
    let close = 0.04;
    let plate = |side: f64| ObstacleSettings {
        shape: ShapeDescription::HalfSpace {
            point: Vector3::new(0.5, 0.5 + side * 1.5 * CELL, 0.0),
            normal: Vector3::new(0.0, -side, 0.0),
        },
        motion: Motion {
            movements: vec![Movement::Translate {
                by: Vector3::new(0.0, -side * 1.5 * CELL * compression, 0.0),
                during: (0.0, close),
                ease: Ease::Smoothstep,
            }],
        },
        friction: 10.0,
        restitution: 0.0,
    };
    settings.obstacles = vec![plate(-1.0), plate(1.0)];
    // A quick draw that mobilises the friction against the yarn's own stretch (load about 68 N/m per unit of closing), then a slow one
    // to measure: yarns that share nodes drag each other in proportion to the speed.
    let strain = 2.0 * friction * 68.0 * compression / (1e4 * 0.5 * CELL);
    let draw = |by: f64, from: f64, to: f64| Movement::Translate {
        by: Vector3::new(by, 0.0, 0.0),
        during: (from, to),
        ease: Ease::Linear,
    };
    let mobilised = 0.5 * (close + time);
    let movements =
        vec![draw((12.0 * strain + 0.15) * CELL, close, mobilised), draw(0.003 * (time - mobilised), mobilised, time)];
    settings.drives = (first_drawn..first_drawn + drawn)
        .map(|yarn| Drive { yarn, vertex: -1, motion: Motion { movements: movements.clone() } })
        .collect();
    let mut step_length = 2e-4;
    if implicit > 0.0 {
        step_length = implicit;
        settings.step.integrator = Integrator::Implicit(ImplicitSettings::default());
    }
    let mut system = YarnSystem::<D>::build(&settings, Path::new(".")).map_err(CaseError::failed)?;
    let steps = (time / step_length) as usize;
    let kept = 0.996f64.powf(step_length / 2e-4);
    let (mut force, mut load, mut count) = (0.0, 0.0, 0.0);
    for step in 0..steps {
        let report = system.advance(step_length).map_err(CaseError::failed)?;
        for v in &mut system.state_mut().velocity {
            *v *= kept;
        }
        if 4 * step > 3 * steps {
            force -= report.drive_force.iter().map(|force| force[0]).sum::<f64>();
            load += 0.5 * (report.obstacle_force[1][1] - report.obstacle_force[0][1]);
            count += 1.0;
        }
    }
    Ok((force / count, load / count))
}
