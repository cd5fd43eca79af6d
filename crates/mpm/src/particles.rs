//! The liquid as particles: contiguous arrays, one entry per particle.

use crate::LiquidError;
use crate::material::{Carried, LiquidMaterial};
use numerics::reduce::compensated_sum;
use numerics::tensor::{Tensor, Vector, determinant, moment, wedge};
use particle_grid::{Lattice, ParticleOrder, permute};
use serde::{Deserialize, Serialize};

/// Particle is torn: its shear strain may fall, not grow, and it bears no tension.
pub const TORN: u8 = 1;
/// Particle flowed in the last step.
pub const YIELDED: u8 = 2;

/// All particles of a liquid. Arrays that no material of the scene needs are empty.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Particles<const D: usize> {
    /// Positions [m].
    pub position: Vec<Vector<D>>,
    /// Velocities [m/s].
    pub velocity: Vec<Vector<D>>,
    /// Affine matrices, row `α` the gradient of velocity component `α` [1/s].
    pub affine: Vec<Tensor<D>>,
    /// Masses [kg] (per metre of depth in 2-D).
    pub mass: Vec<f64>,
    /// Volumes at rest [m³] (m² in 2-D).
    pub rest_volume: Vec<f64>,
    /// Volume over rest volume [1].
    pub volume_ratio: Vec<f64>,
    /// Isochoric elastic left Cauchy–Green tensors, determinant 1 [1]; empty unless a liquid is shear-elastic.
    pub elastic_strain: Vec<Tensor<D>>,
    /// Deformation gradients since birth, the plastic history [1]; empty unless a liquid can tear.
    pub deformation_gradient: Vec<Tensor<D>>,
    /// Index of the material.
    pub material: Vec<u16>,
    /// [`TORN`], [`YIELDED`].
    pub flags: Vec<u8>,
    /// Stable identities, unique over a run.
    pub id: Vec<u64>,
    /// Identity of the next particle to be added.
    pub next_id: u64,
    /// Which of the optional arrays are in use.
    pub carried: Carried,
}

/// One particle on its way into or out of the arrays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Particle<const D: usize> {
    /// Position [m].
    pub position: Vector<D>,
    /// Velocity [m/s].
    pub velocity: Vector<D>,
    /// Affine matrix [1/s].
    pub affine: Tensor<D>,
    /// Mass [kg].
    pub mass: f64,
    /// Rest volume [m³].
    pub rest_volume: f64,
    /// Volume ratio [1].
    pub volume_ratio: f64,
    /// Elastic strain [1].
    pub elastic_strain: Tensor<D>,
    /// Deformation gradient [1].
    pub deformation_gradient: Tensor<D>,
    /// Index of the material.
    pub material: u16,
    /// Flags.
    pub flags: u8,
    /// Stable identity.
    pub id: u64,
}

impl<const D: usize> Particle<D> {
    /// A relaxed particle at rest.
    #[must_use]
    pub fn new(position: Vector<D>, rest_volume: f64, material: u16, density: f64) -> Self {
        Self {
            position,
            velocity: Vector::zeros(),
            affine: Tensor::zeros(),
            mass: density * rest_volume,
            rest_volume,
            volume_ratio: 1.0,
            elastic_strain: Tensor::identity(),
            deformation_gradient: Tensor::identity(),
            material,
            flags: 0,
            id: 0,
        }
    }
}

/// Sums over all particles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Totals<const D: usize> {
    /// Mass [kg].
    pub mass: f64,
    /// Volume at rest [m³].
    pub rest_volume: f64,
    /// Volume now [m³].
    pub volume: f64,
    /// Linear momentum [kg m/s].
    pub momentum: Vector<D>,
    /// Angular momentum about the origin, affine part included [kg m²/s]; `(z)` in 2-D.
    pub angular_momentum: [f64; 3],
    /// Kinetic energy, affine part included [J].
    pub kinetic_energy: f64,
    /// Elastic energy of volume and shear [J].
    pub elastic_energy: f64,
    /// Centre of mass [m].
    pub centre: Vector<D>,
    /// Largest speed [m/s].
    pub max_speed: f64,
}

