//! The world under the common stepper.

use nalgebra::Vector3;
use rods::{RodSet, StepReason};
use serde_json::{Map, Value, json};

use super::contact::{ContactWorld, record};
use super::liquid::seen_in_its_dimension;
use super::{Ledger, Reaction, StrandWorld, World, WorldState, film, measure, submersion};
use crate::record::frame::Frame;
use crate::stages::Step;
use crate::system::{Column, Element, Rejection, RejectionReason, StateError, StepLimit, System};

/// A held vertex may move this many shortest edges in one step before the step is called too long.
const HELD_MOTION: f64 = 1.0;

impl StrandWorld {
    /// Gives held vertices that move from the start their velocity, so that the first step does not jerk.
    pub(super) fn start_held_parts(&self, rods: &mut RodSet) {
        for part in &self.held {
            let (pose, field) = part.motion.evaluate(&part.center, 0.0);
            for (vertex, position) in &part.vertices {
                rods.velocity[*vertex] = field.at(&pose.apply(position));
            }
        }
    }

    /// The strand and vertex whose edge turns by more than the limit in the solved step, with the turn [rad].
    ///
    /// The turn of an edge is bounded by the difference of its ends' motions across it over its length.
    pub fn turned_too_far(&mut self, rods: &RodSet, dt: f64) -> Option<(usize, usize, f64)> {
        if !self.turn_limit.is_finite() {
            return None;
        }
        self.stepper.velocities_into(rods, &mut self.velocities);
        let (velocity, limit) = (&self.velocities, self.turn_limit);
        (0..rods.strand_count()).find_map(|strand| {
            let range = rods.vertices(strand);
            let turned = |i: &usize| {
                let edge = rods.position[i + 1] - rods.position[*i];
                let moved = (velocity[i + 1] - velocity[*i]) * dt;
                let length = edge.norm();
                (moved - edge * (moved.dot(&edge) / (length * length))).norm() / length
            };
            (range.start..range.end - 1).map(|i| (i, turned(&i))).find(|(_, turn)| *turn > limit).map(|(i, turn)| {
                let (_, vertex) = rods.locate_vertex(i);
                (strand, vertex, turn)
            })
        })
    }

    /// Books forces of the clamps and impulses from outside for the step just solved; called before it is accepted.
    pub fn book(
        &mut self,
        rods: &RodSet,
        contact: Option<&ContactWorld>,
        film_mass: Option<&[f64]>,
        gravity: &Vector3<f64>,
        step: Step,
        ledger: &mut Ledger,
    ) {
        let mut sum = Vector3::zeros();
        for (part, reaction) in self.held.iter().zip(&mut self.reactions) {
            *reaction = Reaction::default();
            let center = part.motion.pose(&part.center, step.time + step.dt).apply(&part.center);
            for (vertex, _) in &part.vertices {
                let force = self.stepper.reaction_force(rods, *vertex);
                reaction.force += force;
                reaction.torque += (rods.position[*vertex] - center).cross(&force);
            }
            let first = rods.edges(part.strand).start;
            for (edge, _) in &part.edges {
                let tangent = rods.tangent(part.strand, edge - first).0;
                reaction.torque += tangent * self.stepper.reaction_torque(rods, *edge);
            }
            sum += reaction.force;
        }
        if measure::keeps_momentum_ledger(self) {
            let mut moving = Vec::new();
            if rods.material.iter().any(|material| material.air_drag > 0.0) {
                self.stepper.velocities_into(rods, &mut moving);
            }
            let (impulse, scale) = measure::outside_impulse(rods, &moving, gravity, &sum, film_mass, step.dt);
            ledger.impulse += impulse;
            ledger.impulse_scale += scale;
            if let Some(contact) = contact {
                // between strands impulses cancel; solids give momentum
                ledger.impulse += contact.outside_force * step.dt;
                ledger.impulse_scale += contact.outside_scale * step.dt;
            }
        }
    }
}

