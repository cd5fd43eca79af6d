//! Steps 1, 6, 7 and 19: what touches, and the impulses by which it obeys Coulomb's law.
//!
//! ```text
//! start and free end of the step ─► detection ─► contacts ─► W, q from the rods' factors ─► solve ─► impulses to the rods
//!                ▲                                                                                       │
//!                └── again where impulses push strands into something new, or the scene asks for it ──────┘
//! ```
//!
//! Round by round the problem is posed in the whole impulses: with `r` so far and velocities `v` that contain it, the
//! linearised rods give `u = W r' + (H v + w − W r)`. Handing over `r' − r` is then a Newton step on rods and contacts
//! together; one round is the plain method (Kaufman and others 2014). Where contacts are many, rounds are solved roughly for
//! as long as others follow anyway; the last is solved to the tolerance.

mod cohesion;
mod crossing;
mod impulses;
mod loose;
mod motion;
mod opposed;
mod second_opinion;

use std::time::Instant;

use ::contact::assembly::{AssemblyError, ContactSystem, InverseDynamics, PosedContact, assemble};
use ::contact::block::Vec3;
use ::contact::detection::{Contact, DetectionError, Sight, SolidField, StepSolid, Strands};
use numerics::lanes::F4;
use rods::{RodSet, RodStepper, StrandInverse};
use surface_flow::FilmState;

use crate::stages::Step;
use crate::system::{Rejection, RejectionReason};
use crate::world::World;
use crate::world::contact::memory::{ContactMemory, Place};
use crate::world::contact::{ContactWorld, LooseBridge, StepFigures};

/// Rounds beyond those that the scene asks for, in which contacts are added that the impulses themselves made.
const MOST_ADDITIONS: usize = 16;

/// Turn of an edge by contact impulses \[rad\] up to which linearised rods are true enough: the stretch that a turn feigns
/// is half its square. Beyond it the rods are solved anew with the impulses, and the contacts posed again.
const TRUE_TURN: f64 = 0.02;

/// Rounds beyond those that the scene asks for, in which large turns are followed.
const MOST_TURNS: usize = 8;

/// Turn left after all rounds at which the step counts as too large \[rad\].
const TOO_LARGE_TURN: f64 = 0.2;

/// Rounds in a row that turn edges by as much before the step counts as too large without waiting for the last: what settles
/// at all takes three.
const MOST_WILD: usize = 5;

/// Share of the detection margin by which impulses may move a vertex before detection looks again.
const UNSEEN_MOTION: f64 = 0.5;

/// Overlap at the end of the step, in radii, that a contact without a part in the problem may have.
const UNPOSED_OVERLAP: f64 = 1e-3;

/// Gap at the end of the step, in radii, below which contacts are posed along with those that close, in later rounds.
const NEAR: f64 = 0.01;

/// Gap at the end of the step, in radii, beyond which a contact without impulse leaves the problem.
const RELEASE: f64 = 0.05;

/// The same for bridges that only pull: they are many, and most hang where they are.
const LOOSE: f64 = 0.02;

/// Rounds in which contacts may leave the problem; later on it only grows, so that the rounds come to an end.
const ROUNDS_OF_RELEASE: usize = 6;

/// Contacts from which on rounds that will be followed by others are solved only to [`ROUGH`]. Fewer cost next to nothing.
const MANY: usize = 200;

/// Relative residual of rough rounds: which contacts close next is seen long before the last digits are there, and those
/// take four times the work.
const ROUGH: f64 = 1e-3;

/// Rough rounds end where fewer than one more contact to so many is added.
const FEW: usize = 200;

/// Rounds at the end of all that are never rough, so that what an exact one still closes can be followed.
const EXACT_ROUNDS: usize = 4;

/// Share of an overlap that one step pushes apart (spec A.7).
const STABILISATION: f64 = 0.2;

/// Freedoms per vertex of a rod: position and angle.
const STRIDE: u32 = 4;

