//! The shear stress of every particle and its tangent, linearised about a given motion.
//!
//! The implicit shear solve is one Newton step (or several) on backward Euler: the stress is that of the strain carried
//! through `f = I + dt G` and relaxed by the flow of the step, the tangent its derivative by `dt G`. For the first step `G`
//! is the particle's own affine matrix, the motion of the last step, so that steady flow is balanced by any tangent.
//!
//! What is scattered is the stress carried back to no motion, `τ − dt L[G]`; the grid adds `dt L` of its own motion. An elastic
//! liquid is then exactly backward Euler. (Scattering `τ` and adding `dt L` of the change since the last step looks the same,
//! but the grid has lost the finest motions that the affine matrices still hold, and stiff elastic waves grow from the gap.)
//!
//! With the Kirchhoff stress `τ = μ λ̃ D`, `D = dev b̄*`, `β = tr b̄*/d`, the symmetrised tangent is (spec 6.6)
//! `L[G] = ι dev sym G + γ (G D − (2/d)(tr G D + (G:D) I)) + δ D (D:G)`,
//! with `ι = 2μβλ̃`, `γ = μλ̃`, `δ = μ(2μ̂ λ̃_s/‖D‖ + (2μ/d) λ̃_μ̂)`; its positive part (6.7) has `γ = 0` and
//! `δ = 2μβ(λ_s − λ̃)/‖D‖²`. A Newtonian viscosity adds `2η/dt` to `ι`.
//!
//! Source: Fei et al. 2019, supplemental S106–S119, corrected (docs/errata.md).

use crate::LiquidError;
use crate::arrays;
use crate::grid::LiquidGrid;
use crate::material::LiquidMaterial;
use crate::particles::{Particles, TORN};
use crate::settings::Tangent;
use constitutive::liquid_law::elastic_trial;
use constitutive::tearing::torn_step_with;
use constitutive::wide;
use numerics::lanes::{F4, Lane, LaneKernel, dispatch};
use numerics::tensor::{Tensor, Vector, deviator, double_contraction, inverse, symmetric_part, trace};
use rayon::prelude::*;

/// Tangent of the shear stress of one material point, per volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointTangent<const D: usize> {
    /// Elastic deviator `D`: its independent entries, diagonal first (11, 22, 12 in the plane; 11, 22, 33, 12, 13, 23 in space).
    pub deviator: [f64; 6],
    /// Coefficient ι of `dev sym G` [Pa].
    pub isotropic: f64,
    /// Coefficient γ of the geometric part [Pa].
    pub geometric: f64,
    /// Coefficient δ of `D (D:G)` [Pa].
    pub dyadic: f64,
    /// Coefficient ι that there would be if nothing flowed, `2μβ` (a viscosity's own): bounds every change of stress [Pa].
    pub elastic: f64,
}

impl<const D: usize> PointTangent<D> {
    /// No resistance.
    #[must_use]
    pub fn zero() -> Self {
        Self { deviator: [0.0; 6], isotropic: 0.0, geometric: 0.0, dyadic: 0.0, elastic: 0.0 }
    }

    /// `L[G]`: change of the Kirchhoff stress by a small displacement gradient.
    #[inline(always)]
    #[must_use]
    pub fn apply(&self, g: &Tensor<D>) -> Tensor<D> {
        let two_over_d = 2.0 / D as f64;
        let d = &Tensor::<D>::from_fn(|i, j| self.deviator[symmetric_index::<D>(i, j)]);
        let along = double_contraction(d, g);
        let tr = trace(g);
        let mut out = symmetric_part(g) * self.isotropic
            + (g * d) * self.geometric
            + d * (self.dyadic * along - self.geometric * two_over_d * tr);
        let pressure = self.isotropic * tr / D as f64 + self.geometric * two_over_d * along;
        for i in 0..D {
            out[(i, i)] -= pressure;
        }
        out
    }

    /// Entry `L[e_α ⊗ e_β]_{αβ}`: what the diagonal of the operator needs.
    #[inline(always)]
    #[must_use]
    pub fn diagonal(&self, alpha: usize, beta: usize) -> f64 {
        let d = |i: usize, j: usize| self.deviator[symmetric_index::<D>(i, j)];
        let equal = if alpha == beta { 1.0 } else { 0.0 };
        self.isotropic * (0.5 * (1.0 + equal) - equal / D as f64)
            + self.geometric * (d(beta, beta) - equal * 4.0 / D as f64 * d(alpha, alpha))
            + self.dyadic * d(alpha, beta) * d(alpha, beta)
    }
}

