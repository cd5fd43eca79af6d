//! A box sliding on a plane must not lift.

use crate::case::{Case, CaseError, Outcome, Param, Params};
use contact::cross_check::{OracleSettings, convex_model};
use contact::families::Bodies;
use contact::{ContactSettings, solve};

/// A box on four corners decelerates with ν g and stays down; the convex model lifts it.
pub const CASE: Case = Case {
    id: "contact/sliding-block",
    about: "Sliding box on four corners: deceleration ν g without lifting (exact Coulomb); the one-shot convex model lifts with ν u_T",
    params: &[
        Param::number("nu", 0.3, "1", "friction coefficient"),
        Param::number("speed", 1.0, "m/s", "initial sliding speed"),
        Param::count("steps", 100, "time steps of 1 ms"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let nu = p.number_in("nu", 0.0, 0.9)?;
    let speed = p.positive("speed")?;
    let steps = p.count_in("steps", 1, 100_000)?;
    let (g, dt) = (9.81, 1e-3);
    if speed <= nu * g * dt * steps as f64 {
        return Err(p.reject("speed", "a speed that outlasts the steps: above ν g · steps · 1 ms"));
    }
    let mut s = Bodies::default();
    let (l, h) = (0.2, 0.05);
    let b = s.add([0.0, 0.0, h], 1.0, [(l * l + 4.0 * h * h) / 12.0, (l * l + 4.0 * h * h) / 12.0, l * l / 6.0]);
    for x in [-0.5 * l, 0.5 * l] {
        for y in [-0.5 * l, 0.5 * l] {
            s.touch(b, None, [x, y, 0.0], [0.0, 0.0, 1.0], nu);
        }
    }
    s.velocity[b][0] = speed;
    let settings = ContactSettings { tolerance: 1e-12, ..ContactSettings::default() };
    let (mut lift, mut worst, mut relaxed_lift) = (0.0_f64, 0.0_f64, 0.0_f64);
    for step in 0..steps {
        s.accelerate([0.0, 0.0, -g], dt);
        let problem = s.problem();
        let solution = solve(&problem, None, &settings);
        worst = worst.max(solution.report.solve.residual);
        lift = lift.max(solution.velocities.iter().map(|u| u[0].abs()).fold(0.0, f64::max));
        if step == 0 && problem.delassus.asymmetry() < 1e-12 {
            let relaxed = convex_model(&problem, &OracleSettings::default()).map_err(CaseError::failed)?;
            relaxed_lift = relaxed.velocities.iter().map(|u| u[0]).fold(0.0, f64::max);
        }
        s.apply(&solution.impulses);
    }
    let mut out = Outcome::new();
    out.compare_absolute("normal_velocity", lift, 0.0, 1e-9);
    out.compare("speed", s.velocity[b][0], speed - nu * g * dt * steps as f64, 1e-9);
    out.compare_absolute("spin", s.velocity[b][3].hypot(s.velocity[b][4]).hypot(s.velocity[b][5]), 0.0, 1e-8);
    out.info("residual", worst);
    out.info("normal_velocity_of_convex_model", relaxed_lift);
    Ok(out)
}
