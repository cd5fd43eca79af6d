use constitutive::FlowCurve;
use constitutive::drag::{DragGeometry, DragLaw, DragSettings};

use crate::case::{Case, CaseError, Outcome, Param, Params, Table};

pub const CASE: Case = Case {
    id: "liquid/drag-sphere",
    about: "Drag coefficient of a sphere against tables and the standard Newtonian sphere curve; terminal speed, sticking \
            below the yield force and the implicit step against independent computations.",
    params: &[
        Param::number("reynolds", 1.0, "1", "Reynolds number of the free comparison"),
        Param::number("index", 1.0, "1", "flow index of the free comparison"),
        Param::number("ratio", 4.0, "1", "surface over projected area of the free comparison"),
        Param::number("diameter", 2e-3, "m", "diameter of the falling sphere"),
        Param::number("solid_density", 2500.0, "kg/m3", "density of the falling sphere"),
        Param::number("density", 1000.0, "kg/m3", "density of the liquid"),
        Param::number("viscosity", 8.9e-4, "Pa s", "viscosity of the liquid it falls in"),
    ],
    run,
};

/// The printed formula, written out with plain powers.
pub(super) fn coefficient(re: f64, n: f64, ratio: f64) -> f64 {
    let alpha = 3.0 / (n * n + n + 1.0);
    let x = 6f64.powf((n - 1.0) / 2.0) * alpha.powf(n + 1.0);
    let b = (3.0 * (alpha - 6f64.ln())).exp();
    let k = (3.0 - alpha) / (6.0 * alpha) * 3f64.powf((3.0 - alpha) / (2.0 * alpha));
    let half = (3.0 - alpha) / (2.0 * alpha);
    let s = 11.0 / 48.0 * 6f64.sqrt() * (1.0 - ((6f64.sqrt() - 1.0) / 6f64.sqrt()).powf(half * half));
    let (c0, q) = (24.0 * x / re, 6.0 * x * b);
    c0 + ratio * 0.44 * c0.powf(2.0 * s) * k * (q / (q + c0)).powf(s) + 0.44 * q / (q + 128.0 * c0)
}

fn law(curve: &FlowCurve, density: f64) -> Result<DragLaw, CaseError> {
    DragLaw::new(density, curve, DragSettings::default()).map_err(CaseError::failed)
}

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let mut out = Outcome::new();
    let (re, n, ratio) =
        (p.number_in("reynolds", 1e-8, 1e10)?, p.number_in("index", 0.05, 3.0)?, p.number_in("ratio", 1.0, 100.0)?);
    let unit = |n: f64| law(&FlowCurve::Rheometer { yield_stress: 0.0, consistency: 1.0, index: n }, 1000.0);
    out.compare("coefficient", unit(n)?.coefficient(re, ratio), coefficient(re, n, ratio), 1e-11);
    // tabulated values, and the standard curve of a sphere in a Newtonian liquid
    let mut rows = Vec::new();
    let mut worst = 0.0f64;
    for (n, re, expected) in [
        (1.0, 0.1, 245.4),
        (1.0, 1.0, 27.17),
        (1.0, 10.0, 4.195),
        (1.0, 100.0, 1.0909),
        (1.0, 1000.0, 0.4071),
        (0.22, 0.01, 3410.829),
        (0.22, 1.0, 34.2065),
        (0.22, 100.0, 0.660_854),
        (1.5, 0.01, 1270.016),
        (1.5, 1.0, 20.8689),
        (1.5, 100.0, 0.900_816),
    ] {
        let c = unit(n)?.coefficient(re, 4.0);
        worst = worst.max((c / expected - 1.0).abs());
        rows.push(vec![format!("{n}"), format!("{re}"), format!("{c:.6}"), format!("{expected}")]);
    }
    out.table(Table {
        title: "Coefficient of a sphere".to_owned(),
        columns: ["n", "Re", "computed", "tabulated"].map(String::from).to_vec(),
        rows,
    });
    out.measure("table_error", worst, |e| e < 2e-4, "tabulated coefficients to their digits");
    for (re, standard) in [(0.1, 244.0), (1.0, 27.1), (10.0, 4.26), (100.0, 1.09)] {
        out.compare(&format!("newtonian_re_{re}"), unit(1.0)?.coefficient(re, 4.0), standard, 0.02);
    }
    terminal_speed(p, &mut out)?;
    implicit_step(&mut out)?;
    Ok(out)
}

