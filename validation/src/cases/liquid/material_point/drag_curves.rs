use constitutive::drag::{DragGeometry, DragLaw, DragSettings};
use constitutive::{FlowCurve, RheologyReading};

use super::liquid_choice::preset;
use super::semigroup::uniform;
use crate::case::{Case, CaseError, Curve, Outcome, Param, Params};

pub const CASE: Case = Case {
    id: "liquid/drag-curves",
    about: "Drag coefficient over consistency, yield stress, index and speed (figure S1 of Fei et al. 2019), and its \
            invariance under any change of the units of mass, length and time.",
    params: &[
        Param::text("material", "shaving-cream", "preset whose numbers are varied"),
        Param::number("radius", 5e-5, "m", "radius of the strand"),
        Param::number("length", 2e-3, "m", "length of the piece of strand"),
        Param::number("speed", 0.5, "m/s", "relative speed across the strand"),
        Param::number("porosity", 1.0, "1", "liquid fraction"),
        Param::count("rescalings", 2000, "random changes of units"),
    ],
    run,
};

/// Inputs of one coefficient.
#[derive(Clone, Copy)]
struct State {
    density: f64,
    tau: f64,
    eta: f64,
    n: f64,
    radius: f64,
    length: f64,
    speed: f64,
}

fn coefficient(s: &State, porosity: f64) -> Result<(f64, f64), CaseError> {
    let curve = FlowCurve::J2 { yield_stress: s.tau, consistency: s.eta, index: s.n };
    let law = DragLaw::new(s.density, &curve, DragSettings::default()).map_err(CaseError::failed)?;
    let body = DragGeometry::capsule(s.radius, s.length, 1.0);
    let re = law.reynolds(s.speed, body.diameter, porosity);
    Ok((law.coefficient(re, body.area_ratio()), law.force(s.speed, &body, porosity, 3.4).total()))
}

/// The printed formulas (S64-S66) for a capsule across the stream, with the model's own parameters.
fn printed(s: &State, porosity: f64) -> f64 {
    let pi = std::f64::consts::PI;
    let across = 2.0 * s.radius * s.length + pi * s.radius * s.radius;
    let surface = 2.0 * pi * s.radius * s.length + 4.0 * pi * s.radius * s.radius;
    let d = 2.0 * (across / pi).sqrt();
    let re = porosity * s.density * d.powf(s.n) * s.speed * s.speed
        / (s.eta * s.speed.powf(s.n) + (2.0f64 / 3.0).sqrt() * s.tau * d.powf(s.n));
    super::drag_sphere::coefficient(re, s.n, surface / across)
}

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let liquid = preset(p, "material")?;
    let porosity = p.number_in("porosity", 0.05, 1.0)?;
    let (tau, eta, n) = liquid.flow.j2();
    let j2 = liquid.flow.read_as(RheologyReading::J2);
    let base = State {
        density: liquid.density,
        tau,
        eta,
        n,
        radius: p.positive("radius")?,
        length: p.positive("length")?,
        speed: p.positive("speed")?,
    };
    let mut out = Outcome::new();
    let sweep = |title: &str, label: &str, low: f64, high: f64, set: fn(&mut State, f64)| {
        let mut points = Vec::new();
        for i in 0..=60 {
            let x = low * (high / low).powf(f64::from(i) / 60.0);
            let mut state = base;
            set(&mut state, x);
            points.push([x, coefficient(&state, porosity)?.0]);
        }
        let curve = Curve {
            title: title.to_owned(),
            x_label: label.to_owned(),
            y_label: "drag coefficient".to_owned(),
            log_x: true,
            log_y: true,
            series: vec![(p.text("material")?.to_owned(), points.clone())],
        };
        Ok::<_, CaseError>((curve, points))
    };
    // every point beside the printed formula, written out with plain powers
    let mut worst = 0.0f64;
    let mut points = Vec::new();
    let sweeps: [(&str, &str, f64, f64, fn(&mut State, f64)); 4] = [
        ("Over consistency", "consistency [Pa s^n]", 1e-3, 1e3, |s, x| s.eta = x),
        ("Over yield stress", "yield stress [Pa]", 1e-2, 1e4, |s, x| s.tau = x),
        ("Over index", "index", 0.1, 2.0, |s, x| s.n = x),
        ("Over speed", "speed [m/s]", 1e-4, 1e3, |s, x| s.speed = x),
    ];
    for (title, label, low, high, set) in sweeps {
        let (curve, of) = sweep(title, label, low, high, set)?;
        for q in &of {
            let mut state = base;
            set(&mut state, q[0]);
            worst = worst.max((q[1] / printed(&state, porosity) - 1.0).abs());
        }
        out.curve(curve);
        points = of;
    }
    out.measure("formula_error", worst, |e| e < 1e-9, "four curves equal the printed formula to 1e-9");
    // the force, unlike the coefficient, rises with the speed everywhere
    let mut last = 0.0;
    let mut least = f64::INFINITY;
    for q in &points {
        let force = coefficient(&State { speed: q[0], ..base }, porosity)?.1;
        if last > 0.0 {
            least = least.min(force / last - 1.0);
        }
        last = force;
    }
    out.measure("least_rise_of_force", least, |r| r >= -1e-12, "the force never falls with the speed");
    // the ends of the curve: creeping flow at vanishing speed, a coefficient near 0.44 at high speed
    let slow = State { speed: 1e-3 * points[0][0], ..base };
    let law = DragLaw::new(base.density, &j2, DragSettings::default());
    let law = law.map_err(CaseError::failed)?;
    let diameter = DragGeometry::capsule(base.radius, base.length, 1.0).diameter;
    let creeping = coefficient(&slow, porosity)?.0 * law.reynolds(slow.speed, diameter, porosity) / 24.0;
    out.compare("creeping_factor", creeping, law.creeping_factor(), 1e-2);
    out.measure(
        "fastest_over_inertial",
        points[60][1] / 0.44,
        |c| (0.5..5.0).contains(&c),
        "tends to the inertial coefficient 0.44 (slowly for thinning liquids)",
    );
    // any change of units leaves the coefficient, and turns the force as a force
    let (c0, f0) = coefficient(&base, porosity)?;
    let (mut worst_c, mut worst_f, mut seed) = (0.0f64, 0.0f64, 7u64);
    for _ in 0..p.count_in("rescalings", 1, 1_000_000)? {
        let mut unit = || 10f64.powf(6.0 * uniform(&mut seed) - 3.0);
        let (m, l, t) = (unit(), unit(), unit());
        let stress = m / (l * t * t);
        let scaled = State {
            density: base.density * m / l.powi(3),
            tau: tau * stress,
            eta: eta * stress * t.powf(n),
            n,
            radius: base.radius * l,
            length: base.length * l,
            speed: base.speed * l / t,
        };
        let (c, f) = coefficient(&scaled, porosity)?;
        worst_c = worst_c.max((c / c0 - 1.0).abs());
        worst_f = worst_f.max((f / (m * l / (t * t)) / f0 - 1.0).abs());
    }
    out.measure("coefficient_change", worst_c, |e| e < 1e-11, "unchanged by units of mass, length and time to 1e-11");
    out.measure("force_change", worst_f, |e| e < 1e-11, "force changes as a force to 1e-11");
    out.info("coefficient", c0);
    Ok(out)
}
