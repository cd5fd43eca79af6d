//! Grid to particles: values and gradients of `D` fields at sorted particles.

use crate::blocks::BlockGrid;
use crate::dispatch::vectorised;
use crate::lanes::Lanes;
use crate::order::ParticleOrder;
use crate::tile::{Part, ROW, WIDTH, load, padded_len};
use numerics::bspline::Weights1;
use numerics::tensor::{Tensor, Vector};
use rayon::prelude::*;

/// Interpolates `D` fields at sorted particles.
///
/// - `fields`, `offsets`: one entry per component; [`crate::mac_offset`] for face velocities, all zeros for corners
/// - `values`: receives `Σ w u`, component by component
/// - `gradients`: receives the affine matrix `C`, row `α` the gradient of component `α`: `4/dx² Σ w u (x_node − x_p)ᵀ`
///
/// Nodes of inactive blocks count as zero; a stencil of a sorted particle never reaches one.
pub fn gather<const D: usize>(
    grid: &BlockGrid<D>,
    order: &ParticleOrder<D>,
    positions: &[Vector<D>],
    fields: [&[f64]; D],
    offsets: [[f64; D]; D],
    values: &mut [Vector<D>],
    gradients: &mut [Tensor<D>],
) {
    let lattice = grid.lattice;
    let inverse_dx = 1.0 / lattice.dx;
    let len = padded_len::<D>();
    order.split(values).into_par_iter().zip(order.split(gradients)).enumerate().for_each_init(
        || vec![0.0; len * D],
        |tile, (rank, (values, gradients))| {
            let block = grid.occupied()[rank] as usize;
            for a in 0..D {
                load(grid, block, &Part::WHOLE, fields[a], &mut tile[a * len..(a + 1) * len]);
            }
            let low = lattice.block_low(&order.blocks()[rank]);
            let positions = &positions[order.block_range(rank)];
            vectorised(
                #[inline(always)]
                || {
                    for (p, x) in positions.iter().enumerate() {
                        let local: [f64; D] = std::array::from_fn(|a| (x[a] * inverse_dx - low[a]).max(0.0));
                        // A component needs the weights of at most two offsets per direction; the compiler shares what it can.
                        for c in 0..D {
                            let axis: [Weights1; D] = std::array::from_fn(|a| Weights1::new(local[a], offsets[c][a]));
                            let (value, gradient) = read(&tile[c * len..(c + 1) * len], &axis);
                            values[p][c] = value;
                            for a in 0..D {
                                gradients[p][(c, a)] = gradient[a] * (4.0 * inverse_dx);
                            }
                        }
                    }
                },
            );
        },
    );
}

/// Adds up what `judge` says of every `stride`-th particle of each block, from the gradients of two sets of `D` fields there: an estimate of a
/// sum over all particles at a fraction of the price of [`gather`].
///
/// - `fields`, `offsets`: as in [`gather`]
/// - `judge(p, first, second)`: two numbers to be added up; `first` and `second` are the affine matrices of the two sets
///
/// Blocks are added in their order: the bits do not depend on the thread count.
pub fn sum_over_some<const D: usize>(
    grid: &BlockGrid<D>,
    order: &ParticleOrder<D>,
    positions: &[Vector<D>],
    stride: usize,
    fields: [[&[f64]; D]; 2],
    offsets: [[f64; D]; D],
    judge: impl Fn(usize, &Tensor<D>, &Tensor<D>) -> [f64; 2] + Sync,
) -> [f64; 2] {
    let lattice = grid.lattice;
    let inverse_dx = 1.0 / lattice.dx;
    let len = padded_len::<D>();
    let of_block = |tiles: &mut Vec<f64>, rank: usize| {
        let block = grid.occupied()[rank] as usize;
        for (tile, field) in tiles.chunks_exact_mut(len).zip(fields.as_flattened()) {
            load(grid, block, &Part::WHOLE, field, tile);
        }
        let low = lattice.block_low(&order.blocks()[rank]);
        let mut sums = [0.0; 2];
        for p in order.block_range(rank).step_by(stride) {
            let local: [f64; D] = std::array::from_fn(|a| (positions[p][a] * inverse_dx - low[a]).max(0.0));
            let mut gradients = [Tensor::<D>::zeros(); 2];
            for c in 0..D {
                let axis: [Weights1; D] = std::array::from_fn(|a| Weights1::new(local[a], offsets[c][a]));
                for (set, of) in gradients.iter_mut().enumerate() {
                    let (_, gradient) = read(&tiles[(set * D + c) * len..][..len], &axis);
                    for a in 0..D {
                        of[(c, a)] = gradient[a] * (4.0 * inverse_dx);
                    }
                }
            }
            let said = judge(p, &gradients[0], &gradients[1]);
            sums = [sums[0] + said[0], sums[1] + said[1]];
        }
        sums
    };
    let sums: Vec<[f64; 2]> =
        (0..grid.occupied().len()).into_par_iter().map_init(|| vec![0.0; 2 * D * len], of_block).collect();
    sums.into_iter().fold([0.0; 2], |total, part| [total[0] + part[0], total[1] + part[1]])
}

/// Value and first moment [cells] of a tile under the given weights.
#[inline(always)]
fn read<const D: usize>(tile: &[f64], axis: &[Weights1; D]) -> (f64, [f64; D]) {
    let base: [usize; D] = std::array::from_fn(|a| (axis[a].base + 1).clamp(0, 4) as usize);
    let [w0, w1, w2] = axis[0].weight;
    let wx = Lanes([w0, w1, w2, 0.0]);
    let (mut sum, mut sum_y, mut sum_z) = (Lanes::ZERO, Lanes::ZERO, Lanes::ZERO);
    let (ny, nz) = (if D > 1 { 3 } else { 1 }, if D > 2 { 3 } else { 1 });
    for k in 0..nz {
        let (wz, dz, z) = if D > 2 { (axis[2].weight[k], axis[2].distance[k], base[2] + k) } else { (1.0, 0.0, 0) };
        for j in 0..ny {
            let (wy, dy, y) = if D > 1 { (axis[1].weight[j], axis[1].distance[j], base[1] + j) } else { (1.0, 0.0, 0) };
            let start = (z * if D > 1 { WIDTH } else { 1 } + y) * ROW + base[0];
            let row = &tile[start..start + 4];
            let s = Lanes([row[0], row[1], row[2], row[3]]) * wx;
            let w = wz * wy;
            sum += s * w;
            if D > 1 {
                sum_y += s * (w * dy);
            }
            if D > 2 {
                sum_z += s * (w * dz);
            }
        }
    }
    let [d0, d1, d2] = axis[0].distance;
    let along_x = (sum * Lanes([d0, d1, d2, 0.0])).sum();
    let gradient: [f64; D] = std::array::from_fn(|a| match a {
        0 => along_x,
        1 => sum_y.sum(),
        _ => sum_z.sum(),
    });
    (sum.sum(), gradient)
}
