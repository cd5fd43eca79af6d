//! One step of the spheres: pairs, then spheres, in blocks of fixed size.

use super::state::{Ball, SpherePair, SphereSample, cross, dot};
use crate::error::GranularError;
use crate::model::ContactKind;
use crate::physical::{Lever, SlipRule, StepGuard, StepReport};
use crate::stress::StressTensors;
use crate::tensor::Tensor2;
use rayon::prelude::*;

const BLOCK: usize = 512;
type Matrix = [f64; 9];

#[derive(Clone, Copy, Default)]
struct PairSums {
    virial: Matrix,
    inside: Matrix,
    external: Matrix,
    torque: [f64; 3],
    inside_torque: [f64; 3],
    stiffest: f64,
    contacts: u32,
    slipping: u32,
}

#[derive(Clone, Copy, Default)]
struct BallSums {
    linear: Matrix,
    kinetic: Matrix,
    spin: Matrix,
    torque: [f64; 3],
    energy: f64,
    largest_move: f64,
    finite: f64,
}

#[inline(always)]
fn add_dyad(m: &mut Matrix, a: [f64; 3], b: [f64; 3], scale: f64) {
    for r in 0..3 {
        for c in 0..3 {
            m[3 * r + c] += scale * a[r] * b[c];
        }
    }
}

fn add<const N: usize>(a: &mut [f64; N], b: &[f64; N]) {
    for k in 0..N {
        a[k] += b[k];
    }
}

/// `½ [T]ₓ`: the antisymmetric tensor of a torque.
fn torque_tensor(t: [f64; 3]) -> Matrix {
    let h = t.map(|v| 0.5 * v);
    [0.0, -h[2], h[1], h[2], 0.0, -h[0], -h[1], h[0], 0.0]
}

fn scaled(m: Matrix, s: f64) -> Matrix {
    m.map(|v| v * s)
}

fn sum(a: Matrix, b: Matrix) -> Matrix {
    std::array::from_fn(|k| a[k] + b[k])
}

/// The block of flow and gradient.
fn block(m: Matrix) -> Tensor2 {
    Tensor2([m[0], m[1], m[3], m[4]])
}

impl SphereSample {
    /// Sets a new shear rate [1/s]; peculiar velocities and spins stay the same.
    pub fn set_rate(&mut self, rate: f64) {
        let change = rate - self.cell.rate;
        if change != 0.0 {
            let mid = self.cell.height / 2.0;
            for b in &mut self.balls {
                b.velocity[0] += (b.position[1] - mid) * change;
                b.omega[2] -= 0.5 * change;
            }
            self.cell.rate = rate;
            self.pending_rate_change += change;
        }
    }

    /// Advances by `dt` [s] with peculiar velocities multiplied by `damping` [-]; see [`crate::physical::Sample::advance`].
    ///
    /// # Errors
    /// [`GranularError::NonFinite`], [`GranularError::StepTooLarge`].
    pub fn advance(&mut self, dt: f64, damping: f64) -> Result<StepReport, GranularError> {
        let (mut report, mut remaining, mut first) = (StepReport::default(), dt, true);
        loop {
            self.ensure_pairs();
            let sums = self.evaluate_pairs();
            let parts = self.parts(remaining, sums.stiffest)?;
            let (h, q) = if first && parts == 1 {
                (dt, damping)
            } else {
                let h = remaining / f64::from(parts);
                (h, damping.powf(h / dt))
            };
            let balls = self.move_balls(h, q);
            if first {
                report = self.report(&sums, &balls);
                first = false;
            }
            report.substeps += 1;
            self.largest_move = balls.largest_move.sqrt();
            self.pending_dt = h;
            self.pending_rate_change = 0.0;
            self.cell.strain += self.cell.rate * h;
            self.time += h;
            if !balls.finite.is_finite() {
                let bad = |b: &Ball| !(b.position.iter().chain(&b.velocity).sum::<f64>()).is_finite();
                let grain = self.balls.iter().position(bad).unwrap_or(0);
                return Err(GranularError::NonFinite { grain, time: self.time });
            }
            if parts == 1 {
                self.extra_steps += u64::from(report.substeps - 1);
                return Ok(report);
            }
            remaining -= h;
        }
    }

