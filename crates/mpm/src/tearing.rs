//! Stage 5: which particles are torn.

use crate::LiquidError;
use crate::material::LiquidMaterial;
use crate::particles::{Particles, TORN};
use constitutive::tearing::{is_torn, plastic_history};
use constitutive::wide;
use numerics::lanes::{F4, Lane, LaneKernel, dispatch};
use numerics::tensor::Tensor;
use rayon::prelude::*;

/// Sets the torn flag of every particle from its plastic history; returns how many are torn.
///
/// # Errors
/// Where a history is not finite.
pub fn tearing<const D: usize>(
    particles: &mut Particles<D>,
    materials: &[LiquidMaterial],
) -> Result<usize, LiquidError> {
    compiled::tearing(particles, materials)
}

fn tearing_any<const D: usize>(
    particles: &mut Particles<D>,
    materials: &[LiquidMaterial],
) -> Result<usize, LiquidError> {
    if !particles.carried.history {
        return Ok(0);
    }
    let Particles { elastic_strain, deformation_gradient, material, id, flags, .. } = particles;
    flags
        .par_chunks_mut(CHUNK)
        .enumerate()
        .map(|(chunk, flags)| {
            let range = chunk * CHUNK..chunk * CHUNK + flags.len();
            dispatch(Task {
                materials,
                strains: &elastic_strain[range.clone()],
                histories: &deformation_gradient[range.clone()],
                material: &material[range.clone()],
                id: &id[range],
                flags,
                torn: 0,
            })
        })
        .reduce(|| Ok(0), |a, b| Ok(a? + b?))
}

/// Particles of a parallel task; a multiple of four.
const CHUNK: usize = 1024;
/// Largest entry of a strain or gradient that goes through the lanes.
const EXTREME: f64 = 1e4;

/// The particles of one task.
struct Task<'a, const D: usize> {
    materials: &'a [LiquidMaterial],
    strains: &'a [Tensor<D>],
    histories: &'a [Tensor<D>],
    material: &'a [u16],
    id: &'a [u64],
    flags: &'a mut [u8],
    torn: usize,
}

impl<const D: usize> Task<'_, D> {
    fn mark(&mut self, k: usize, torn: bool) {
        let flags = &mut self.flags[k];
        *flags = if torn { *flags | TORN } else { *flags & !TORN };
        self.torn += usize::from(torn);
    }

    /// One particle by itself.
    fn alone(&mut self, k: usize) -> Result<(), LiquidError> {
        let Some(limit) = self.materials[self.material[k] as usize].tearing_strain else { return Ok(()) };
        let history = plastic_history(&self.histories[k], &self.strains[k])
            .map_err(|source| LiquidError::Deformation { id: self.id[k], source })?;
        self.mark(k, is_torn(&history, limit));
        Ok(())
    }
}

impl<const D: usize> LaneKernel for Task<'_, D> {
    type Output = Result<usize, LiquidError>;
    #[inline(always)]
    fn run<L: Lane<Memory = F4>>(mut self) -> Self::Output {
        let n = self.flags.len();
        let mut k = 0;
        while k + 4 <= n {
            let m = self.material[k];
            let strains = wide::four(self.strains, k);
            let gradients = wide::four(self.histories, k);
            let limit = self.materials[m as usize].tearing_strain;
            let mut done = false;
            if let Some(limit) = limit
                && self.material[k..k + 4].iter().all(|&other| other == m)
                && strains.iter().chain(&gradients).all(|b| b.amax() < EXTREME)
            {
                let (history, j) =
                    wide::plastic_history(&wide::load::<D, L>(&gradients), &wide::load::<D, L>(&strains));
                let (dev, _) = wide::deviator(&history);
                let square = wide::parts(wide::contraction(&dev, &dev));
                if wide::parts(j).iter().all(|&j| j > 1e-100) && square.iter().all(|s| s.is_finite()) {
                    for (i, s) in square.into_iter().enumerate() {
                        self.mark(k + i, s >= limit * limit);
                    }
                    done = true;
                }
            }
            if !done {
                (k..k + 4).try_for_each(|k| self.alone(k))?;
            }
            k += 4;
        }
        (k..n).try_for_each(|k| self.alone(k))?;
        Ok(self.torn)
    }
}

numerics::compile_here! {
    mod compiled {
        fn tearing(particles: &mut Particles<D>, materials: &[LiquidMaterial]) -> Result<usize, LiquidError> = tearing_any;
    }
}
