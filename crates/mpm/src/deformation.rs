//! Stage 8: volume ratio, trial elastic strain and plastic history of the particles, carried through the motion of the step.

use crate::LiquidError;
use crate::material::{Carried, LiquidMaterial};
use crate::particles::{Particles, TORN};
use constitutive::liquid_law::{DETERMINANT_RANGE, elastic_trial};
use constitutive::tearing::torn_step_with;
use constitutive::{FlowMap, RheologyError, wide};
use numerics::lanes::{F4, Lane, LaneKernel, dispatch};
use numerics::tensor::{Tensor, determinant};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What the stage found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DeformationReport {
    /// Particles whose strain was extreme and was limited.
    pub limited: usize,
    /// Smallest determinant of a particle's deformation in this step.
    pub smallest_determinant: f64,
    /// Largest determinant of a particle's deformation in this step.
    pub largest_determinant: f64,
}

/// Elastic strains before the step, kept for the flow map that needs them.
#[derive(Clone, Debug, Default)]
pub struct PreviousStrain<const D: usize> {
    pub(crate) strain: Vec<Tensor<D>>,
}

/// Carries the particles through `f = I + dt C`.
///
/// Elastic strains hold the *trial* strain afterwards, until stage 10 lets it flow. Volume ratios of rigid liquids stay as they
/// are; `compressible` off keeps all of them.
///
/// # Errors
/// Where a particle deforms too much or inverts; the particles are then partly advanced and the caller restores its snapshot.
pub fn deformation<const D: usize>(
    particles: &mut Particles<D>,
    materials: &[LiquidMaterial],
    previous: &mut PreviousStrain<D>,
    dt: f64,
    compressible: bool,
) -> Result<DeformationReport, LiquidError> {
    compiled::deformation(particles, materials, previous, dt, compressible)
}

fn deformation_any<const D: usize>(
    particles: &mut Particles<D>,
    materials: &[LiquidMaterial],
    previous: &mut PreviousStrain<D>,
    dt: f64,
    compressible: bool,
) -> Result<DeformationReport, LiquidError> {
    previous.strain.clear();
    if particles.carried.strain && materials.iter().any(|m| m.law.settings.flow_map == FlowMap::Forced) {
        previous.strain.extend_from_slice(&particles.elastic_strain);
    }
    // Absent arrays are replaced by empty chunks of the same number.
    let n = particles.len();
    let carried = particles.carried;
    let mut strains: Vec<&mut [Tensor<D>]> = chunks(&mut particles.elastic_strain, CHUNK, n);
    let mut histories: Vec<&mut [Tensor<D>]> = chunks(&mut particles.deformation_gradient, CHUNK, n);
    let (affine, material, flags, id) = (&particles.affine, &particles.material, &particles.flags, &particles.id);
    particles
        .volume_ratio
        .par_chunks_mut(CHUNK)
        .zip(strains.par_iter_mut())
        .zip(histories.par_iter_mut())
        .enumerate()
        .map(|(chunk, ((ratios, strains), histories))| {
            let range = chunk * CHUNK..chunk * CHUNK + ratios.len();
            dispatch(Task {
                materials,
                affine: &affine[range.clone()],
                material: &material[range.clone()],
                flags: &flags[range.clone()],
                id: &id[range],
                dt,
                compressible,
                carried,
                ratios,
                strains,
                histories,
                report: DeformationReport::NONE,
            })
        })
        .reduce(
            || Ok(DeformationReport::NONE),
            |a, b| {
                let (a, b) = (a?, b?);
                Ok(DeformationReport {
                    limited: a.limited + b.limited,
                    smallest_determinant: a.smallest_determinant.min(b.smallest_determinant),
                    largest_determinant: a.largest_determinant.max(b.largest_determinant),
                })
            },
        )
}

/// Particles of a parallel task; a multiple of four.
const CHUNK: usize = 2048;

impl DeformationReport {
    const NONE: Self = Self { limited: 0, smallest_determinant: f64::INFINITY, largest_determinant: 0.0 };

    fn see(&mut self, determinant: f64) {
        self.smallest_determinant = self.smallest_determinant.min(determinant);
        self.largest_determinant = self.largest_determinant.max(determinant);
    }
}

