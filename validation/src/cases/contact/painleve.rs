//! Painlevé's rod: a rigid rod sliding on its tip, where friction above 4/3 leaves no finite force.

use crate::case::{Case, CaseError, Outcome, Param, Params, Table};
use contact::{BlockMatrix, ContactProblem, ContactSettings, solve};

/// The implicit solve finds an impact; energy does not grow.
pub const CASE: Case = Case {
    id: "contact/painleve",
    about: "Painlevé rod (ν above 4/3, no finite force exists): the implicit solve finds an impact solution and energy does not grow",
    params: &[
        Param::number("nu", 1.6, "1", "friction coefficient"),
        Param::number("speed", 1.0, "m/s", "sliding speed of the tip"),
        Param::count("angles", 90, "inclinations tried between 1° and 89°"),
    ],
    run,
};

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let nu = p.number_in("nu", 0.0, 10.0)?;
    let speed = p.number_in("speed", -100.0, 100.0)?;
    let angles = p.count_in("angles", 2, 10_000)?;
    let (mass, half, g, dt) = (1.0, 0.5, 9.81, 1e-3);
    let inertia = mass * half * half / 3.0;
    let settings = ContactSettings { tolerance: 1e-11, ..ContactSettings::default() };
    let mut out = Outcome::new();
    let (mut worst, mut gain, mut paradox) = (0.0_f64, f64::NEG_INFINITY, 0usize);
    let mut rows = Vec::new();
    for i in 0..angles {
        let a = (1.0 + 88.0 * i as f64 / (angles - 1) as f64).to_radians();
        let (s, c) = (half * a.sin(), half * a.cos());
        // tip below and behind the centre: lever (−c, −s); normal z, tangent x
        let w = [
            1.0 / mass + c * c / inertia,
            -s * c / inertia,
            0.0,
            -s * c / inertia,
            1.0 / mass + s * s / inertia,
            0.0,
            0.0,
            0.0,
            1.0 / mass,
        ];
        // Painlevé: sliding with full friction against the motion would need W_NN − ν W_NT·sign < 0
        let sign = if speed >= 0.0 { 1.0 } else { -1.0 };
        let indeterminate = w[0] - nu * sign * w[1] <= 0.0 || w[0] + nu * sign * w[1] <= 0.0;
        paradox += usize::from(indeterminate);
        // centre moves with the tip's speed, no rotation; one step of gravity
        let free = [-g * dt, speed, 0.0];
        let problem = ContactProblem::new(BlockMatrix::from_triplets(1, &[(0, 0, w)]), vec![free], vec![nu])
            .map_err(CaseError::failed)?;
        let solution = solve(&problem, None, &settings);
        let (r, u) = (solution.impulses[0], solution.velocities[0]);
        worst = worst.max(solution.report.solve.residual);
        // change of kinetic energy by the impulse: r·(u_free + u)/2
        let change = (0..3).map(|d| 0.5 * r[d] * (free[d] + u[d])).sum::<f64>();
        gain = gain.max(change / (0.5 * mass * speed * speed).max(1e-12));
        if i % (angles / 12).max(1) == 0 {
            rows.push(vec![
                format!("{:.1}", a.to_degrees()),
                indeterminate.to_string(),
                format!("{:.4e}", r[0]),
                format!("{:.4e}", u[0]),
                format!("{:.4e}", u[1]),
                format!("{change:.3e}"),
            ]);
        }
    }
    out.compare_absolute("residual", worst, 0.0, 1e-10);
    out.measure("energy_gain", gain, |v| v <= 1e-10, "the contact impulse never adds kinetic energy");
    out.info("paradoxical_angles", paradox as f64);
    if nu > 4.0 / 3.0 {
        out.measure(
            "angles_in_the_paradox",
            paradox as f64,
            |v| v > 0.0,
            "above ν = 4/3 some inclinations are paradoxical",
        );
    }
    out.table(Table {
        title: "Rod by inclination".into(),
        columns: ["angle [deg]", "paradox", "normal impulse [N s]", "u_N [m/s]", "u_T [m/s]", "energy change [J]"]
            .map(String::from)
            .to_vec(),
        rows,
    });
    Ok(out)
}
