//! Force of one pair, and the sums over a block of pairs.

use super::rules::{Lever, Rules, SlipRule};
use super::state::{Body, Pair};
use crate::cell::Cell;
use crate::law::CentralLaw;
use crate::model::{ContactKind, ContactModel};
use crate::tensor::Tensor2;

/// Compression law specialised for the pair loop: force and stiffness from distance and its inverse.
pub(super) trait Compression: Copy + Sync {
    fn force_and_stiffness(&self, d: f64, inverse: f64, d0: f64) -> [f64; 2];
}

/// The blend of linear and divergent law.
#[derive(Clone, Copy)]
pub(super) struct Blend {
    pub linear: f64,
    pub divergent: f64,
}

impl Compression for Blend {
    #[inline(always)]
    fn force_and_stiffness(&self, d: f64, inverse: f64, d0: f64) -> [f64; 2] {
        let q = (d0 * inverse).min(1000.0);
        [-self.linear * (d0 - d) - self.divergent * d0 * (q - 1.0), self.linear + self.divergent * q * q]
    }
}

/// Any other law.
#[derive(Clone, Copy)]
pub(super) struct General<'a> {
    pub law: &'a CentralLaw,
    pub spring: f64,
}

impl Compression for General<'_> {
    #[inline(always)]
    fn force_and_stiffness(&self, d: f64, _: f64, d0: f64) -> [f64; 2] {
        [self.law.force(d, d0, self.spring), self.law.stiffness(d, d0, self.spring)]
    }
}

/// What is the same for all pairs of a step.
pub(super) struct Frame<'a, L> {
    pub bodies: &'a [Body],
    pub plate: &'a [i8],
    pub model: &'a ContactModel,
    pub law: L,
    pub rules: Rules,
    pub cell: Cell,
    pub centre: [f64; 2],
    /// Step by which the springs still have to move [s].
    pub dt: f64,
    /// Rate now minus rate during that step [1/s].
    pub rate_change: f64,
}

/// Sums over a block of pairs, in units of force times length.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct PairSums {
    pub love_weber: Tensor2,
    pub external: Tensor2,
    pub virial: Tensor2,
    pub internal_torque: f64,
    pub all_torque: f64,
    /// Largest `stiffness (1/m_i + 1/m_j)` or square of `viscosity (1/m_i + 1/m_j)` [1/s²].
    pub stiffest: f64,
    pub contacts: u32,
    pub slipping: u32,
}

impl PairSums {
    pub fn add(&mut self, o: &Self) {
        self.love_weber += o.love_weber;
        self.external += o.external;
        self.virial += o.virial;
        self.internal_torque += o.internal_torque;
        self.all_torque += o.all_torque;
        self.stiffest = self.stiffest.max(o.stiffest);
        self.contacts += o.contacts;
        self.slipping += o.slipping;
    }
}

