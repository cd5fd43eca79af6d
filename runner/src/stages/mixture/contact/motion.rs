//! Where strands start and end, how wide they are towards a contact, and which velocity closes a gap.

use ::contact::detection::{Contact, SolidField, effective_radius};
use nalgebra::Vector3;
use rods::{Integrator, RodSet, RodStepper};

use super::{STABILISATION, Setting};
use crate::world::contact::{ContactWorld, HELD, Lists, Yielding};

/// Ends of the step under the present solution.
pub(super) fn read_ends(lists: &mut Lists, rods: &RodSet, stepper: &RodStepper) {
    stepper.ends_into(rods, &mut lists.vectors);
    lists.end.clear();
    lists.end.extend(lists.vectors.iter().map(|x| [x.x, x.y, x.z]));
}

/// Displacement that the velocities do not account for: a two-step formula goes on with part of the step before.
pub(super) fn read_drift(lists: &mut Lists, rods: &RodSet, stepper: &RodStepper, dt: f64) {
    lists.drift.clear();
    if stepper.settings.integrator != Integrator::Bdf2 {
        return;
    }
    let tau = stepper.equivalent_step().unwrap_or(dt);
    stepper.velocities_into(rods, &mut lists.vectors);
    for v in 0..rods.vertex_count() {
        lists.drift.push(Vector3::from(lists.end[v]) - rods.position[v] - lists.vectors[v] * tau);
    }
}

/// Both sides of a contact as pairs of vertices with weights; side B has none where it is a solid.
fn sides(c: &Contact, first_vertex: &[u32]) -> [Option<(usize, [f64; 2])>; 2] {
    let side = |(strand, edge): (u32, u32), at: f64| ((first_vertex[strand as usize] + edge) as usize, [1.0 - at, at]);
    [Some(side(c.key.a, c.alpha)), (!c.with_solid()).then(|| side(c.key.b, c.beta))]
}

/// Relative value (A − B) of a vector field on the vertices at a contact.
pub(super) fn relative(c: &Contact, first_vertex: &[u32], field: impl Fn(usize) -> Vector3<f64>) -> Vector3<f64> {
    let mut sum = Vector3::zeros();
    for (side, sign) in sides(c, first_vertex).into_iter().zip([1.0, -1.0]) {
        let Some((v, weight)) = side else { continue };
        sum += (field(v) * weight[0] + field(v + 1) * weight[1]) * sign;
    }
    sum
}

/// Share of the contact that free vertices carry, on the side where it is larger.
fn free_share(c: &Contact, first_vertex: &[u32], held: &[bool]) -> f64 {
    let share = |(v, weight): (usize, [f64; 2])| -> f64 {
        let free = |i: usize| if held[v + i] { 0.0 } else { weight[i] };
        free(0) + free(1)
    };
    sides(c, first_vertex).into_iter().flatten().map(share).fold(0.0, f64::max)
}

/// How far the last impulses moved a vertex of either side [m].
pub(super) fn moved(c: &Contact, lists: &Lists, first_vertex: &[u32]) -> f64 {
    let vertices = sides(c, first_vertex).into_iter().flatten().flat_map(|(v, _)| [v, v + 1]);
    vertices.map(|v| lists.moved[v]).fold(0.0, f64::max)
}

/// Whether no free vertex carries the contact.
pub(super) fn is_held(c: &Contact, first_vertex: &[u32], held: &[bool]) -> bool {
    free_share(c, first_vertex, held) < HELD
}

/// Gap at the end of the step along the normal if nothing more happens [m].
pub(super) fn end_gap(c: &Contact, lists: &Lists, first_vertex: &[u32], solids: &[&dyn SolidField]) -> f64 {
    let moved = relative(c, first_vertex, |v| Vector3::from(lists.end[v]) - Vector3::from(lists.start[v]));
    let carried = if c.with_solid() {
        Vector3::from(c.solid_velocity) * solids.first().map_or(0.0, |solid| solid.dt())
    } else {
        Vector3::zeros()
    };
    c.gap + Vector3::from(c.normal).dot(&(moved - carried))
}

