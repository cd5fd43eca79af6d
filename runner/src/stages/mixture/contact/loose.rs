//! Bridges of liquid that only pull.
//!
//! A bridge over an open gap pulls with a force that is known beforehand, as long as the strands neither close the gap nor, where
//! they hang or part, come nearer. Among wet hairs nearly all bridges do no more. They have no part in the contact problem,
//! which would grow with the square of their number; nor has a second bridge at the place of another. Their pull is given to
//! the rods before the problem is posed, and only where that or the impulses of others bring two sides too near does a bridge
//! become a contact.

use ::contact::assembly::{PosedContact, normal_mobilities};
use ::contact::detection::SolidField;
use nalgebra::Vector3;
use rods::{RodSet, RodStepper};

use super::{Inverses, LOOSE, STRIDE, Setting, TRUE_TURN, motion, no_number};
use crate::system::Rejection;
use crate::world::contact::memory::{ContactMemory, Place};
use crate::world::contact::{ContactWorld, Lists, LooseBridge};

/// Share of its pull by which the normal force of a bridge must have differed in the last step for it to begin as a contact:
/// pulls change from step to step.
const HELD_BACK: f64 = 0.5;

/// Room that a bridge must have to leave the problem, in motions of its sides by the last round.
const CALM: f64 = 2.0;

/// Friction, relative to the pull, that only a bridge that was a contact can have had.
const FRICTION: f64 = 1e-6;

impl ContactWorld {
    /// Lets the bridges from number `from` on pull. Returns how far they moved the farthest vertex [m].
    pub(super) fn pull(
        &mut self,
        from: usize,
        rods: &RodSet,
        stepper: &mut RodStepper,
        setting: &Setting<'_>,
    ) -> Result<f64, Rejection> {
        if self.lists.loose.len() == from {
            return Ok(0.0);
        }
        let touched = strands_of(self.lists.loose[from..].iter().map(|bridge| &bridge.contact));
        stepper.prepare_factors(Some(&touched));
        let inverses = Inverses::of(&touched, rods.strand_count(), |strand| stepper.strand_inverse(strand));
        let posed: Vec<PosedContact> =
            self.lists.loose[from..].iter().map(|bridge| bridge.contact.posed(0.0, 0.0, STRIDE)).collect();
        let mobilities = normal_mobilities(&posed, &inverses, rods.strand_count()).map_err(no_number)?;
        stepper.velocities_into(rods, &mut self.lists.vectors);
        let Lists { loose, vectors: velocity, .. } = &mut self.lists;
        for (bridge, mobility) in loose[from..].iter_mut().zip(mobilities) {
            let (c, wet) = (&bridge.contact, &mut bridge.wet);
            let relative = motion::relative(c, &self.first_vertex, |v| velocity[v]) - Vector3::from(c.solid_velocity);
            let free = Vector3::from(c.normal).dot(&relative);
            wet.decide(free, mobility, setting.tau);
            bridge.pull = wet.bound(setting.tau);
        }
        self.hand_over_pulls(rods, from);
        let turn = self.turn(rods, &touched, &inverses, setting.dt);
        self.give_to_rods(rods, stepper, turn > TRUE_TURN)?;
        Ok(self.follow(rods, stepper))
    }

    /// Makes contacts of the bridges whose sides come nearer than `allowed` beyond what the law lets them, and along with them
    /// of those that come as near as `near`. The first time only of those that did not merely pull in the last step: a
    /// pull that nothing resists moves a light strand by many times its radius.
    pub(super) fn tighten(
        &mut self,
        (allowed, near): (f64, f64),
        solids: &[&dyn SolidField],
        memory: Option<&ContactMemory>,
        tau: f64,
    ) {
        let mut loose = std::mem::take(&mut self.lists.loose);
        let room: Vec<f64> = loose.iter().map(|bridge| self.room(bridge, solids)).collect();
        let closes = room.iter().any(|room| *room < -allowed);
        let mut room = room.into_iter();
        let lists = &mut self.lists;
        loose.retain(|bridge| {
            let room = room.next().unwrap_or(f64::INFINITY);
            let near = closes && room < near;
            let joins = match memory {
                // what holds the other at its place holds a twin too: it adds its pull, and no contact that says the same again
                Some(_) if bridge.contact.twin => false,
                Some(memory) if bridge.pull > 0.0 => was_held_back(bridge, memory, tau),
                Some(memory) => near || memory.holds(&Place::of(&bridge.contact)),
                None => near,
            };
            if !joins {
                return true;
            }
            lists.pose_wet(bridge.contact, bridge.wet, bridge.impulse());
            false
        });
        lists.loose = loose;
    }

    /// A posed contact as a loose bridge, if it only pulls and is far from doing otherwise.
    pub(super) fn loosened(&self, i: usize, solids: &[&dyn SolidField], tau: f64) -> Option<LooseBridge> {
        let lists = &self.lists;
        let (contact, wet, [normal, along, across]) = (lists.active[i], lists.wet[i], lists.impulses[i]);
        let bridge = LooseBridge { contact, wet, pull: -normal };
        let only_pulls =
            wet.bridged && wet.flow.is_none() && (contact.gap > 0.0 || contact.twin) && wet.draws_near.is_some();
        let fully = normal == -wet.bound(tau) && along == 0.0 && across == 0.0;
        if !(only_pulls && fully) {
            return None;
        }
        // where the last round moved a side by more than it has room, the next may bring it back
        let moved = CALM * motion::moved(&contact, lists, &self.first_vertex);
        (self.room(&bridge, solids) > moved.max(LOOSE * self.smallest_radius)).then_some(bridge)
    }

    /// Bridges posed after the last problem was solved have pulled all the time, and go on.
    pub(super) fn loosen_unsolved(&mut self, solved: usize) {
        let lists = &mut self.lists;
        for i in solved..lists.active.len() {
            if lists.impulses[i] != [0.0; 3] {
                let pull = -lists.impulses[i][0];
                lists.loose.push(LooseBridge { contact: lists.active[i], wet: lists.wet[i], pull });
            }
        }
    }

    /// How far the sides of a bridge stay from what the law forbids them at the end of the step [m]: to close the gap where
    /// they draw near, to come nearer at all where they do not.
    fn room(&self, bridge: &LooseBridge, solids: &[&dyn SolidField]) -> f64 {
        let limit = if bridge.wet.draws_near == Some(true) { 0.0 } else { bridge.contact.gap };
        self.end_gap(&bridge.contact, solids) - limit
    }
}

/// Whether something stopped the bridge from merely pulling in the last step, or it was not there.
fn was_held_back(bridge: &LooseBridge, memory: &ContactMemory, tau: f64) -> bool {
    let place = Place::of(&bridge.contact);
    if !memory.holds(&place) {
        return true;
    }
    let [normal, along, across] = memory.start(&place, &bridge.contact.posed(0.0, 0.0, STRIDE).basis(), tau);
    normal + bridge.pull > HELD_BACK * bridge.pull || along.hypot(across) > FRICTION * bridge.pull
}

/// Strands that touch something, in order.
pub(super) fn strands_of<'a>(contacts: impl Iterator<Item = &'a ::contact::detection::Contact>) -> Vec<usize> {
    let mut touched: Vec<usize> = Vec::new();
    for c in contacts {
        touched.push(c.key.a.0 as usize);
        if !c.with_solid() {
            touched.push(c.key.b.0 as usize);
        }
    }
    touched.sort_unstable();
    touched.dedup();
    touched
}
