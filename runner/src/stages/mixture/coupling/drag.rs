//! Drag between strands and liquid: secant coefficients and impulses.

use constitutive::drag::{DragGeometry, DragLaw, voidage_exponent};
use mpm::LiquidGrid;
use nalgebra::Vector3;
use particle_grid::{CENTRE, mac_offset, stencil};

use super::Both;
use crate::stages::Step;
use crate::stages::mixture::rods::solve;
use crate::system::Rejection;
use crate::world::World;
use crate::world::liquid::coupling::FaceNumbers;
use crate::world::submersion::{DENSEST, vertex_tangent};

/// A vertex is in the liquid only where this share of the faces around it holds some.
const SURROUNDED: f64 = 0.5;

/// Effective masses are capped at this multiple of the vertex's own: held vertices have none of their own.
const HEAVIEST: f64 = 1e12;

/// A vertex that drag moves more easily than this many times its own mass would: rounding, or a strand about to turn.
const LIGHTEST: f64 = 0.25;

/// Finds the vertices in the liquid and what they see of it; the pressure of the last step and the momentum of captured
/// liquid go to the loads of the rods.
pub fn meet(world: &mut World, step: Step) -> Result<(), Rejection> {
    let Some(mut both) = Both::of(world) else {
        // before the first particle, or after the last, nothing acts
        if let (Some(submersion), Some(memory)) = (&mut world.submersion, &mut world.state.submersion) {
            submersion.wet.clear();
            memory.pressure_gradient.fill(Vector3::zeros());
            memory.pull.fill(None);
            submersion.add_up(world.film.as_ref());
        }
        return Ok(());
    };
    super::pressure::forces(&mut both);
    let Both { rods, film, flow, submersion, memory, .. } = both;
    submersion.wet.clear();
    let grid = &flow.grid;
    let mut list = Vec::new();
    for strand in 0..rods.strand_count() {
        let density = film.density[strand];
        for v in rods.vertices(strand) {
            let x = &rods.position[v];
            let (mut level, mut share, mut ratio, mut filled) = (0.0, 0.0, 0.0, 0.0);
            let known = stencil(&grid.blocks, x, &[CENTRE; 3], |s| {
                level += s.weight * grid.cell.liquid_distance[s.node];
                share += s.weight * flow.coupling.solid_fraction.get(s.node).copied().unwrap_or(0.0);
                let weight = s.weight * grid.cell.liquid_fraction[s.node];
                ratio += weight * grid.cell.volume_ratio[s.node];
                filled += weight;
            });
            if known < SURROUNDED || level > 0.0 || filled <= 0.0 {
                continue;
            }
            let (mut velocity, mut surrounded) = (Vector3::zeros(), 1.0f64);
            for a in 0..3 {
                surrounded = surrounded.min(faces(grid, x, a, &mut list));
                velocity[a] = list.iter().map(|(node, weight)| weight * grid.face[a].velocity[*node]).sum();
            }
            if surrounded < SURROUNDED {
                continue;
            }
            let ratio = (ratio / filled).clamp(0.1, 10.0);
            // where the liquid would be at the end of the step without drag, as far as the last step tells
            let pull = memory.pull[v].unwrap_or(flow.body - memory.pressure_gradient[v] * (ratio / density));
            submersion.start_velocity[v] = velocity;
            submersion.fluid_velocity[v] = velocity + pull * step.dt;
            submersion.porosity[v] = 1.0 - share.min(DENSEST);
            submersion.volume_ratio[v] = ratio;
            submersion.wet.push(v);
        }
    }
    submersion.add_up(Some(film));
    Ok(())
}

/// Weights of the faces that hold liquid around a point, for one direction: kernel times mass, adding up to one. With the
/// mass in them an impulse changes the velocities of all faces alike: those that hold next to nothing do not fly off.
/// Returns the share of the kernel that they cover.
pub(super) fn faces(grid: &LiquidGrid<3>, x: &Vector3<f64>, axis: usize, list: &mut Vec<(usize, f64)>) -> f64 {
    list.clear();
    let (mut sum, mut covered) = (0.0, 0.0);
    stencil(&grid.blocks, x, &mac_offset(axis), |s| {
        let mass = grid.face[axis].mass[s.node];
        if mass > grid.mass_floor {
            list.push((s.node, s.weight * mass));
            sum += s.weight * mass;
            covered += s.weight;
        }
    });
    list.iter_mut().for_each(|(_, weight)| *weight /= sum);
    covered
}

