//! Stage 8: volume ratio, trial elastic strain and plastic history of the particles, carried through the motion of the step.

use crate::LiquidError;
use crate::material::LiquidMaterial;
use crate::particles::{Particles, TORN};
use constitutive::liquid_law::{DETERMINANT_RANGE, elastic_trial};
use constitutive::tearing::torn_step_with;
use constitutive::{FlowMap, RheologyError};
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
    previous.strain.clear();
    if particles.carried.strain && materials.iter().any(|m| m.law.settings.flow_map == FlowMap::Forced) {
        previous.strain.extend_from_slice(&particles.elastic_strain);
    }
    let carried = particles.carried;
    // Absent arrays are replaced by empty chunks of the same number.
    let n = particles.len();
    const CHUNK: usize = 2048;
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
            let mut report =
                DeformationReport { limited: 0, smallest_determinant: f64::INFINITY, largest_determinant: 0.0 };
            for (k, ratio) in ratios.iter_mut().enumerate() {
                let p = chunk * CHUNK + k;
                let law = &materials[material[p] as usize];
                let fail = |source: RheologyError| LiquidError::Deformation { id: id[p], source };
                let f = Tensor::<D>::identity() + affine[p] * dt;
                let mut factor = determinant(&f);
                report.smallest_determinant = report.smallest_determinant.min(factor);
                report.largest_determinant = report.largest_determinant.max(factor);
                if !(factor >= DETERMINANT_RANGE.0 && factor <= DETERMINANT_RANGE.1) {
                    return Err(fail(RheologyError::Deformation { determinant: factor }));
                }
                if carried.strain && law.law.is_shear_elastic() {
                    let (trial, applied) = if flags[p] & TORN != 0 {
                        let step = torn_step_with(law.law.settings.torn, &strains[k], *ratio, &f).map_err(fail)?;
                        (step.trial, step.applied)
                    } else {
                        (elastic_trial(&strains[k], &f).map_err(fail)?, f)
                    };
                    strains[k] = trial.strain;
                    factor = trial.volume_factor;
                    report.limited += usize::from(trial.limited);
                    if carried.history {
                        histories[k] = applied * histories[k];
                    }
                }
                if compressible && !law.rigid_volume {
                    *ratio *= factor;
                }
            }
            Ok(report)
        })
        .reduce(
            || Ok(DeformationReport { limited: 0, smallest_determinant: f64::INFINITY, largest_determinant: 0.0 }),
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

/// Splits an array into chunks; an absent array gives empty ones.
pub(crate) fn chunks<T>(array: &mut [T], size: usize, n: usize) -> Vec<&mut [T]> {
    if array.is_empty() {
        (0..n.div_ceil(size)).map(|_| Default::default()).collect()
    } else {
        array.chunks_mut(size).collect()
    }
}
