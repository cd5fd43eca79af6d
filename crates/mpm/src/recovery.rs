//! Stage 12: plastic history heals.

use crate::LiquidError;
use crate::material::LiquidMaterial;
use crate::particles::Particles;
use constitutive::tearing::recover;
use rayon::prelude::*;

/// Heals the plastic history of all particles over `dt`: its logarithm decays with the recovery time of the material.
///
/// # Errors
/// Where a history is not finite.
pub fn recovery<const D: usize>(
    particles: &mut Particles<D>,
    materials: &[LiquidMaterial],
    dt: f64,
) -> Result<(), LiquidError> {
    if !particles.carried.history {
        return Ok(());
    }
    let Particles { elastic_strain, deformation_gradient, material, id, .. } = particles;
    deformation_gradient
        .par_iter_mut()
        .enumerate()
        .with_min_len(1024)
        .map(|(p, gradient)| {
            let Some(time) = materials[material[p] as usize].recovery_time else { return Ok(()) };
            *gradient = recover(gradient, &elastic_strain[p], dt, time)
                .map_err(|source| LiquidError::Deformation { id: id[p], source })?;
            Ok(())
        })
        .reduce(|| Ok(()), Result::and)
}