/// Adds impulses [N s] on the vertices `wet` to numbers on the faces around them.
pub(super) fn spread(
    grid: &LiquidGrid<3>,
    positions: &[Vector3<f64>],
    wet: &[usize],
    impulse: impl Fn(usize) -> Vector3<f64>,
    to: &mut FaceNumbers<3>,
) {
    let mut list = Vec::new();
    for (k, v) in wet.iter().enumerate() {
        let r = impulse(k);
        for a in 0..3 {
            faces(grid, &positions[*v], a, &mut list);
            for (node, weight) in &list {
                to.0[a][*node] += weight * r[a];
            }
        }
    }
}

/// Exchanges momentum between the vertices in the liquid and the faces around them.
pub fn drag(world: &mut World, step: Step) -> Result<(), Rejection> {
    let Some(mut both) = Both::of(world) else { return Ok(()) };
    if both.submersion.wet.is_empty() || !both.submersion.drags {
        return Ok(());
    }
    exchange(&mut both, step.dt)?;
    let Both { rods, strands, flow, submersion, .. } = both;
    if submersion.drag_in_faces {
        coefficients_to_faces(rods, strands, flow, submersion);
        return Ok(());
    }
    let mut taken = FaceNumbers::<3>::zeros(flow.grid.blocks.node_count());
    spread(&flow.grid, &rods.position, &submersion.wet, |k| submersion.drag_impulse[submersion.wet[k]], &mut taken);
    let floor = flow.grid.mass_floor;
    for a in 0..3 {
        let face = &mut flow.grid.face[a];
        for ((u, m), r) in face.velocity.iter_mut().zip(&face.mass).zip(&taken.0[a]) {
            if *m > floor {
                *u -= r / m;
            }
        }
    }
    Ok(())
}

/// Impulses of drag from the rods as they are solved without it and the liquid as it would be without it
/// (`fluid_velocity`). Nothing acts on the liquid yet.
pub(super) fn exchange(both: &mut Both<'_>, dt: f64) -> Result<(), Rejection> {
    let answers = first_answers(both, dt);
    find_coefficients(both, dt, &answers);
    // the rods with the coefficients: implicit, elasticity and clamps and all
    both.submersion.coefficient_in_loads = true;
    both.strands.report = {
        let loads = both.submersion.add_to(both.film.loads(both.gravity));
        solve(both.strands, both.rods, dt, &loads)?
    };
    let Both { rods, strands, submersion, .. } = both;
    if submersion.drag_in_faces {
        return Ok(());
    }
    submersion.coefficient_in_loads = false;
    strands.stepper.velocities_into(rods, &mut submersion.vectors);
    for v in &submersion.wet {
        let relative = submersion.pulls_to[*v] - submersion.vectors[*v];
        submersion.drag_impulse[*v] = relative * (dt * submersion.coefficient[*v]);
    }
    Ok(())
}

/// Impulses on the vertices in the liquid and how the strands answer to them.
struct Answers {
    /// Impulses [N s].
    impulse: Vec<Vector3<f64>>,
    /// Change of the velocities by them [m/s].
    yields: Vec<Vector3<f64>>,
    /// Speeds of the liquid past the vertices without drag [m/s], the laws of drag there and the pieces as they see them.
    law: Vec<(f64, DragLaw, DragGeometry)>,
}

/// Drag at the velocities without it, and how the strands answer to that.
fn first_answers(both: &mut Both<'_>, dt: f64) -> Answers {
    let Both { rods, strands, film, submersion, .. } = both;
    let stepper = &mut strands.stepper;
    stepper.velocities_into(rods, &mut submersion.vectors);
    let mut touched: Vec<usize> = submersion.wet.iter().map(|v| rods.locate_vertex(*v).0).collect();
    touched.dedup();
    stepper.prepare_factors(Some(&touched));

    // drag at the relative velocity without it, along that velocity
    let count = submersion.wet.len();
    let (mut trial, mut bodies) = (vec![Vector3::zeros(); count], Vec::with_capacity(count));
    for (k, v) in submersion.wet.iter().enumerate() {
        let (strand, i) = rods.locate_vertex(*v);
        let law = submersion.drag[film.liquid_of[strand] as usize];
        let law = law.at_density(film.density[strand] / submersion.volume_ratio[*v]);
        let relative = submersion.fluid_velocity[*v] - submersion.vectors[*v];
        let speed = relative.norm();
        let along = if speed > 0.0 { relative / speed } else { Vector3::zeros() };
        let [a, b] = rods.radius[*v];
        let sine = vertex_tangent(rods, strand, i).cross(&along).norm();
        let body = DragGeometry::capsule(0.5 * (a + b), rods.vertex_length(strand, i), sine);
        let porosity = submersion.porosity[*v];
        let exponent = voidage_exponent(law.reynolds(speed, body.diameter, porosity));
        trial[k] = along * (dt * law.force(speed, &body, porosity, exponent).total());
        bodies.push((speed, law, body));
    }

    // how the strands yield to it, elasticity and clamps and all
    let mut yields = vec![Vector3::zeros(); count];
    let mut k = 0;
    while k < count {
        let strand = rods.locate_vertex(submersion.wet[k]).0;
        let vertices = rods.vertices(strand);
        let end = k + submersion.wet[k..].iter().take_while(|v| vertices.contains(v)).count();
        let Some(inverse) = stepper.strand_inverse(strand) else {
            k = end;
            continue;
        };
        let mut x = vec![0.0; inverse.len()];
        for n in k..end {
            let at = 4 * (submersion.wet[n] - vertices.start);
            x[at..at + 3].copy_from_slice(trial[n].as_slice());
        }
        inverse.apply(&mut x);
        for n in k..end {
            let at = 4 * (submersion.wet[n] - vertices.start);
            yields[n] = Vector3::new(x[at], x[at + 1], x[at + 2]);
        }
        k = end;
    }

    Answers { impulse: trial, yields, law: bodies }
}

