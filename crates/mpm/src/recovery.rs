//! Stage 12: plastic history heals.

use crate::LiquidError;
use crate::material::LiquidMaterial;
use crate::particles::Particles;
use constitutive::tearing::recover;
use constitutive::wide;
use numerics::lanes::{F4, Lane, LaneKernel, dispatch};
use numerics::tensor::Tensor;
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
    compiled::recovery(particles, materials, dt)
}

fn recovery_any<const D: usize>(
    particles: &mut Particles<D>,
    materials: &[LiquidMaterial],
    dt: f64,
) -> Result<(), LiquidError> {
    if !particles.carried.history {
        return Ok(());
    }
    let Particles { elastic_strain, deformation_gradient, material, id, .. } = particles;
    deformation_gradient
        .par_chunks_mut(CHUNK)
        .enumerate()
        .map(|(chunk, histories)| {
            let range = chunk * CHUNK..chunk * CHUNK + histories.len();
            dispatch(Task {
                materials,
                strains: &elastic_strain[range.clone()],
                material: &material[range.clone()],
                id: &id[range],
                dt,
                histories,
            })
        })
        .reduce(|| Ok(()), Result::and)
}

/// Particles of a parallel task; a multiple of four.
const CHUNK: usize = 1024;
/// Largest entry of a strain or gradient that goes through the lanes.
const EXTREME: f64 = 1e4;

/// The particles of one task.
struct Task<'a, const D: usize> {
    materials: &'a [LiquidMaterial],
    strains: &'a [Tensor<D>],
    material: &'a [u16],
    id: &'a [u64],
    dt: f64,
    histories: &'a mut [Tensor<D>],
}

impl<const D: usize> Task<'_, D> {
    /// One particle by itself.
    fn alone(&mut self, k: usize) -> Result<(), LiquidError> {
        let Some(time) = self.materials[self.material[k] as usize].recovery_time else { return Ok(()) };
        self.histories[k] = recover(&self.histories[k], &self.strains[k], self.dt, time)
            .map_err(|source| LiquidError::Deformation { id: self.id[k], source })?;
        Ok(())
    }
}

impl<const D: usize> LaneKernel for Task<'_, D> {
    type Output = Result<(), LiquidError>;
    #[inline(always)]
    fn run<L: Lane<Memory = F4>>(mut self) -> Self::Output {
        let n = self.histories.len();
        let mut k = 0;
        while k + 4 <= n {
            let m = self.material[k];
            let strains = wide::four(self.strains, k);
            let gradients = wide::four(self.histories, k);
            let mut sound = [0.0; 4];
            if let Some(time) = self.materials[m as usize].recovery_time
                && self.material[k..k + 4].iter().all(|&other| other == m)
                && strains.iter().chain(&gradients).all(|b| b.amax() < EXTREME)
            {
                let exponent = L::splat(0.5 * (-self.dt / time).exp_m1());
                let (healed, holds) =
                    wide::recover(&wide::load::<D, L>(&gradients), &wide::load::<D, L>(&strains), exponent);
                let mut out = gradients;
                wide::store(&healed, &mut out);
                sound = wide::parts(holds);
                for i in 0..4 {
                    if sound[i] == 1.0 {
                        self.histories[k + i] = out[i];
                    }
                }
            }
            for i in 0..4 {
                if sound[i] != 1.0 {
                    self.alone(k + i)?;
                }
            }
            k += 4;
        }
        (k..n).try_for_each(|k| self.alone(k))
    }
}

numerics::compile_here! {
    mod compiled {
        fn recovery(particles: &mut Particles<D>, materials: &[LiquidMaterial], dt: f64) -> Result<(), LiquidError> = recovery_any;
    }
}
