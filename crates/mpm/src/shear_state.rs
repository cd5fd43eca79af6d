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
use crate::grid::LiquidGrid;
use crate::material::LiquidMaterial;
use crate::particles::{Particles, TORN};
use crate::settings::Tangent;
use constitutive::liquid_law::elastic_trial;
use constitutive::tearing::torn_step_with;
use numerics::tensor::{Tensor, Vector, deviator, double_contraction, inverse, symmetric_part, trace};
use rayon::prelude::*;

/// Tangent of the shear stress of one material point, per volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointTangent<const D: usize> {
    /// Elastic deviator `D`.
    pub deviator: Tensor<D>,
    /// Coefficient ι of `dev sym G` [Pa].
    pub isotropic: f64,
    /// Coefficient γ of the geometric part [Pa].
    pub geometric: f64,
    /// Coefficient δ of `D (D:G)` [Pa].
    pub dyadic: f64,
}

impl<const D: usize> PointTangent<D> {
    /// No resistance.
    #[must_use]
    pub fn zero() -> Self {
        Self { deviator: Tensor::zeros(), isotropic: 0.0, geometric: 0.0, dyadic: 0.0 }
    }

    /// `L[G]`: change of the Kirchhoff stress by a small displacement gradient.
    #[inline(always)]
    #[must_use]
    pub fn apply(&self, g: &Tensor<D>) -> Tensor<D> {
        let two_over_d = 2.0 / D as f64;
        let d = &self.deviator;
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
        let d = &self.deviator;
        let equal = if alpha == beta { 1.0 } else { 0.0 };
        self.isotropic * (0.5 * (1.0 + equal) - equal / D as f64)
            + self.geometric * (d[(beta, beta)] - equal * 4.0 / D as f64 * d[(alpha, alpha)])
            + self.dyadic * d[(alpha, beta)] * d[(alpha, beta)]
    }
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
    let mut tangent = PointTangent { deviator: d, isotropic, geometric: 0.0, dyadic: 0.0 };
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
        self.stress.resize(n, Tensor::zeros());
        self.tangent.resize(n, PointTangent::zero());
        let identity = Tensor::<D>::identity();
        self.stress
            .par_iter_mut()
            .zip(self.tangent.par_iter_mut())
            .enumerate()
            .with_min_len(1024)
            .map(|(p, (stress, tangent))| {
                let material = &materials[particles.material[p] as usize];
                let strain = if particles.carried.strain { &particles.elastic_strain[p] } else { &identity };
                let torn = particles.flags[p] & TORN != 0;
                let (s, t) = linearise(material, strain, particles.volume_ratio[p], torn, &gradients[p], dt, kind)
                    .map_err(|source| LiquidError::Deformation { id: particles.id[p], source })?;
                *stress = s;
                *tangent = t;
                Ok::<(), LiquidError>(())
            })
            .reduce(|| Ok(()), Result::and)?;
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
    values.resize(particles.len(), Vector::zeros());
    gradients.resize(particles.len(), Tensor::zeros());
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
