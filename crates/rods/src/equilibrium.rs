//! Static equilibrium, and rest shapes that make a given shape an equilibrium.

use crate::boundary::Boundary;
use crate::coefficients::stretch_stiffness;
use crate::error::RodError;
use crate::loads::Loads;
use crate::settings::{Integrator, RodSettings};
use crate::state::RodSet;
use crate::stepper::RodStepper;
use constitutive::curvature::vertex_gradient;
use nalgebra::{Matrix4, Vector3, Vector4};
use serde::{Deserialize, Serialize};

/// Settings of [`equilibrium`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EquilibriumSettings {
    /// Unbalanced force allowed, relative to the larger of load and bending stiffness over length squared; 1e-14 to 1e-2.
    pub tolerance: f64,
    /// Pseudo-time steps allowed.
    pub max_steps: usize,
    /// Newton iterations allowed in one pseudo-time step.
    pub max_iterations: usize,
}

impl Default for EquilibriumSettings {
    fn default() -> Self {
        Self { tolerance: 1e-9, max_steps: 400, max_iterations: 40 }
    }
}

/// How an equilibrium was reached.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EquilibriumReport {
    /// Pseudo-time steps.
    pub steps: usize,
    /// Newton iterations of all steps.
    pub iterations: usize,
    /// Largest unbalanced force \[N\].
    pub residual: f64,
    /// Tolerance \[N\], round-off of the stiffest edge included.
    pub tolerance: f64,
}

/// Moves the strands to a static equilibrium under constant loads and leaves them at rest.
///
/// Follows the gradient flow of the energy in the mass metric by implicit steps that start from rest and grow while
/// Newton's method copes: short steps far from equilibrium keep the way downhill, long ones end as pure Newton steps.
/// Because every step lowers the energy, the end is a minimum (or a saddle approached exactly along its stable
/// directions: perturb the start to leave it).
///
/// A thin strand can hardly stretch, which makes the way downhill a narrow curved valley. The descent therefore starts
/// with the stretching stiffness reduced to a few thousand times the bending stiffness over length squared and
/// restores it in stages; only the last stage, with the true stiffness, is judged.
pub fn equilibrium(
    rods: &mut RodSet,
    loads: &Loads,
    boundary: &Boundary,
    settings: &EquilibriumSettings,
) -> Result<EquilibriumReport, RodError> {
    let mut stiffest = 0.0f64;
    for s in 0..rods.strand_count() {
        let length_scale = rods.bending_force_scale(s).max(weight(rods, s, loads));
        let stiff = (0..rods.edges(s).len()).map(|j| stretch_stiffness(rods, s, j)).fold(0.0, f64::max);
        if rods.bending_force_scale(s) > 0.0 {
            stiffest = stiffest.max(stiff / length_scale);
        }
    }
    let true_multipliers: Vec<f64> = rods.material.iter().map(|m| m.stretch_multiplier).collect();
    let mut report = EquilibriumReport { steps: 0, iterations: 0, residual: 0.0, tolerance: 0.0 };
    let mut reduction = if stiffest > 1e5 { 5e3 / stiffest } else { 1.0 };
    loop {
        for (m, t) in rods.material.iter_mut().zip(&true_multipliers) {
            m.stretch_multiplier = t * reduction;
        }
        let stage = descend(rods, loads, boundary, settings, reduction == 1.0);
        if reduction == 1.0 || stage.is_err() {
            for (m, t) in rods.material.iter_mut().zip(&true_multipliers) {
                m.stretch_multiplier = *t;
            }
        }
        let stage = stage?;
        report = EquilibriumReport {
            steps: report.steps + stage.steps,
            iterations: report.iterations + stage.iterations,
            ..stage
        };
        if reduction == 1.0 {
            return Ok(report);
        }
        reduction = if reduction > 0.03 { 1.0 } else { 30.0 * reduction };
    }
}

fn weight(rods: &RodSet, strand: usize, loads: &Loads) -> f64 {
    rods.strand_momentum(strand, loads).mass * loads.gravity.norm()
}