impl WorldState {
    /// Copies everything that a step changes, into memory that is there already.
    fn copy_from(&mut self, other: &WorldState) {
        let (to, from) = (&mut self.rods, &other.rods);
        to.position.clone_from(&from.position);
        to.velocity.clone_from(&from.velocity);
        to.twist_angle.clone_from(&from.twist_angle);
        to.twist_rate.clone_from(&from.twist_rate);
        to.reference_director.clone_from(&from.reference_director);
        to.reference_twist.clone_from(&from.reference_twist);
        to.history.clone_from(&from.history);
        self.ledger = other.ledger;
        self.contact.clone_from(&other.contact);
        if let (Some(to), Some(from)) = (&mut self.film, &other.film) {
            to.copy_from(from);
        }
        if let (Some(to), Some(from)) = (&mut self.submersion, &other.submersion) {
            to.copy_from(from);
        }
        match (&mut self.liquid, &other.liquid) {
            (Some(to), Some(from)) => to.copy_from(from),
            (to, from) => to.clone_from(from),
        }
    }
}

impl System for World {
    fn kind(&self) -> &'static str {
        match (&self.strands, &self.liquid) {
            (Some(_), Some(_)) => "strands and liquid",
            (None, Some(_)) => "liquid",
            _ => "strands",
        }
    }

    fn columns(&self) -> Vec<Column> {
        let mut columns = Vec::new();
        measure::columns(self, &mut columns);
        if let Some(contact) = &self.contact {
            record::columns(contact, &self.solids, &mut columns);
        }
        seen_in_its_dimension!(self, (), |flow, _state| flow.columns(&mut columns));
        if self.film.is_some() {
            film::measure::columns(&mut columns);
            if let Some(submersion) = &self.submersion {
                submersion::measure::columns(submersion, &mut columns);
            }
            let name = if self.liquid.is_some() { "total_liquid_mass_defect" } else { "liquid_mass_defect" };
            columns.push(Column::new(
                name,
                "1",
                "liquid on strands and in bulk that the books do not account for, relative",
            ));
        }
        columns
    }

    fn row(&self, out: &mut Vec<f64>) {
        measure::row(self, out);
        if let (Some(contact), Some(memory)) = (&self.contact, &self.state.contact) {
            record::row(contact, memory, out);
        }
        seen_in_its_dimension!(self, (), |flow, state| flow.row(state, out));
        if let (Some(film), Some(films)) = (&self.film, &self.state.film) {
            film::measure::row(film, films, out);
        }
        if let (Some(submersion), Some(memory)) = (&self.submersion, &self.state.submersion) {
            submersion::measure::row(submersion, memory, out);
        }
        if let Some(defect) = self.liquid_mass_defect() {
            out.push(defect);
        }
    }

    fn step_limits(&self) -> Vec<StepLimit> {
        let mut limits = Vec::new();
        seen_in_its_dimension!(self, (), |flow, state| flow.step_limits(state, &self.solids, self.time, &mut limits));
        let Some(strands) = &self.strands else { return limits };
        let rods = &self.state.rods;
        let turn = strands.stepper.step_limit(rods);
        if let StepReason::Turn { .. } = turn.reason {
            limits.push(StepLimit { seconds: turn.seconds, reason: "rods: turn of an edge" });
        }
        let mut held = f64::INFINITY;
        for part in &strands.held {
            let speed = part.speed(self.time);
            if speed > 0.0 {
                let edges = rods.edges(part.strand);
                let shortest = rods.rest_length[edges].iter().copied().fold(f64::INFINITY, f64::min);
                held = held.min(HELD_MOTION * shortest / speed);
            }
        }
        if held.is_finite() {
            limits.push(StepLimit { seconds: held, reason: "rods: motion of a clamp" });
        }
        if let Some(seconds) = self.contact.as_ref().and_then(|contact| contact.step_limit(rods)) {
            limits.push(StepLimit { seconds, reason: "contact: motion of a vertex" });
        }
        if let Some(seconds) = self.film_step_limit() {
            limits.push(StepLimit { seconds, reason: "film: flow along an edge" });
        }
        limits
    }

    fn snapshot(&mut self) {
        self.kept.copy_from(&self.state);
    }

    fn restore(&mut self) {
        self.state.copy_from(&self.kept);
    }

    fn advance(&mut self, time: f64, dt: f64) -> Result<(), Rejection> {
        self.time = time;
        self.run_stages(Step { time, dt })?;
        self.time = time + dt;
        self.refuse_non_finite()
    }

    fn iterations(&self) -> usize {
        let contact = self.contact.as_ref().map_or(0, |contact| contact.report.iterations);
        self.strands.as_ref().map_or(0, |strands| strands.report.total_iterations)
            + contact
            + self.liquid.as_ref().map_or(0, super::liquid::LiquidWorld::iterations)
    }

    fn stage_seconds(&self) -> Vec<(&'static str, f64)> {
        let mut seconds: Vec<(&'static str, f64)> =
            self.stages.iter().map(|stage| stage.name).zip(self.seconds.iter().copied()).collect();
        if let Some(contact) = &self.contact {
            // parts of the mixture stage, shown beside what is left of it
            let parts = ["contact_detection", "contact_assembly", "contact_solve"];
            for stage in seconds.iter_mut().filter(|(name, _)| *name == "mixture") {
                stage.1 -= contact.seconds.iter().sum::<f64>();
            }
            seconds.extend(parts.into_iter().zip(contact.seconds));
        }
        if let Some(liquid) = &self.liquid {
            let parts = liquid.seconds();
            for stage in seconds.iter_mut().filter(|(name, _)| *name == "mixture") {
                stage.1 -= parts.iter().sum::<f64>();
            }
            seconds.extend(["shear_solve", "pressure_solve"].into_iter().zip(parts));
        }
        seconds
    }

    fn frame(&self, step: u64, time: f64) -> Frame {
        super::picture::frame(self, step, time)
    }

    fn save(&self) -> Result<Vec<u8>, StateError> {
        postcard::to_stdvec(&(self.time, &self.state)).map_err(StateError::from_display)
    }

    fn load(&mut self, bytes: &[u8]) -> Result<(), StateError> {
        let (time, state): (f64, WorldState) = postcard::from_bytes(bytes).map_err(StateError::from_display)?;
        if state.rods.first_vertex != self.state.rods.first_vertex {
            let (saved, here) = (state.rods.strand_count(), self.state.rods.strand_count());
            return Err(StateError(format!(
                "it holds {saved} strands with other vertices than the {here} of the scene"
            )));
        }
        match (&self.state.liquid, &state.liquid) {
            (Some(here), Some(saved)) => here.accepts(saved)?,
            (None, None) => {}
            (Some(_), None) => return Err(StateError("it holds no liquid, the scene does".to_owned())),
            (None, Some(_)) => return Err(StateError("it holds liquid, the scene does not".to_owned())),
        }
        // what the scene says about the strands holds, also for a branch that changes it; what moved is taken over
        self.state.copy_from(&state);
        self.kept = self.state.clone();
        self.time = time;
        if let (Some(film), Some(films)) = (&mut self.film, &self.state.film) {
            film.weigh(&films.state, &self.state.rods);
        }
        Ok(())
    }

    fn summary(&self) -> Map<String, Value> {
        let mut summary = Map::new();
        let rods = &self.state.rods;
        if let (Some(contact), Some(memory)) = (&self.contact, &self.state.contact) {
            record::summary(contact, memory, &mut summary);
        }
        seen_in_its_dimension!(self, (), |flow, state| flow.summary(state, &mut summary));
        if let Some(strands) = &self.strands {
            let (momentum, energy) = (rods.momentum(&self.loads()), rods.energy(&self.loads()));
            let film_mass = self.film.as_ref().map_or(0.0, |film| film.mass.iter().sum());
            summary.insert("strands".into(), json!(rods.strand_count()));
            summary.insert("vertices".into(), json!(rods.vertex_count()));
            summary.insert("strand_mass".into(), json!(momentum.mass - film_mass));
            // the mass of a dry strand is a property of its scene: there is nothing it could lose
            let share = self.liquid_mass_defect().unwrap_or(0.0);
            summary.insert("mass_defect".into(), json!(share));
            if measure::keeps_momentum_ledger(strands) {
                let defect = measure::momentum_defect(self, &momentum.linear);
                summary.insert("momentum_defect".into(), json!(defect));
            }
            summary.insert("kinetic_energy".into(), json!(energy.kinetic));
            summary.insert("total_energy".into(), json!(energy.total()));
        }
        if let (Some(film), Some(films)) = (&self.film, &self.state.film) {
            film::measure::summary(film, films, &mut summary);
        }
        if let Some(defect) = self.liquid_mass_defect() {
            summary.insert("liquid_mass_defect".into(), json!(defect));
        }
        summary
    }

    fn failing_problem(&self) -> Option<(String, Vec<u8>)> {
        self.unsolved_contact_problem()
    }

    fn final_files(&self) -> Vec<(String, Vec<u8>)> {
        // a run that went on past an unsolved problem leaves the first one beside its record
        let goes_on = self.contact.as_ref().is_some_and(|contact| !contact.rejects);
        let mut files: Vec<_> =
            if goes_on { self.unsolved_contact_problem().into_iter().collect() } else { Vec::new() };
        for (step, problem) in self.contact.iter().flat_map(|contact| &contact.saved) {
            if let Ok(text) = ::contact::problem::ron::write(problem) {
                files.push((format!("contact-problem-{step:06}.ron"), text.into_bytes()));
            }
        }
        files
    }
}