/// Spare arrays for sorting.
#[derive(Clone, Debug, Default)]
pub struct SortScratch<const D: usize> {
    vectors: Vec<Vector<D>>,
    /// Lent to the stresses of the shear solve for the rest of the step ([`crate::shear_solve::ShearSolver::lend`]).
    pub(crate) tensors: Vec<Tensor<D>>,
    numbers: Vec<f64>,
    words: Vec<u64>,
    shorts: Vec<u16>,
    bytes: Vec<u8>,
}

impl<const D: usize> SortScratch<D> {
    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.vectors.capacity() * size_of::<Vector<D>>()
            + self.tensors.capacity() * size_of::<Tensor<D>>()
            + 8 * (self.numbers.capacity() + self.words.capacity())
            + 2 * self.shorts.capacity()
            + self.bytes.capacity()
    }
}

impl<const D: usize> Particles<D> {
    /// No particles, with the arrays that the materials need.
    #[must_use]
    pub fn new(materials: &[LiquidMaterial]) -> Self {
        Self {
            position: Vec::new(),
            velocity: Vec::new(),
            affine: Vec::new(),
            mass: Vec::new(),
            rest_volume: Vec::new(),
            volume_ratio: Vec::new(),
            elastic_strain: Vec::new(),
            deformation_gradient: Vec::new(),
            material: Vec::new(),
            flags: Vec::new(),
            id: Vec::new(),
            next_id: 0,
            carried: Carried::by(materials),
        }
    }

    /// Number of particles.
    #[must_use]
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// Adds a particle under a new identity (the one in `p` is ignored).
    ///
    /// Arrays grow by an eighth at a time: a liquid holds hundreds of bytes a particle, and doubling would keep twice that.
    pub fn push(&mut self, p: Particle<D>) {
        if self.position.len() == self.position.capacity() {
            self.reserve(self.len() / 8 + 64);
        }
        self.position.push(p.position);
        self.velocity.push(p.velocity);
        self.affine.push(p.affine);
        self.mass.push(p.mass);
        self.rest_volume.push(p.rest_volume);
        self.volume_ratio.push(p.volume_ratio);
        if self.carried.strain {
            self.elastic_strain.push(p.elastic_strain);
        }
        if self.carried.history {
            self.deformation_gradient.push(p.deformation_gradient);
        }
        self.material.push(p.material);
        self.flags.push(p.flags);
        self.id.push(self.next_id);
        self.next_id += 1;
    }

    /// Makes room for more particles, and no more than that.
    fn reserve(&mut self, more: usize) {
        self.position.reserve_exact(more);
        self.velocity.reserve_exact(more);
        self.affine.reserve_exact(more);
        self.mass.reserve_exact(more);
        self.rest_volume.reserve_exact(more);
        self.volume_ratio.reserve_exact(more);
        if self.carried.strain {
            self.elastic_strain.reserve_exact(more);
        }
        if self.carried.history {
            self.deformation_gradient.reserve_exact(more);
        }
        self.material.reserve_exact(more);
        self.flags.reserve_exact(more);
        self.id.reserve_exact(more);
    }

    /// A copy of one particle.
    #[must_use]
    pub fn get(&self, i: usize) -> Particle<D> {
        Particle {
            position: self.position[i],
            velocity: self.velocity[i],
            affine: self.affine[i],
            mass: self.mass[i],
            rest_volume: self.rest_volume[i],
            volume_ratio: self.volume_ratio[i],
            elastic_strain: if self.carried.strain { self.elastic_strain[i] } else { Tensor::identity() },
            deformation_gradient: if self.carried.history { self.deformation_gradient[i] } else { Tensor::identity() },
            material: self.material[i],
            flags: self.flags[i],
            id: self.id[i],
        }
    }

    /// Overwrites one particle.
    pub fn set(&mut self, i: usize, p: &Particle<D>) {
        self.position[i] = p.position;
        self.velocity[i] = p.velocity;
        self.affine[i] = p.affine;
        self.mass[i] = p.mass;
        self.rest_volume[i] = p.rest_volume;
        self.volume_ratio[i] = p.volume_ratio;
        if self.carried.strain {
            self.elastic_strain[i] = p.elastic_strain;
        }
        if self.carried.history {
            self.deformation_gradient[i] = p.deformation_gradient;
        }
        self.material[i] = p.material;
        self.flags[i] = p.flags;
        self.id[i] = p.id;
    }

