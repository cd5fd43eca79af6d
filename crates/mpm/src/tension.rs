//! Stage 8, second half: volume ratios that no pressure watches.
//!
//! The pressure solve sees the average volume ratio of a cell. Two things escape it, and left to themselves both grow until
//! they are set free as energy:
//!
//! * *Particles outside liquid cells* (spray, threads thinner than a cell, the outermost layer) have no equation for their
//!   pressure, which is zero there: their volume ratio is `J(0) = 1`. Their velocity field opens and closes gaps between them, and
//!   a ratio that followed it would leave all bounds.
//! * *Differences within a cell* bear no pressure. They even out, by half each step; the volume of the cell stays, and its elastic
//!   energy, convex in the ratio, can only fall.
//!
//! And one thing has no shape at all: a particle that is alone on the grid. Nothing holds its strain, and what its affine velocity stretches stretches on,
//! ever faster, until no step is short enough. It keeps its mass, momentum and spin, and bears nothing.

use crate::grid::LiquidGrid;
use crate::material::LiquidMaterial;
use crate::particles::Particles;
use crate::settings::LiquidSettings;
use numerics::tensor::Tensor;
use particle_grid::cells_per_block;
use rayon::prelude::*;

/// Part of its distance from the average of its cell that a volume ratio gives up in a step.
///
/// A block of 10⁵ Pa dropped at 1 m/s should compress to 0.955: with a tenth its particles reach 0.88, with a half 0.954, with all
/// 0.966; the height of the rebound is the same within a hundredth of the block.
const EVENING: f64 = 0.5;

/// Gives particles that lie in no liquid cell the volume of no pressure and evens out volume ratios within cells; returns how many
/// particles were released.
///
/// Particles must still be where they were when the grid was made. Does nothing where no volume ratio can change or no pressure
/// acts.
pub fn settle_volume<const D: usize>(
    particles: &mut Particles<D>,
    materials: &[LiquidMaterial],
    grid: &LiquidGrid<D>,
    settings: &LiquidSettings,
) -> usize {
    compiled::settle_volume(particles, materials, grid, settings)
}

fn settle_volume_any<const D: usize>(
    particles: &mut Particles<D>,
    materials: &[LiquidMaterial],
    grid: &LiquidGrid<D>,
    settings: &LiquidSettings,
) -> usize {
    let acts = settings.pressure.enabled
        && settings.compressibility
        && materials.iter().any(|material| !material.rigid_volume);
    if !acts || particles.is_empty() {
        return 0;
    }
    let per = cells_per_block::<D>();
    let rigid = |m: u16| materials[m as usize].rigid_volume;
    let (material, rest_volume) = (&particles.material, &particles.rest_volume);
    let ratios = grid.order.split(&mut particles.volume_ratio);
    ratios
        .into_par_iter()
        .enumerate()
        .map(|(rank, ratios)| {
            let block = grid.blocks.occupied()[rank] as usize;
            let start = grid.order.block_range(rank).start;
            let mut released = 0;
            for cell in 0..per {
                let range = grid.order.cell_range(rank, cell);
                if range.is_empty() {
                    continue;
                }
                let ratio = &mut ratios[range.start - start..range.end - start];
                let material = &material[range.clone()];
                if grid.cell.liquid_distance[block * per + cell] >= 0.0 {
                    for (j, _) in ratio.iter_mut().zip(material).filter(|(_, m)| !rigid(**m)) {
                        released += usize::from(*j != 1.0);
                        *j = 1.0;
                    }
                } else {
                    even_out(material, &rest_volume[range], ratio, rigid);
                }
            }
            released
        })
        .sum()
}

/// Largest fill of a cell by the one particle in it and what reaches in from around, over what the particle alone can fill.
const ALONE: f64 = 1.5;