/// Finds contacts and gives the rods the impulses that obey Coulomb's law.
pub fn resolve(world: &mut World, step: Step) -> Result<(), Rejection> {
    let World { state, contact: Some(contact), strands: Some(strands), solids, .. } = world else { return Ok(()) };
    let Some(memory) = &mut state.contact else { return Ok(()) };
    let rods = &state.rods;
    let stepper = &mut strands.stepper;
    contact.begin(rods, step, stepper, &strands.boundary);
    let films = state.film.as_ref().map(|films| &films.state);
    contact.widen(rods, films, memory);
    let tau = stepper.equivalent_step().unwrap_or(step.dt);

    let fields: Vec<StepSolid> = if contact.with_solids {
        solids.iter().map(|solid| StepSolid::new(&solid.solid, step.time, step.dt)).collect()
    } else {
        Vec::new()
    };
    let fields: Vec<&dyn SolidField> = fields.iter().map(|field| field as &dyn SolidField).collect();
    let setting = Setting { dt: step.dt, tau, friction: &strands.friction, solids };
    let surroundings = Surroundings { solids: &fields, films, memory, setting: &setting };
    contact.look(rods, stepper, &surroundings, 0)?;

    let mut posed: Option<ContactSystem> = None;
    // every strand that got impulses in some round, also where later rounds took them back: what it lacks is its clamps' share
    let mut corrected: Vec<usize> = Vec::new();
    let most_rounds = contact.relinearisations + MOST_ADDITIONS + MOST_TURNS;
    // once a rough round has closed nothing more, all that follow are exact
    let mut settled = false;
    // what the last round left: its report where it missed the tolerance, and whether contacts were still to be added. Rounds
    // before it were on the way, and what they missed is made good
    let (mut missed, mut unfinished) = (None, false);
    let mut wild = 0;
    for round in 0..most_rounds {
        if contact.lists.active.is_empty() {
            posed = None;
            missed = None;
            contact.report.residual = 0.0;
            break;
        }
        let begin = Instant::now();
        let touched = contact.touched_strands();
        stepper.prepare_factors(Some(&touched));
        let inverses = Inverses::of(&touched, rods.strand_count(), |strand| stepper.strand_inverse(strand));
        contact.read_velocities(rods, stepper);
        let mut system = contact.pose(rods, &inverses, &setting)?;
        contact.cohere(&mut system, rods, &setting);
        let start = contact.start(&system, memory, tau);
        contact.seconds[1] += begin.elapsed().as_secs_f64();

        let begin = Instant::now();
        // the velocities contain the impulses of the rounds before
        let problem = &mut system.problem;
        let before = problem.delassus.product_sparse(&contact.lists.impulses);
        for (q, part) in problem.free_velocity.iter_mut().zip(before) {
            *q = [q[0] - part[0], q[1] - part[1], q[2] - part[2]];
        }
        contact.resist_sliding(&mut system, tau);
        let rough = !settled && contact.lists.active.len() >= MANY && round + EXACT_ROUNDS < most_rounds;
        let mut settings = contact.settings;
        if rough {
            settings.tolerance = settings.tolerance.max(ROUGH);
        }
        let solution = contact.solve(&mut system, &start, &settings, &setting);
        contact.seconds[2] += begin.elapsed().as_secs_f64();
        contact.report.rounds += 1;
        contact.report.residual = solution.report.solve.residual;
        let converged = solution.report.status().is_converged();
        // a rough round may be as good as an exact one
        let exact = !rough || converged && contact.report.residual <= contact.settings.tolerance;
        missed = (!rough && !converged).then_some(solution.report.solve);

        let flow = contact.lists.flow.iter();
        let whole: Vec<Vec3> =
            solution.impulses.iter().zip(flow).map(|(r, f)| [r[0] + f[0], r[1] + f[1], r[2] + f[2]]).collect();
        contact.hand_over(rods, &whole);
        let turn = contact.turn(rods, &touched, &inverses, step.dt);
        let last = round + 1 == most_rounds;
        wild = if turn > TOO_LARGE_TURN { wild + 1 } else { 0 };
        if wild > 0 && (last || wild == MOST_WILD) {
            let detail = format!("contact impulses turn an edge by {turn:.2} rad after {} rounds", round + 1);
            return Err(Rejection { stage: "mixture", reason: RejectionReason::TooLargeMotion, element: None, detail });
        }
        let nonlinear = !last && (round + 1 < contact.relinearisations || turn > TRUE_TURN);
        let report = contact.give_to_rods(rods, stepper, nonlinear)?;
        strands.report.halvings += report.halvings;
        contact.lists.impulses = whole;
        contact.lists.states = solution.states;
        contact.lists.solved = contact.lists.active.len();
        posed = Some(system);
        corrected.extend_from_slice(&touched);

        let moved = contact.follow(rods, stepper);
        let woken = contact.wake(&surroundings, round + 1);
        let grown = moved > contact.unseen() && contact.look(rods, stepper, &surroundings, round + 1)?;
        let grown = contact.part_crossed() || grown;
        if !woken && !grown && !nonlinear {
            if exact {
                break;
            }
            settled = true;
            continue;
        }
        // few more: exact rounds from here follow what rough ones would chase one by one
        let more = contact.lists.active.len() - contact.lists.solved;
        settled |= round >= ROUNDS_OF_RELEASE / 2 && more * FEW < contact.lists.solved;
        // what the last round would add stays without impulse in this step: told like a problem that was not solved
        unfinished = last && (woken || grown);
        if round < ROUNDS_OF_RELEASE {
            contact.release(&fields, tau);
        }
    }

    memory.warnings += u64::from(missed.is_some() || unfinished);
    if let Some(system) = &posed {
        if let Some(report) = &missed {
            contact.not_solved(system, report)?;
        }
        // contacts added after the last round have no impulse yet, but for bridges that pulled already
        contact.loosen_unsolved(system.contacts.len());
        contact.drop_unsolved(system.contacts.len());
        contact.confirm(memory, system);
        contact.keep(memory, system);
    }
    corrected.extend(loose::strands_of(contact.lists.loose.iter().map(|bridge| &bridge.contact)));
    corrected.sort_unstable();
    corrected.dedup();
    contact.account(rods, stepper, &corrected, solids, step, tau);
    contact.remember(memory, tau);
    Ok(())
}