/// Place of the entry `(i, j)` among the independent ones of a symmetric matrix: diagonal first, then 12 (13, 23).
#[inline(always)]
#[must_use]
pub const fn symmetric_index<const D: usize>(i: usize, j: usize) -> usize {
    if i == j {
        i
    } else if D == 2 {
        2
    } else {
        i + j + 2
    }
}

/// The independent entries of a symmetric matrix.
#[inline(always)]
fn independent<const D: usize>(a: &Tensor<D>) -> [f64; 6] {
    let mut out = [0.0; 6];
    for i in 0..D {
        for j in i..D {
            out[symmetric_index::<D>(i, j)] = a[(i, j)];
        }
    }
    out
}

/// Stress and tangent of all particles for one linearisation.
#[derive(Clone, Debug, Default)]
pub struct ShearState<const D: usize> {
    /// Stress `τ f^{-T}` of each particle carried back to no motion by the tangent [Pa].
    pub stress: Vec<Tensor<D>>,
    /// Tangent of each particle.
    pub tangent: Vec<PointTangent<D>>,
    /// Whether any particle has a geometric part, so that the operator may be indefinite.
    pub may_be_indefinite: bool,
    /// Largest ratio of the elastic tangent to the density [m²/s²]: twice the square of the fastest shear wave.
    pub wave: f64,
}

/// Stress carried back to no motion, `τ f^{-T} − dt L[g]` [Pa], and tangent `L` of one particle whose velocity gradient is
/// `g` [1/s] over the step `dt` [s].
///
/// Viscous and damping stresses are linear in the motion: they appear in the tangent alone.
///
/// # Errors
/// Where the deformation is too large.
#[inline]
pub fn linearise<const D: usize>(
    material: &LiquidMaterial,
    strain: &Tensor<D>,
    volume_ratio: f64,
    torn: bool,
    g: &Tensor<D>,
    dt: f64,
    kind: Tangent,
) -> Result<(Tensor<D>, PointTangent<D>), constitutive::RheologyError> {
    let law = &material.law;
    if !law.is_shear_elastic() {
        let eta = law.newtonian_viscosity;
        return Ok((Tensor::zeros(), PointTangent { isotropic: 2.0 * eta / dt, ..PointTangent::zero() }));
    }
    let f = Tensor::<D>::identity() + g * dt;
    let trial = if torn {
        torn_step_with(law.settings.torn, strain, volume_ratio, &f)?.trial
    } else {
        elastic_trial(strain, &f)?
    };
    let relaxed = law.relax(&trial.strain, strain, dt)?;
    let mu = law.shear_modulus;
    let d = deviator(&trial.strain);
    let beta = trace(&trial.strain) / D as f64;
    let size = d.norm();
    let mu_hat = mu * beta;
    let stress = d * (mu * relaxed.radial);
    let isotropic = 2.0 * mu_hat * relaxed.radial;
    let mut tangent =
        PointTangent { deviator: independent(&d), isotropic, geometric: 0.0, dyadic: 0.0, elastic: 2.0 * mu_hat };
    if size > 1e-12 {
        match kind {
            Tangent::Symmetric => {
                tangent.geometric = mu * relaxed.radial;
                tangent.dyadic = mu
                    * (2.0 * mu_hat * relaxed.radial_by_stress / size
                        + 2.0 * mu / D as f64 * relaxed.radial_by_modulus);
            }
            Tangent::PositiveDefinite => {
                // λ_s − λ̃ = s λ̃_s
                tangent.dyadic = 2.0 * mu_hat * (mu * size) * relaxed.radial_by_stress / (size * size);
            }
            Tangent::Secant => {}
        }
    }
    // A torn particle follows another motion than f; its stress acts on the current configuration all the same.
    let back = inverse(&f).unwrap_or_else(Tensor::<D>::identity);
    let carried_back = stress * back.transpose() - tangent.apply(g) * dt;
    if material.shear_damping > 0.0 {
        let factor = 1.0 + material.shear_damping / dt;
        tangent.isotropic *= factor;
        tangent.geometric *= factor;
        tangent.dyadic *= factor;
    }
    Ok((carried_back, tangent))
}