impl<L: Compression> Frame<'_, L> {
    /// Evaluates a block: forces on the first grain of each pair `[f_x, f_y, couple, 0]`, where the torque on a grain is
    /// `couple` times its radius; moves the springs by the pending step.
    pub fn block(
        &self,
        pairs: &[Pair],
        kinds: &mut [ContactKind],
        springs: &mut [f64],
        rests: &[f64],
        forces: &mut [[f64; 4]],
    ) -> PairSums {
        let mut sums = PairSums::default();
        let m = self.model;
        let [fc, fv, ft, ftv] = m.permanent_factors();
        let row_shift = self.cell.height * self.cell.strain;
        let row_speed = self.cell.height * self.cell.rate;
        let row_closing = self.cell.height * self.cell.closing;
        for k in 0..pairs.len() {
            let p = pairs[k];
            let (i, j) = (p.i as usize, p.j as usize);
            let (a, b) = (&self.bodies[i], &self.bodies[j]);
            let (columns, rows) = (f64::from(p.columns), f64::from(p.rows));
            let dx = b.x - a.x + (columns * self.cell.width + rows * row_shift);
            let dy = b.y - a.y + rows * self.cell.height;
            let square = dx * dx + dy * dy;
            let touch = a.radius + b.radius;
            let permanent = kinds[k] == ContactKind::Permanent;
            if !permanent && square >= touch * touch {
                kinds[k] = ContactKind::Apart;
                springs[k] = 0.0;
                forces[k] = [0.0; 4];
                continue;
            }
            let d = square.sqrt();
            // Coincident centres part along the flow.
            let (inverse, n) = if d > 0.0 { (1.0 / d, [dx / d, dy / d]) } else { (f64::MAX, [1.0, 0.0]) };
            let t = [-n[1], n[0]];
            let rvx = b.vx - a.vx + rows * row_speed;
            let rvy = b.vy - a.vy - rows * row_closing;
            let normal_speed = rvx * n[0] + rvy * n[1];
            let share = d / touch;
            let lever = match self.rules.lever {
                Lever::Consistent => share,
                Lever::Radius => 1.0,
            };
            let slide = rvx * t[0] + rvy * t[1] - lever * (a.radius * a.omega + b.radius * b.omega);
            let mut spring = springs[k];
            if kinds[k] != ContactKind::Apart {
                // The step that led here was made at the old rate: undo the jump of the affine flow.
                let before = slide - self.rate_change * (dy * t[0] + 0.5 * lever * touch);
                spring += before * self.dt;
            }
            let viscous_slide = if d < touch { m.tangential_viscosity * slide } else { 0.0 };
            let (central, stiffness, tangential, shear_stiffness, dashpot);
            if permanent {
                let rest = rests[k];
                let [elastic, s] = if d > rest {
                    [m.tension.force(d, rest, m.spring), m.spring]
                } else {
                    self.law.force_and_stiffness(d, inverse, rest)
                };
                central = elastic * fc + m.viscosity * fv * normal_speed;
                stiffness = s * fc;
                shear_stiffness = m.tangential_spring * ft;
                dashpot = (m.viscosity * fv).max(m.tangential_viscosity * ftv);
                tangential = m.tangential_spring * ft * spring + viscous_slide * ftv;
            } else {
                let [elastic, s] = self.law.force_and_stiffness(d, inverse, touch);
                let total = elastic + m.viscosity * normal_speed;
                central = if self.rules.viscous_attraction { total } else { total.min(0.0) };
                stiffness = s;
                shear_stiffness = m.tangential_spring;
                dashpot = m.viscosity.max(m.tangential_viscosity);
                let limit = m.friction * elastic.abs();
                let trial = m.tangential_spring * spring + viscous_slide;
                if trial.abs() > limit {
                    let held = if trial >= 0.0 { limit } else { -limit };
                    spring = match self.rules.slip {
                        SlipRule::KeepAtLimit if m.tangential_spring > 0.0 => {
                            (held - viscous_slide.clamp(-limit, limit)) / m.tangential_spring
                        }
                        _ => 0.0,
                    };
                    tangential = held;
                    kinds[k] = ContactKind::Slip;
                    sums.slipping += 1;
                } else {
                    tangential = trial;
                    kinds[k] = ContactKind::Stick;
                }
            }
            springs[k] = spring;
            sums.contacts += 1;
            // Springs oscillate at the root of this, dashpots decay at `rate`; both bound the step alike.
            let inverse_masses = a.inverse_mass + b.inverse_mass;
            let rate = dashpot * inverse_masses;
            sums.stiffest = sums.stiffest.max((stiffness.max(shear_stiffness) * inverse_masses).max(rate * rate));
            let f = [central * n[0] + tangential * t[0], central * n[1] + tangential * t[1]];
            let torque = tangential * d;
            forces[k] = [f[0], f[1], tangential * share, 0.0];

            let dyad = Tensor2::dyad(f, [-dx, -dy]);
            sums.virial += dyad;
            sums.all_torque += torque;
            let inside = p.columns == 0 && p.rows == 0;
            match (self.plate[i] == 0, self.plate[j] == 0) {
                (true, true) if inside => {
                    sums.love_weber += dyad;
                    sums.internal_torque += torque;
                }
                (true, true) => sums.external += Tensor2::dyad(f, [b.x - a.x, b.y - a.y]),
                (true, false) => sums.external += -Tensor2::dyad(f, [a.x - self.centre[0], a.y - self.centre[1]]),
                (false, true) => sums.external += Tensor2::dyad(f, [b.x - self.centre[0], b.y - self.centre[1]]),
                (false, false) => {}
            }
        }
        sums
    }
}
