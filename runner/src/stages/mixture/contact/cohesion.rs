//! Wet contacts: which bridges live, how strongly they pull, and what resists sliding (step 18).
//!
//! A bridge over an open gap pulls with the force of its meniscus until the surfaces meet; yield stress and viscosity of the
//! liquid resist both parting and drawing near. Per contact, by its velocity `u` without impulses and `W` of its own:
//!
//! ```text
//! u − W h (F − R) < 0   they draw near: attraction F − R, the law sees the gap (they may close it and no more)
//! otherwise             they part or hang: resistance up to F + R, the law sees no gap (u_N ≥ 0 from here)
//! ```
//! `F`: capillary force, `R`: viscous and plastic resistance (spec 7.7). Contacts whose surfaces meet take `F + R`.

use ::contact::assembly::ContactSystem;
use ::contact::block::Vec3;
use ::contact::cohesion::{
    CohesionInput, TangentialFlow, WetContact, cohesive_bound, contact_share, overlap_length, unequal::Side,
};
use ::contact::detection::{Contact, SolidField};
use nalgebra::Vector3;
use rayon::prelude::*;
use rods::RodSet;
use surface_flow::{FilmState, film_height};

use super::{Setting, motion};
use crate::world::contact::cohesion::{CohesionWorld, Wetness};
use crate::world::contact::memory::{ContactMemory, Place};
use crate::world::contact::{ContactWorld, Lists};

/// At the end of a strand no bridge where the normal comes within 30° of it: pulling lengthwise it is no cylinder.
const STEEPEST: f64 = 0.866_025_403_784_438_6;

/// Cosine of the normal with an edge beyond which the neighbouring edge is nearer, and has the bridge.
const ASKEW: f64 = 0.2;

/// Sweeps of the sliding resistance.
const MOST_SWEEPS: usize = 200;

/// Relative change at which those sweeps stop.
const SETTLED: f64 = 1e-10;

impl ContactWorld {
    /// How far the liquid of each edge can reach a neighbour [m], so that detection finds bridges.
    pub(super) fn widen(&mut self, rods: &RodSet, films: Option<&FilmState>, memory: &ContactMemory) {
        let lists = &mut self.lists;
        lists.reach.clear();
        lists.height.clear();
        lists.shared.clear();
        let (Some(cohesion), Some(films)) = (&self.cohesion, films) else { return };
        lists.reach.resize(rods.vertex_count(), 0.0);
        lists.height.resize(rods.vertex_count(), 0.0);
        for strand in 0..rods.strand_count() {
            let (_, angle) = cohesion.liquids[cohesion.liquid_of[strand] as usize];
            let vertices = rods.vertices(strand);
            for v in vertices.start..vertices.end - 1 {
                let area = films.area[v].max(films.area[v + 1]);
                if area > 0.0 {
                    let axes =
                        (rods.radius[v][0] + rods.radius[v][1]).min(rods.radius[v + 1][0] + rods.radius[v + 1][1]);
                    lists.height[v] = film_height(area, axes);
                    lists.reach[v] = lists.height[v].max((1.0 + 0.5 * angle) * area.sqrt());
                }
            }
        }
        lists.shared.extend(memory.bridges.iter().flat_map(Place::edges));
        lists.shared.sort_unstable();
    }

    /// The liquid at each of these contacts.
    pub(super) fn wetness(
        &self,
        contacts: &[Contact],
        rods: &RodSet,
        films: Option<&FilmState>,
        memory: &ContactMemory,
        solids: &[&dyn SolidField],
    ) -> Vec<Wetness> {
        let (Some(cohesion), Some(films)) = (&self.cohesion, films) else {
            return vec![Wetness::default(); contacts.len()];
        };
        let lists = &self.lists;
        let look = Look { rods, films, cohesion, solids, first_vertex: &self.first_vertex, shared: &lists.shared };
        contacts.par_iter().with_min_len(256).map(|c| look.wetness(c, &lists.found, memory)).collect()
    }

    /// Gives the posed problem the pull of the bridges.
    pub(super) fn cohere(&mut self, system: &mut ContactSystem, rods: &RodSet, setting: &Setting<'_>) {
        if !self.cohesion.as_ref().is_some_and(|cohesion| cohesion.pulls) {
            return;
        }
        let problem = &mut system.problem;
        let mut bounds = vec![0.0; problem.len()];
        for (k, bound) in bounds.iter_mut().enumerate() {
            let Lists { active, wet, yielding, .. } = &self.lists;
            let (c, mut wet, yielding) = (active[k], wet[k], yielding[k]);
            if !wet.bridged {
                continue;
            }
            if c.gap > 0.0 {
                let gap = motion::gap_velocity(&c, yielding, &self.lists, &self.first_vertex, rods, setting);
                let free = problem.free_velocity[k][0] - gap;
                if !wet.decide(free, problem.delassus.diagonal(k)[0], setting.tau) {
                    problem.free_velocity[k][0] = free;
                }
                self.lists.wet[k] = wet;
            }
            *bound = wet.bound(setting.tau);
        }
        if bounds.iter().any(|bound| *bound > 0.0) {
            problem.cohesion = bounds;
        }
    }

