//! Stage 10: the trial elastic strain of the particles flows.

use crate::LiquidError;
use crate::deformation::PreviousStrain;
use crate::material::LiquidMaterial;
use crate::particles::{Particles, YIELDED};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What the stage found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlasticityReport {
    /// Particles that flowed.
    pub yielded: usize,
    /// Largest shear stress norm after flow [Pa].
    pub max_stress: f64,
}

/// Lets the trial strains flow over `dt`; sets the yielded flag.
///
/// # Errors
/// Where a strain is not finite.
pub fn liquid_plasticity<const D: usize>(
    particles: &mut Particles<D>,
    materials: &[LiquidMaterial],
    previous: &PreviousStrain<D>,
    dt: f64,
) -> Result<PlasticityReport, LiquidError> {
    if !particles.carried.strain {
        return Ok(PlasticityReport::default());
    }
    let (material, id) = (&particles.material, &particles.id);
    particles
        .elastic_strain
        .par_iter_mut()
        .zip(particles.flags.par_iter_mut())
        .enumerate()
        .with_min_len(1024)
        .map(|(p, (strain, flags))| {
            let law = &materials[material[p] as usize].law;
            if !law.is_shear_elastic() {
                return Ok(PlasticityReport::default());
            }
            let before = previous.strain.get(p).copied().unwrap_or(*strain);
            let relaxed =
                law.relax(strain, &before, dt).map_err(|source| LiquidError::Deformation { id: id[p], source })?;
            *strain = relaxed.strain;
            *flags = if relaxed.yielded { *flags | YIELDED } else { *flags & !YIELDED };
            Ok(PlasticityReport { yielded: usize::from(relaxed.yielded), max_stress: relaxed.stress })
        })
        .reduce(
            || Ok(PlasticityReport::default()),
            |a, b| {
                let (a, b) = (a?, b?);
                Ok(PlasticityReport { yielded: a.yielded + b.yielded, max_stress: a.max_stress.max(b.max_stress) })
            },
        )
}