/// What a contact problem needs beside the contacts.
struct Setting<'a> {
    dt: f64,
    tau: f64,
    friction: &'a [f64],
    solids: &'a [crate::world::solids::SceneSolid],
}

/// What detection sees beside the strands.
struct Surroundings<'a> {
    solids: &'a [&'a dyn SolidField],
    films: Option<&'a FilmState>,
    memory: &'a ContactMemory,
    setting: &'a Setting<'a>,
}

/// The factored step matrices of the strands in contact.
struct Inverses {
    place: Vec<u32>,
    factors: Vec<StrandInverse>,
}

impl Inverses {
    fn of(touched: &[usize], strands: usize, factor: impl Fn(usize) -> Option<StrandInverse>) -> Inverses {
        let mut inverses = Inverses { place: vec![u32::MAX; strands], factors: Vec::with_capacity(touched.len()) };
        for strand in touched {
            if let Some(found) = factor(*strand) {
                inverses.place[*strand] = inverses.factors.len() as u32;
                inverses.factors.push(found);
            }
        }
        inverses
    }

    fn get(&self, strand: usize) -> Option<&StrandInverse> {
        self.place.get(strand).and_then(|place| self.factors.get(*place as usize))
    }
}

impl InverseDynamics for Inverses {
    fn dofs(&self, strand: usize) -> usize {
        self.get(strand).map_or(0, StrandInverse::len)
    }

    fn apply(&self, strand: usize, x: &mut [f64]) {
        if let Some(inverse) = self.get(strand) {
            inverse.apply(x);
        }
    }

    fn apply_three(&self, strand: usize, x: &mut [f64]) {
        let Some(inverse) = self.get(strand) else { return };
        let mut lanes: Vec<F4> = x.as_chunks::<3>().0.iter().map(|c| F4([c[0], c[1], c[2], 0.0])).collect();
        inverse.apply_four(&mut lanes);
        for (c, lane) in x.as_chunks_mut::<3>().0.iter_mut().zip(&lanes) {
            *c = [lane[0], lane[1], lane[2]];
        }
    }
}

fn no_number(what: impl ToString) -> Rejection {
    Rejection { stage: "mixture", reason: RejectionReason::NonFinite, element: None, detail: what.to_string() }
}

