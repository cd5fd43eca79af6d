//! One time step: pairs, then grains; stress of its beginning; guard against steps too large for the stiffest contact.

use super::flow::FlowSums;
use super::kernel::{Blend, Compression, Frame, General, PairSums};
use super::rules::StepGuard;
use super::state::{Body, Pair, Sample};
use crate::cell::Boundary;
use crate::error::GranularError;
use crate::law::CentralLaw;
use crate::model::ContactKind;
use crate::stress::StressTensors;
use crate::tensor::Tensor2;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Pairs and grains per block; the order of sums, hence the bits, depend on it and on nothing else.
const BLOCK: usize = 1024;

/// What a step saw at its beginning.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct StepReport {
    /// Stress tensors [Pa].
    pub stress: StressTensors,
    /// Touching pairs and links.
    pub contacts: u32,
    /// Transient contacts at the Coulomb limit.
    pub slipping: u32,
    /// Kinetic energy relative to the shear flow [µm² mg s⁻²/m].
    pub kinetic_energy: f64,
    /// Parts the step was cut into.
    pub substeps: u32,
}

#[derive(Debug, Clone, Copy, Default)]
struct GrainSums {
    linear: Tensor2,
    flow: FlowSums,
    wall_external: Tensor2,
    wall_virial: Tensor2,
    torque: f64,
    spin: f64,
    all_spin: f64,
    kinetic: f64,
    largest_move: f64,
    wall_contacts: u32,
    wall_torque: f64,
    finite: f64,
}

impl GrainSums {
    fn add(&mut self, o: &Self) {
        self.linear += o.linear;
        self.flow.add(&o.flow);
        self.wall_external += o.wall_external;
        self.wall_virial += o.wall_virial;
        self.torque += o.torque;
        self.spin += o.spin;
        self.all_spin += o.all_spin;
        self.kinetic += o.kinetic;
        self.largest_move = self.largest_move.max(o.largest_move);
        self.wall_contacts += o.wall_contacts;
        self.wall_torque += o.wall_torque;
        self.finite += o.finite;
    }
}

impl Sample {
    /// Sets a new shear rate [1/s] and shifts all velocities so that peculiar velocities and spins stay the same.
    pub fn set_rate(&mut self, rate: f64) {
        let change = rate - self.cell.rate;
        if change == 0.0 {
            return;
        }
        let mid = self.cell.height / 2.0;
        let shift = |b: &mut Body| {
            b.vx += (b.y - mid) * change;
            b.omega -= 0.5 * change;
        };
        if self.bodies.len() > 4 * BLOCK && rayon::current_num_threads() > 1 {
            self.bodies.par_chunks_mut(BLOCK).for_each(|block| block.iter_mut().for_each(shift));
        } else {
            self.bodies.iter_mut().for_each(shift);
        }
        self.cell.rate = rate;
        self.pending_rate_change += change;
    }

    /// Sets the rate at which the box closes along the gradient [1/s], with the matching jump of all velocities.
    pub fn set_closing(&mut self, closing: f64) {
        let change = closing - self.cell.closing;
        if change != 0.0 {
            for b in &mut self.bodies {
                b.vy -= b.y * change;
            }
            self.cell.closing = closing;
        }
    }

