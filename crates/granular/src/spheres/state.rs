//! State of the sphere sample.

use crate::cell::Cell;
use crate::error::{GranularError, require};
use crate::model::{ContactKind, ContactModel, ModelSettings};
use crate::physical::Rules;
use crate::random::Random;
use serde::{Deserialize, Serialize};

/// One sphere.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[repr(C, align(64))]
pub struct Ball {
    /// Position [µm].
    pub position: [f64; 3],
    /// Velocity [µm/s].
    pub velocity: [f64; 3],
    /// Angular velocity [rad/s].
    pub omega: [f64; 3],
    /// Radius [µm].
    pub radius: f64,
    /// One over mass [1/mg].
    pub inverse_mass: f64,
    /// One over moment of inertia [1/(mg µm²)].
    pub inverse_inertia: f64,
}

/// Two spheres close enough to touch soon, `i < j`, with the image of `j` that `i` sees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SpherePair {
    /// First sphere.
    pub i: u32,
    /// Second sphere.
    pub j: u32,
    /// Whole widths, heights (each with the shift of the sheared rows) and depths added to the second position.
    pub image: [i32; 3],
    /// Kind of contact.
    pub kind: ContactKind,
    /// Tangential spring [µm], in the contact plane.
    pub spring: [f64; 3],
    /// Rest distance of a permanent link [µm].
    pub rest: f64,
}

/// Spheres with undirected contacts in a Lees–Edwards or periodic box.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SphereSample {
    pub(crate) balls: Vec<Ball>,
    pub(crate) cell: Cell,
    /// Depth of the box along the vorticity [µm].
    pub(crate) depth: f64,
    pub(crate) model: ContactModel,
    pub(crate) rules: Rules,
    pub(crate) time: f64,
    pub(crate) pairs: Vec<SpherePair>,
    pub(crate) first: Vec<u32>,
    pub(crate) gather_offsets: Vec<u32>,
    pub(crate) gather: Vec<u32>,
    pub(crate) moved: Vec<[f64; 3]>,
    pub(crate) largest_move: f64,
    pub(crate) strain_at_build: f64,
    pub(crate) skin_in_use: f64,
    pub(crate) reach: f64,
    pub(crate) valid: bool,
    pub(crate) pending_dt: f64,
    pub(crate) pending_rate_change: f64,
    pub(crate) extra_steps: u64,
    /// Full bulk stress of the last evaluated state, row-major [Pa].
    pub(crate) bulk: [f64; 9],
    #[serde(skip)]
    pub(crate) forces: Vec<[f64; 6]>,
}

impl SphereSample {
    /// Creates a sample without contacts.
    ///
    /// # Errors
    /// [`GranularError`] for non-finite or empty spheres, a box without depth, or one that is neither sheared nor periodic.
    pub fn new(
        balls: Vec<Ball>,
        cell: Cell,
        depth: f64,
        model: ContactModel,
        rules: Rules,
    ) -> Result<Self, GranularError> {
        require("depth", depth, |d| d > 0.0, "positive [µm]")?;
        if !cell.boundary.periodic_y() {
            return Err(GranularError::State("spheres need a Lees–Edwards or periodic box".into()));
        }
        for (i, b) in balls.iter().enumerate() {
            let all = b.position.iter().chain(&b.velocity).chain(&b.omega).sum::<f64>();
            if !(all.is_finite() && b.radius > 0.0 && b.inverse_mass > 0.0 && b.inverse_inertia > 0.0) {
                return Err(GranularError::NonFinite { grain: i, time: 0.0 });
            }
        }
        let n = balls.len();
        Ok(Self {
            balls,
            cell,
            depth,
            model,
            rules,
            time: 0.0,
            pairs: Vec::new(),
            first: vec![0; n + 1],
            gather_offsets: Vec::new(),
            gather: Vec::new(),
            moved: vec![[0.0; 3]; n],
            largest_move: 0.0,
            strain_at_build: 0.0,
            skin_in_use: 0.0,
            reach: 0.0,
            valid: false,
            pending_dt: 0.0,
            pending_rate_change: 0.0,
            extra_steps: 0,
            bulk: [0.0; 9],
            forces: Vec::new(),
        })
    }

    /// Number of spheres.
    pub fn len(&self) -> usize {
        self.balls.len()
    }

    /// True without spheres.
    pub fn is_empty(&self) -> bool {
        self.balls.is_empty()
    }

    /// The spheres; positions may lie a little outside the box between two rebuilds of the pair list.
    pub fn balls(&self) -> &[Ball] {
        &self.balls
    }

    /// The spheres, to be changed between steps.
    pub fn balls_mut(&mut self) -> &mut [Ball] {
        self.valid = false;
        &mut self.balls
    }

    /// Depth of the box [µm].
    pub fn depth(&self) -> f64 {
        self.depth
    }

    /// Full bulk stress tensor of the last evaluated state, row-major [Pa].
    pub fn bulk_stress(&self) -> [f64; 9] {
        self.bulk
    }