impl ContactWorld {
    /// Contacts of the motion from the start to the present end of the step. New bridges begin to pull, and what would overlap
    /// and is not there yet is posed; the first look also takes what was pressed in the last step. Returns whether anything
    /// was added.
    fn look(
        &mut self,
        rods: &RodSet,
        stepper: &mut RodStepper,
        around: &Surroundings<'_>,
        round: usize,
    ) -> Result<bool, Rejection> {
        let (posed, loose) = (self.lists.active.len(), self.lists.loose.len());
        self.find(rods, around, round)?;
        let begin = Instant::now();
        let moved = self.pull(loose, rods, stepper, around.setting)?;
        self.seconds[1] += begin.elapsed().as_secs_f64();
        // pulled by bridges that no contact resists yet, the strands of a bundle fly through each other by many radii; what is on
        // that way is not looked at, for the first impulses bring them back
        let wild = round == 0 && around.memory.kept.len() >= MANY;
        if moved > self.unseen() && !wild {
            let more = self.lists.loose.len();
            self.find(rods, around, round)?;
            self.pull(more, rods, stepper, around.setting)?;
        }
        let grown = self.lists.loose.len() > loose;
        self.wake(around, round);
        Ok(grown || self.lists.active.len() > posed)
    }

    /// Looks for contacts that are not known yet: those in view, bridges that are to pull, and bridges of sides that touch, which
    /// are posed.
    fn find(&mut self, rods: &RodSet, around: &Surroundings<'_>, round: usize) -> Result<(), Rejection> {
        let first = round == 0;
        let begin = Instant::now();
        let lists = &mut self.lists;
        let strands = Strands {
            start: &lists.start,
            end: &lists.end,
            first_vertex: &self.first_vertex,
            radius: &self.edge_radius,
        };
        let (height, first_vertex, memory) = (&lists.height, &self.first_vertex, around.memory);
        let film = |(strand, edge): (u32, u32)| height[(first_vertex[strand as usize] + edge) as usize];
        let matters = |a: (u32, u32), b: (u32, u32), gap: f64| {
            gap <= film(a) + film(b) || memory.was_bridged(&Place::between(a, b))
        };
        let sight = (!lists.reach.is_empty()).then_some(Sight { reach: &lists.reach, matters: &matters });
        lists
            .detector
            .detect(&strands, sight.as_ref(), around.solids, &self.detection, &mut lists.found)
            .map_err(|error: DetectionError| no_number(error))?;
        self.adjust_gaps(rods);
        let lists = &mut self.lists;
        if first {
            let deepest = lists.found.iter().map(|c| -c.gap).fold(0.0, f64::max);
            self.report.worst_penetration = deepest;
        }
        let known = lists.active.iter().chain(lists.loose.iter().map(|bridge| &bridge.contact));
        let mut known: Vec<Place> = known.map(Place::of).collect();
        known.sort_unstable();
        let mut new: Vec<Contact> = Vec::new();
        let mut held = 0;
        for c in &lists.found {
            if motion::is_held(c, &self.first_vertex, &lists.held) {
                held += 1;
            } else if known.binary_search(&Place::of(c)).is_err() {
                new.push(*c);
            }
        }
        if first {
            self.report.held = held;
        }
        let wetness = self.wetness(&new, rods, around.films, memory, around.solids);
        let lists = &mut self.lists;
        lists.spare.clear();
        for (contact, wet) in new.into_iter().zip(wetness) {
            if !wet.bridged {
                lists.spare.push(contact);
            } else if (contact.gap > 0.0 || contact.twin) && wet.flow.is_none() {
                lists.loose.push(LooseBridge { contact, wet, pull: 0.0 });
            } else {
                lists.pose_wet(contact, wet, [0.0; 3]);
            }
        }
        self.seconds[0] += begin.elapsed().as_secs_f64();
        Ok(())
    }