    /// Advances by `dt` [s] with peculiar velocities multiplied by `damping` [-], and returns the state at its beginning.
    ///
    /// The stiffest contact bounds the step; a larger one is cut into parts or refused, as the rules say.
    ///
    /// # Errors
    /// [`GranularError::NonFinite`], [`GranularError::StepTooLarge`].
    pub fn advance(&mut self, dt: f64, damping: f64) -> Result<StepReport, GranularError> {
        let mut report = StepReport::default();
        let mut remaining = dt;
        let mut first = true;
        loop {
            self.ensure_pairs();
            let sums = self.evaluate_pairs();
            let parts = self.parts(remaining, &sums)?;
            let (h, q) = if first && parts == 1 {
                (dt, damping)
            } else {
                let h = remaining / f64::from(parts);
                (h, damping.powf(h / dt))
            };
            let grains = self.move_grains(h, q);
            if first {
                report = self.report(&sums, &grains);
                first = false;
            }
            report.substeps += 1;
            self.largest_move = grains.largest_move;
            self.pending_dt = h;
            self.pending_rate_change = 0.0;
            self.cell.strain += self.cell.rate * h;
            if self.cell.closing != 0.0 {
                self.cell.height -= self.cell.height * self.cell.closing * h;
                // Pairs approach by the closing of the box as well; the list is renewed rather than bounded.
                self.closed += self.cell.closing.abs() * h;
            }
            self.time += h;
            if !grains.finite.is_finite() {
                return Err(self.first_non_finite());
            }
            if parts == 1 {
                self.extra_steps += u64::from(report.substeps - 1);
                return Ok(report);
            }
            remaining -= h;
        }
    }

    /// Evaluates the state without moving it: the report that a step would give.
    pub fn observe(&mut self) -> StepReport {
        self.ensure_pairs();
        let sums = self.evaluate_pairs();
        let mut copy = self.clone();
        let grains = copy.move_grains(0.0, 1.0);
        self.report(&sums, &grains)
    }

    fn first_non_finite(&self) -> GranularError {
        let bad = |b: &Body| !(b.x + b.y + b.vx + b.vy + b.omega).is_finite();
        GranularError::NonFinite { grain: self.bodies.iter().position(bad).unwrap_or(0), time: self.time }
    }

    fn parts(&self, remaining: f64, sums: &PairSums) -> Result<u32, GranularError> {
        let limit = match self.rules.guard {
            StepGuard::Off => return Ok(1),
            StepGuard::Refuse => 1,
            StepGuard::SubStep(most) => most.max(1),
        };
        if sums.stiffest <= 0.0 {
            return Ok(1);
        }
        let stable = self.rules.guard_fraction / sums.stiffest.sqrt();
        // A hair of slack, so that a step equal to the bound is one part.
        let parts = (remaining / stable * (1.0 - 1e-12)).ceil().max(1.0);
        if parts <= f64::from(limit) {
            Ok(parts as u32)
        } else {
            Err(GranularError::StepTooLarge { step: remaining, stable, time: self.time })
        }
    }

    fn evaluate_pairs(&mut self) -> PairSums {
        match self.model.law {
            CentralLaw::Blend { repulsion } => {
                let k = self.model.spring;
                self.evaluate_with(|_| Blend { linear: k * (1.0 - repulsion), divergent: k * repulsion })
            }
            _ => {
                let law = self.model.law.clone();
                let spring = self.model.spring;
                self.evaluate_with(|_| General { law: &law, spring })
            }
        }
    }