/// Falling sphere: balance of weight and drag solved here with the printed formula.
fn terminal_speed(p: &Params, out: &mut Outcome) -> Result<(), CaseError> {
    let (d, solid, rho, eta) =
        (p.positive("diameter")?, p.positive("solid_density")?, p.positive("density")?, p.positive("viscosity")?);
    if solid <= rho {
        return Err(p.reject("solid_density", "above the density of the liquid"));
    }
    let weight = (solid - rho) * 9.81 * std::f64::consts::PI * d.powi(3) / 6.0;
    let area = std::f64::consts::PI * d * d / 4.0;
    let (mut low, mut high) = (-40f64, 20f64);
    for _ in 0..200 {
        let u = (0.5 * (low + high)).exp();
        let drag = 0.5 * rho * area * u * u * coefficient(rho * d * u / eta, 1.0, 4.0);
        if drag < weight {
            low = 0.5 * (low + high);
        } else {
            high = 0.5 * (low + high);
        }
    }
    let expected = (0.5 * (low + high)).exp();
    let body = DragGeometry::sphere(d);
    let newtonian = law(&FlowCurve::newtonian(eta), rho)?;
    out.compare("terminal_speed", newtonian.terminal_speed(weight, &body, 1.0), expected, 1e-9);
    // marched by the implicit step from rest: weight, then drag
    let (mass, mut u) = (solid * std::f64::consts::PI * d.powi(3) / 6.0, 0.0);
    let dt = 0.5 * mass * expected / weight;
    for _ in 0..400 {
        u = newtonian.solve(u + dt * weight / mass, mass, dt, &body, 1.0).speed;
    }
    out.compare("terminal_speed_marched", u, expected, 1e-9);
    out.info("stokes_speed", weight / (3.0 * std::f64::consts::PI * eta * d));
    Ok(())
}

/// Two bodies and drag alone: momentum kept, no overshoot at any step; sticking and breaking loose at the yield force.
fn implicit_step(out: &mut Outcome) -> Result<(), CaseError> {
    let curve = FlowCurve::J2 { yield_stress: 31.9, consistency: 27.2, index: 0.22 };
    let cream = law(&curve, 200.0)?;
    let body = DragGeometry::capsule(5e-5, 2e-3, 0.7);
    let (m1, m2) = (3e-8, 5e-8);
    let reduced = m1 * m2 / (m1 + m2);
    let (mut defect, mut overshoot) = (0.0f64, 0.0f64);
    for exponent in -9..=2 {
        let dt = 10f64.powi(exponent);
        let (mut v1, mut v2) = (0.7f64, -0.4f64);
        let begin = m1 * v1 + m2 * v2;
        for _ in 0..50 {
            let before = v1 - v2;
            let step = cream.solve(before.abs(), reduced, dt, &body, 0.8);
            v1 -= step.impulse * before.signum() / m1;
            v2 += step.impulse * before.signum() / m2;
            overshoot = overshoot.max((v1 - v2).abs() - before.abs()).max(-(v1 - v2) * before.signum() - 1e-15);
        }
        defect = defect.max((m1 * v1 + m2 * v2 - begin).abs() / (m1 * 0.7));
    }
    out.measure("momentum_defect", defect, |e| e < 1e-12, "momentum of two bodies kept by drag to 1e-12");
    out.measure("overshoot", overshoot, |e| e <= 1e-12, "relative speed falls monotonically at every step size");
    let hold = cream.yield_force(&body, 1.0, 3.7);
    let pulled = |load: f64| {
        let (mass, dt) = (1e-8, 1e-4);
        (0..100).fold(0.0, |u, _| cream.solve(u + dt * load / mass, mass, dt, &body, 1.0).speed)
    };
    out.compare("held_speed", pulled(0.999 * hold), 0.0, 0.0);
    out.measure("loose_speed", pulled(1.01 * hold), |u| u > 0.0, "a load above the yield force moves the body");
    Ok(())
}