/// Part of an overlap that one step pushes apart \[m\], negative. Next to a clamp a vertex would have to move many times as far as
/// the contact it carries a small share of; there the contact moves by so much less.
pub(super) fn push(c: &Contact, lists: &Lists, first_vertex: &[u32]) -> f64 {
    STABILISATION * c.gap.min(0.0) * free_share(c, first_vertex, &lists.held)
}

/// What the gap adds to the normal velocity that the law constrains [m/s] (spec A.7): an open gap may be closed and no
/// more, an overlap is pushed apart by a share, unless others forbid it. A bouncing solid gives back a part of the approach velocity instead.
pub(super) fn gap_velocity(
    c: &Contact,
    yielding: Yielding,
    lists: &Lists,
    first_vertex: &[u32],
    rods: &RodSet,
    setting: &Setting<'_>,
) -> f64 {
    let normal = Vector3::from(c.normal);
    let mut gap = if c.gap > 0.0 {
        c.gap
    } else if yielding == Yielding::No {
        push(c, lists, first_vertex)
    } else {
        0.0
    };
    if c.with_solid() {
        let restitution = setting.solids[c.key.b.1 as usize].restitution;
        let approach = normal.dot(&(relative(c, first_vertex, |v| rods.velocity[v]) - Vector3::from(c.solid_velocity)));
        if restitution > 0.0 && approach < 0.0 && c.gap + approach * setting.dt < 0.0 {
            return restitution * approach;
        }
    }
    if !lists.drift.is_empty() {
        gap += normal.dot(&relative(c, first_vertex, |v| lists.drift[v]));
        gap -= (setting.dt - setting.tau) * normal.dot(&Vector3::from(c.solid_velocity));
        return gap / setting.tau;
    }
    // implicit Euler and the midpoint rule: the end is start + dt · velocity
    gap / setting.dt
}

impl ContactWorld {
    /// Detection sees every edge as thick as it is anywhere; where sections are flat or taper, gaps widen to the true
    /// thickness towards the contact.
    pub(super) fn adjust_gaps(&mut self, rods: &RodSet) {
        if self.uniform {
            return;
        }
        let (first_vertex, edge_radius) = (&self.first_vertex, &self.edge_radius);
        for c in &mut self.lists.found {
            let normal = c.normal;
            let mut slack = 0.0;
            let key = c.key;
            let with_solid = c.with_solid();
            let sides = [(key.a, c.alpha, false), (key.b, c.beta, with_solid)];
            for ((strand, edge), at, solid) in sides {
                if solid {
                    continue;
                }
                let v = (first_vertex[strand as usize] + edge) as usize;
                let mix = |k: usize| (1.0 - at) * rods.radius[v][k] + at * rods.radius[v + 1][k];
                let (tangent, _) = rods.tangent(strand as usize, edge as usize);
                let (major, _) = rods.material_directors(strand as usize, edge as usize);
                let true_radius = effective_radius((mix(0), mix(1)), &major.into(), &tangent.into(), &normal);
                slack += edge_radius[v] - true_radius;
            }
            c.gap += slack;
        }
    }

    /// Takes over the velocities of the present solution, four numbers a vertex.
    pub(super) fn read_velocities(&mut self, rods: &RodSet, stepper: &RodStepper) {
        let lists = &mut self.lists;
        stepper.velocities_into(rods, &mut lists.vectors);
        lists.velocity.clear();
        lists.velocity.extend(lists.vectors.iter().flat_map(|v| [v.x, v.y, v.z, 0.0]));
    }

    /// Takes over the ends of the step after impulses; returns how far they moved the farthest vertex [m].
    pub(super) fn follow(&mut self, rods: &RodSet, stepper: &RodStepper) -> f64 {
        let lists = &mut self.lists;
        stepper.ends_into(rods, &mut lists.vectors);
        lists.moved.clear();
        for (end, new) in lists.end.iter_mut().zip(&lists.vectors) {
            lists.moved.push((Vector3::from(*end) - new).norm());
            *end = [new.x, new.y, new.z];
        }
        lists.moved.iter().copied().fold(0.0, f64::max)
    }
}