/// The particles of one task.
struct Task<'a, const D: usize> {
    materials: &'a [LiquidMaterial],
    affine: &'a [Tensor<D>],
    material: &'a [u16],
    flags: &'a [u8],
    id: &'a [u64],
    dt: f64,
    compressible: bool,
    carried: Carried,
    ratios: &'a mut [f64],
    strains: &'a mut [Tensor<D>],
    histories: &'a mut [Tensor<D>],
    report: DeformationReport,
}

impl<const D: usize> Task<'_, D> {
    /// One particle by itself.
    fn alone(&mut self, k: usize) -> Result<(), LiquidError> {
        let law = &self.materials[self.material[k] as usize];
        let id = self.id[k];
        let fail = |source: RheologyError| LiquidError::Deformation { id, source };
        let f = Tensor::<D>::identity() + self.affine[k] * self.dt;
        let mut factor = determinant(&f);
        self.report.see(factor);
        if !(factor >= DETERMINANT_RANGE.0 && factor <= DETERMINANT_RANGE.1) {
            return Err(fail(RheologyError::Deformation { determinant: factor }));
        }
        if self.carried.strain && law.law.is_shear_elastic() {
            let strain = &mut self.strains[k];
            let (trial, applied) = if self.flags[k] & TORN != 0 {
                let step = torn_step_with(law.law.settings.torn, strain, self.ratios[k], &f).map_err(fail)?;
                (step.trial, step.applied)
            } else {
                (elastic_trial(strain, &f).map_err(fail)?, f)
            };
            *strain = trial.strain;
            factor = trial.volume_factor;
            self.report.limited += usize::from(trial.limited);
            if self.carried.history {
                self.histories[k] = applied * self.histories[k];
            }
        }
        if self.compressible && !law.rigid_volume {
            self.ratios[k] *= factor;
        }
        Ok(())
    }

    /// Four whole particles of a shear-elastic liquid; changes nothing and returns false where one of them needs a closer look.
    #[inline(always)]
    fn together<L: Lane<Memory = F4>>(&mut self, k: usize, rigid: bool) -> bool {
        let g = wide::load::<D, L>(&wide::four(self.affine, k));
        let f = wide::identity_plus(&g, L::splat(self.dt));
        let trial = wide::elastic_trial(&wide::load(&wide::four(self.strains, k)), &f);
        if wide::parts(trial.sound) != [1.0; 4] {
            return false;
        }
        let mut out = [Tensor::<D>::zeros(); 4];
        wide::store(&trial.strain, &mut out);
        self.strains[k..k + 4].copy_from_slice(&out);
        if self.carried.history {
            let moved = wide::product(&f, &wide::load(&wide::four(self.histories, k)));
            wide::store(&moved, &mut out);
            self.histories[k..k + 4].copy_from_slice(&out);
        }
        for (i, factor) in wide::parts(trial.factor).into_iter().enumerate() {
            self.report.see(factor);
            if self.compressible && !rigid {
                self.ratios[k + i] *= factor;
            }
        }
        true
    }
}

impl<const D: usize> LaneKernel for Task<'_, D> {
    type Output = Result<DeformationReport, LiquidError>;
    #[inline(always)]
    fn run<L: Lane<Memory = F4>>(mut self) -> Self::Output {
        let n = self.ratios.len();
        let mut k = 0;
        while k + 4 <= n {
            let m = self.material[k];
            let material = &self.materials[m as usize];
            let alike = self.carried.strain
                && self.material[k..k + 4].iter().all(|&other| other == m)
                && self.flags[k..k + 4].iter().all(|f| f & TORN == 0)
                && material.law.is_shear_elastic();
            if !(alike && self.together::<L>(k, material.rigid_volume)) {
                (k..k + 4).try_for_each(|k| self.alone(k))?;
            }
            k += 4;
        }
        (k..n).try_for_each(|k| self.alone(k))?;
        Ok(self.report)
    }
}

/// Splits an array into chunks; an absent array gives empty ones.
pub(crate) fn chunks<T>(array: &mut [T], size: usize, n: usize) -> Vec<&mut [T]> {
    if array.is_empty() {
        (0..n.div_ceil(size)).map(|_| Default::default()).collect()
    } else {
        array.chunks_mut(size).collect()
    }
}

numerics::compile_here! {
    mod compiled {
        fn deformation(particles: &mut Particles<D>, materials: &[LiquidMaterial], previous: &mut PreviousStrain<D>, dt: f64, compressible: bool) -> Result<DeformationReport, LiquidError> = deformation_any;
    }
}