    /// Evaluates the state without moving it.
    pub fn observe(&mut self) -> StepReport {
        self.ensure_pairs();
        let sums = self.evaluate_pairs();
        let balls = self.clone().move_balls(0.0, 1.0);
        self.report(&sums, &balls)
    }

    fn parts(&self, remaining: f64, stiffest: f64) -> Result<u32, GranularError> {
        let limit = match self.rules.guard {
            StepGuard::Off => return Ok(1),
            StepGuard::Refuse => 1,
            StepGuard::SubStep(most) => most.max(1),
        };
        if stiffest <= 0.0 {
            return Ok(1);
        }
        let stable = self.rules.guard_fraction / stiffest.sqrt();
        let parts = (remaining / stable * (1.0 - 1e-12)).ceil().max(1.0);
        if parts <= f64::from(limit) {
            Ok(parts as u32)
        } else {
            Err(GranularError::StepTooLarge { step: remaining, stable, time: self.time })
        }
    }

    fn evaluate_pairs(&mut self) -> PairSums {
        if self.forces.len() != self.pairs.len() {
            self.forces.resize(self.pairs.len(), [0.0; 6]);
        }
        let mut pairs = std::mem::take(&mut self.pairs);
        let mut forces = std::mem::take(&mut self.forces);
        let run = |(pairs, forces): (&mut [SpherePair], &mut [[f64; 6]])| {
            let mut sums = PairSums::default();
            for (p, f) in pairs.iter_mut().zip(forces) {
                self.pair(p, f, &mut sums);
            }
            sums
        };
        let mut total = PairSums::default();
        let blocks = pairs.chunks_mut(BLOCK).zip(forces.chunks_mut(BLOCK));
        let parts: Vec<PairSums> = if blocks.len() > 8 && rayon::current_num_threads() > 1 {
            blocks.collect::<Vec<_>>().into_par_iter().map(run).collect()
        } else {
            blocks.map(run).collect()
        };
        for s in &parts {
            add(&mut total.virial, &s.virial);
            add(&mut total.inside, &s.inside);
            add(&mut total.external, &s.external);
            add(&mut total.torque, &s.torque);
            add(&mut total.inside_torque, &s.inside_torque);
            total.stiffest = total.stiffest.max(s.stiffest);
            total.contacts += s.contacts;
            total.slipping += s.slipping;
        }
        (self.pairs, self.forces) = (pairs, forces);
        self.pending_dt = 0.0;
        total
    }

