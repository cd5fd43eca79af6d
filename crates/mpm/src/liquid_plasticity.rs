//! Stage 10: the trial elastic strain of the particles flows.

use crate::LiquidError;
use crate::deformation::PreviousStrain;
use crate::material::LiquidMaterial;
use crate::particles::{Particles, YIELDED};
use constitutive::wide;
use numerics::lanes::{F4, Lane, LaneKernel, dispatch};
use numerics::tensor::Tensor;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Largest entry of a strain that goes through the lanes.
const EXTREME: f64 = 1e4;

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
    compiled::liquid_plasticity(particles, materials, previous, dt)
}

fn liquid_plasticity_any<const D: usize>(
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
        .par_chunks_mut(CHUNK)
        .zip(particles.flags.par_chunks_mut(CHUNK))
        .enumerate()
        .map(|(chunk, (strains, flags))| {
            let range = chunk * CHUNK..chunk * CHUNK + strains.len();
            dispatch(Task {
                materials,
                material: &material[range.clone()],
                id: &id[range.clone()],
                previous: previous.strain.get(range).unwrap_or_default(),
                dt,
                strains,
                flags,
                report: PlasticityReport::default(),
            })
        })
        .reduce(
            || Ok(PlasticityReport::default()),
            |a, b| {
                let (a, b) = (a?, b?);
                Ok(PlasticityReport { yielded: a.yielded + b.yielded, max_stress: a.max_stress.max(b.max_stress) })
            },
        )
}

/// Particles of a parallel task; a multiple of four.
const CHUNK: usize = 1024;

/// The particles of one task.
struct Task<'a, const D: usize> {
    materials: &'a [LiquidMaterial],
    material: &'a [u16],
    id: &'a [u64],
    /// Strains before the step, or nothing.
    previous: &'a [Tensor<D>],
    dt: f64,
    strains: &'a mut [Tensor<D>],
    flags: &'a mut [u8],
    report: PlasticityReport,
}

impl<const D: usize> Task<'_, D> {
    fn mark(&mut self, k: usize, yielded: bool, stress: f64) {
        let flags = &mut self.flags[k];
        *flags = if yielded { *flags | YIELDED } else { *flags & !YIELDED };
        self.report.yielded += usize::from(yielded);
        self.report.max_stress = self.report.max_stress.max(stress);
    }

    /// One particle by itself.
    fn alone(&mut self, k: usize) -> Result<(), LiquidError> {
        let law = &self.materials[self.material[k] as usize].law;
        if !law.is_shear_elastic() {
            return Ok(());
        }
        let strain = self.strains[k];
        let before = self.previous.get(k).copied().unwrap_or(strain);
        let relaxed = law
            .relax(&strain, &before, self.dt)
            .map_err(|source| LiquidError::Deformation { id: self.id[k], source })?;
        self.strains[k] = relaxed.strain;
        self.mark(k, relaxed.yielded, relaxed.stress);
        Ok(())
    }
}

impl<const D: usize> LaneKernel for Task<'_, D> {
    type Output = Result<PlasticityReport, LiquidError>;
    #[inline(always)]
    fn run<L: Lane<Memory = F4>>(mut self) -> Self::Output {
        let n = self.strains.len();
        let mut known: Option<(u16, wide::Law<L>)> = None;
        let mut k = 0;
        while k + 4 <= n {
            let m = self.material[k];
            let material = &self.materials[m as usize];
            let four = wide::four(self.strains, k);
            let tame = self.material[k..k + 4].iter().all(|&other| other == m)
                && wide::covers(&material.law)
                && four.iter().all(|b| b.amax() < EXTREME);
            if tame {
                let law = match known {
                    Some((of, law)) if of == m => law,
                    _ => known.insert((m, wide::Law::new(&material.law, self.dt))).1,
                };
                let (strain, flowed) = law.relax(&wide::load::<D, L>(&four));
                let mut out = four;
                wide::store(&strain, &mut out);
                self.strains[k..k + 4].copy_from_slice(&out);
                let (yielded, stress) = (wide::parts(flowed.yielded), wide::parts(flowed.stress));
                for i in 0..4 {
                    self.mark(k + i, yielded[i] == 1.0, stress[i]);
                }
            } else {
                (k..k + 4).try_for_each(|k| self.alone(k))?;
            }
            k += 4;
        }
        (k..n).try_for_each(|k| self.alone(k))?;
        Ok(self.report)
    }
}

numerics::compile_here! {
    mod compiled {
        fn liquid_plasticity(particles: &mut Particles<D>, materials: &[LiquidMaterial], previous: &PreviousStrain<D>, dt: f64) -> Result<PlasticityReport, LiquidError> = liquid_plasticity_any;
    }
}
