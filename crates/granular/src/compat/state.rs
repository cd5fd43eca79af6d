//! State of the directed-contact sample.

use crate::cell::Cell;
use crate::grains::Grains;
use crate::model::{ContactKind, ContactModel};
use crate::random::Random;
use serde::{Deserialize, Serialize};

/// Entry `i → other` of the contact list of grain `i`; the reverse entry is separate and carries its own spring.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DirectedContact {
    /// Partner.
    pub other: u32,
    /// Stick, slip or permanent.
    pub kind: ContactKind,
    /// Tangential displacement [µm].
    pub spring: f64,
    /// Rest distance of a permanent link [µm], zero for transient contacts.
    pub rest: f64,
}

/// Grains with directed contact lists.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct DirectedSample {
    /// The grains.
    pub grains: Grains,
    /// Contact list of each grain in the order of creation; it fixes the order of summation.
    pub contacts: Vec<Vec<DirectedContact>>,
    /// The box.
    pub cell: Cell,
    /// Contact laws.
    pub model: ContactModel,
    /// Plates on: grains that touch the lower and upper edge are carried.
    pub applying_shear: bool,
    /// Time [s].
    pub time: f64,
    /// Net force on each grain [µm mg s⁻²/m]; that of carried grains piles up unless zeroed.
    pub fx: Vec<f64>,
    /// See [`Self::fx`].
    pub fy: Vec<f64>,
    /// Net torque [µm² mg s⁻²/m].
    pub torque: Vec<f64>,
    /// Directions for coincident centres.
    pub random: Random,
    pub(super) candidates: Candidates,
    #[serde(skip)]
    pub(super) scratch: Scratch,
}

/// Lists of possible partners, valid while nobody moved further than the skin.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Candidates {
    pub offsets: Vec<u32>,
    pub partners: Vec<u32>,
    /// Peculiar displacement of each grain since the build [µm].
    pub moved: Vec<[f64; 2]>,
    pub strain: f64,
    pub skin: f64,
    pub valid: bool,
}

/// Values of one directed contact of the current step.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Visit {
    pub i: u32,
    pub other: u32,
    pub slot: u32,
    pub n: [f64; 2],
    /// Position of the partner's image minus own position.
    pub separation: [f64; 2],
    pub d: f64,
    pub relative: [f64; 2],
    pub central: f64,
    pub tangential: f64,
    pub wrapped: bool,
}

#[derive(Debug, Clone, Default)]
pub(super) struct Scratch {
    pub visits: Vec<Visit>,
}

impl DirectedSample {
    /// Creates a sample without contacts.
    pub fn new(grains: Grains, cell: Cell, model: ContactModel, seed: u64) -> Self {
        let n = grains.len();
        Self {
            contacts: vec![Vec::new(); n],
            cell,
            model,
            applying_shear: false,
            time: 0.0,
            fx: vec![0.0; n],
            fy: vec![0.0; n],
            torque: vec![0.0; n],
            random: Random::new(seed ^ 0x5EED_C01C_1DE0_0001),
            candidates: Candidates::default(),
            scratch: Scratch::default(),
            grains,
        }
    }

    /// True if the grain may move: plates off, or clear of both plate lines.
    #[inline(always)]
    pub fn movable(&self, i: usize) -> bool {
        let (y, r) = (self.grains.y[i], self.grains.radius[i]);
        !self.applying_shear || (y > r && y < self.cell.height - r)
    }

    /// Turns every listed contact into a permanent link at touching distance.
    pub fn link_all(&mut self) {
        for i in 0..self.grains.len() {
            for k in 0..self.contacts[i].len() {
                let j = self.contacts[i][k].other as usize;
                self.set_permanent(i, j);
                self.set_permanent(j, i);
            }
        }
    }

    /// Makes the entry `i → j` permanent, adding it where absent.
    fn set_permanent(&mut self, i: usize, j: usize) {
        let rest = self.grains.radius[i] + self.grains.radius[j];
        let entry = DirectedContact { other: j as u32, kind: ContactKind::Permanent, spring: 0.0, rest };
        match self.contacts[i].iter_mut().find(|c| c.other as usize == j) {
            Some(c) => *c = entry,
            None => self.contacts[i].push(entry),
        }
    }

    /// Links two grains permanently at touching distance, in both directions.
    pub fn link(&mut self, i: usize, j: usize) {
        self.set_permanent(i, j);
        self.set_permanent(j, i);
    }

    /// Cuts the permanent link between two grains; the entries become slipping contacts.
    pub fn cut(&mut self, i: usize, j: usize) {
        for (a, b) in [(i, j), (j, i)] {
            for c in &mut self.contacts[a] {
                if c.other as usize == b {
                    c.kind = ContactKind::Slip;
                    c.spring = 0.0;
                    c.rest = 0.0;
                }
            }
        }
    }

    /// Longest permanent link along either axis over half of the box [-]; at 1 its nearest image becomes ambiguous (fault F15).
    pub fn longest_link(&self) -> f64 {
        let g = &self.grains;
        self.links().into_iter().fold(0.0, |most: f64, [i, j]| {
            let ([dx, dy], ..) = self.cell.nearest(g.x[j] - g.x[i], g.y[j] - g.y[i]);
            most.max(2.0 * dx.abs() / self.cell.width).max(2.0 * dy.abs() / self.cell.height)
        })
    }

    /// Permanent links, each once with `first < second`, in list order.
    pub fn links(&self) -> Vec<[usize; 2]> {
        let mut links = Vec::new();
        for (i, list) in self.contacts.iter().enumerate() {
            for c in list {
                if c.kind == ContactKind::Permanent && i < c.other as usize {
                    links.push([i, c.other as usize]);
                }
            }
        }
        links
    }
}