/// [`linearise`] for one particle.
pub(crate) fn linearise_particle<const D: usize>(
    particles: &Particles<D>,
    materials: &[LiquidMaterial],
    p: usize,
    g: &Tensor<D>,
    dt: f64,
    kind: Tangent,
) -> Result<(Tensor<D>, PointTangent<D>), LiquidError> {
    let identity = Tensor::<D>::identity();
    let strain = if particles.carried.strain { &particles.elastic_strain[p] } else { &identity };
    let material = &materials[particles.material[p] as usize];
    linearise(material, strain, particles.volume_ratio[p], particles.flags[p] & TORN != 0, g, dt, kind)
        .map_err(|source| LiquidError::Deformation { id: particles.id[p], source })
}

/// Particles of a parallel task; a multiple of four, so that groups of four do not depend on the tasks.
const CHUNK: usize = 1024;

/// What [`linearise`] takes, for the particles of one task.
struct Task<'a, const D: usize> {
    particles: &'a Particles<D>,
    materials: &'a [LiquidMaterial],
    gradients: &'a [Tensor<D>],
    dt: f64,
    kind: Tangent,
    /// First particle of the task.
    start: usize,
    stress: &'a mut [Tensor<D>],
    tangent: &'a mut [PointTangent<D>],
    /// Largest tangent over density so far.
    wave: f64,
}

impl<const D: usize> Task<'_, D> {
    /// One particle by itself.
    fn alone(&mut self, k: usize) -> Result<(), LiquidError> {
        let (p, particles) = (self.start + k, self.particles);
        let (stress, tangent) =
            linearise_particle(particles, self.materials, p, &self.gradients[p], self.dt, self.kind)?;
        self.stress[k] = stress;
        self.tangent[k] = tangent;
        let material = &self.materials[particles.material[p] as usize];
        if material.law.is_shear_elastic() {
            // damping acts on velocities only, wholly inside the solve: no part of the force that the points do not see
            let damped = 1.0 + material.shear_damping / self.dt;
            self.wave = self.wave.max(tangent.isotropic / damped / material.density);
        }
        Ok(())
    }

    /// Four particles of one material side by side; returns which of them hold.
    #[inline(always)]
    fn together<L: Lane<Memory = F4>>(&mut self, k: usize, material: &LiquidMaterial, law: &wide::Law<L>) -> [bool; 4] {
        let p = self.start + k;
        let strain = wide::load::<D, L>(&wide::four(&self.particles.elastic_strain, p));
        let g = wide::load::<D, L>(&wide::four(self.gradients, p));
        let dt = L::splat(self.dt);
        let zero = L::splat(0.0);
        let f = wide::identity_plus(&g, dt);
        let trial = wide::elastic_trial(&strain, &f);
        let (d, mean) = wide::deviator(&trial.strain);
        let size = wide::contraction(&d, &d).sqrt();
        let mu = law.modulus();
        let mu_hat = mu * mean;
        let flowed = law.flow(mu * size, mu_hat);
        let two = L::splat(2.0);
        let isotropic = two * mu_hat * flowed.radial;
        // Without a direction there is only the isotropic part.
        let seen = L::select_gt(size, L::splat(1e-12), L::splat(1.0), zero);
        let safe = size.max(L::splat(1e-12));
        let (geometric, dyadic) = match self.kind {
            Tangent::Symmetric => (
                seen * mu * flowed.radial,
                seen * mu
                    * (two * mu_hat * flowed.radial_by_stress / safe
                        + two * mu * L::splat(1.0 / D as f64) * flowed.radial_by_modulus),
            ),
            // λ_s − λ̃ = s λ̃_s
            Tangent::PositiveDefinite => (zero, seen * two * mu_hat * mu * flowed.radial_by_stress / safe),
            Tangent::Secant => (zero, zero),
        };
        // τ f^{−T} − dt L[g]
        let back = wide::adjugate(&f);
        let scale = mu * flowed.radial / trial.factor;
        let mut stress = wide::product_transposed(&d, &back);
        let along = wide::contraction(&d, &g);
        let tr = wide::trace(&g);
        let turned = wide::product(&g, &d);
        let two_over_d = L::splat(2.0 / D as f64);
        let level = dyadic * along - geometric * two_over_d * tr;
        let pressure = isotropic * tr * L::splat(1.0 / D as f64) + geometric * two_over_d * along;
        for i in 0..D {
            for j in 0..D {
                let mut l =
                    (g[i][j] + g[j][i]) * L::splat(0.5) * isotropic + turned[i][j] * geometric + d[i][j] * level;
                if i == j {
                    l -= pressure;
                }
                stress[i][j] = stress[i][j] * scale - l * dt;
            }
        }
        let damped = L::splat(if material.shear_damping > 0.0 { 1.0 + material.shear_damping / self.dt } else { 1.0 });
        let mut out = [Tensor::<D>::zeros(); 4];
        wide::store(&stress, &mut out);
        self.stress[k..k + 4].copy_from_slice(&out);
        wide::store(&d, &mut out);
        let undamped = wide::parts(isotropic);
        let (isotropic, geometric, dyadic) =
            (wide::parts(isotropic * damped), wide::parts(geometric * damped), wide::parts(dyadic * damped));
        let elastic = wide::parts(two * mu_hat);
        for i in 0..4 {
            self.wave = self.wave.max(undamped[i] / material.density);
            self.tangent[k + i] = PointTangent {
                deviator: independent(&out[i]),
                isotropic: isotropic[i],
                geometric: geometric[i],
                dyadic: dyadic[i],
                elastic: elastic[i],
            };
        }
        let sound = wide::parts(trial.sound);
        [sound[0] == 1.0, sound[1] == 1.0, sound[2] == 1.0, sound[3] == 1.0]
    }
}