    /// Poses those of the contacts in view that would overlap at the end of the step, and bridges that would do more than pull;
    /// those that stay open need no impulse, and leaving them out is exact as long as none of them closes. Returns whether
    /// there were any.
    fn wake(&mut self, around: &Surroundings<'_>, round: usize) -> bool {
        // what impulses bring nearer than that is pushed apart in the next step
        let allowed = if round == 0 { 0.0 } else { UNPOSED_OVERLAP * self.smallest_radius };
        // from the third round on what is merely near goes along, so that a chain does not close one link a round
        let near = if round < 3 { -allowed } else { NEAR * self.smallest_radius };
        let mut spare = std::mem::take(&mut self.lists.spare);
        let gaps: Vec<f64> = spare.iter().map(|c| self.end_gap(c, around.solids)).collect();
        let lists = &mut self.lists;
        let closes = gaps.iter().any(|gap| *gap < -allowed);
        let before = lists.active.len();
        let mut gaps = gaps.into_iter();
        spare.retain(|c| {
            let gap = gaps.next().unwrap_or(f64::INFINITY);
            if !(closes && gap < near || round == 0 && around.memory.holds(&Place::of(c))) {
                return true;
            }
            lists.pose(*c);
            false
        });
        lists.spare = spare;
        let memory = (round == 0).then_some(around.memory);
        self.tighten((allowed, near), around.solids, memory, around.setting.tau);
        self.lists.active.len() > before
    }

    /// Gap at the end of the step if nothing more happens [m]; that of a twin counts from an overlap by a radius on.
    fn end_gap(&self, c: &Contact, solids: &[&dyn SolidField]) -> f64 {
        let overlap = if c.twin { self.smallest_radius } else { 0.0 };
        motion::end_gap(c, &self.lists, &self.first_vertex, solids) + overlap
    }

    /// How far impulses may move a vertex before detection looks again [m].
    fn unseen(&self) -> f64 {
        UNSEEN_MOTION * self.detection.proximity * self.smallest_radius
    }

    /// Takes contacts without impulse that are far from closing out of the problem again. The first impulses go to contacts
    /// that hold what others would have held; what they close in passing need not stay.
    fn release(&mut self, solids: &[&dyn SolidField], tau: f64) {
        let (mut kept, solved) = (0, self.lists.solved);
        for i in 0..self.lists.active.len() {
            if let Some(bridge) = self.loosened(i, solids, tau) {
                let lists = &mut self.lists;
                lists.loose.push(bridge);
                lists.solved -= usize::from(i < solved);
                continue;
            }
            let c = self.lists.active[i];
            let open = self.lists.impulses[i] == [0.0; 3] && !self.lists.wet[i].bridged;
            let leaves = open && self.end_gap(&c, solids) > RELEASE * self.smallest_radius;
            let lists = &mut self.lists;
            if leaves {
                lists.spare.push(c);
                lists.solved -= usize::from(i < solved);
                continue;
            }
            lists.active[kept] = c;
            lists.impulses[kept] = lists.impulses[i];
            lists.states[kept] = lists.states[i];
            lists.yielding[kept] = lists.yielding[i];
            lists.wet[kept] = lists.wet[i];
            lists.flow[kept] = lists.flow[i];
            kept += 1;
        }
        self.drop_unsolved(kept);
    }

    /// Strands that touch something, in order.
    fn touched_strands(&self) -> Vec<usize> {
        loose::strands_of(self.lists.active.iter())
    }

    /// The contact problem at the present velocities.
    fn pose(&self, rods: &RodSet, inverses: &Inverses, setting: &Setting<'_>) -> Result<ContactSystem, Rejection> {
        let lists = &self.lists;
        let friction_of = |strand: u32| setting.friction[strand as usize];
        let posed: Vec<PosedContact> = lists
            .active
            .iter()
            .map(|c| {
                let other =
                    if c.with_solid() { setting.solids[c.key.b.1 as usize].friction } else { friction_of(c.key.b.0) };
                let friction = if self.with_friction { (friction_of(c.key.a.0) * other).sqrt() } else { 0.0 };
                // the gap is added below, where restitution and two-step formulas are known
                PosedContact { gap: 0.0, ..c.posed(friction, 0.0, STRIDE) }
            })
            .collect();
        let velocities: Vec<&[f64]> =
            rods.first_vertex.windows(2).map(|w| &lists.velocity[4 * w[0]..4 * w[1]]).collect();
        let mut system = assemble(&posed, inverses, rods.strand_count(), &velocities, setting.dt, 0.0)
            .map_err(|error: AssemblyError| no_number(error))?;
        let active = lists.active.iter().zip(&lists.yielding);
        for (q, (c, yielding)) in system.problem.free_velocity.iter_mut().zip(active) {
            q[0] += motion::gap_velocity(c, *yielding, lists, &self.first_vertex, rods, setting);
        }
        Ok(system)
    }