    /// Force on the first sphere, and the couple whose product with a radius is that sphere's torque.
    #[inline(always)]
    fn pair(&self, p: &mut SpherePair, force: &mut [f64; 6], sums: &mut PairSums) {
        let m = &self.model;
        let (a, b) = (&self.balls[p.i as usize], &self.balls[p.j as usize]);
        let s = self.separation(p);
        let square = dot(s, s);
        let touch = a.radius + b.radius;
        let permanent = p.kind == ContactKind::Permanent;
        if !permanent && square >= touch * touch {
            p.kind = ContactKind::Apart;
            p.spring = [0.0; 3];
            *force = [0.0; 6];
            return;
        }
        let d = square.sqrt();
        let n = if d > 0.0 { s.map(|c| c / d) } else { [1.0, 0.0, 0.0] };
        let share = d / touch;
        let lever = match self.rules.lever {
            Lever::Consistent => share,
            Lever::Radius => 1.0,
        };
        let mut v: [f64; 3] = std::array::from_fn(|c| b.velocity[c] - a.velocity[c]);
        v[0] += f64::from(p.image[1]) * self.cell.height * self.cell.rate;
        let normal_speed = dot(v, n);
        let spin: [f64; 3] = std::array::from_fn(|c| lever * (a.radius * a.omega[c] + b.radius * b.omega[c]));
        let turning = cross(spin, n);
        // Relative velocity of the contact point in the contact plane.
        let slide: [f64; 3] = std::array::from_fn(|c| v[c] - normal_speed * n[c] - turning[c]);
        let mut spring = p.spring;
        if p.kind != ContactKind::Apart {
            // Turn with the plane, keep the length, then add the slip of the last step at its own rate.
            let length = dot(spring, spring).sqrt();
            let off = dot(spring, n);
            for c in 0..3 {
                spring[c] -= off * n[c];
            }
            let flat = dot(spring, spring).sqrt();
            if flat > 0.0 {
                spring = spring.map(|c| c * (length / flat));
            }
            let mut jump = [self.rate_change_speed(s[1]), 0.0, 0.0];
            let along = dot(jump, n);
            let roll = cross([0.0, 0.0, -0.5 * self.pending_rate_change * lever * touch], n);
            for c in 0..3 {
                jump[c] -= along * n[c] + roll[c];
                spring[c] += (slide[c] - jump[c]) * self.pending_dt;
            }
        }
        let [fc, fv, ft, ftv] = m.permanent_factors();
        let dashpot = if d < touch { m.tangential_viscosity } else { 0.0 };
        let (central, stiffness, tangential);
        if permanent {
            let elastic = m.link_force(d, p.rest);
            let k = if d > p.rest { m.spring } else { m.law.stiffness(d, p.rest, m.spring) };
            central = elastic * fc + m.viscosity * fv * normal_speed;
            stiffness = k * fc;
            tangential = std::array::from_fn(|c| m.tangential_spring * ft * spring[c] + dashpot * ftv * slide[c]);
        } else {
            let elastic = m.law.force(d, touch, m.spring);
            let total = elastic + m.viscosity * normal_speed;
            central = if self.rules.viscous_attraction { total } else { total.min(0.0) };
            stiffness = m.law.stiffness(d, touch, m.spring);
            let limit = m.friction * elastic.abs();
            let viscous = slide.map(|c| dashpot * c);
            let trial: [f64; 3] = std::array::from_fn(|c| m.tangential_spring * spring[c] + viscous[c]);
            let size = dot(trial, trial).sqrt();
            if size > limit {
                tangential = trial.map(|c| c * (limit / size));
                let drag = dot(viscous, viscous).sqrt();
                let held = if drag > limit { limit / drag } else { 1.0 };
                spring = match self.rules.slip {
                    SlipRule::KeepAtLimit if m.tangential_spring > 0.0 => {
                        std::array::from_fn(|c| (tangential[c] - held * viscous[c]) / m.tangential_spring)
                    }
                    _ => [0.0; 3],
                };
                p.kind = ContactKind::Slip;
                sums.slipping += 1;
            } else {
                tangential = trial;
                p.kind = ContactKind::Stick;
            }
        }
        p.spring = spring;
        sums.contacts += 1;
        let inverse_masses = a.inverse_mass + b.inverse_mass;
        let (shear, drag) = if permanent {
            (m.tangential_spring * ft, (m.viscosity * fv).max(m.tangential_viscosity * ftv))
        } else {
            (m.tangential_spring, m.viscosity.max(m.tangential_viscosity))
        };
        let rate = drag * inverse_masses;
        sums.stiffest = sums.stiffest.max((stiffness.max(shear) * inverse_masses).max(rate * rate));
        let f: [f64; 3] = std::array::from_fn(|c| central * n[c] + tangential[c]);
        // The arm on either sphere is its share of the branch: torque = (d r/(r_i + r_j)) n × T.
        let couple = cross(n, tangential).map(|c| c * share);
        *force = [f[0], f[1], f[2], couple[0], couple[1], couple[2]];
        let arm = s.map(|c| -c);
        add_dyad(&mut sums.virial, f, arm, 1.0);
        for c in 0..3 {
            sums.torque[c] += couple[c] * touch;
        }
        if p.image == [0; 3] {
            add_dyad(&mut sums.inside, f, arm, 1.0);
            for c in 0..3 {
                sums.inside_torque[c] += couple[c] * touch;
            }
        } else {
            add_dyad(&mut sums.external, f, std::array::from_fn(|c| b.position[c] - a.position[c]), 1.0);
        }
    }

    #[inline(always)]
    fn rate_change_speed(&self, dy: f64) -> f64 {
        self.pending_rate_change * dy
    }

