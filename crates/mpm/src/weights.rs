//! Stage 4: where solids and the free surface are on the grid.
//!
//! *Solids.* Faces get their open share from the distances at their corners, and the velocity of the solid. Faces at or
//! behind a wall are tied to the first face in front of it so that the velocity vanishes (or slips) on the wall itself, not on
//! the nearest node: no-slip is then second-order accurate wherever the wall lies in the cell.
//!
//! *Free surface.* The kernel-smoothed liquid fraction of a half-space is a known monotone function of the distance to its
//! surface; inverting it gives a signed distance that is unbiased for flat surfaces in any direction (exact along axes), with no
//! particle radius to calibrate. Near walls the fraction is divided by the share of the kernel that is open: exactly for plane
//! walls and where two of them meet at a right angle or face each other, interpolated in between, within one solid as between two.
//!
//! *Threads.* What is thinner than a cell fills no cell to its centre, and a thread without pressure is nonsense where the liquid bears
//! shear: its axial tension comes with a radial push of half the size, which only the pressure balances. The cells in which such a thread
//! or sheet is thickest therefore count as liquid. (A stream of shaving cream that thins to nine tenths of its radius, two cells wide, swelled to thrice
//! its width without.)

use crate::arrays;
use crate::grid::{LiquidGrid, WallTie};
use crate::settings::PressureSettings;
use crate::solid::{Nearest, Solid, distance, nearest};
use crate::{LiquidError, open_fraction};
use numerics::bspline;
use numerics::tensor::Vector;
use particle_grid::lattice::local_digits;
use particle_grid::{BLOCK, BlockGrid, CENTRE, NONE, cells_per_block, mac_offset};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Distance [cells] below which a face counts as belonging to the wall.
const AT_WALL: f64 = 0.4;
/// Solids are taken this much larger [cells], so that a face lying exactly on a wall counts as closed.
const SKIN: f64 = 1e-6;
/// A cell holds the thickest part of a thread if it is filled at least this much as well as the best of its neighbours …
const RIDGE: f64 = 0.8;
/// … and at least this much in all: less is spray.
const CRUMB: f64 = 0.1;
/// How deep the centre of such a cell counts as lying in the liquid [cells].
const THREAD_DEPTH: f64 = 0.25;
/// Faces whose normal component exceeds this share (squared cosine) are left to the pressure where they are open.
const NORMAL_SHARE: f64 = 0.5;

/// What the stage found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WeightsReport {
    /// Cells that count as liquid.
    pub liquid_cells: usize,
    /// Faces tied by walls.
    pub tied_faces: usize,
    /// Blocks near a solid.
    pub blocks_near_solids: usize,
}

/// Open shares and solid velocities of the faces of one block, one direction.
type FaceSlices<'a> = (&'a mut [f64], &'a mut [f64]);

/// What one block contributes.
struct BlockWeights {
    ties: Vec<WallTie>,
    near: bool,
}

