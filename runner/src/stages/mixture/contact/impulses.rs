//! Impulses to the vertices, forces to the solids and the ledger.

use ::contact::block::Vec3;
use ::contact::detection::Contact;
use ::contact::law::ContactState;
use nalgebra::Vector3;
use rods::{RodReport, RodSet, RodStepper};

use super::Inverses;

use crate::stages::Step;
use crate::stages::mixture::rejection;
use crate::system::Rejection;
use crate::world::Reaction;
use crate::world::contact::record::world_impulse;
use crate::world::contact::{ContactWorld, Lists};
use crate::world::solids::SceneSolid;

impl ContactWorld {
    /// Writes what the vertices get beyond the impulses of the rounds before, `Hᵀ (r' − r)`.
    pub(super) fn hand_over(&mut self, rods: &RodSet, impulses: &[Vec3]) {
        let Lists { active, impulses: before, per_vertex, .. } = &mut self.lists;
        per_vertex.clear();
        per_vertex.resize(rods.vertex_count(), Vector3::zeros());
        for ((c, new), old) in active.iter().zip(impulses).zip(before) {
            give(per_vertex, &self.first_vertex, c, &[new[0] - old[0], new[1] - old[1], new[2] - old[2]]);
        }
    }

    /// Writes what the vertices get from the loose bridges from number `from` on.
    pub(super) fn hand_over_pulls(&mut self, rods: &RodSet, from: usize) {
        let Lists { loose, per_vertex, .. } = &mut self.lists;
        per_vertex.clear();
        per_vertex.resize(rods.vertex_count(), Vector3::zeros());
        for bridge in &loose[from..] {
            give(per_vertex, &self.first_vertex, &bridge.contact, &bridge.impulse());
        }
    }

    /// Gives the rods what was handed over, by the linear step or by solving them anew.
    pub(super) fn give_to_rods(
        &self,
        rods: &RodSet,
        stepper: &mut RodStepper,
        nonlinear: bool,
    ) -> Result<RodReport, Rejection> {
        let given = &self.lists.per_vertex;
        let done = if nonlinear { stepper.resolve(rods, given) } else { stepper.correct(rods, given) };
        done.map_err(|error| rejection(&error))
    }

    /// Largest turn of an edge by the impulses just handed over, as the linearised rods give it [rad].
    pub(super) fn turn(&self, rods: &RodSet, touched: &[usize], inverses: &Inverses, dt: f64) -> f64 {
        let per_vertex = &self.lists.per_vertex;
        let turn_of = |strand: &usize| -> f64 {
            let Some(inverse) = inverses.get(*strand) else { return 0.0 };
            let vertices = rods.vertices(*strand);
            let mut x: Vec<f64> = per_vertex[vertices.clone()].iter().flat_map(|r| [r.x, r.y, r.z, 0.0]).collect();
            inverse.apply(&mut x);
            let change = |i: usize| Vector3::new(x[4 * i], x[4 * i + 1], x[4 * i + 2]);
            let edges = rods.edges(*strand);
            let turn = |i: usize| (change(i + 1) - change(i)).norm() * dt / rods.rest_length[edges.start + i];
            (0..edges.len()).map(turn).fold(0.0, f64::max)
        };
        touched.iter().map(turn_of).fold(0.0, f64::max)
    }

    /// Counts states, sums forces on solids, and what the ledger must know.
    pub(super) fn account(
        &mut self,
        rods: &RodSet,
        stepper: &RodStepper,
        corrected: &[usize],
        solids: &[SceneSolid],
        step: Step,
        tau: f64,
    ) {
        let report = &mut self.report;
        report.contacts = self.lists.active.len();
        report.bridges = self.lists.wet.iter().filter(|wet| wet.bridged).count() + self.lists.loose.len();
        for state in &self.lists.states {
            match state {
                ContactState::Open => report.open += 1,
                ContactState::Stick => report.sticking += 1,
                ContactState::Slip => report.slipping += 1,
                ContactState::Cohesive => report.cohesive += 1,
            }
        }
        self.on_solids.fill(Reaction::default());
        let (mut outside, mut scale) = (Vector3::zeros(), 0.0);
        if self.with_solids {
            let end = step.time + step.dt;
            let center = |s: &SceneSolid| s.solid.at(end).pose().apply(&s.solid.shape.center());
            let centers: Vec<Vector3<f64>> = solids.iter().map(center).collect();
            for (c, r) in self.lists.acting().filter(|(c, _)| c.with_solid()) {
                let force = world_impulse(c, &r) / tau;
                let solid = c.key.b.1 as usize;
                let arm = self.point(c) - centers[solid];
                self.on_solids[solid].force -= force;
                self.on_solids[solid].torque -= arm.cross(&force);
                outside += force;
                scale += force.norm();
            }
        }
        // the linear step balances linearised forces: its clamps hold by the reactions and what the others lack
        for strand in corrected {
            if rods.strand_count() > *strand {
                outside += stepper.unbalanced_force(*strand);
            }
        }
        self.outside_force = outside;
        self.outside_scale = scale;
    }
}

/// Gives the vertices of both sides of a contact its impulse.
fn give(per_vertex: &mut [Vector3<f64>], first_vertex: &[u32], c: &Contact, impulse: &Vec3) {
    let world = world_impulse(c, impulse);
    let mut side = |(strand, edge): (u32, u32), at: f64, sign: f64| {
        let v = (first_vertex[strand as usize] + edge) as usize;
        per_vertex[v] += world * (sign * (1.0 - at));
        per_vertex[v + 1] += world * (sign * at);
    };
    side(c.key.a, c.alpha, 1.0);
    if !c.with_solid() {
        side(c.key.b, c.beta, -1.0);
    }
}
