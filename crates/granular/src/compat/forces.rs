//! Contact detection and the three force passes, in the published order.

use super::state::{DirectedContact, DirectedSample, Visit};
use crate::model::ContactKind;

impl DirectedSample {
    /// Evaluates contacts, forces and torques at the current state (steps 1–4 of one time step).
    pub fn evaluate(&mut self) {
        self.detect();
        self.central_pass();
        self.viscous_pass();
        self.tangential_pass();
    }

    /// Contact lists: lost transient entries leave, new ones are appended in ascending order of the partner.
    pub(super) fn detect(&mut self) {
        self.refresh_candidates();
        let g = &self.grains;
        for i in 0..g.len() {
            let (from, to) = (self.candidates.offsets[i] as usize, self.candidates.offsets[i + 1] as usize);
            let (x, y, r) = (g.x[i], g.y[i], g.radius[i]);
            let (cell, list) = (&self.cell, &mut self.contacts[i]);
            let touches = |j: usize| {
                let ([dx, dy], ..) = cell.nearest(g.x[j] - x, g.y[j] - y);
                (dx * dx + dy * dy).sqrt() < r + g.radius[j]
            };
            list.retain(|c| c.kind == ContactKind::Permanent || touches(c.other as usize));
            for &j in &self.candidates.partners[from..to] {
                if touches(j as usize) && !list.iter().any(|c| c.other == j) {
                    list.push(DirectedContact { other: j, kind: ContactKind::Stick, spring: 0.0, rest: 0.0 });
                }
            }
        }
    }

    /// Drops the lists of possible partners.
    pub fn forget_candidates(&mut self) {
        self.candidates.valid = false;
    }

    fn refresh_candidates(&mut self) {
        let c = &self.candidates;
        let g = &self.grains;
        if c.valid && c.offsets.len() == g.len() + 1 {
            let moved = c.moved.iter().fold(0.0f64, |m, u| m.max(u[0] * u[0] + u[1] * u[1])).sqrt();
            let turned = (self.cell.strain - c.strain).abs();
            let reach = 2.0 * g.radius.iter().fold(0.0f64, |m, &r| m.max(r)) + c.skin;
            // Relative motion of a pair: twice the largest own motion, plus the shear of its separation.
            if (2.0 * moved + turned * reach) * (1.0 + turned) < c.skin {
                return;
            }
        }
        let n = g.len();
        let skin = 0.25 * g.radius.iter().sum::<f64>() / n.max(1) as f64;
        let list = crate::neighbours::all_partners(&self.cell, &g.x, &g.y, &g.radius, skin);
        let c = &mut self.candidates;
        (c.offsets, c.partners) = list;
        c.moved.clear();
        c.moved.resize(n, [0.0; 2]);
        c.strain = self.cell.strain;
        c.skin = skin;
        c.valid = true;
    }

    /// Unit vector to the partner; a fresh random one for coincident centres (fault F10).
    fn normal(&mut self, separation: [f64; 2], d: f64) -> [f64; 2] {
        if d > 0.0 {
            return [separation[0] / d, separation[1] / d];
        }
        let angle = std::f64::consts::TAU * self.random.uniform();
        [angle.cos(), angle.sin()]
    }

    fn central_pass(&mut self) {
        let mut visits = std::mem::take(&mut self.scratch.visits);
        visits.clear();
        let ratio = self.model.permanent_ratio_central;
        for i in 0..self.grains.len() {
            for slot in 0..self.contacts[i].len() {
                let c = self.contacts[i][slot];
                let j = c.other as usize;
                let g = &self.grains;
                let (separation, rows, wrapped) = self.cell.nearest(g.x[j] - g.x[i], g.y[j] - g.y[i]);
                let shift = -f64::from(rows) * self.cell.height * self.cell.rate;
                let relative = [g.vx[j] - g.vx[i] + shift, g.vy[j] - g.vy[i]];
                let touch = g.radius[i] + g.radius[j];
                let d = (separation[0] * separation[0] + separation[1] * separation[1]).sqrt();
                let n = self.normal(separation, d);
                let central = if c.kind == ContactKind::Permanent {
                    self.model.link_force(d, c.rest) * ratio
                } else {
                    self.model.law.force(d, touch, self.model.spring)
                };
                self.fx[i] += central * n[0];
                self.fy[i] += central * n[1];
                visits.push(Visit {
                    i: i as u32,
                    other: c.other,
                    slot: slot as u32,
                    n,
                    separation,
                    d,
                    relative,
                    central,
                    tangential: 0.0,
                    wrapped,
                });
            }
        }
        self.scratch.visits = visits;
    }

    fn viscous_pass(&mut self) {
        let [_, factor, _, _] = self.model.permanent_factors();
        for v in &mut self.scratch.visits {
            let i = v.i as usize;
            let permanent = self.contacts[i][v.slot as usize].kind == ContactKind::Permanent;
            let nu = if permanent { self.model.viscosity * factor } else { self.model.viscosity };
            let force = nu * (v.relative[0] * v.n[0] + v.relative[1] * v.n[1]);
            self.fx[i] += force * v.n[0];
            self.fy[i] += force * v.n[1];
            v.central += force;
        }
    }

    /// Tangential couples. Both directions of a contact are visited; each applies half. The second visit of a sliding
    /// contact finds its spring already reset (fault F2).
    fn tangential_pass(&mut self) {
        let mut visits = std::mem::take(&mut self.scratch.visits);
        let [_, _, spring_factor, viscous_factor] = self.model.permanent_factors();
        for v in &mut visits {
            let (i, j) = (v.i as usize, v.other as usize);
            let c = self.contacts[i][v.slot as usize];
            let g = &self.grains;
            let (ri, rj) = (g.radius[i], g.radius[j]);
            let t = [-v.n[1], v.n[0]];
            let speed = v.relative[0] * t[0] + v.relative[1] * t[1] - (ri * g.omega[i] + rj * g.omega[j]);
            let permanent = c.kind == ContactKind::Permanent;
            let (kt, nt) = if permanent {
                (self.model.tangential_spring * spring_factor, self.model.tangential_viscosity * viscous_factor)
            } else {
                (self.model.tangential_spring, self.model.tangential_viscosity)
            };
            let viscous = if v.d < ri + rj { nt * speed } else { 0.0 };
            let trial = viscous + kt * c.spring;
            let mut force = trial;
            if !permanent {
                let limit = self.model.friction * self.model.law.force(v.d, ri + rj, self.model.spring).abs();
                let slips = trial.abs() > limit;
                let kind = if slips { ContactKind::Slip } else { ContactKind::Stick };
                if slips {
                    force = if trial >= 0.0 { limit } else { -limit };
                }
                self.contacts[i][v.slot as usize].kind = kind;
                if slips {
                    self.contacts[i][v.slot as usize].spring = 0.0;
                }
                if let Some(back) = self.contacts[j].iter_mut().find(|b| b.other as usize == i) {
                    back.kind = kind;
                    if slips {
                        back.spring = 0.0;
                    }
                }
            }
            v.tangential = force;
            let half = force / 2.0;
            self.fx[i] += half * t[0];
            self.fy[i] += half * t[1];
            self.fx[j] -= half * t[0];
            self.fy[j] -= half * t[1];
            let arm = v.d * half;
            self.torque[i] += arm * (ri / (ri + rj));
            self.torque[j] += arm * (rj / (ri + rj));
        }
        self.scratch.visits = visits;
    }
}
