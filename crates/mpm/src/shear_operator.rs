//! The shear operator, applied without a matrix: through every particle, or through `2^D` points a cell.
//!
//! `(H q)_{gα} = Σ V (4/dx²) w_g L[G(q)]_{αβ} (x_g − x)_β` with `G(q)_{αβ} = (4/dx²) Σ_g q_{gα} w_g (x_g − x)_β`, over
//! particles or quadrature points. Source: spec 6.4–6.7; the quadrature is our own: tangents are summed over the particles of a
//! sub-cell and act at its centre, where all weights are constants and the stencil sums factorise by direction.

use crate::grid::LiquidGrid;
use crate::particles::Particles;
use crate::shear_state::{PointTangent, ShearState};
use numerics::bspline::Weights1;
use numerics::tensor::{Tensor, Vector};
use particle_grid::tile::{self, Part, ROW, WIDTH, padded_len};
use particle_grid::{ParticleOrder, mac_offset, vectorised};
use rayon::prelude::*;

/// Scratch of operator products.
#[derive(Clone, Debug, Default)]
pub struct OperatorScratch {
    pub(crate) tiles: Vec<f64>,
}

impl OperatorScratch {
    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        8 * self.tiles.capacity()
    }
}

/// Loads tiles of `q`, lets `work` fill tiles of results, and adds them up into `out`; both hold the `D` components one after
/// the other.
///
/// - `part(rank)`: the part of the tiles that `work` reads and writes; the rest holds whatever it held
pub(crate) fn through_tiles<const D: usize>(
    grid: &LiquidGrid<D>,
    q: &[f64],
    out: &mut [f64],
    scratch: &mut OperatorScratch,
    part: impl Fn(usize) -> Part<D> + Sync,
    work: impl Fn(usize, &[f64], &mut [f64]) + Sync,
) {
    let blocks = &grid.blocks;
    let n = blocks.node_count();
    let len = padded_len::<D>();
    let stride = len * D;
    scratch.tiles.resize(blocks.occupied().len() * stride, 0.0);
    scratch.tiles.par_chunks_mut(stride).enumerate().for_each_init(
        || vec![0.0; stride],
        |input, (rank, result)| {
            let block = blocks.occupied()[rank] as usize;
            let part = part(rank);
            for a in 0..D {
                let q = &q[a * n..(a + 1) * n];
                tile::load(blocks, block, &part, q, &mut input[a * len..(a + 1) * len]);
                tile::clear(&part, &mut result[a * len..(a + 1) * len]);
            }
            work(rank, input, result);
        },
    );
    tile::sum(blocks, &scratch.tiles, D, out);
}

/// Lets `work` fill tiles of results and adds them up into `out`.
pub(crate) fn into_tiles<const D: usize>(
    grid: &LiquidGrid<D>,
    out: &mut [f64],
    scratch: &mut OperatorScratch,
    work: impl Fn(usize, &mut [f64]) + Sync,
) {
    let blocks = &grid.blocks;
    let stride = padded_len::<D>() * D;
    scratch.tiles.resize(blocks.occupied().len() * stride, 0.0);
    scratch.tiles.par_chunks_mut(stride).enumerate().for_each(|(rank, result)| {
        result.fill(0.0);
        work(rank, result);
    });
    tile::sum(blocks, &scratch.tiles, D, out);
}

/// Position of a particle relative to its block [cells].
#[inline(always)]
fn local<const D: usize>(grid: &LiquidGrid<D>, order: &ParticleOrder<D>, rank: usize, x: &Vector<D>) -> [f64; D] {
    let lattice = grid.lattice();
    let low = lattice.block_low(&order.blocks()[rank]);
    let inverse_dx = 1.0 / lattice.dx;
    std::array::from_fn(|a| (x[a] * inverse_dx - low[a]).max(0.0))
}

/// Index of a tile entry for stencil digits above a base.
#[inline(always)]
fn entry<const D: usize>(base: &[usize; D], j: usize, k: usize) -> usize {
    let z = if D > 2 { base[2] + k } else { 0 };
    let y = if D > 1 { base[1] + j } else { 0 };
    (z * if D > 1 { WIDTH } else { 1 } + y) * ROW + base[0]
}

