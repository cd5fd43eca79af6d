//! Error against seconds: resolution, step size and integrator, for a falling cantilever and for vibration.

use super::setup::{GRAVITY, V, cantilever, thin_material, thin_weight};
use crate::case::{Case, CaseError, Curve, Outcome, Param, Params, Table};
use rods::{Integrator, Loads, RodSet, RodSettings, RodStepper};
use std::time::Instant;

/// Work and precision.
pub const WORK_PRECISION: Case = Case {
    id: "rods/work-precision",
    about: "Error of the tip against seconds over step size, resolution and integrator, for a cantilever released under its weight and for small vibration.",
    params: &[
        Param::number("gamma", 10.0, "1", "weight over bending stiffness of the released cantilever"),
        Param::count("vertices", 41, "vertices at which the step is varied"),
        Param::count("finest", 3200, "steps of the reference run"),
    ],
    run,
};

const INTEGRATORS: [(Integrator, &str); 3] = [
    (Integrator::ImplicitEuler, "implicit Euler"),
    (Integrator::Bdf2, "BDF2"),
    (Integrator::ImplicitMidpoint, "implicit midpoint"),
];

/// Tip of a cantilever released from the horizontal at `time` (in units of `√(L/g)`), and the seconds it took.
fn release(
    gamma: f64,
    vertices: usize,
    steps: usize,
    time: f64,
    integrator: Integrator,
) -> Result<(V, f64), CaseError> {
    let mut c = cantilever(vertices, V::x(), thin_material(thin_weight() / gamma), |_, _| ())?;
    let loads = Loads::gravity(V::new(0.0, 0.0, -GRAVITY));
    let dt = time / GRAVITY.sqrt() / steps as f64;
    let seconds = drive(&mut c.rods, dt, steps, integrator, &loads, &c.boundary)?;
    Ok((c.rods.position[vertices - 1], seconds))
}

/// Tip of a cantilever plucked by a small velocity profile after `1.3` periods of its first mode.
fn pluck(vertices: usize, steps: usize, integrator: Integrator) -> Result<(V, f64), CaseError> {
    let mut c = cantilever(vertices, V::x(), thin_material(thin_weight()), |spec, edge| {
        // the first clamped-free mode, so that no faster vibration blurs the figure
        let beta = super::reference::clamped_free_root();
        let sigma = (beta.cosh() + beta.cos()) / (beta.sinh() + beta.sin());
        let profile = |i: usize| {
            let x = beta * ((i as f64 - 0.5) * edge).max(0.0);
            0.5 * (x.cosh() - x.cos() - sigma * (x.sinh() - x.sin()))
        };
        spec.velocities = Some((0..vertices).map(|i| V::new(0.0, 0.0, 0.01 * profile(i))).collect());
    })?;
    // ω² = 3.516² EI/(ρ A L⁴) with EI = ρ A g L³
    let period = std::f64::consts::TAU / (3.516_015 * GRAVITY.sqrt());
    let dt = 1.3 * period / steps as f64;
    let seconds = drive(&mut c.rods, dt, steps, integrator, &Loads::default(), &c.boundary)?;
    Ok((c.rods.position[vertices - 1], seconds))
}

fn drive(
    rods: &mut RodSet,
    dt: f64,
    steps: usize,
    integrator: Integrator,
    loads: &Loads,
    boundary: &rods::Boundary,
) -> Result<f64, CaseError> {
    let settings = RodSettings { integrator, ..RodSettings::default() };
    let mut stepper = RodStepper::new(settings).map_err(CaseError::failed)?;
    let start = Instant::now();
    for _ in 0..steps {
        stepper.advance(rods, dt, loads, boundary).map_err(CaseError::failed)?;
    }
    Ok(start.elapsed().as_secs_f64())
}