impl<const D: usize> LaneKernel for Task<'_, D> {
    type Output = Result<f64, LiquidError>;
    #[inline(always)]
    fn run<L: Lane<Memory = F4>>(mut self) -> Result<f64, LiquidError> {
        let n = self.stress.len();
        let particles = self.particles;
        // The law of the last group, in lanes.
        let mut known: Option<(u16, wide::Law<L>)> = None;
        let mut k = 0;
        while k + 4 <= n {
            let p = self.start + k;
            let m = particles.material[p];
            let material = &self.materials[m as usize];
            let alike = particles.carried.strain
                && particles.material[p..p + 4].iter().all(|&other| other == m)
                && particles.flags[p..p + 4].iter().all(|f| f & TORN == 0)
                && wide::covers(&material.law);
            let mut sound = [false; 4];
            if alike {
                let law = match known {
                    Some((of, law)) if of == m => law,
                    _ => known.insert((m, wide::Law::new(&material.law, self.dt))).1,
                };
                sound = self.together(k, material, &law);
            }
            for i in 0..4 {
                if !sound[i] {
                    self.alone(k + i)?;
                }
            }
            k += 4;
        }
        (k..n).try_for_each(|k| self.alone(k))?;
        Ok(self.wave)
    }
}

impl<const D: usize> ShearState<D> {
    /// Linearises all particles about the velocity gradients `gradients` (usually the affine matrices) [1/s].
    ///
    /// # Errors
    /// Where a particle deforms too much in one step.
    pub fn build(
        &mut self,
        particles: &Particles<D>,
        materials: &[LiquidMaterial],
        gradients: &[Tensor<D>],
        dt: f64,
        kind: Tangent,
    ) -> Result<(), LiquidError> {
        let n = particles.len();
        arrays::resize(&mut self.stress, n, Tensor::zeros());
        arrays::resize(&mut self.tangent, n, PointTangent::zero());
        self.wave = self
            .stress
            .par_chunks_mut(CHUNK)
            .zip(self.tangent.par_chunks_mut(CHUNK))
            .enumerate()
            .map(|(chunk, (stress, tangent))| {
                let start = chunk * CHUNK;
                dispatch(Task { particles, materials, gradients, dt, kind, start, stress, tangent, wave: 0.0 })
            })
            .reduce(|| Ok(0.0), |a, b| Ok(f64::max(a?, b?)))?;
        self.may_be_indefinite = kind == Tangent::Symmetric && materials.iter().any(|m| m.law.is_shear_elastic());
        Ok(())
    }

    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.stress.capacity() * size_of::<Tensor<D>>() + self.tangent.capacity() * size_of::<PointTangent<D>>()
    }
}

/// Velocity gradients at the particles of face velocities `velocity` [1/s].
pub fn velocity_gradients<const D: usize>(
    particles: &Particles<D>,
    grid: &LiquidGrid<D>,
    velocity: [&[f64]; D],
    values: &mut Vec<Vector<D>>,
    gradients: &mut Vec<Tensor<D>>,
) {
    arrays::resize(values, particles.len(), Vector::zeros());
    arrays::resize(gradients, particles.len(), Tensor::zeros());
    particle_grid::gather(
        &grid.blocks,
        &grid.order,
        &particles.position,
        velocity,
        LiquidGrid::<D>::offsets(),
        values,
        gradients,
    );
}
