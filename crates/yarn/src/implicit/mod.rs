//! Backward Euler on the grid by Newton–CG.
//!
//! The velocities `v` of nodes at the end of the step minimise
//!
//! ```text
//! Φ(v) = Σ m/2 |v − v*|² + E(x + dt·G v, (1 + dt C(v)) F),     v* = momentum/mass + dt (gravity + attractor)
//! ```
//!
//! where `G` gathers velocities to vertices (hand-back and driven vertices included) and `C` to quadrature points; its gradient
//! and Hessian come from the law's exact stress and stress differential through the adjoints of the same maps. Obstacles, pins
//! and walls hold some directions of some nodes; which contacts hold, stick or slip is found by a primal–dual active set, with
//! friction from the normal reactions of the last solve.
//!
//! Friction acts inside the solve: the potential is that of `constitutive::yarn::FlowLimits`, whose stress is that of the return map at the
//! pressure of the last iterate, and slipping nodes feel the impulse that their reaction allows. So a long step rubs as much
//! as many short ones. Reactions and pressures are renewed until they agree with the solution; after [`FLOW_ITERATIONS`], [`FLOW_ROUNDS`] and [`MAX_ROUNDS`]
//! they stay, and what is left is a smooth minimisation that cannot fail to descend.
//!
//! ```text
//! contact ── candidate nodes, active set, projection, friction
//! operator ─ potential, gradient, Hessian times a vector
//! ```

mod contact;
mod operator;
mod vector;

use nalgebra::{SMatrix, SVector};
use particle_grid::Lanes;

use crate::YarnError;
use crate::boundary::BoundarySample;
use crate::forces::Forces;
use crate::grid::{MASS, lanes, momentum};
use crate::kinematics::Gathered;
use crate::nodes::{Loads, Totals};
use crate::settings::ImplicitSettings;
use crate::state::YarnState;
use crate::step::{Scratch, Setting};
use constitutive::yarn::{FlowLimits, StressTangent};
use contact::{Change, Contacts};
use operator::Operator;

/// Effort and success of a solve.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SolveOutcome {
    pub newton: usize,
    pub cg: usize,
    pub residual: f64,
}

/// Working memory of the solve, by node and by vertex.
#[derive(Clone, Debug, Default)]
pub(crate) struct ImplicitScratch<const D: usize> {
    // By node.
    star: Vec<SVector<f64, D>>,
    velocity: Vec<SVector<f64, D>>,
    trial: Vec<SVector<f64, D>>,
    residual: Vec<SVector<f64, D>>,
    direction: Vec<SVector<f64, D>>,
    search: Vec<SVector<f64, D>>,
    image: Vec<SVector<f64, D>>,
    left: Vec<SVector<f64, D>>,
    mass: Vec<f64>,
    packed: Vec<Lanes>,
    // By vertex.
    gathered: Gathered<D>,
    forces: Forces<D>,
    affine: Vec<SMatrix<f64, D, D>>,
    moved: Vec<SVector<f64, D>>,
    position: Vec<SVector<f64, D>>,
    deformation: Vec<SMatrix<f64, D, D>>,
    limits: Vec<FlowLimits>,
    force: Vec<SVector<f64, D>>,
    on_vertex: Vec<SVector<f64, D>>,
    on_quadrature: Vec<SVector<f64, D>>,
    tangents: Vec<Option<StressTangent<D>>>,
}

/// Rounds of contacts and friction before the last one is taken as it is.
const MAX_ROUNDS: usize = 24;
/// Newton iterations of a round in which the limits of plastic flow follow the pressure; afterwards they stay.
const FLOW_ITERATIONS: usize = 4;
/// Rounds in which they do.
const FLOW_ROUNDS: usize = 8;
/// Part of the friction impulses to which they are found.
const FRICTION_ACCURACY: f64 = 3e-3;
/// Newton iterations with secants of the flowing shear after one that overshot.
const CAREFUL: usize = 3;
/// Share of its scale to which a round is solved while contacts and friction still change.
const LOOSE: f64 = 0.03;
/// Halvings of a Newton direction.
const MAX_HALVINGS: usize = 20;