/// One descent with the present stiffness; `last` asks for the full accuracy.
fn descend(
    rods: &mut RodSet,
    loads: &Loads,
    boundary: &Boundary,
    settings: &EquilibriumSettings,
    last: bool,
) -> Result<EquilibriumReport, RodError> {
    let mut stepper = RodStepper::new(RodSettings {
        integrator: Integrator::ImplicitEuler,
        tolerance: 1e-10,
        max_iterations: settings.max_iterations.clamp(1, 10_000),
        max_halvings: 40,
        ..RodSettings::default()
    })?;
    let ns = rods.strand_count();
    if ns == 0 {
        return Ok(EquilibriumReport { steps: 0, iterations: 0, residual: 0.0, tolerance: 0.0 });
    }
    rods.history = None;
    let masses: Vec<Vec<f64>> = (0..ns).map(|s| rods.mass_diagonal(s, loads)).collect();
    let (mut scale, mut floor, mut slow) = (0.0f64, 0.0f64, 0.0f64);
    for s in 0..ns {
        let length: f64 = rods.rest_length[rods.edges(s)].iter().sum();
        let (bend, total): (f64, f64) = (rods.bending_force_scale(s), rods.strand_momentum(s, loads).mass);
        let stiff = (0..rods.edges(s).len()).map(|j| stretch_stiffness(rods, s, j)).fold(0.0, f64::max);
        scale = scale.max(bend).max(total * loads.gravity.norm());
        floor = floor.max(256.0 * f64::EPSILON * stiff);
        let force = bend.max(total * loads.gravity.norm()).max(1e-6 * stiff);
        slow = slow.max((total * length / force).sqrt());
    }
    if let Some(f) = loads.force {
        scale = f.iter().fold(scale, |m, f| m.max(f.amax()));
    }
    let tolerance = settings.tolerance.max(if last { 0.0 } else { 1e-5 }) * scale + floor;
    let mut dt = 0.05 * slow;
    let mut report = EquilibriumReport { steps: 0, iterations: 0, residual: f64::INFINITY, tolerance };
    let mut polished = false;
    let rest = |rods: &mut RodSet| {
        rods.velocity.fill(Vector3::zeros());
        rods.twist_rate.fill(0.0);
    };
    rest(rods);
    while report.steps < settings.max_steps {
        report.steps += 1;
        match stepper.solve(rods, dt, loads, boundary) {
            Ok(r) => {
                let before = (rods.position.clone(), rods.twist_angle.clone());
                stepper.accept(rods)?;
                report.iterations += r.total_iterations;
                let mut residual = 0.0f64;
                for s in 0..ns {
                    let free = rods.free_unknowns(s, boundary);
                    let (v, e) = (rods.vertices(s), rods.edges(s));
                    let length: f64 = rods.rest_length[e.clone()].iter().sum();
                    for (i, k) in v.enumerate() {
                        let du = rods.position[k] - before.0[k];
                        for c in (0..3).filter(|c| free[4 * i + c]) {
                            residual = residual.max((masses[s][4 * i + c] * du[c]).abs() / (dt * dt));
                        }
                        if free[4 * i + 3] {
                            let du = rods.twist_angle[e.start + i] - before.1[e.start + i];
                            residual = residual.max((masses[s][4 * i + 3] * du).abs() / (dt * dt * length));
                        }
                    }
                }
                rest(rods);
                report.residual = residual;
                if residual <= tolerance && dt > 100.0 * slow {
                    if polished || !last {
                        return Ok(report);
                    }
                    // one more, practically undamped Newton solve takes the rest away at no risk
                    polished = true;
                    dt = 1e6 * slow;
                    continue;
                }
                if r.solve.iterations <= settings.max_iterations / 2 {
                    dt = (dt * if r.solve.iterations <= 6 { 6.0 } else { 2.0 }).min(1e9 * slow);
                }
            }
            Err(error @ (RodError::NotConverged { .. } | RodError::Folded { .. } | RodError::NonFinite { .. })) => {
                dt *= 0.2;
                if dt < 1e-9 * slow {
                    return Err(error);
                }
            }
            Err(error) => return Err(error),
        }
    }
    Err(RodError::NoEquilibrium { steps: report.steps, residual: report.residual, tolerance })
}