fn order(points: &[(usize, f64)]) -> f64 {
    let pairs: Vec<(f64, f64)> = points.iter().map(|(n, e)| (1.0 / *n as f64, *e)).collect();
    super::setup::observed_order(&pairs, 1e-9)
}

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let gamma = p.number_in("gamma", 0.1, 100.0)?;
    let vertices = p.count_in("vertices", 11, 201)?;
    let finest = p.count_in("finest", 1600, 50_000)?;
    let mut out = Outcome::new();
    let time = 1.5;
    let mut rows = Vec::new();
    for (name, title, scale) in [
        ("release", "cantilever released under its weight", 1.0),
        ("vibration", "small vibration of a cantilever", 2e-3),
    ] {
        let go = |n: usize, steps: usize, integrator: Integrator| {
            if name == "release" { release(gamma, n, steps, time, integrator) } else { pluck(n, steps, integrator) }
        };
        let (reference, _) = go(vertices, finest, Integrator::ImplicitMidpoint)?;
        let mut series = Vec::new();
        for (integrator, label) in INTEGRATORS {
            let mut points = Vec::new();
            let mut curve = Vec::new();
            for steps in [25, 50, 100, 200, 400, 800] {
                let (tip, seconds) = go(vertices, steps, integrator)?;
                let error = (tip - reference).norm() / scale;
                points.push((steps, error));
                curve.push([seconds, error]);
                rows.push(vec![
                    name.to_owned(),
                    label.to_owned(),
                    vertices.to_string(),
                    steps.to_string(),
                    format!("{error:.3e}"),
                    format!("{:.3}", 1e3 * seconds),
                ]);
            }
            series.push((format!("{label}, {vertices} vertices"), curve));
            let observed = order(&points);
            let key = format!("{name}_order_{}", label.replace(' ', "_").to_lowercase());
            let (least, why) = match (integrator, name) {
                (Integrator::ImplicitEuler, _) => (0.7, "first order in time: above 0.7"),
                // the sudden release excites all modes, and a step resolves only the slow ones
                (_, "release") => {
                    (1.2, "between first and second order in time, as the modes excited get resolved: above 1.2")
                }
                _ => (1.7, "second order in time: above 1.7"),
            };
            out.measure(&key, observed, |o| o > least, why);
            if integrator != Integrator::ImplicitEuler {
                out.measure(
                    &format!("{name}_error_{}", label.replace(' ', "_").to_lowercase()),
                    points[5].1,
                    |e| e < 0.02,
                    "error below 2 % of the length (release) or of the amplitude scale (vibration) at 800 steps",
                );
            }
        }
        // resolution: the same motion on coarser rods, each with a step that no longer matters
        let (fine, _) = go(161, 400, Integrator::ImplicitMidpoint)?;
        let mut curve = Vec::new();
        let mut points = Vec::new();
        for n in [11, 21, 41, 81] {
            let (tip, seconds) = go(n, 400, Integrator::ImplicitMidpoint)?;
            let error = (tip - fine).norm() / scale;
            points.push((n - 1, error));
            curve.push([seconds, error]);
            rows.push(vec![
                name.to_owned(),
                "implicit midpoint".to_owned(),
                n.to_string(),
                "400".to_owned(),
                format!("{error:.3e}"),
                format!("{:.3}", 1e3 * seconds),
            ]);
        }
        series.push(("resolution: 11 to 81 vertices, 400 steps".to_owned(), curve));
        out.measure(
            &format!("{name}_order_resolution"),
            order(&points),
            |o| o > 1.6,
            "second order in the edge length: above 1.6",
        );
        out.curve(Curve {
            title: format!("work and precision: {title}"),
            x_label: "seconds".into(),
            y_label: "error of the tip".into(),
            log_x: true,
            log_y: true,
            series,
        });
    }
    out.table(Table {
        title: "error against cost".into(),
        columns: ["motion", "integrator", "vertices", "steps", "error", "milliseconds"].map(String::from).to_vec(),
        rows,
    });
    Ok(out)
}