    /// Keeps the particles for which `keep` holds, in their order.
    pub fn retain(&mut self, keep: impl Fn(usize) -> bool) {
        fn filter<T: Copy>(array: &mut Vec<T>, keep: &impl Fn(usize) -> bool) {
            let mut next = 0;
            for i in 0..array.len() {
                if keep(i) {
                    array[next] = array[i];
                    next += 1;
                }
            }
            array.truncate(next);
        }
        filter(&mut self.position, &keep);
        filter(&mut self.velocity, &keep);
        filter(&mut self.affine, &keep);
        filter(&mut self.mass, &keep);
        filter(&mut self.rest_volume, &keep);
        filter(&mut self.volume_ratio, &keep);
        filter(&mut self.elastic_strain, &keep);
        filter(&mut self.deformation_gradient, &keep);
        filter(&mut self.material, &keep);
        filter(&mut self.flags, &keep);
        filter(&mut self.id, &keep);
    }

    /// Sorts the particles by block and cell of the lattice; `order` then describes them.
    ///
    /// # Errors
    /// Where a position is not finite, outside a period, or too far away.
    pub fn sort(
        &mut self,
        lattice: &Lattice<D>,
        order: &mut ParticleOrder<D>,
        scratch: &mut SortScratch<D>,
    ) -> Result<(), LiquidError> {
        order.build(lattice, &self.position)?;
        if order.is_sorted() {
            return Ok(());
        }
        let index = order.index();
        permute(&mut self.position, index, &mut scratch.vectors);
        permute(&mut self.velocity, index, &mut scratch.vectors);
        permute(&mut self.affine, index, &mut scratch.tensors);
        permute(&mut self.mass, index, &mut scratch.numbers);
        permute(&mut self.rest_volume, index, &mut scratch.numbers);
        permute(&mut self.volume_ratio, index, &mut scratch.numbers);
        if self.carried.strain {
            permute(&mut self.elastic_strain, index, &mut scratch.tensors);
        }
        if self.carried.history {
            permute(&mut self.deformation_gradient, index, &mut scratch.tensors);
        }
        permute(&mut self.material, index, &mut scratch.shorts);
        permute(&mut self.flags, index, &mut scratch.bytes);
        permute(&mut self.id, index, &mut scratch.words);
        Ok(())
    }

    /// Volume of one particle now [m³].
    #[inline(always)]
    #[must_use]
    pub fn volume(&self, i: usize) -> f64 {
        self.rest_volume[i] * self.volume_ratio[i]
    }

    /// Norm of the shear stress of each particle [Pa]: for outputs.
    pub fn shear_stress_norm<'a>(&'a self, materials: &'a [LiquidMaterial]) -> impl Iterator<Item = f64> + 'a {
        (0..self.len()).map(move |i| {
            if !self.carried.strain {
                return 0.0;
            }
            materials.get(self.material[i] as usize).map_or(0.0, |m| m.law.shear_stress_norm(&self.elastic_strain[i]))
        })
    }