    /// Listed pairs.
    pub fn pairs(&self) -> &[SpherePair] {
        &self.pairs
    }

    /// Vector from the first sphere of a pair to the image of the second [µm].
    #[inline(always)]
    pub fn separation(&self, p: &SpherePair) -> [f64; 3] {
        let (a, b) = (&self.balls[p.i as usize].position, &self.balls[p.j as usize].position);
        let [c, r, l] = p.image.map(f64::from);
        [
            b[0] - a[0] + (c * self.cell.width + r * (self.cell.height * self.cell.strain)),
            b[1] - a[1] + r * self.cell.height,
            b[2] - a[2] + l * self.depth,
        ]
    }

    pub(crate) fn pair_index(&self, i: usize, j: usize) -> Option<usize> {
        let (a, b) = (i.min(j), i.max(j));
        let range = self.first[a] as usize..self.first[a + 1] as usize;
        let k = self.pairs[range.clone()].binary_search_by_key(&(b as u32), |p| p.j).ok()?;
        Some(range.start + k)
    }

    /// Links two listed spheres with a rest distance [µm]; false if they are not listed as a pair.
    pub fn link(&mut self, i: usize, j: usize, rest: f64) -> bool {
        self.ensure_pairs();
        let Some(k) = self.pair_index(i, j) else { return false };
        let p = &mut self.pairs[k];
        (p.kind, p.spring, p.rest) = (ContactKind::Permanent, [0.0; 3], rest);
        true
    }

    /// Links all touching pairs at touching distance.
    pub fn link_all(&mut self) {
        for p in &mut self.pairs {
            if p.kind != ContactKind::Apart {
                p.kind = ContactKind::Permanent;
                p.spring = [0.0; 3];
                p.rest = self.balls[p.i as usize].radius + self.balls[p.j as usize].radius;
            }
        }
    }

    /// Cuts a permanent link.
    pub fn cut(&mut self, i: usize, j: usize) {
        if let Some(k) = self.pair_index(i, j)
            && self.pairs[k].kind == ContactKind::Permanent
        {
            let p = &mut self.pairs[k];
            (p.kind, p.spring, p.rest) = (ContactKind::Slip, [0.0; 3], 0.0);
        }
    }

    /// Subtracts the mean velocity, unweighted.
    pub fn remove_drift(&mut self) {
        let n = self.len() as f64;
        for k in 0..3 {
            let mean = self.balls.iter().map(|b| b.velocity[k]).sum::<f64>() / n;
            self.balls.iter_mut().for_each(|b| b.velocity[k] -= mean);
        }
    }

    /// Linear momentum, and angular momentum about the origin.
    pub fn momenta(&self) -> [f64; 6] {
        let mut p = [0.0; 6];
        for b in &self.balls {
            let m = 1.0 / b.inverse_mass;
            let (x, v) = (b.position, b.velocity);
            let l = cross(x, v);
            for k in 0..3 {
                p[k] += m * v[k];
                p[3 + k] += m * l[k] + b.omega[k] / b.inverse_inertia;
            }
        }
        p
    }

    /// Kinetic energy of translation and rotation [µm² mg s⁻²].
    pub fn kinetic_energy(&self) -> f64 {
        self.balls
            .iter()
            .map(|b| {
                0.5 * dot(b.velocity, b.velocity) / b.inverse_mass + 0.5 * dot(b.omega, b.omega) / b.inverse_inertia
            })
            .sum()
    }
}

/// Scatters spheres of two sizes at random.
pub(crate) fn random_balls(settings: &ModelSettings, random: &mut Random) -> Vec<Ball> {
    let c = settings.constants();
    let n = settings.grains;
    let mut sizes: Vec<f64> = (0..n)
        .map(|i| match settings.radii {
            crate::model::Radii::ExactHalf => i < n / 2,
            crate::model::Radii::Random => random.uniform() < 0.5,
        })
        .map(|large| if large { c.large } else { c.small })
        .collect();
    random.shuffle(&mut sizes);
    let depth = settings.depth();
    let mut balls: Vec<Ball> = sizes
        .into_iter()
        .map(|radius| {
            let mass = c.mass * (radius / c.mean_radius).powi(3);
            Ball {
                position: [
                    random.uniform() * settings.width,
                    random.uniform() * settings.height,
                    random.uniform() * depth,
                ],
                velocity: [0.0; 3],
                omega: [0.0; 3],
                radius,
                inverse_mass: 1.0 / mass,
                inverse_inertia: 1.0 / (0.4 * mass * radius * radius),
            }
        })
        .collect();
    let layer = |v: f64| (v / (2.0 * c.mean_radius)) as i64;
    balls.sort_by(|a, b| {
        let key = |b: &Ball| (layer(b.position[2]), layer(b.position[1]));
        key(a).cmp(&key(b)).then(a.position[0].total_cmp(&b.position[0]))
    });
    balls
}

#[inline(always)]
pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