/// Particles that are alone on the grid forget their elastic strain and keep of their affine velocity the spin; returns how many.
///
/// Particles must still be where they were when the grid was made. Does nothing where no liquid is elastic in shear.
pub fn release_loners<const D: usize>(particles: &mut Particles<D>, grid: &LiquidGrid<D>) -> usize {
    if particles.elastic_strain.is_empty() {
        return 0;
    }
    let per = cells_per_block::<D>();
    // the kernel of a cell at its centre, along every direction
    let share = 0.75f64.powi(D as i32) / grid.cell_volume();
    let loners: Vec<usize> = (0..grid.blocks.occupied().len())
        .into_par_iter()
        .flat_map_iter(|rank| {
            let first = grid.blocks.occupied()[rank] as usize * per;
            (0..per).filter_map(move |cell| {
                let range = grid.order.cell_range(rank, cell);
                (range.len() == 1).then_some((range.start, grid.cell.liquid_fraction[first + cell]))
            })
        })
        .filter(|(p, filled)| *filled <= ALONE * share * particles.rest_volume[*p])
        .map(|(p, _)| p)
        .collect();
    for &p in &loners {
        particles.elastic_strain[p] = Tensor::identity();
        let affine = particles.affine[p];
        particles.affine[p] = (affine - affine.transpose()) * 0.5;
    }
    loners.len()
}

/// Moves the ratios of each material towards their average by rest volume.
fn even_out(material: &[u16], rest_volume: &[f64], ratio: &mut [f64], rigid: impl Fn(u16) -> bool) {
    let mut done = 0u64;
    for k in 0..material.len() {
        let m = material[k];
        // more materials than that in one scene stay as they are
        if m >= 64 || done & (1 << m) != 0 || rigid(m) {
            continue;
        }
        let (mut volume, mut rest) = (0.0, 0.0);
        for i in (k..material.len()).filter(|i| material[*i] == m) {
            volume += rest_volume[i] * ratio[i];
            rest += rest_volume[i];
        }
        let average = volume / rest;
        for i in (k..material.len()).filter(|i| material[*i] == m) {
            ratio[i] += EVENING * (average - ratio[i]);
        }
        done |= 1 << m;
    }
}

numerics::compile_here! {
    mod compiled {
        fn settle_volume(particles: &mut Particles<D>, materials: &[LiquidMaterial], grid: &LiquidGrid<D>, settings: &LiquidSettings) -> usize = settle_volume_any;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_particle_alone_keeps_its_spin_and_forgets_its_strain() {
        use crate::{Particle, particles_to_grid};
        use numerics::tensor::Vector;
        let lattice = particle_grid::Lattice::<2>::new(1e-2);
        let liquid = constitutive::Liquid::preset("shaving-cream").unwrap();
        let materials = vec![LiquidMaterial::new(&liquid, constitutive::LawSettings::default()).unwrap()];
        let mut particles = Particles::new(&materials);
        let strained = Tensor::<2>::new(2.0, 0.0, 0.0, 0.5);
        let motion = Tensor::<2>::new(3.0, 5.0, -1.0, 4.0);
        for x in [[0.051, 0.052], [0.004, 0.004], [0.006, 0.007]] {
            let mut p = Particle::new(Vector::<2>::new(x[0], x[1]), 6e-6, 0, liquid.density);
            (p.elastic_strain, p.affine) = (strained, motion);
            particles.push(p);
        }
        let mut grid = LiquidGrid::new(lattice);
        particles_to_grid::activate(&mut particles, &materials, &[], &mut grid).unwrap();
        particles_to_grid::particles_to_grid(&particles, &materials, None, &mut grid);
        assert_eq!(release_loners(&mut particles, &grid), 1);
        for p in 0..3 {
            if particles.position[p].x > 0.05 {
                assert_eq!(particles.elastic_strain[p], Tensor::<2>::identity());
                assert_eq!(particles.affine[p], Tensor::<2>::new(0.0, 3.0, -3.0, 0.0));
            } else {
                assert_eq!((particles.elastic_strain[p], particles.affine[p]), (strained, motion));
            }
        }
    }

    #[test]
    fn evening_out_keeps_volume_and_leaves_other_materials_alone() {
        let material = [0, 1, 0, 0, 2, 2];
        let rest = [1.0, 2.0, 3.0, 1.0, 1.0, 1.0];
        let before = [0.5, 0.7, 1.2, 2.0, 0.4, 1.6];
        let mut after = before;
        even_out(&material, &rest, &mut after, |m| m == 2);
        let volume = |ratio: &[f64]| [0, 2, 3].iter().map(|&i| rest[i] * ratio[i]).sum::<f64>();
        assert!((volume(&after) - volume(&before)).abs() < 1e-15);
        assert!((after[1] - 0.7).abs() < 1e-15 && after[4..] == before[4..]);
        assert!(after[0] > 0.5 && after[3] < 2.0);
    }
}