    /// Sums over all particles, compensated and in storage order.
    #[must_use]
    pub fn totals(&self, materials: &[LiquidMaterial], dx: f64) -> Totals<D> {
        let n = self.len();
        let inertia = 0.25 * dx * dx;
        let mass = compensated_sum(self.mass.iter().copied());
        let momentum = Vector::from_fn(|a, _| compensated_sum((0..n).map(|i| self.mass[i] * self.velocity[i][a])));
        let mut angular_momentum = [0.0; 3];
        for (k, l) in angular_momentum.iter_mut().enumerate() {
            *l = compensated_sum((0..n).map(|i| {
                self.mass[i] * (wedge(&self.position[i], &self.velocity[i])[k] + moment(&(self.affine[i] * inertia))[k])
            }));
        }
        let kinetic_energy =
            compensated_sum((0..n).map(|i| {
                0.5 * self.mass[i] * (self.velocity[i].norm_squared() + inertia * self.affine[i].norm_squared())
            }));
        let elastic_energy = compensated_sum((0..n).map(|i| {
            let Some(m) = materials.get(self.material[i] as usize) else { return 0.0 };
            let shear = if self.carried.strain && m.law.is_shear_elastic() {
                0.5 * m.law.shear_modulus * (self.elastic_strain[i].trace() - D as f64)
            } else {
                0.0
            };
            let volume = if m.rigid_volume { 0.0 } else { m.law.volume.energy(self.volume_ratio[i]) };
            self.rest_volume[i] * (shear + volume)
        }));
        let centre = if mass > 0.0 {
            Vector::from_fn(|a, _| compensated_sum((0..n).map(|i| self.mass[i] * self.position[i][a])) / mass)
        } else {
            Vector::zeros()
        };
        Totals {
            mass,
            rest_volume: compensated_sum(self.rest_volume.iter().copied()),
            volume: compensated_sum((0..n).map(|i| self.volume(i))),
            momentum,
            angular_momentum,
            kinetic_energy,
            elastic_energy,
            centre,
            max_speed: self.velocity.iter().fold(0.0f64, |m, v| m.max(v.norm_squared())).sqrt(),
        }
    }

    /// Checks the invariants: equal lengths, finite numbers, positive masses and volumes, `det b̄ = 1 ± 1e-8`.
    ///
    /// # Errors
    /// Names the first violation.
    pub fn check(&self) -> Result<(), LiquidError> {
        let n = self.len();
        let lengths = [
            ("velocity", self.velocity.len(), n),
            ("affine", self.affine.len(), n),
            ("mass", self.mass.len(), n),
            ("rest_volume", self.rest_volume.len(), n),
            ("volume_ratio", self.volume_ratio.len(), n),
            ("elastic_strain", self.elastic_strain.len(), if self.carried.strain { n } else { 0 }),
            ("deformation_gradient", self.deformation_gradient.len(), if self.carried.history { n } else { 0 }),
            ("material", self.material.len(), n),
            ("flags", self.flags.len(), n),
            ("id", self.id.len(), n),
        ];
        if let Some((name, len, wanted)) = lengths.iter().find(|(_, len, wanted)| len != wanted) {
            return Err(LiquidError::State(format!("{name} has {len} entries instead of {wanted}")));
        }
        for i in 0..n {
            let finite = self.position[i].iter().chain(&self.velocity[i]).chain(&self.affine[i]).all(|x| x.is_finite());
            if !finite {
                return Err(LiquidError::State(format!("particle {} is not finite", self.id[i])));
            }
            let positive = |x: f64| x > 0.0 && x.is_finite();
            if !(positive(self.mass[i]) && positive(self.rest_volume[i]) && positive(self.volume_ratio[i])) {
                return Err(LiquidError::State(format!(
                    "particle {}: mass {}, rest volume {}, volume ratio {}",
                    self.id[i], self.mass[i], self.rest_volume[i], self.volume_ratio[i]
                )));
            }
            if self.carried.strain {
                let b = &self.elastic_strain[i];
                let det = determinant(b);
                // Cancellation in the determinant grows with the cube of the largest entry.
                let scale = b.amax().max(1.0).powi(D as i32);
                if (det - 1.0).abs().is_nan() || (det - 1.0).abs() > 1e-8 * scale {
                    return Err(LiquidError::State(format!(
                        "particle {}: elastic strain of determinant {det}",
                        self.id[i]
                    )));
                }
            }
        }
        Ok(())
    }

    /// Bytes held by the arrays.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let vectors = self.position.capacity() + self.velocity.capacity();
        let tensors = self.affine.capacity() + self.elastic_strain.capacity() + self.deformation_gradient.capacity();
        vectors * size_of::<Vector<D>>()
            + tensors * size_of::<Tensor<D>>()
            + 8 * (self.mass.capacity()
                + self.rest_volume.capacity()
                + self.volume_ratio.capacity()
                + self.id.capacity())
            + 2 * self.material.capacity()
            + self.flags.capacity()
    }
}
