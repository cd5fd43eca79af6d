//! State of the undirected sample.

use super::rules::Rules;
use crate::cell::Cell;
use crate::error::{GranularError, require};
use crate::grains::Grains;
use crate::model::{ContactKind, ContactModel};
use serde::{Deserialize, Serialize};

/// What the pair loop reads of one grain: one cache line, since partners are read in random order.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[repr(C, align(64))]
pub struct Body {
    /// Position [µm].
    pub x: f64,
    /// Position [µm].
    pub y: f64,
    /// Velocity [µm/s].
    pub vx: f64,
    /// Velocity [µm/s].
    pub vy: f64,
    /// Angular velocity [rad/s].
    pub omega: f64,
    /// Radius [µm].
    pub radius: f64,
    /// One over mass [m/mg].
    pub inverse_mass: f64,
    /// One over moment of inertia [m/(mg µm²)].
    pub inverse_inertia: f64,
}

/// Two grains close enough to touch soon, `i < j`, with the image of `j` that `i` sees.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Pair {
    /// First grain.
    pub i: u32,
    /// Second grain.
    pub j: u32,
    /// Whole widths added to the second grain's position.
    pub columns: i32,
    /// Whole heights added, each with the shift of the sheared rows.
    pub rows: i32,
}

/// Grains with undirected contacts.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Sample {
    pub(crate) bodies: Vec<Body>,
    pub(crate) angle: Vec<f64>,
    /// 0 free, -1 carried by the lower plate, 1 by the upper.
    pub(crate) plate: Vec<i8>,
    /// Tangential springs of the contacts with the lower and upper wall [µm]; empty without walls.
    pub(crate) wall_springs: Vec<[f64; 2]>,
    /// The box.
    pub(crate) cell: Cell,
    /// Contact laws.
    pub(crate) model: ContactModel,
    /// Rules.
    pub(crate) rules: Rules,
    /// Time [s].
    pub(crate) time: f64,
    pub(crate) pairs: Vec<Pair>,
    /// Start of each grain's pairs in `pairs`.
    pub(crate) first: Vec<u32>,
    pub(crate) kind: Vec<ContactKind>,
    /// Tangential springs [µm].
    pub(crate) spring: Vec<f64>,
    /// Rest distances of permanent links [µm].
    pub(crate) rest: Vec<f64>,
    /// Displacement against the shear flow since the last rebuild [µm].
    pub(crate) moved: Vec<[f64; 2]>,
    pub(crate) largest_move: f64,
    pub(crate) strain_at_build: f64,
    /// Compressive strain since the last rebuild [-].
    pub(crate) closed: f64,
    pub(crate) skin_in_use: f64,
    pub(crate) reach: f64,
    pub(crate) valid: bool,
    /// Step that led to the current positions [s]; the springs have not yet been moved by it.
    pub(crate) pending_dt: f64,
    /// Change of the rate since that step [1/s].
    pub(crate) pending_rate_change: f64,
    /// Rebuilds of the pair list so far.
    pub(crate) rebuilds: u64,
    /// Sub-steps taken beyond the requested ones.
    pub(crate) extra_steps: u64,
    pub(crate) gather_offsets: Vec<u32>,
    pub(crate) gather: Vec<u32>,
    #[serde(skip)]
    pub(crate) forces: Vec<[f64; 4]>,
}

impl Sample {
    /// Creates a sample without contacts.
    ///
    /// # Errors
    /// [`GranularError`] if the grains are inconsistent or the rules out of range.
    pub fn new(grains: &Grains, cell: Cell, model: ContactModel, rules: Rules) -> Result<Self, GranularError> {
        grains.check(0.0)?;
        require("guard_fraction", rules.guard_fraction, |v| (0.005..=0.5).contains(&v), "0.005 … 0.5")?;
        require("skin", rules.skin, |v| (0.02..=2.0).contains(&v), "0.02 … 2")?;
        require("grains", grains.len() as f64, |n| n < 2e9, "fewer than 2e9")?;
        let n = grains.len();
        let bodies = (0..n)
            .map(|i| Body {
                x: grains.x[i],
                y: grains.y[i],
                vx: grains.vx[i],
                vy: grains.vy[i],
                omega: grains.omega[i],
                radius: grains.radius[i],
                inverse_mass: 1.0 / grains.mass[i],
                inverse_inertia: 1.0 / grains.inertia[i],
            })
            .collect();
        let walls = cell.boundary == crate::cell::Boundary::Walls;
        Ok(Self {
            bodies,
            angle: grains.angle.clone(),
            plate: vec![0; n],
            wall_springs: if walls { vec![[0.0; 2]; n] } else { Vec::new() },
            cell,
            model,
            rules,
            time: 0.0,
            pairs: Vec::new(),
            first: vec![0; n + 1],
            kind: Vec::new(),
            spring: Vec::new(),
            rest: Vec::new(),
            moved: vec![[0.0; 2]; n],
            largest_move: 0.0,
            strain_at_build: 0.0,
            closed: 0.0,
            skin_in_use: 0.0,
            reach: 0.0,
            valid: false,
            pending_dt: 0.0,
            pending_rate_change: 0.0,
            rebuilds: 0,
            extra_steps: 0,
            gather_offsets: Vec::new(),
            gather: Vec::new(),
            forces: Vec::new(),
        })
    }