/// Changes rest curvatures, twists and lengths so that the present shape is an equilibrium under the loads.
///
/// For strands clamped at the root (first two vertices and first angle). Going from the tip to the root, the force on
/// each vertex and the torque on each edge fix four unknowns of the element before it: the tension, two bending moments
/// (taken equal in the frames of both edges) and the twisting moment. The four equations are solved exactly, so the
/// unbalanced force is round-off. Whether the equilibrium is stable is another question: [`RodSet::unstable_modes`] answers it.
///
/// Rest lengths change the lengths that belong to the vertices, hence masses and stiffnesses; the sweep is repeated until
/// the rest lengths settle (two or three times for ordinary materials).
pub fn make_sag_free(rods: &mut RodSet, loads: &Loads, boundary: &Boundary) -> Result<(), RodError> {
    loads.check(rods)?;
    boundary.check(rods)?;
    for strand in 0..rods.strand_count() {
        let free = rods.free_unknowns(strand, boundary);
        let held = [0, 1, 2, 3, 4, 5, 6];
        let n = free.len();
        if !held.iter().all(|d| !free[*d]) || free[7..n - 1].iter().any(|f| !f) {
            return Err(RodError::NotClampedAtRoot { strand });
        }
        for _ in 0..60 {
            let before = rods.rest_length[rods.edges(strand)].to_vec();
            sweep(rods, strand, loads)?;
            let e = rods.edges(strand);
            let change = before.iter().zip(&rods.rest_length[e]).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
            if change < 1e-15 {
                break;
            }
        }
    }
    rods.history = None;
    Ok(())
}

fn sweep(rods: &mut RodSet, strand: usize, loads: &Loads) -> Result<(), RodError> {
    let (v, e) = (rods.vertices(strand), rods.edges(strand));
    let n = v.len();
    let mass = rods.mass_diagonal(strand, loads);
    // external force on each vertex minus the elastic forces found so far
    let mut pull: Vec<Vector3<f64>> = (0..n)
        .map(|i| loads.gravity * mass[4 * i] + loads.force.map_or(Vector3::zeros(), |f| f[v.start + i]))
        .collect();
    let mut torque: Vec<f64> = (0..n - 1).map(|j| loads.torque.map_or(0.0, |t| t[e.start + j])).collect();
    for j in (1..n - 1).rev() {
        let (x, m) = rods.element(strand, j);
        let mut law = rods.law(strand, j);
        // unit responses: moment weights (w0 = w2), (w1 = w3), twisting moment, tension
        let response = |w: [f64; 3]| {
            let mut unit = law;
            (unit.c0, unit.c1, unit.cm) = (1.0, 1.0, 1.0);
            unit.rest = [x.k[0] - w[0], x.k[1] - w[1], x.k[2] - w[0], x.k[3] - w[1]];
            unit.rest_twist = m - w[2];
            vertex_gradient(&unit.gradient(&x, m))
        };
        let units = [response([1.0, 0.0, 0.0]), response([0.0, 1.0, 0.0]), response([0.0, 0.0, 1.0])];
        let t = Vector3::from(x.tf.0);
        let length = 1.0 / x.inv_lf;
        // torques in the unit of forces, so that the system is balanced whatever the unit of length
        let mut b = Matrix4::zeros();
        for (column, g) in units.iter().enumerate() {
            for c in 0..3 {
                b[(c, column)] = g[8 + c];
            }
            b[(3, column)] = g[7] / length;
        }
        for c in 0..3 {
            b[(c, 3)] = t[c];
        }
        let rhs = Vector4::new(pull[j + 1].x, pull[j + 1].y, pull[j + 1].z, torque[j] / length);
        let Some(w) = b.lu().solve(&rhs) else {
            return Err(RodError::Geometry { strand, vertex: j, reason: "no rest shape holds this fold" });
        };
        let ks = stretch_stiffness(rods, strand, j);
        let strain = w[3] / ks;
        if !(strain > -0.5 && w.iter().all(|c| c.is_finite())) {
            return Err(RodError::Geometry { strand, vertex: j, reason: "the load is too large for a rest shape" });
        }
        law.rest = [x.k[0] - w[0] / law.c0, x.k[1] - w[1] / law.c1, x.k[2] - w[0] / law.c0, x.k[3] - w[1] / law.c1];
        law.rest_twist = m - w[2] / law.cm;
        for c in 0..3 {
            let along = t[c] * w[3];
            pull[j + 1][c] -= along;
            pull[j][c] += along;
        }
        let g = vertex_gradient(&law.gradient(&x, m));
        for c in 0..3 {
            pull[j - 1][c] -= g[c];
            pull[j][c] -= g[4 + c];
            pull[j + 1][c] -= g[8 + c];
        }
        torque[j - 1] -= g[3];
        torque[j] -= g[7];
        rods.rest_curvature[v.start + j] = law.rest;
        rods.rest_twist[v.start + j] = law.rest_twist;
        rods.rest_length[e.start + j] = length / (1.0 + strain);
    }
    Ok(())
}