impl World {
    /// Liquid that no exchange accounts for, relative to all there was; none without liquid.
    #[must_use]
    pub fn liquid_mass_defect(&self) -> Option<f64> {
        let (film, films) = (self.film.as_ref()?, self.state.film.as_ref()?);
        let ledger = &films.ledger;
        let strands = film.liquid_mass(&films.state) + ledger.dripped;
        let (bulk, came) = seen_in_its_dimension!(self, (0.0, 0.0), |_flow, state| {
            let books = &state.ledger;
            let there = numerics::reduce::compensated_sum(state.particles.mass.iter().copied());
            (there + books.terminated_mass + books.removed_mass, books.initial_mass + books.emitted_mass)
        });
        let (now, ever) = (strands + bulk, ledger.initial + came);
        Some(if ever > 0.0 { (now - ever).abs() / ever } else { (now - ever).abs() })
    }

    /// The step in which the fastest film passes one edge [s].
    fn film_step_limit(&self) -> Option<f64> {
        let (film, films) = (self.film.as_ref()?, self.state.film.as_ref()?);
        let rates = films.state.velocity.iter().zip(&film.edge_length).map(|(u, length)| u.abs() / length);
        let fastest = rates.fold(0.0, f64::max);
        (film.advects && fastest > 0.0).then(|| 1.0 / fastest)
    }

    fn unsolved_contact_problem(&self) -> Option<(String, Vec<u8>)> {
        let problem = self.contact.as_ref()?.unsolved.as_ref()?;
        let text = ::contact::problem::ron::write(problem).ok()?;
        Some(("unsolved-contact.ron".to_owned(), text.into_bytes()))
    }

    fn refuse_non_finite(&self) -> Result<(), Rejection> {
        let rods = &self.state.rods;
        let bad = |v: &Vector3<f64>| !v.iter().all(|x| x.is_finite());
        let place = rods.position.iter().position(bad).or_else(|| rods.velocity.iter().position(bad));
        let Some(place) = place else { return Ok(()) };
        let (strand, vertex) = rods.locate_vertex(place);
        let element = Some(Element::StrandVertex { strand, vertex });
        let detail = "after the step".to_owned();
        Err(Rejection { stage: "advect", reason: RejectionReason::NonFinite, element, detail })
    }
}