    fn move_balls(&mut self, h: f64, q: f64) -> BallSums {
        let cell = self.cell;
        let centre = [cell.width / 2.0, cell.height / 2.0, self.depth / 2.0];
        let rest = if self.rules.damp_to_flow_spin { -0.5 * cell.rate } else { 0.0 };
        let (offsets, gather, forces) = (&self.gather_offsets, &self.gather, &self.forces);
        let run = |(block, (balls, moved)): (usize, (&mut [Ball], &mut [[f64; 3]]))| {
            let mut sums = BallSums::default();
            for (k, (g, u)) in balls.iter_mut().zip(moved).enumerate() {
                let i = block * BLOCK + k;
                let (mut f, mut t) = ([0.0; 3], [0.0; 3]);
                for &e in &gather[offsets[i] as usize..offsets[i + 1] as usize] {
                    let p = &forces[(e >> 1) as usize];
                    let sign = if e & 1 == 0 { 1.0 } else { -1.0 };
                    for c in 0..3 {
                        f[c] += sign * p[c];
                        t[c] += p[3 + c];
                    }
                }
                t = t.map(|c| c * g.radius);
                let arm: [f64; 3] = std::array::from_fn(|c| g.position[c] - centre[c]);
                let flow = arm[1] * cell.rate;
                let (mass, inertia) = (1.0 / g.inverse_mass, 1.0 / g.inverse_inertia);
                let v = [g.velocity[0] - flow, g.velocity[1], g.velocity[2]];
                add_dyad(&mut sums.linear, f, arm, 1.0);
                add_dyad(&mut sums.kinetic, v, v, -mass);
                // Half the moment of inertia: the second moment of mass along one axis.
                let chi = 0.5 * inertia;
                let w2 = dot(g.omega, g.omega);
                add_dyad(&mut sums.spin, g.omega, g.omega, chi);
                for c in 0..3 {
                    sums.spin[4 * c] -= chi * w2;
                    sums.torque[c] += t[c];
                }
                sums.energy += 0.5 * mass * dot(v, v) + 0.5 * inertia * w2;
                for c in 0..3 {
                    g.velocity[c] += f[c] * g.inverse_mass * h;
                    g.omega[c] += t[c] * g.inverse_inertia * h;
                }
                g.velocity[0] = flow + (g.velocity[0] - flow) * q;
                g.velocity[1] *= q;
                g.velocity[2] *= q;
                g.omega[0] *= q;
                g.omega[1] *= q;
                g.omega[2] = rest + (g.omega[2] - rest) * q;
                u[0] += (g.velocity[0] - flow) * h;
                u[1] += g.velocity[1] * h;
                u[2] += g.velocity[2] * h;
                sums.largest_move = sums.largest_move.max(dot(*u, *u));
                for c in 0..3 {
                    g.position[c] += g.velocity[c] * h;
                    sums.finite += g.position[c] + g.velocity[c] + g.omega[c];
                }
            }
            sums
        };
        let blocks = self.balls.chunks_mut(BLOCK).zip(self.moved.chunks_mut(BLOCK)).enumerate();
        let parts: Vec<BallSums> = if blocks.len() > 8 && rayon::current_num_threads() > 1 {
            blocks.collect::<Vec<_>>().into_par_iter().map(run).collect()
        } else {
            blocks.map(run).collect()
        };
        let mut total = BallSums::default();
        for s in &parts {
            add(&mut total.linear, &s.linear);
            add(&mut total.kinetic, &s.kinetic);
            add(&mut total.spin, &s.spin);
            add(&mut total.torque, &s.torque);
            total.energy += s.energy;
            total.largest_move = total.largest_move.max(s.largest_move);
            total.finite += s.finite;
        }
        total
    }

    fn report(&mut self, p: &PairSums, b: &BallSums) -> StepReport {
        // Force 1e-12 N, length 1e-6 m.
        let scale = 1e-18 / (self.cell.width * 1e-6 * (self.cell.height * 1e-6) * (self.depth * 1e-6));
        let spin = scaled(b.spin, scale);
        let inside_torque = scaled(torque_tensor(p.inside_torque), scale);
        let love_weber = scaled(p.inside, scale);
        self.bulk = sum(sum(scaled(p.virial, scale), scaled(torque_tensor(p.torque), scale)), spin);
        let stress = StressTensors {
            love_weber: block(love_weber),
            otsuki: block(scaled(b.kinetic, scale)),
            external: block(scaled(p.external, scale)),
            linear: block(scaled(b.linear, scale)),
            torque: block(scaled(torque_tensor(b.torque), scale)),
            internal_torque: block(inside_torque),
            centrifugal: block(spin),
            overall: block(sum(sum(love_weber, inside_torque), spin)),
            bulk: block(self.bulk),
        };
        StepReport { stress, contacts: p.contacts, slipping: p.slipping, kinetic_energy: b.energy, substeps: 0 }
    }
}