    fn evaluate_with<L: Compression>(&mut self, law: impl Fn(()) -> L) -> PairSums {
        if self.forces.len() != self.pairs.len() {
            self.forces.resize(self.pairs.len(), [0.0; 4]);
        }
        let frame = Frame {
            bodies: &self.bodies,
            plate: &self.plate,
            model: &self.model,
            law: law(()),
            rules: self.rules,
            cell: self.cell,
            centre: [self.cell.width / 2.0, self.cell.height / 2.0],
            dt: self.pending_dt,
            rate_change: self.pending_rate_change,
        };
        let blocks = self
            .pairs
            .chunks(BLOCK)
            .zip(self.kind.chunks_mut(BLOCK))
            .zip(self.spring.chunks_mut(BLOCK))
            .zip(self.rest.chunks(BLOCK))
            .zip(self.forces.chunks_mut(BLOCK));
        type Block<'a> = ((((&'a [Pair], &'a mut [ContactKind]), &'a mut [f64]), &'a [f64]), &'a mut [[f64; 4]]);
        let run =
            |((((pairs, kinds), springs), rests), forces): Block| frame.block(pairs, kinds, springs, rests, forces);
        let mut total = PairSums::default();
        if self.pairs.len() > 8 * BLOCK && rayon::current_num_threads() > 1 {
            let blocks: Vec<Block> = blocks.collect();
            for sums in blocks.into_par_iter().map(run).collect::<Vec<_>>() {
                total.add(&sums);
            }
        } else {
            for block in blocks {
                total.add(&run(block));
            }
        }
        self.pending_dt = 0.0;
        total
    }

    fn move_grains(&mut self, h: f64, q: f64) -> GrainSums {
        let (cell, rules) = (self.cell, self.rules);
        let (offsets, gather, forces, plate) = (&self.gather_offsets, &self.gather, &self.forces, &self.plate);
        let model = &self.model;
        let centre = [cell.width / 2.0, cell.height / 2.0];
        let rest_spin = if rules.damp_to_flow_spin { -0.5 * cell.rate } else { 0.0 };
        let walls = cell.boundary == Boundary::Walls;
        let run = |b: usize, bodies: &mut [Body], angles: &mut [f64], moved: &mut [[f64; 2]], wall: &mut [[f64; 2]]| {
            let mut sums = GrainSums::default();
            for k in 0..bodies.len() {
                let i = b * BLOCK + k;
                let g = &mut bodies[k];
                let (mut fx, mut fy, mut couple) = (0.0, 0.0, 0.0);
                for &e in &gather[offsets[i] as usize..offsets[i + 1] as usize] {
                    let f = &forces[(e >> 1) as usize];
                    let sign = if e & 1 == 0 { 1.0 } else { -1.0 };
                    fx += sign * f[0];
                    fy += sign * f[1];
                    couple += f[2];
                }
                let mut torque = couple * g.radius;
                let free = plate[i] == 0;
                let (mass, inertia) = (1.0 / g.inverse_mass, 1.0 / g.inverse_inertia);
                let arm = [g.x - centre[0], g.y - centre[1]];
                let flow = arm[1] * cell.rate;
                if walls {
                    let f = wall_forces(g, &mut wall[k], model, &cell, h, &mut sums);
                    sums.wall_external += -Tensor2::dyad([f[0], f[1]], arm);
                    fx += f[0];
                    fy += f[1];
                    torque += f[2];
                }
                sums.torque += torque;
                let spin = 0.5 * inertia * g.omega * g.omega;
                sums.all_spin += spin;
                let closing_flow = -g.y * cell.closing;
                let v = [g.vx - flow, g.vy - closing_flow];
                sums.kinetic += 0.5 * mass * (v[0] * v[0] + v[1] * v[1]) + spin;
                if free {
                    sums.linear += Tensor2::dyad([fx, fy], arm);
                    sums.spin += spin;
                    sums.flow.grain(mass, arm, v);
                    g.vx += fx * g.inverse_mass * h;
                    g.vy += fy * g.inverse_mass * h;
                    g.omega += torque * g.inverse_inertia * h;
                    g.vx = flow + (g.vx - flow) * q;
                    g.vy = closing_flow + (g.vy - closing_flow) * q;
                    g.omega = rest_spin + (g.omega - rest_spin) * q;
                } else {
                    // Part of the plate: carried along, not spinning.
                    g.vx = f64::from(plate[i]) * cell.rate * cell.height / 2.0;
                    g.vy = closing_flow;
                    g.omega = 0.0;
                }
                angles[k] += g.omega * h;
                let u = &mut moved[k];
                u[0] += (g.vx - flow) * h;
                u[1] += (g.vy - closing_flow) * h;
                sums.largest_move = sums.largest_move.max(u[0] * u[0] + u[1] * u[1]);
                g.x += g.vx * h;
                g.y += g.vy * h;
                sums.finite += g.x + g.y + g.vx + g.vy + g.omega;
            }
            sums
        };
        let n = self.bodies.len();
        let mut no_walls = vec![[0.0; 2]; 0];
        let wall_springs = if walls { &mut self.wall_springs } else { &mut no_walls };
        let bodies = self.bodies.chunks_mut(BLOCK);
        let angles = self.angle.chunks_mut(BLOCK);
        let moved = self.moved.chunks_mut(BLOCK);
        let mut rest: &mut [[f64; 2]] = wall_springs;
        let mut wall_blocks: Vec<&mut [[f64; 2]]> = Vec::with_capacity(n.div_ceil(BLOCK));
        for _ in 0..n.div_ceil(BLOCK) {
            let (head, tail) = rest.split_at_mut(rest.len().min(BLOCK));
            wall_blocks.push(head);
            rest = tail;
        }
        let blocks = bodies.zip(angles).zip(moved).zip(wall_blocks).enumerate();
        let mut total = GrainSums::default();
        if n > 4 * BLOCK && rayon::current_num_threads() > 1 {
            let blocks: Vec<_> = blocks.collect();
            let parts: Vec<GrainSums> =
                blocks.into_par_iter().map(|(b, (((g, a), m), w))| run(b, g, a, m, w)).collect();
            parts.iter().for_each(|s| total.add(s));
        } else {
            for (b, (((g, a), m), w)) in blocks {
                total.add(&run(b, g, a, m, w));
            }
        }
        total.largest_move = total.largest_move.sqrt();
        total
    }

    fn report(&self, pairs: &PairSums, grains: &GrainSums) -> StepReport {
        let scale = self.cell.stress_scale();
        let mut s = StressTensors {
            love_weber: pairs.love_weber * scale,
            external: (pairs.external + grains.wall_external) * scale,
            linear: grains.linear * scale,
            otsuki: grains.flow.fluctuation() * -scale,
            torque: Tensor2::torque(grains.torque * scale),
            internal_torque: Tensor2::torque(pairs.internal_torque * scale),
            centrifugal: Tensor2::isotropic(-grains.spin * scale),
            ..StressTensors::default()
        };
        s.overall = s.love_weber + s.internal_torque + s.centrifugal;
        s.bulk = (pairs.virial + grains.wall_virial) * scale
            + Tensor2::torque((pairs.all_torque + grains.wall_torque) * scale)
            + Tensor2::isotropic(-grains.all_spin * scale);
        StepReport {
            stress: s,
            contacts: pairs.contacts + grains.wall_contacts,
            slipping: pairs.slipping,
            kinetic_energy: grains.kinetic,
            substeps: 0,
        }
    }
}