/// Fills open shares, solid velocities, wall ties, distances to solids and to the free surface.
///
/// - `solid_fraction`: volume fraction taken by strands in each cell, if any [1]
///
/// # Errors
/// Never at present; kept for symmetry with the other stages.
pub fn weights<const D: usize, S: Solid<D>>(
    grid: &mut LiquidGrid<D>,
    solids: &[S],
    solid_fraction: Option<&[f64]>,
    settings: &PressureSettings,
) -> Result<WeightsReport, LiquidError> {
    let n = grid.blocks.node_count();
    let per = cells_per_block::<D>();
    for face in &mut grid.face {
        face.open.clear();
        arrays::resize(&mut face.open, n, 1.0);
        face.solid_velocity.clear();
        arrays::resize(&mut face.solid_velocity, n, 0.0);
    }
    grid.cell.solid_distance.clear();
    arrays::resize(&mut grid.cell.solid_distance, n, f64::INFINITY);
    grid.cell.kernel_open.clear();
    arrays::resize(&mut grid.cell.kernel_open, n, 1.0);
    grid.ties.clear();
    grid.near_solid.clear();
    grid.near_solid.resize(grid.blocks.block_count(), false);
    if !solids.is_empty() {
        let mut face: Vec<(Vec<f64>, Vec<f64>)> = grid
            .face
            .iter_mut()
            .map(|f| (std::mem::take(&mut f.open), std::mem::take(&mut f.solid_velocity)))
            .collect();
        let mut cell = std::mem::take(&mut grid.cell.solid_distance);
        let mut kernel = std::mem::take(&mut grid.cell.kernel_open);
        let view = &*grid;
        // One slice per block and field, so that blocks can be filled side by side.
        let mut parts: Vec<(Vec<FaceSlices<'_>>, &mut [f64], &mut [f64])> =
            cell.chunks_mut(per).zip(kernel.chunks_mut(per)).map(|(c, k)| (Vec::with_capacity(D), c, k)).collect();
        for (open, velocity) in &mut face {
            for (part, (o, v)) in parts.iter_mut().zip(open.chunks_mut(per).zip(velocity.chunks_mut(per))) {
                part.0.push((o, v));
            }
        }
        let found: Vec<BlockWeights> = parts
            .into_par_iter()
            .enumerate()
            .map(|(block, (mut faces, cells, open))| fill_block(view, solids, block, &mut faces, cells, open))
            .collect();
        grid.cell.solid_distance = cell;
        grid.cell.kernel_open = kernel;
        for (a, (open, velocity)) in face.into_iter().enumerate() {
            grid.face[a].open = open;
            grid.face[a].solid_velocity = velocity;
        }
        for (block, mut w) in found.into_iter().enumerate() {
            grid.near_solid[block] = w.near;
            grid.ties.append(&mut w.ties);
        }
        grid.ties.sort_by_key(|t| (t.axis, t.face));
    }
    liquid_distance(grid, solid_fraction, settings);
    Ok(WeightsReport {
        liquid_cells: grid.cell.liquid_distance.iter().filter(|&&d| d < 0.0).count(),
        tied_faces: grid.ties.len(),
        blocks_near_solids: grid.near_solid.iter().filter(|&&b| b).count(),
    })
}

fn fill_block<const D: usize, S: Solid<D>>(
    grid: &LiquidGrid<D>,
    solids: &[S],
    block: usize,
    faces: &mut [FaceSlices<'_>],
    cells: &mut [f64],
    kernel_open: &mut [f64],
) -> BlockWeights {
    let lattice = grid.lattice();
    let dx = lattice.dx;
    let coordinates = grid.blocks.blocks()[block];
    let low: [i32; D] = std::array::from_fn(|a| coordinates[a] * BLOCK as i32);
    let centre = lattice.node_position(&low, &[0.5 * BLOCK as f64; D]);
    // A distance changes by no more than the way walked: far blocks need no look at their cells.
    let reach = (0.5 * BLOCK as f64 * (D as f64).sqrt() + 2.0) * dx;
    let from_centre = distance(solids, &centre);
    if from_centre > reach {
        cells.fill(from_centre);
        return BlockWeights { ties: Vec::new(), near: false };
    }
    let corners_per_axis = BLOCK + 1;
    let mut corner = vec![0.0; corners_per_axis.pow(D as u32)];
    for (k, c) in corner.iter_mut().enumerate() {
        let mut rest = k;
        let at: [i32; D] = std::array::from_fn(|a| {
            let digit = rest % corners_per_axis;
            rest /= corners_per_axis;
            low[a] + digit as i32
        });
        *c = distance(solids, &lattice.node_position(&at, &[0.0; D])) - SKIN * dx;
    }
    let corner_at = |digits: &[usize; D]| {
        let mut index = 0;
        for a in (0..D).rev() {
            index = index * corners_per_axis + digits[a];
        }
        corner[index]
    };
    let per = cells_per_block::<D>();
    let mut ties = Vec::new();
    let mut normals = Vec::new();
    for local in 0..per {
        let digits = local_digits::<D>(local);
        let cell: [i32; D] = std::array::from_fn(|a| low[a] + digits[a] as i32);
        let middle = lattice.node_position(&cell, &[CENTRE; D]);
        cells[local] = distance(solids, &middle);
        if cells[local] < 1.5 * dx {
            kernel_open[local] = open_kernel(solids, &middle, dx, &mut normals);
        }
        for axis in 0..D {
            let open = 1.0 - covered(&digits, axis, &corner_at);
            faces[axis].0[local] = open;
            let x = lattice.node_position(&cell, &mac_offset(axis));
            let gap = distance(solids, &x);
            if open >= 1.0 && gap >= AT_WALL * dx {
                continue;
            }
            let Some(wall) = nearest(solids, &x) else { continue };
            faces[axis].1[local] = wall.velocity[axis];
            let node = block * per + local;
            if grid.face[axis].mass[node] <= grid.mass_floor || gap >= AT_WALL * dx {
                continue;
            }
            if let Some(tie) = tie(grid, solids, axis, node, &x, &wall, open) {
                ties.push(tie);
            }
        }
    }
    BlockWeights { ties, near: true }
}

/// Share of the kernel around a point that solids leave open.
///
/// Each solid is taken for its tangent planes: that at the point and, where it turns towards the point within the reach of the kernel (the
/// corner of a pot), those beyond the turn. Planes at a right angle leave the product of their shares, planes facing each other what both
/// leave; of planes along each other only the nearest counts.
fn open_kernel<const D: usize, S: Solid<D>>(
    solids: &[S],
    x: &Vector<D>,
    dx: f64,
    normals: &mut Vec<(f64, Vector<D>)>,
) -> f64 {
    normals.clear();
    for s in solids {
        if s.distance(x) < 1.5 * dx {
            normals.push(s.sample(x));
            turns(s, x, dx, normals);
        }
    }
    normals.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut open = 1.0;
    for (k, (distance, normal)) in normals.iter().enumerate() {
        let share = bspline::integral((distance / dx).clamp(-1.5, 1.5));
        let (mut along, mut against) = (0.0f64, 0.0f64);
        for (_, other) in &normals[..k] {
            let cosine = normal.dot(other);
            along = along.max(cosine);
            against = against.max(-cosine);
        }
        let corner = open * share.powf(1.0 - along.min(1.0));
        let gap = open + share - 1.0;
        open = corner + against.min(1.0) * (gap - corner);
    }
    open.max(1.0 / 48.0)
}

/// Adds the tangent planes of a solid beyond the edges where it turns towards a point; the last in the list is that at the point.
///
/// Around a point the distance to what turns towards it is the least of the distances to its planes: a step aside that is nearer to the solid
/// than the plane at the point sees another one. (Away from edges that point out a step aside is farther, and nothing is added.)
fn turns<const D: usize, S: Solid<D>>(solid: &S, x: &Vector<D>, dx: f64, planes: &mut Vec<(f64, Vector<D>)>) {
    let Some(&(distance, normal)) = planes.last() else { return };
    for a in 0..D {
        for step in [-1.5 * dx, 1.5 * dx] {
            let mut aside = *x;
            aside[a] += step;
            let (there, other) = solid.sample(&aside);
            let here = there - other[a] * step;
            let turned = there < distance + normal[a] * step - 1e-6 * dx && normal.dot(&other) < 1.0 - 1e-6;
            if turned && here >= distance - 1e-6 * dx && here < 1.5 * dx {
                planes.push((here, other));
            }
        }
    }
}

/// Share of a face that is covered by solids.
fn covered<const D: usize>(digits: &[usize; D], axis: usize, corner: &impl Fn(&[usize; D]) -> f64) -> f64 {
    let shifted = |shift: &[usize]| {
        let mut d = *digits;
        for &a in shift {
            d[a] += 1;
        }
        corner(&d)
    };
    match D {
        2 => open_fraction::inside_of_segment(shifted(&[]), shifted(&[1 - axis])),
        _ => {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            open_fraction::inside_of_square([shifted(&[]), shifted(&[u]), shifted(&[u, v]), shifted(&[v])])
        }
    }
}

/// Ties a face at a wall to the first face in front of it.
fn tie<const D: usize, S: Solid<D>>(
    grid: &LiquidGrid<D>,
    solids: &[S],
    axis: usize,
    node: usize,
    x: &Vector<D>,
    wall: &Nearest<D>,
    open: f64,
) -> Option<WallTie> {
    let dx = grid.lattice().dx;
    let normal_share = wall.normal[axis] * wall.normal[axis];
    let along_normal = normal_share > NORMAL_SHARE;
    // How far the component is held: fully along the normal of a closed face, by the stickiness across it.
    let hold = wall.stick + (1.0 - wall.stick) * normal_share;
    if open > 0.0 && (along_normal || wall.stick == 0.0) {
        return None;
    }
    let out = wall.normal.iamax();
    let side = if wall.normal[out] > 0.0 { 1 } else { -1 };
    let prescribed =
        WallTie { axis: axis as u8, face: node as u32, source: NONE, ratio: 0.0, offset: wall.velocity[axis] };
    let mut source = node as u32;
    for k in 1..=3 {
        source = grid.blocks.along(source as usize, out, side);
        if source == NONE {
            return Some(prescribed);
        }
        let mut y = *x;
        y[out] += f64::from(k * side) * dx;
        let gap = distance(solids, &y);
        if gap >= AT_WALL * dx {
            if grid.face[axis].mass[source as usize] <= grid.mass_floor {
                return Some(prescribed);
            }
            let mirrored = wall.distance / gap;
            let ratio = hold * mirrored + (1.0 - hold);
            let offset = hold * (1.0 - mirrored) * wall.velocity[axis];
            return Some(WallTie { source, ratio, offset, ..prescribed });
        }
    }
    Some(prescribed)
}

/// Distance to the free surface from the smoothed liquid fraction.
fn liquid_distance<const D: usize>(
    grid: &mut LiquidGrid<D>,
    solid_fraction: Option<&[f64]>,
    settings: &PressureSettings,
) {
    let n = grid.blocks.node_count();
    let dx = grid.lattice().dx;
    let shift = bspline::inverse_integral(settings.liquid_threshold);
    let LiquidGrid { blocks, cell, elastic, .. } = grid;
    arrays::resize(&mut cell.liquid_distance, n, 0.0);
    let (fraction, solid, kernel) = (&cell.liquid_fraction, &cell.solid_distance, &cell.kernel_open);
    // The kernel of a cell at a wall reaches into the solid, where there is no liquid.
    let filled = |i: usize| {
        let strands = solid_fraction.map_or(0.0, |s| s[i]).min(0.95);
        fraction[i] / (kernel[i] * (1.0 - strands))
    };
    cell.liquid_distance.par_iter_mut().enumerate().with_min_len(4096).for_each(|(i, d)| {
        if fraction[i] <= 0.0 {
            *d = 1.5 * dx;
            return;
        }
        let here = filled(i);
        *d = -dx * (bspline::inverse_integral(here.min(1.0)) - shift);
        if solid[i] < 0.0 && fraction[i] > 1e-3 {
            // The open rest of a cell whose centre lies in the solid continues the liquid in front of it.
            *d = d.min(-0.5 * dx);
        }
        if *elastic && *d >= 0.0 && here >= CRUMB && here >= RIDGE * fullest_around(blocks, i, &filled) {
            *d = -THREAD_DEPTH * dx;
        }
    });
}

/// The largest fill among the cells around one, diagonals included.
fn fullest_around<const D: usize>(blocks: &BlockGrid<D>, node: usize, filled: &impl Fn(usize) -> f64) -> f64 {
    let mut most = 0.0f64;
    for around in 0..3usize.pow(D as u32) {
        let (mut at, mut rest) = (node as u32, around);
        for axis in 0..D {
            let step = (rest % 3) as i32 - 1;
            rest /= 3;
            if step != 0 && at != NONE {
                at = blocks.along(at as usize, axis, step);
            }
        }
        if at != NONE && at != node as u32 {
            most = most.max(filled(at as usize));
        }
    }
    most
}
