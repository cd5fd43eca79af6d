//! A block on an inclined plane.

use crate::case::{Case, CaseError, Outcome, Param, Params};
use contact::block::IDENTITY;
use contact::{BlockMatrix, ContactProblem, ContactSettings, solve};

/// Sticks below the friction angle, slides with g (sin − ν cos) above.
pub const CASE: Case = Case {
    id: "contact/incline",
    about: "Block on an incline: sticks to the last digit below atan ν, slides with g (sin − ν cos) above (elementary mechanics)",
    params: &[
        Param::number("nu", 0.3, "1", "friction coefficient"),
        Param::number("angle", 30.0, "deg", "inclination of the plane"),
        Param::number("mass", 0.02, "kg", "mass of the block"),
        Param::count("steps", 200, "time steps of 1 ms"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let nu = p.number_in("nu", 0.0, 10.0)?;
    let angle = p.number_in("angle", 0.0, 89.0)?.to_radians();
    let mass = p.positive("mass")?;
    let steps = p.count_in("steps", 1, 1_000_000)?;
    let (g, dt) = (9.81, 1e-3);
    let w = BlockMatrix::from_triplets(1, &[(0, 0, IDENTITY.map(|v| v / mass))]);
    let settings = ContactSettings { tolerance: 1e-14, ..ContactSettings::default() };
    // velocity in the contact basis: normal, down the slope, across
    let mut velocity = [0.0_f64; 3];
    let (mut lift, mut worst) = (0.0_f64, 0.0_f64);
    for _ in 0..steps {
        let free = [velocity[0] - g * dt * angle.cos(), velocity[1] + g * dt * angle.sin(), velocity[2]];
        let problem = ContactProblem::new(w.clone(), vec![free], vec![nu]).map_err(CaseError::failed)?;
        let s = solve(&problem, None, &settings);
        velocity = s.velocities[0];
        lift = lift.max(velocity[0].abs());
        worst = worst.max(s.report.solve.residual);
    }
    let expected = (g * (angle.sin() - nu * angle.cos())).max(0.0);
    let acceleration = velocity[1] / (steps as f64 * dt);
    let mut out = Outcome::new();
    if expected == 0.0 {
        out.compare_absolute("acceleration", acceleration, 0.0, 1e-12);
    } else {
        out.compare("acceleration", acceleration, expected, 1e-9);
    }
    out.compare_absolute("normal_velocity", lift, 0.0, 1e-12);
    out.compare_absolute("cross_velocity", velocity[2].abs(), 0.0, 1e-12);
    out.info("residual", worst);
    Ok(out)
}