    /// Step 18: impulses by which the liquid between wet strands resists sliding, contact after contact until they settle;
    /// the problem then has the velocities with them. `q` must be those without contact impulses.
    pub(super) fn resist_sliding(&mut self, system: &mut ContactSystem, tau: f64) {
        if !self.cohesion.as_ref().is_some_and(|cohesion| cohesion.flow_friction) {
            return;
        }
        let problem = &mut system.problem;
        let flow = &mut self.lists.flow;
        flow.iter_mut().for_each(|r| *r = [0.0; 3]);
        for _ in 0..MOST_SWEEPS {
            let (mut change, mut largest) = (0.0_f64, 0.0_f64);
            for k in 0..problem.len() {
                let Some(law) = self.lists.wet[k].flow else { continue };
                let law = TangentialFlow { yield_impulse: tau * law.yield_impulse, viscous: tau * law.viscous, ..law };
                let (w, own) = (*problem.delassus.diagonal(k), flow[k]);
                let all = problem.delassus.row_product(k, flow);
                let without =
                    |i: usize| problem.free_velocity[k][i] + all[i] - w[3 * i + 1] * own[1] - w[3 * i + 2] * own[2];
                let new = law.impulse(&[w[4], w[5], w[7], w[8]], &[without(1), without(2)]);
                change = change.max((new[0] - own[1]).hypot(new[1] - own[2]));
                largest = largest.max(new[0].hypot(new[1]));
                flow[k] = [0.0, new[0], new[1]];
            }
            if change <= SETTLED * largest {
                break;
            }
        }
        let moved = problem.delassus.product_sparse(flow);
        for (q, more) in problem.free_velocity.iter_mut().zip(moved) {
            *q = [q[0] + more[0], q[1] + more[1], q[2] + more[2]];
        }
    }

    /// Impulses of the contact law alone, without the resistance to sliding.
    pub(super) fn law_impulses(&self) -> Vec<Vec3> {
        let pairs = self.lists.impulses.iter().zip(&self.lists.flow);
        pairs.map(|(r, f)| [r[0] - f[0], r[1] - f[1], r[2] - f[2]]).collect()
    }
}

/// What is needed to see the liquid at a contact.
struct Look<'a> {
    rods: &'a RodSet,
    films: &'a FilmState,
    cohesion: &'a CohesionWorld,
    solids: &'a [&'a dyn SolidField],
    first_vertex: &'a [u32],
    /// Edges of last step's bridges, sorted: as often as they have bridges.
    shared: &'a [(u32, u32)],
}