/// Drag coefficients of the vertices in the liquid, from how strands and liquid answer to impulses.
fn find_coefficients(both: &mut Both<'_>, dt: f64, answers: &Answers) {
    let Both { rods, film, flow, submersion, .. } = both;
    let trial = &answers.impulse;
    // how the liquid around yields to them, were all along each other: impulses that cancel today need not cancel when they are
    // given, and liquid that is light against the strands in it (little is left in a dense bundle) would overshoot from step to step
    let grid = &flow.grid;
    let mut taken = FaceNumbers::<3>::zeros(grid.blocks.node_count());
    spread(grid, &rods.position, &submersion.wet, |k| Vector3::repeat(trial[k].norm()), &mut taken);
    let mut list = Vec::new();
    submersion.stuck = 0;
    for (k, v) in submersion.wet.iter().enumerate() {
        let (strand, i) = rods.locate_vertex(*v);
        let own = rods.vertex_mass(strand, i) + film.mass[*v];
        let impulse = trial[k].norm();
        submersion.pulls_to[*v] = submersion.fluid_velocity[*v];
        submersion.coefficient[*v] = 0.0;
        submersion.recoil[*v] = 0.0;
        if impulse <= 0.0 || !impulse.is_finite() {
            continue;
        }
        let along = trial[k] / impulse;
        let mut recoil = 0.0f64;
        for a in 0..3 {
            faces(grid, &rods.position[*v], a, &mut list);
            let one = list.iter().map(|(node, weight)| weight * taken.0[a][*node] / grid.face[a].mass[*node]);
            recoil = recoil.max(one.sum());
        }
        let strand_yields = (answers.yields[k].dot(&along) / impulse).clamp(0.0, 1.0 / (LIGHTEST * own));
        let liquid_yields = recoil / impulse;
        let mass = 1.0 / (strand_yields + liquid_yields).max(1.0 / (HEAVIEST * own));
        let (speed, law, body) = &answers.law[k];
        let solved = law.solve(*speed, mass, dt, body, submersion.porosity[*v]);
        submersion.stuck += usize::from(solved.stuck);
        submersion.recoil[*v] = liquid_yields;
        let secant = solved.coefficient;
        submersion.coefficient[*v] =
            if submersion.drag_in_faces { secant } else { secant / (1.0 + dt * secant * liquid_yields) };
    }
}

/// The form of the reference code: coefficients on the faces, the velocity of the strands averaged by mass.
fn coefficients_to_faces(
    rods: &rods::RodSet,
    strands: &mut crate::world::StrandWorld,
    flow: &mut crate::world::liquid::Flow<3>,
    submersion: &mut crate::world::submersion::Submersion,
) {
    strands.stepper.velocities_into(rods, &mut submersion.vectors);
    let n = flow.grid.blocks.node_count();
    let (mut coefficient, mut velocity) = (FaceNumbers::<3>::zeros(n), FaceNumbers::<3>::zeros(n));
    let mut mass = FaceNumbers::<3>::zeros(n);
    let wet = &submersion.wet;
    spread(&flow.grid, &rods.position, wet, |k| Vector3::repeat(submersion.coefficient[wet[k]]), &mut coefficient);
    let own = |k: usize| {
        let (strand, i) = rods.locate_vertex(wet[k]);
        rods.vertex_mass(strand, i)
    };
    spread(&flow.grid, &rods.position, wet, |k| Vector3::repeat(own(k)), &mut mass);
    spread(&flow.grid, &rods.position, wet, |k| submersion.vectors[wet[k]] * own(k), &mut velocity);
    for a in 0..3 {
        for (u, m) in velocity.0[a].iter_mut().zip(&mass.0[a]) {
            *u = if *m > 0.0 { *u / m } else { 0.0 };
        }
    }
    flow.coupling.drag = Some((coefficient, velocity));
}