/// Solves for the node velocities at the end of the step; `scratch.transfer.nodes` holds momentum and mass before, velocity and mass after.
#[expect(clippy::too_many_arguments, reason = "the parts of one step, each owned elsewhere")]
pub(crate) fn solve<const D: usize>(
    setting: &Setting<'_, D>,
    implicit: &ImplicitSettings,
    state: &YarnState<D>,
    scratch: &mut Scratch<D>,
    posed: &BoundarySample<'_, D>,
    loads: &Loads<D>,
    targets: &[(usize, SVector<f64, D>)],
    dt: f64,
    least_mass: f64,
    totals: &mut Totals<D>,
) -> Result<SolveOutcome, YarnError> {
    let Scratch { transfer, implicit: work, .. } = scratch;
    let count = transfer.nodes.len();
    // Predictor.
    work.star.clear();
    work.mass.clear();
    for (node, packed) in transfer.nodes.iter().enumerate() {
        let mass = packed.0[MASS];
        if mass <= least_mass {
            let p = momentum::<D>(packed);
            if p.iter().any(|x| *x != 0.0) {
                totals.lost -= p;
                totals.massless += 1;
            }
            work.star.push(SVector::zeros());
            work.mass.push(0.0);
            continue;
        }
        let x = transfer.grid.lattice.node_position(&transfer.grid.cell(node), &[0.0; D]);
        let change = loads.acceleration(&x) * dt;
        totals.body += change * mass;
        work.star.push(momentum::<D>(packed) / mass + change);
        work.mass.push(mass);
    }
    for vector in
        [&mut work.trial, &mut work.residual, &mut work.direction, &mut work.search, &mut work.image, &mut work.left]
    {
        vector.resize(count, SVector::zeros());
    }
    work.velocity.clone_from(&work.star);
    let mut contacts = Contacts::find(&transfer.grid, posed, &work.star, &work.mass);
    contacts.enforce(&mut work.velocity);

    let noise = rounding_noise(setting, state, dt) + 1e-14 * vector::momentum_norm(&work.star, &work.mass);
    let mut operator = Operator { setting, state, transfer, targets, dt };
    let mut outcome = SolveOutcome::default();
    let mut scale = 0.0;
    let mut converged = false;
    // Rounds with the same contacts: how many there were, Newton iterations in this one, how well it must be solved.
    let (mut rounds, mut iterations, mut wanted) = (0, 0, LOOSE.max(implicit.tolerance));
    let mut careful = 0;
    while iterations < implicit.max_newton {
        operator.gradient(work, iterations <= FLOW_ITERATIONS && rounds < FLOW_ROUNDS);
        work.left.clone_from(&work.residual);
        contacts.slipping(|node, impulse| work.left[node] -= impulse);
        contacts.project(&mut work.left);
        let size = vector::mass_norm(&work.left, &work.mass);
        if scale == 0.0 {
            scale = vector::mass_norm(&work.residual, &work.mass).max(size).max(f64::MIN_POSITIVE);
        }
        outcome.residual = size / scale;
        if !outcome.residual.is_finite() {
            break;
        }
        if size <= wanted * scale || size <= noise {
            let mut change = Change::default();
            if rounds < MAX_ROUNDS {
                change = contacts.update(&work.velocity, &work.residual, &work.mass);
            }
            // Where a stiff yarn makes the scale large, friction itself sets what is good enough.
            let mut target = implicit.tolerance * scale;
            if change.size > 0.0 {
                target = target.min(FRICTION_ACCURACY * change.size);
            }
            let changed = change.switched > 0 || change.friction > 0.0;
            if change.switched == 0 && size <= target.max(noise) && change.friction <= target.max(noise) {
                converged = true;
                break;
            }
            // While contacts switch a rough solution shows which; then each round is solved ten times better than friction has moved.
            let rough = LOOSE * scale;
            wanted = (if change.switched > 0 { rough } else { (0.1 * change.friction).min(rough).max(target) }) / scale;
            if changed {
                rounds += 1;
                iterations = 0;
                contacts.enforce(&mut work.velocity);
                continue;
            }
        }
        operator.linearise(work, careful > 0);
        careful = usize::saturating_sub(careful, 1);
        // Inexact Newton: solve just well enough for the convergence to stay superlinear.
        let forcing = outcome.residual.sqrt().min(0.1).max(0.1 * implicit.tolerance);
        outcome.cg += conjugate_gradients(&mut operator, work, &contacts, forcing, implicit.max_cg);
        outcome.newton += 1;
        iterations += 1;
        // Potential with the work of the friction impulses, which are constant within a round.
        let rubbed = |velocity: &[SVector<f64, D>]| {
            let mut work = 0.0;
            contacts.slipping(|node, impulse| work += impulse.dot(&velocity[node]));
            work
        };
        let potential = operator.potential(work, false) - rubbed(&work.velocity);
        let slope = vector::dot(&work.residual, &work.direction) - rubbed(&work.direction);
        let mut share = 1.0;
        let mut accepted = false;
        for _ in 0..MAX_HALVINGS {
            vector::combine(&mut work.trial, &work.velocity, share, &work.direction);
            let next = operator.potential_of_trial(work) - rubbed(&work.trial);
            // Near the solution the potential falls by less than its rounding.
            let noise = 1e-11 * potential.abs();
            if next <= potential + 1e-4 * share * slope + noise {
                accepted = true;
                break;
            }
            share *= 0.5;
        }
        if share < 1.0 {
            careful = CAREFUL;
        }
        if !accepted {
            break;
        }
        std::mem::swap(&mut work.velocity, &mut work.trial);
    }
    if !converged {
        // The last iterate has not been judged yet.
        operator.gradient(work, false);
        work.left.clone_from(&work.residual);
        contacts.slipping(|node, impulse| work.left[node] -= impulse);
        contacts.project(&mut work.left);
        outcome.residual = vector::mass_norm(&work.left, &work.mass) / scale.max(f64::MIN_POSITIVE);
        converged = outcome.residual <= implicit.tolerance || outcome.residual * scale <= noise;
    }
    if !outcome.residual.is_finite() || (implicit.require_convergence && !converged) {
        return Err(YarnError::NotConverged {
            iterations: outcome.newton,
            residual: outcome.residual,
            tolerance: implicit.tolerance,
        });
    }
    totals.drives.extend(targets.iter().map(|&(vertex, _)| -work.forces.on_vertex(vertex) * dt));
    contacts.finish(&mut work.velocity, &work.residual, &work.mass, totals);
    for (node, packed) in transfer.nodes.iter_mut().enumerate() {
        *packed = lanes(&work.velocity[node], work.mass[node]);
    }
    Ok(outcome)
}

