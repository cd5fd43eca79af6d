//! Stage 5: which particles are torn.

use crate::LiquidError;
use crate::material::LiquidMaterial;
use crate::particles::{Particles, TORN};
use constitutive::tearing::{is_torn, plastic_history};
use rayon::prelude::*;

/// Sets the torn flag of every particle from its plastic history; returns how many are torn.
///
/// # Errors
/// Where a history is not finite.
pub fn tearing<const D: usize>(
    particles: &mut Particles<D>,
    materials: &[LiquidMaterial],
) -> Result<usize, LiquidError> {
    if !particles.carried.history {
        return Ok(0);
    }
    let Particles { elastic_strain, deformation_gradient, material, id, flags, .. } = particles;
    flags
        .par_iter_mut()
        .enumerate()
        .with_min_len(1024)
        .map(|(p, flags)| {
            let Some(limit) = materials[material[p] as usize].tearing_strain else { return Ok(0) };
            let history = plastic_history(&deformation_gradient[p], &elastic_strain[p])
                .map_err(|source| LiquidError::Deformation { id: id[p], source })?;
            let torn = is_torn(&history, limit);
            *flags = if torn { *flags | TORN } else { *flags & !TORN };
            Ok(usize::from(torn))
        })
        .reduce(|| Ok(0), |a, b| Ok(a? + b?))
}
