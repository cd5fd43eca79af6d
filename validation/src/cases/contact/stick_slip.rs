//! A clamped strip pressed on a plane and drawn to and fro.

use crate::case::{Case, CaseError, Outcome, Param, Params};
use crate::hard::SceneRun;

/// Stick and slip of the strip's end.
pub const CASE: Case = Case {
    id: "contact/stick-slip",
    about: "A clamped strip pressed on a plane, as a scene, its clamp drawn sideways to and fro: the end sticks without creep while the force is inside the cone, and slides with exactly ν between friction and normal force, against its motion",
    params: &[
        Param::number("nu", 0.4, "1", "friction coefficient"),
        Param::number("press", 2e-3, "m", "how far the clamp is lowered"),
        Param::number("draw", 3e-3, "m", "how far the clamp is drawn sideways"),
        Param::count("vertices", 13, "vertices of the strip"),
    ],
    run,
};

fn scene(nu: f64, press: f64, draw: f64, vertices: usize) -> String {
    format!(
        "Scene(
            units: Si, time: (end: 0.8, step: Fixed(2e-3)), gravity: [0, 0, 0],
            materials: {{ \"strip\": Fibre(density: 1200, young_modulus: 1e7, poisson_ratio: 0.4, viscosity: 2e4) }},
            strands: [(material: \"strip\", radius: 1e-3, friction: {nu:e},
                shape: Straight(from: [0, 0.011, 0], to: [0.03, 0.00101, 0], vertices: {vertices}),
                clamp: [First(2, motion: [
                    Translate(by: [0, {:e}, 0], during: (0, 0.2), ease: Smooth),
                    Translate(by: [0, 0, {draw:e}], during: (0.2, 0.5)),
                    Translate(by: [0, 0, {:e}], during: (0.5, 0.8)),
                ])])],
            solids: [(name: \"plane\", shape: HalfSpace(point: [0, 0, 0], normal: Y), friction: {nu:e})],
            contact: (tolerance: 1e-10, relinearisations: 2),
            output: (frames: Never, checkpoint: Never, probes: [Vertex(name: \"end\", strand: 0, vertex: {})]),
        )",
        -press,
        -draw,
        vertices - 1
    )
}

fn run(p: &Params) -> Result<Outcome, CaseError> {
    let nu = p.number_in("nu", 0.05, 1.0)?;
    let press = p.number_in("press", 1e-4, 5e-3)?;
    let draw = p.number_in("draw", 1e-3, 1e-2)?;
    let vertices = p.count_in("vertices", 5, 200)?;
    let run = SceneRun::of(&scene(nu, press, draw, vertices), "stick-slip.ron", &[])?;
    let column = |name: &str| run.series.column(name);
    let (x, z) = (column("end_x")?, column("end_z")?);
    let (sticks, slips) = (column("sticking")?, column("slipping")?);
    // force of the strip on the plane: down, and along with the motion
    let force = run.series.vector("plane_force")?;
    let (mut creep, mut off, mut outside, mut askew) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
    let (mut stuck, mut slid, mut turns) = (0usize, 0usize, 0usize);
    let mut state = None;
    for i in 1..x.len() {
        let (normal, friction) = (-force[i][1], force[i][0].hypot(force[i][2]));
        if normal <= 0.0 {
            continue;
        }
        let excess = friction / normal / nu - 1.0;
        outside = outside.max(excess);
        let motion = [x[i] - x[i - 1], z[i] - z[i - 1]];
        let moved = motion[0].hypot(motion[1]);
        let now = if slips[i] == 1.0 {
            slid += 1;
            off = off.max(excess.abs());
            let along = (motion[0] * force[i][0] + motion[1] * force[i][2]) / (moved * friction);
            askew = askew.max(1.0 - along);
            true
        } else if sticks[i] == 1.0 {
            stuck += 1;
            creep = creep.max(moved);
            false
        } else {
            continue;
        };
        turns += usize::from(state.is_some_and(|before| before != now));
        state = Some(now);
    }
    let mut out = Outcome::new();
    out.measure("completed", run.completed(), |x| x == 1.0, "the run comes to its end");
    out.measure("sticking_steps", stuck as f64, |x| x >= 10.0, "it sticks for a while");
    out.measure("slipping_steps", slid as f64, |x| x >= 10.0, "and slides for a while");
    out.measure("changes", turns as f64, |x| x >= 2.0, "it changes between the two when the clamp turns back");
    out.measure("creep", creep, |x| x <= 1e-12, "a sticking end moves by less than 1e-12 m a step");
    out.measure("sliding_ratio", off, |x| x <= 1e-6, "friction over normal force is ν to 1e-6 where it slides");
    out.measure("outside_cone", outside, |x| x <= 1e-6, "and never more than ν");
    out.measure("askew", askew, |x| x <= 1e-6, "and acts against the motion (one less the cosine)");
    out.measure(
        "warnings",
        column("contact_warnings")?.last().copied().unwrap_or(f64::NAN),
        |x| x == 0.0,
        "all contact problems were solved",
    );
    Ok(out)
}