/// `out = H q` through every particle.
pub fn apply_particles<const D: usize>(
    particles: &Particles<D>,
    state: &ShearState<D>,
    grid: &LiquidGrid<D>,
    q: &[f64],
    out: &mut [f64],
    scratch: &mut OperatorScratch,
) {
    let len = padded_len::<D>();
    let dx = grid.lattice().dx;
    // One factor 4/dx for each gradient, distances being in cells.
    let scale = 4.0 / dx;
    let (ny, nz) = (if D > 1 { 3 } else { 1 }, if D > 2 { 3 } else { 1 });
    // Rounding may put a particle a hair outside its cell: what it reads there has to be there.
    through_tiles(
        grid,
        q,
        out,
        scratch,
        |_| Part::WHOLE,
        |rank, input, result| {
            vectorised(
                #[inline(always)]
                || {
                    for p in grid.order.block_range(rank) {
                        let x = local(grid, &grid.order, rank, &particles.position[p]);
                        let axes: [[Weights1; D]; D] = std::array::from_fn(|c| {
                            let offset = mac_offset::<D>(c);
                            std::array::from_fn(|a| Weights1::new(x[a], offset[a]))
                        });
                        let mut g = Tensor::<D>::zeros();
                        for c in 0..D {
                            let axis = &axes[c];
                            let base: [usize; D] = std::array::from_fn(|a| (axis[a].base + 1).clamp(0, 4) as usize);
                            let field = &input[c * len..(c + 1) * len];
                            for k in 0..nz {
                                let (wz, dz) =
                                    if D > 2 { (axis[2].weight[k], axis[2].distance[k]) } else { (1.0, 0.0) };
                                for j in 0..ny {
                                    let (wy, dy) =
                                        if D > 1 { (axis[1].weight[j], axis[1].distance[j]) } else { (1.0, 0.0) };
                                    let row = &field[entry(&base, j, k)..][..3];
                                    let (mut sum, mut moment) = (0.0, 0.0);
                                    for i in 0..3 {
                                        let t = row[i] * axis[0].weight[i];
                                        sum += t;
                                        moment += t * axis[0].distance[i];
                                    }
                                    let w = wy * wz;
                                    g[(c, 0)] += w * moment;
                                    if D > 1 {
                                        g[(c, 1)] += w * dy * sum;
                                    }
                                    if D > 2 {
                                        g[(c, 2)] += w * dz * sum;
                                    }
                                }
                            }
                        }
                        let l = state.tangent[p].apply(&(g * scale)) * (particles.rest_volume[p] * scale);
                        for c in 0..D {
                            let axis = &axes[c];
                            let base: [usize; D] = std::array::from_fn(|a| (axis[a].base + 1).clamp(0, 4) as usize);
                            let field = &mut result[c * len..(c + 1) * len];
                            for k in 0..nz {
                                let (wz, lz) = if D > 2 {
                                    (axis[2].weight[k], axis[2].distance[k] * l[(c, 2)])
                                } else {
                                    (1.0, 0.0)
                                };
                                for j in 0..ny {
                                    let (wy, ly) = if D > 1 {
                                        (axis[1].weight[j], axis[1].distance[j] * l[(c, 1)])
                                    } else {
                                        (1.0, 0.0)
                                    };
                                    let row = &mut field[entry(&base, j, k)..][..3];
                                    for i in 0..3 {
                                        row[i] +=
                                            wy * wz * axis[0].weight[i] * (axis[0].distance[i] * l[(c, 0)] + ly + lz);
                                    }
                                }
                            }
                        }
                    }
                },
            );
        },
    );
}

/// Diagonal of `H` through every particle, without the products of different directions: for preconditioning.
pub fn diagonal_particles<const D: usize>(
    particles: &Particles<D>,
    state: &ShearState<D>,
    grid: &LiquidGrid<D>,
    out: &mut [f64],
    scratch: &mut OperatorScratch,
) {
    let len = padded_len::<D>();
    let scale = 4.0 / grid.lattice().dx;
    let (ny, nz) = (if D > 1 { 3 } else { 1 }, if D > 2 { 3 } else { 1 });
    into_tiles(grid, out, scratch, |rank, result| {
        for p in grid.order.block_range(rank) {
            let x = local(grid, &grid.order, rank, &particles.position[p]);
            let tangent: &PointTangent<D> = &state.tangent[p];
            let factor = particles.rest_volume[p] * scale * scale;
            for c in 0..D {
                let offset = mac_offset::<D>(c);
                let axis: [Weights1; D] = std::array::from_fn(|a| Weights1::new(x[a], offset[a]));
                let base: [usize; D] = std::array::from_fn(|a| (axis[a].base + 1).clamp(0, 4) as usize);
                let q: [f64; D] = std::array::from_fn(|a| factor * tangent.diagonal(c, a));
                let field = &mut result[c * len..(c + 1) * len];
                for k in 0..nz {
                    let (wz, dz) = if D > 2 { (axis[2].weight[k], axis[2].distance[k]) } else { (1.0, 0.0) };
                    for j in 0..ny {
                        let (wy, dy) = if D > 1 { (axis[1].weight[j], axis[1].distance[j]) } else { (1.0, 0.0) };
                        let row = &mut field[entry(&base, j, k)..][..3];
                        for i in 0..3 {
                            let w = wy * wz * axis[0].weight[i];
                            let d = [axis[0].distance[i], dy, dz];
                            let mut sum = 0.0;
                            for a in 0..D {
                                sum += q[a] * d[a] * d[a];
                            }
                            row[i] += w * w * sum;
                        }
                    }
                }
            }
        }
    });
}