    /// Number of grains.
    pub fn len(&self) -> usize {
        self.bodies.len()
    }

    /// True without any grain.
    pub fn is_empty(&self) -> bool {
        self.bodies.is_empty()
    }

    /// The box.
    pub fn cell(&self) -> &Cell {
        &self.cell
    }

    /// Sets the accumulated strain, for tests of lattice symmetries and affine states; drops the pair list's images of
    /// transient contacts.
    pub fn set_strain(&mut self, strain: f64) {
        self.cell.strain = strain;
        self.valid = false;
    }

    /// Time [s].
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Contact laws.
    pub fn model(&self) -> &ContactModel {
        &self.model
    }

    /// Changes the contact laws, such as the friction during preparation.
    pub fn model_mut(&mut self) -> &mut ContactModel {
        &mut self.model
    }

    /// Grains as one array per quantity, wrapped into the box.
    pub fn grains(&self) -> Grains {
        let mut g = Grains::default();
        for (i, b) in self.bodies.iter().enumerate() {
            let ([x, y], kick) = self.cell.wrap(b.x, b.y);
            g.x.push(x);
            g.y.push(y);
            g.vx.push(b.vx + kick);
            g.vy.push(b.vy - (y - b.y) * self.cell.closing);
            g.omega.push(b.omega);
            g.angle.push(self.angle[i]);
            g.radius.push(b.radius);
            g.mass.push(1.0 / b.inverse_mass);
            g.inertia.push(1.0 / b.inverse_inertia);
        }
        g
    }

    /// Listed pairs with their kind and tangential spring [µm].
    pub fn contacts(&self) -> impl Iterator<Item = (&Pair, ContactKind, f64)> {
        self.pairs
            .iter()
            .zip(&self.kind)
            .zip(&self.spring)
            .filter(|((_, k), _)| **k != ContactKind::Apart)
            .map(|((p, k), s)| (p, *k, *s))
    }

    /// Rebuilds of the pair list and sub-steps taken beyond the requested steps.
    pub fn counters(&self) -> (u64, u64) {
        (self.rebuilds, self.extra_steps)
    }

    /// Vector from the first grain of a pair to the image of the second [µm].
    #[inline(always)]
    pub fn separation(&self, p: &Pair) -> [f64; 2] {
        let (a, b) = (&self.bodies[p.i as usize], &self.bodies[p.j as usize]);
        let (c, r) = (f64::from(p.columns), f64::from(p.rows));
        [
            b.x - a.x + (c * self.cell.width + r * (self.cell.height * self.cell.strain)),
            b.y - a.y + r * self.cell.height,
        ]
    }

    /// Turns every touching pair into a permanent link at touching distance.
    pub fn link_all(&mut self) {
        for k in 0..self.pairs.len() {
            if self.kind[k] != ContactKind::Apart {
                self.link_pair(k);
            }
        }
    }

    pub(crate) fn link_pair(&mut self, k: usize) {
        let p = self.pairs[k];
        self.kind[k] = ContactKind::Permanent;
        self.spring[k] = 0.0;
        self.rest[k] = self.bodies[p.i as usize].radius + self.bodies[p.j as usize].radius;
    }

    pub(crate) fn pair_index(&self, i: usize, j: usize) -> Option<usize> {
        let (a, b) = (i.min(j), i.max(j));
        let range = self.first[a] as usize..self.first[a + 1] as usize;
        let k = self.pairs[range.clone()].binary_search_by_key(&(b as u32), |p| p.j).ok()?;
        Some(range.start + k)
    }

    /// Links two listed grains permanently with the given rest distance [µm]; false if they are not listed as a pair.
    pub fn link(&mut self, i: usize, j: usize, rest: f64) -> bool {
        self.ensure_pairs();
        match self.pair_index(i, j) {
            Some(k) => {
                self.link_pair(k);
                self.rest[k] = rest;
                true
            }
            None => false,
        }
    }