    /// Impulses to start from: those of the round before, where that solved for the contact; else forces of the last step.
    fn start(&self, system: &ContactSystem, memory: &ContactMemory, tau: f64) -> Vec<Vec3> {
        let used = self.law_impulses();
        let active = self.lists.active.iter().zip(&system.contacts).zip(used).enumerate();
        active
            .map(|(k, ((c, posed), used))| {
                // what the round before left open is not pressed again by what held it a step ago
                let solved = k < self.lists.solved;
                let place = Place::of(c);
                if solved || !memory.holds(&place) { used } else { memory.start(&place, &posed.basis(), tau) }
            })
            .collect()
    }

    /// Keeps a problem that was not solved; refuses the step where the scene wants that.
    fn not_solved(&mut self, system: &ContactSystem, report: &numerics::SolveReport) -> Result<(), Rejection> {
        if self.rejects || self.unsolved.is_none() {
            self.unsolved = Some(system.problem.clone());
        }
        if !self.rejects {
            return Ok(());
        }
        let detail = format!(
            "{} contacts, {:?}: residual {:.2e}, tolerance {:.1e}",
            system.problem.len(),
            report.status,
            report.residual,
            report.tolerance
        );
        Err(Rejection { stage: "mixture", reason: RejectionReason::NotConverged, element: None, detail })
    }

    /// Keeps the problem where the scene asks for it.
    fn keep(&mut self, memory: &ContactMemory, system: &ContactSystem) {
        if self.save_every.is_some_and(|every| memory.steps.is_multiple_of(every.max(1))) {
            self.saved.push((memory.steps, system.problem.clone()));
        }
    }

    /// Forgets contacts that were found after the last problem was solved.
    fn drop_unsolved(&mut self, solved: usize) {
        self.lists.wet.truncate(solved);
        self.lists.flow.truncate(solved);
        self.lists.active.truncate(solved);
        self.lists.impulses.truncate(solved);
        self.lists.states.truncate(solved);
        self.lists.yielding.truncate(solved);
    }

    /// Forces to start from in the next step.
    fn remember(&self, memory: &mut ContactMemory, tau: f64) {
        memory.steps += 1;
        let lists = &self.lists;
        let pulling = lists.loose.iter().map(|bridge| (&bridge.contact, bridge.impulse()));
        let pressed = lists.active.iter().zip(self.law_impulses()).chain(pulling).filter(|(_, r)| *r != [0.0; 3]);
        let bridged = lists.active.iter().zip(&lists.wet).filter(|(_, wet)| wet.bridged).map(|(c, _)| c);
        memory.bridges.clear();
        memory.bridges.extend(bridged.chain(lists.loose.iter().map(|bridge| &bridge.contact)).map(Place::of));
        memory.bridges.sort_unstable();
        memory.renew(pressed.map(|(c, r)| {
            let force = crate::world::contact::record::world_impulse(c, &r) / tau;
            (Place::of(c), force.into(), c.normal)
        }));
    }

    fn begin(&mut self, rods: &RodSet, step: Step, stepper: &RodStepper, boundary: &rods::Boundary) {
        self.report = StepFigures::default();
        self.seconds = [0.0; 3];
        let lists = &mut self.lists;
        lists.active.clear();
        lists.loose.clear();
        lists.solved = 0;
        lists.impulses.clear();
        lists.states.clear();
        lists.yielding.clear();
        lists.wet.clear();
        lists.flow.clear();
        lists.start.clear();
        lists.start.extend(rods.position.iter().map(|x| [x.x, x.y, x.z]));
        lists.held.clear();
        lists.held.resize(rods.vertex_count(), false);
        for fixed in &boundary.vertices {
            lists.held[fixed.vertex] |= fixed.components == [true; 3];
        }
        motion::read_ends(lists, rods, stepper);
        motion::read_drift(lists, rods, stepper, step.dt);
    }
}