/// Size of the impulses that rounding of the positions alone makes, as a mass norm.
fn rounding_noise<const D: usize>(setting: &Setting<'_, D>, state: &YarnState<D>, dt: f64) -> f64 {
    let model = setting.model;
    let sum = vector::total(model.len(), |i| {
        if !model.has_segment(i) {
            return 0.0;
        }
        let material = &model.materials[model.material[i] as usize];
        let rounding = 4.0 * f64::EPSILON * (1.0 + state.position[i].norm() / model.rest_length[i]);
        let stiffness = material.law.stretch_modulus.max(2.0 * material.law.mu + material.law.lambda);
        let force = stiffness * rounding * model.volume[i] / model.rest_length[i];
        force * force / (material.density * model.volume[i])
    });
    dt * sum.sqrt()
}

/// Truncated conjugate gradients for `H d = −r` in the free directions, preconditioned by the node masses; stops at negative curvature.
fn conjugate_gradients<const D: usize>(
    operator: &mut Operator<'_, D>,
    work: &mut ImplicitScratch<D>,
    contacts: &Contacts<D>,
    forcing: f64,
    max: usize,
) -> usize {
    work.direction.fill(SVector::zeros());
    // `left` holds the projected residual; the equation's right side is its negative.
    for left in &mut work.left {
        *left = -*left;
    }
    vector::over_mass(&mut work.search, &work.left, &work.mass);
    let mut rho = vector::dot(&work.left, &work.search);
    let stop = forcing * forcing * rho;
    for iteration in 0..max {
        if rho <= stop || rho == 0.0 {
            return iteration;
        }
        operator.hessian(work);
        contacts.project(&mut work.image);
        let curvature = vector::dot(&work.search, &work.image);
        let inertia = vector::momentum_norm(&work.search, &work.mass);
        if curvature <= 1e-8 * inertia * inertia {
            if iteration == 0 {
                work.direction.clone_from(&work.search);
            }
            return iteration + 1;
        }
        let step = rho / curvature;
        vector::add(&mut work.direction, step, &work.search);
        vector::add(&mut work.left, -step, &work.image);
        vector::over_mass(&mut work.trial, &work.left, &work.mass);
        let next = vector::dot(&work.left, &work.trial);
        vector::scale_add(&mut work.search, next / rho, &work.trial);
        rho = next;
    }
    max
}