    /// Cuts a permanent link; the pair becomes a sliding contact.
    pub fn cut(&mut self, i: usize, j: usize) {
        if let Some(k) = self.pair_index(i, j)
            && self.kind[k] == ContactKind::Permanent
        {
            self.kind[k] = ContactKind::Slip;
            self.spring[k] = 0.0;
            self.rest[k] = 0.0;
        }
    }

    /// Permanent links, each once, ascending.
    pub fn links(&self) -> Vec<[usize; 2]> {
        (0..self.pairs.len())
            .filter(|&k| self.kind[k] == ContactKind::Permanent)
            .map(|k| [self.pairs[k].i as usize, self.pairs[k].j as usize])
            .collect()
    }

    /// Carries all grains that touch a plate line at this moment; the choice stays as it is until the plates are released.
    ///
    /// # Errors
    /// [`GranularError::NothingMovable`] if every grain touches a plate.
    pub fn attach_plates(&mut self) -> Result<usize, GranularError> {
        let height = self.cell.height;
        for (b, plate) in self.bodies.iter().zip(&mut self.plate) {
            let (_, y) = (b.x, b.y.rem_euclid(height));
            *plate = if y <= b.radius {
                -1
            } else if y >= height - b.radius {
                1
            } else {
                0
            };
        }
        let carried = self.plate.iter().filter(|p| **p != 0).count();
        if carried == self.len() { Err(GranularError::NothingMovable { time: self.time }) } else { Ok(carried) }
    }

    /// Carries, in addition, whoever touches a plate line now: the published rule, for studies of its effect.
    pub fn capture(&mut self) {
        let height = self.cell.height;
        for (b, plate) in self.bodies.iter().zip(&mut self.plate) {
            if *plate == 0 {
                let y = b.y.rem_euclid(height);
                *plate = i8::from(y >= height - b.radius) - i8::from(y <= b.radius);
            }
        }
    }

    /// Releases all grains from the plates.
    pub fn release_plates(&mut self) {
        self.plate.fill(0);
    }

    /// Grains carried by plates.
    pub fn carried(&self) -> usize {
        self.plate.iter().filter(|p| **p != 0).count()
    }

    /// Linear momentum and spin plus orbital angular momentum of the unwrapped grains.
    pub fn momenta(&self) -> [f64; 3] {
        let mut p = [0.0; 3];
        for b in &self.bodies {
            let (px, py) = (b.vx / b.inverse_mass, b.vy / b.inverse_mass);
            p[0] += px;
            p[1] += py;
            p[2] += b.x * py - b.y * px + b.omega / b.inverse_inertia;
        }
        p
    }

    /// Rules.
    pub fn rules_mut(&mut self) -> &mut Rules {
        &mut self.rules
    }

    /// Adds a velocity along the flow to all grains [µm/s].
    pub fn boost(&mut self, velocity: f64) {
        self.bodies.iter_mut().for_each(|b| b.vx += velocity);
    }

    /// Adds a velocity along the gradient to all grains [µm/s].
    pub fn lift(&mut self, velocity: f64) {
        self.bodies.iter_mut().for_each(|b| b.vy += velocity);
    }

    /// Subtracts the mean velocity, unweighted.
    pub fn remove_drift(&mut self) {
        let n = self.len() as f64;
        let mean = self.bodies.iter().fold([0.0; 2], |m, b| [m[0] + b.vx / n, m[1] + b.vy / n]);
        for b in &mut self.bodies {
            b.vx -= mean[0];
            b.vy -= mean[1];
        }
    }

    /// Elastic energy of contacts and links, central and tangential [µm² mg s⁻²/m].
    pub fn elastic_energy(&self) -> f64 {
        let m = &self.model;
        let [fc, _, ft, _] = m.permanent_factors();
        let mut sum = 0.0;
        for (k, p) in self.pairs.iter().enumerate() {
            if self.kind[k] == ContactKind::Apart {
                continue;
            }
            let s = self.separation(p);
            let d = (s[0] * s[0] + s[1] * s[1]).sqrt();
            let touch = self.bodies[p.i as usize].radius + self.bodies[p.j as usize].radius;
            let tangential = 0.5 * m.tangential_spring * self.spring[k] * self.spring[k];
            sum += if self.kind[k] == ContactKind::Permanent {
                let rest = self.rest[k];
                let central =
                    if d > rest { m.tension.energy(d, rest, m.spring) } else { m.law.energy(d, rest, m.spring) };
                central * fc + tangential * ft
            } else {
                m.law.energy(d, touch, m.spring) + tangential
            };
        }
        sum
    }
}