impl Look<'_> {
    fn vertex(&self, (strand, edge): (u32, u32)) -> usize {
        (self.first_vertex[strand as usize] + edge) as usize
    }

    /// Share of the film's cross-section at a place of an edge that one contact may use [m²].
    fn share(&self, edge: (u32, u32), at: f64) -> f64 {
        let v = self.vertex(edge);
        let area = (1.0 - at) * self.films.area[v] + at * self.films.area[v + 1];
        let count = self.shared.partition_point(|e| *e <= edge) - self.shared.partition_point(|e| *e < edge);
        contact_share(area, count)
    }

    fn axes(&self, edge: (u32, u32), at: f64) -> f64 {
        let (v, radius) = (self.vertex(edge), &self.rods.radius);
        (1.0 - at) * (radius[v][0] + radius[v][1]) + at * (radius[v + 1][0] + radius[v + 1][1])
    }

    fn wetness(&self, c: &Contact, found: &[Contact], memory: &ContactMemory) -> Wetness {
        let (rods, with_solid) = (self.rods, c.with_solid());
        let (share_a, share_b) =
            (self.share(c.key.a, c.alpha), if with_solid { 0.0 } else { self.share(c.key.b, c.beta) });
        if share_a + share_b <= 0.0 {
            return Wetness::default();
        }
        let normal = Vector3::from(c.normal);
        // whether a place is a vertex of the strand, and whether it is an end of the strand
        let vertex_and_end = |(strand, edge): (u32, u32), at: f64| {
            let last = rods.edges(strand as usize).len() as u32 - 1;
            (at == 0.0 || at == 1.0, (at == 0.0 && edge == 0) || (at == 1.0 && edge == last))
        };
        let steep = |(strand, edge): (u32, u32), at: f64| {
            let limit = if vertex_and_end((strand, edge), at).1 { STEEPEST } else { ASKEW };
            normal.dot(&rods.tangent(strand as usize, edge as usize).0).abs() > limit
        };
        if steep(c.key.a, c.alpha) || (!with_solid && steep(c.key.b, c.beta)) {
            return Wetness::default();
        }
        if !with_solid {
            // edges that lie one behind the other along two strands meet at vertices: pairs side by side have the bridge
            let (a, b) = (vertex_and_end(c.key.a, c.alpha), vertex_and_end(c.key.b, c.beta));
            if a.0 && b.0 && !a.1 && !b.1 {
                return Wetness::default();
            }
        }
        // the liquid of the wetter side
        let strand = if share_a >= share_b { c.key.a.0 } else { c.key.b.0 };
        let (settings, contact_angle) = self.cohesion.liquids[self.cohesion.liquid_of[strand as usize] as usize];
        let side = |axes: f64| Side { radius: 0.5 * axes, contact_angle };
        let axes_a = self.axes(c.key.a, c.alpha);
        let (other, height_b) = if with_solid {
            (Side { radius: f64::INFINITY, contact_angle }, 0.0)
        } else {
            let axes = self.axes(c.key.b, c.beta);
            // equal but for the last digits: the bridge between equal cylinders is far quicker found
            let axes = if (axes - axes_a).abs() < 1e-9 * axes_a { axes_a } else { axes };
            (side(axes), film_height(share_b, axes))
        };
        let wet = WetContact {
            sides: [side(axes_a), other],
            clearance: c.gap,
            heights: [film_height(share_a, axes_a), height_b],
            area: share_a + share_b,
        };
        if !wet.bridged(memory.was_bridged(&Place::of(c))) {
            return Wetness::default();
        }
        let length = self.overlap(c, &wet, found);
        let parting = self.parting_speed(c);
        let input = CohesionInput { dt: 1.0, length, normal_velocity: parting };
        let full = cohesive_bound(&wet, &settings, &input);
        let capillary = length * settings.surface_tension * wet.attraction();
        let resists = (full - capillary).max(0.0);
        let flow = self.cohesion.flow_friction.then(|| {
            let radius = wet.mean_radius();
            let gap = wet.sides.iter().filter(|s| s.radius.is_finite()).map(|s| s.radius).sum::<f64>() + wet.clearance;
            let (eta, n, yields) = (settings.consistency, settings.flow_index, settings.yield_stress);
            TangentialFlow::of_liquid(1.0, length, radius, gap, eta, n, yields)
        });
        Wetness {
            bridged: true,
            against_parting: full,
            towards: (capillary - resists).max(0.0),
            draws_near: None,
            flow,
        }
    }

    /// Relative normal speed at the start of the step [m/s], positive when parting.
    fn parting_speed(&self, c: &Contact) -> f64 {
        let at = |edge: (u32, u32), x: f64| {
            let v = self.vertex(edge);
            self.rods.velocity[v] * (1.0 - x) + self.rods.velocity[v + 1] * x
        };
        let other = if c.with_solid() { Vector3::from(c.solid_velocity) } else { at(c.key.b, c.beta) };
        Vector3::from(c.normal).dot(&(at(c.key.a, c.alpha) - other))
    }

    /// Length over which the bridge of a contact reaches [m].
    fn overlap(&self, c: &Contact, wet: &WetContact, found: &[Contact]) -> f64 {
        let reach = wet.rupture_clearance();
        let ends = |edge: (u32, u32)| {
            let v = self.vertex(edge);
            [self.rods.position[v], self.rods.position[v + 1]]
        };
        let a = ends(c.key.a);
        let length = |e: &[Vector3<f64>; 2]| (e[1] - e[0]).norm();
        if c.with_solid() {
            // several contacts of one edge with a solid are one bridge
            let same = found.iter().filter(|other| other.key == c.key).count().max(1);
            let solid = self.solids[c.key.b.1 as usize];
            let radius = wet.sides[0].radius;
            let away = a.map(|x| solid.sample(&x.into(), 0.0).0 - radius);
            return overlap_length([length(&a); 2], [away; 2], reach) / same as f64;
        }
        let b = ends(c.key.b);
        let radii = wet.sides[0].radius + wet.sides[1].radius;
        let away = |x: &Vector3<f64>, edge: &[Vector3<f64>; 2]| distance(x, edge) - radii;
        let to_b = a.map(|x| away(&x, &b));
        let to_a = b.map(|x| away(&x, &a));
        overlap_length([length(&a), length(&b)], [to_b, to_a], reach)
    }
}

/// Distance of a point from a segment [m].
fn distance(x: &Vector3<f64>, edge: &[Vector3<f64>; 2]) -> f64 {
    let along = edge[1] - edge[0];
    let t = ((x - edge[0]).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
    (x - edge[0] - along * t).norm()
}