/// Force and torque of the walls on one grain; the wall acts like a flat partner at the distance of the centre.
fn wall_forces(
    g: &Body,
    springs: &mut [f64; 2],
    model: &crate::model::ContactModel,
    cell: &crate::cell::Cell,
    h: f64,
    sums: &mut GrainSums,
) -> [f64; 3] {
    let mut total = [0.0; 3];
    for (side, spring) in springs.iter_mut().enumerate() {
        let (d, n) = if side == 0 { (g.y, -1.0) } else { (cell.height - g.y, 1.0) };
        if d >= g.radius {
            *spring = 0.0;
            continue;
        }
        // A grain pressed through the wall is pushed back with the largest force of the law.
        let d = d.max(1e-3 * g.radius);
        let wall_speed = n * cell.rate * cell.height / 2.0;
        let wall_rise = if side == 0 { 0.0 } else { -cell.closing * cell.height };
        let elastic = model.law.force(d, g.radius, model.spring);
        let central = (elastic + model.viscosity * ((wall_rise - g.vy) * n)).min(0.0);
        let t = -n;
        let slide = (wall_speed - g.vx) * t - d * g.omega;
        let viscous = model.tangential_viscosity * slide;
        let limit = model.friction * elastic.abs();
        let trial = model.tangential_spring * *spring + viscous;
        let tangential = trial.clamp(-limit, limit);
        if trial != tangential && model.tangential_spring > 0.0 {
            *spring = (tangential - viscous.clamp(-limit, limit)) / model.tangential_spring;
        }
        *spring += slide * h;
        let f = [tangential * t, central * n];
        total[0] += f[0];
        total[1] += f[1];
        total[2] += d * tangential;
        sums.wall_virial += Tensor2::dyad(f, [0.0, -n * d]);
        sums.wall_torque += d * tangential;
        sums.wall_contacts += 1;
    }
    total
}
