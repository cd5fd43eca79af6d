//! Stage 3: mass, momentum, volume and shear force of the particles on the faces; volume ratio and fill of the cells.

use crate::arrays;
use crate::grid::LiquidGrid;
use crate::material::{LiquidMaterial, check_materials};
use crate::particles::Particles;
use crate::shear_state::ShearState;
use crate::{LiquidError, Totals};
use numerics::bspline;
use numerics::tensor::Vector;
use particle_grid::{CENTRE, Contribution, Lanes, cells_per_block, mac_offset, scatter};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What the transfer did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TransferReport {
    /// Active blocks.
    pub blocks: usize,
    /// Blocks that hold particles.
    pub occupied: usize,
    /// Mass on the faces of the first direction [kg].
    pub mass: f64,
}

/// Sorts the particles and lets the grid follow them.
///
/// - `extra`: points that are not particles but need the grid around them, such as strand vertices [m]
///
/// # Errors
/// Where a position is not finite, outside a period or too far away, or a particle has no material.
pub fn activate<const D: usize>(
    particles: &mut Particles<D>,
    materials: &[LiquidMaterial],
    extra: &[Vector<D>],
    grid: &mut LiquidGrid<D>,
) -> Result<(), LiquidError> {
    compiled::activate(particles, materials, extra, grid)
}

fn activate_any<const D: usize>(
    particles: &mut Particles<D>,
    materials: &[LiquidMaterial],
    extra: &[Vector<D>],
    grid: &mut LiquidGrid<D>,
) -> Result<(), LiquidError> {
    check_materials(&particles.material, &particles.id, materials.len())?;
    let lattice = *grid.lattice();
    particles.sort(&lattice, &mut grid.order, &mut grid.sort)?;
    grid.blocks.rebuild(&grid.order, extra);
    let density = materials.iter().map(|m| m.density).fold(f64::INFINITY, f64::min);
    grid.elastic = materials.iter().any(|m| m.law.is_shear_elastic());
    grid.mass_floor = if density.is_finite() { 1e-12 * density * grid.cell_volume() } else { 0.0 };
    Ok(())
}

/// Scatters the sorted particles. [`activate`] must have run on the same particles.
///
/// `shear`: stresses of this step, if any liquid resists shear.
pub fn particles_to_grid<const D: usize>(
    particles: &Particles<D>,
    materials: &[LiquidMaterial],
    shear: Option<&ShearState<D>>,
    grid: &mut LiquidGrid<D>,
) -> TransferReport {
    compiled::particles_to_grid(particles, materials, shear, grid)
}

fn particles_to_grid_any<const D: usize>(
    particles: &Particles<D>,
    materials: &[LiquidMaterial],
    shear: Option<&ShearState<D>>,
    grid: &mut LiquidGrid<D>,
) -> TransferReport {
    let n = grid.blocks.node_count();
    let per = cells_per_block::<D>();
    let lattice = *grid.lattice();
    let affine_inverse = 4.0 / (lattice.dx * lattice.dx);
    arrays::resize(&mut grid.lanes, n, Lanes::ZERO);
    for a in 0..D {
        // mass, momentum, volume, shear force
        let give = |p: usize| {
            let m = particles.mass[p];
            let c = &particles.affine[p];
            let (stress, factor) = match shear {
                Some(s) => (s.stress[p], -particles.rest_volume[p] * affine_inverse),
                None => (numerics::tensor::Tensor::<D>::zeros(), 0.0),
            };
            Contribution {
                value: Lanes([m, m * particles.velocity[p][a], particles.volume(p), 0.0]),
                gradient: std::array::from_fn(|b| Lanes([0.0, m * c[(a, b)], 0.0, factor * stress[(a, b)]])),
            }
        };
        let offset = mac_offset(a);
        scatter(&grid.blocks, &grid.order, &particles.position, &offset, 0.0, give, &mut grid.scatter, &mut grid.lanes);
        let face = &mut grid.face[a];
        for field in [&mut face.mass, &mut face.velocity, &mut face.volume, &mut face.shear_force] {
            arrays::resize(field, n, 0.0);
        }
        face.pressure_gradient.clear();
        arrays::resize(&mut face.pressure_gradient, n, 0.0);
        let floor = grid.mass_floor;
        grid.lanes
            .par_chunks(per)
            .zip(face.mass.par_chunks_mut(per))
            .zip(face.velocity.par_chunks_mut(per))
            .zip(face.volume.par_chunks_mut(per))
            .zip(face.shear_force.par_chunks_mut(per))
            .with_min_len(32)
            .for_each(|((((lanes, mass), velocity), volume), force)| {
                for i in 0..lanes.len() {
                    let [m, mv, v, f] = lanes[i].0;
                    mass[i] = m;
                    velocity[i] = if m > floor { mv / m } else { 0.0 };
                    volume[i] = v;
                    force[i] = f;
                }
            });
    }
    // weight, volume ratio, volume, volume by bulk modulus
    let give = |p: usize| {
        let material = &materials[particles.material[p] as usize];
        let v = particles.volume(p);
        let compliance = if material.rigid_volume { 0.0 } else { v / material.law.volume.bulk_modulus };
        Contribution { value: Lanes([1.0, particles.volume_ratio[p], v, compliance]), gradient: [Lanes::ZERO; D] }
    };
    let offset = [CENTRE; D];
    let smear = bspline::smear_of(grid.particle_width);
    scatter(&grid.blocks, &grid.order, &particles.position, &offset, smear, give, &mut grid.scatter, &mut grid.lanes);
    let cell = &mut grid.cell;
    for field in [&mut cell.liquid_fraction, &mut cell.volume_ratio, &mut cell.compliance] {
        arrays::resize(field, n, 0.0);
    }
    cell.pressure.clear();
    arrays::resize(&mut cell.pressure, n, 0.0);
    let inverse_volume = 1.0 / lattice.dx.powi(D as i32);
    for i in 0..n {
        let [w, wj, v, c] = grid.lanes[i].0;
        cell.volume_ratio[i] = if w > 0.0 { wj / w } else { 1.0 };
        cell.liquid_fraction[i] = v * inverse_volume;
        cell.compliance[i] = if v > 0.0 { c / v } else { 0.0 };
    }
    TransferReport {
        blocks: grid.blocks.block_count(),
        occupied: grid.blocks.occupied().len(),
        mass: grid.face[0].mass.iter().sum(),
    }
}

/// Relative difference between the mass of the particles and the mass that the faces received: round-off.
#[must_use]
pub fn mass_defect<const D: usize>(totals: &Totals<D>, report: &TransferReport) -> f64 {
    if totals.mass > 0.0 { (report.mass / totals.mass - 1.0).abs() } else { 0.0 }
}

numerics::compile_here! {
    mod compiled {
        fn activate(particles: &mut Particles<D>, materials: &[LiquidMaterial], extra: &[Vector<D>], grid: &mut LiquidGrid<D>) -> Result<(), LiquidError> = activate_any;
        fn particles_to_grid(particles: &Particles<D>, materials: &[LiquidMaterial], shear: Option<&ShearState<D>>, grid: &mut LiquidGrid<D>) -> TransferReport = particles_to_grid_any;
    }
}
