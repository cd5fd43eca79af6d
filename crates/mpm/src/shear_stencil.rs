//! Gradients at the `2^D` points of cells, and forces from the stresses there, by sums that factorise by direction.
//!
//! Weights at sub-cell centres are constants. A block is swept in slices of cells with one x: what the rows of its tile are worth at the two
//! points along x is summed once for all cells that share the row, what its planes are worth at the four points along x and y once for
//! all cells that share the plane, and only the last direction is summed cell by cell. Forces go the same way back.
//!
//! ```text
//! rows (y, z) ──x──▶ both points along x ──y──▶ four points of a plane z ──z──▶ gradients at the points of a cell
//!      ▲                     ▲                        ▲                                   │ act
//!      └────────xᵀ───────────┴──────────yᵀ────────────┴─────────────zᵀ───────────  stresses there
//! ```
//!
//! Only rows and planes that a cell in use needs are touched: streams thinner than a block fill few of its cells.

use particle_grid::tile::{ROW, WIDTH};
use particle_grid::{BLOCK, Lanes};

/// One number at each point of a cell: lanes over four points, x fastest, those of the lower half first.
pub type Points = [Lanes; 2];
/// Nothing at all points.
pub const NOTHING: Points = [Lanes::ZERO; 2];

/// Weights and slopes of the two points of a cell along one direction, on nodes `−1, 0, 1, 2` relative to the cell.
///
/// `faced` belongs to the direction normal to the faces of a component (nodes on the low side of cells), the other to the
/// rest. Slopes are `4 w d` with `d` in cells. Each point sees three of the four nodes, from `first` on.
struct Line {
    first: [usize; 2],
    weight: [[f64; 4]; 2],
    slope: [[f64; 4]; 2],
}

const fn line(faced: bool) -> Line {
    let mut out = Line { first: [0, if faced { 1 } else { 0 }], weight: [[0.0; 4]; 2], slope: [[0.0; 4]; 2] };
    let mut point = 0;
    while point < 2 {
        // Distance of the point from the middle node of its stencil.
        let f = if faced == (point == 0) { 0.25 } else { -0.25 };
        let w = [0.5 * (0.5 - f) * (0.5 - f), 0.75 - f * f, 0.5 * (0.5 + f) * (0.5 + f)];
        let d = [-1.0 - f, -f, 1.0 - f];
        let mut i = 0;
        while i < 3 {
            let node = out.first[point] + i;
            out.weight[point][node] = w[i];
            out.slope[point][node] = 4.0 * w[i] * d[i];
            i += 1;
        }
        point += 1;
    }
    out
}

/// Squares of weights and slopes: what a diagonal needs.
const fn squared(of: &Line) -> Line {
    let mut out = Line { first: of.first, weight: [[0.0; 4]; 2], slope: [[0.0; 4]; 2] };
    let mut k = 0;
    while k < 8 {
        let (p, i) = (k / 4, k % 4);
        out.weight[p][i] = of.weight[p][i] * of.weight[p][i];
        out.slope[p][i] = of.slope[p][i] * of.slope[p][i];
        k += 1;
    }
    out
}

/// All constants of the stencils of one component.
pub struct Lines {
    /// Along x: for node `i` the lanes (weights of both points, slopes of both points).
    x: [Lanes; 4],
    /// The same, lane by lane: the four nodes of each.
    x_by_lane: [Lanes; 4],
    y: Line,
    z: Line,
}

const fn lines(component: usize, square: bool) -> Lines {
    let x = if square { squared(&line(component == 0)) } else { line(component == 0) };
    let y = if square { squared(&line(component == 1)) } else { line(component == 1) };
    let z = if square { squared(&line(component == 2)) } else { line(component == 2) };
    let mut out = Lines { x: [Lanes([0.0; 4]); 4], x_by_lane: [Lanes([0.0; 4]); 4], y, z };
    let mut i = 0;
    while i < 4 {
        let lanes = [x.weight[0][i], x.weight[1][i], x.slope[0][i], x.slope[1][i]];
        out.x[i] = Lanes(lanes);
        let mut l = 0;
        while l < 4 {
            out.x_by_lane[l].0[i] = lanes[l];
            l += 1;
        }
        i += 1;
    }
    out
}

/// Constants per component.
pub static LINES: [Lines; 3] = [lines(0, false), lines(1, false), lines(2, false)];
/// Their squares.
pub static SQUARES: [Lines; 3] = [lines(0, true), lines(1, true), lines(2, true)];

/// What the four points along x and y of a cell get from one plane: values, slopes along x, slopes along y.
type Plane = [Lanes; 3];

/// Results per row, by z and y.
type Rows = [[Lanes; WIDTH]; WIDTH];

/// Bits of the nodes that a cell's stencil covers along one direction.
const STENCIL: u8 = 0b1111;

/// Places in a tile of the first of four nodes along x.
#[inline(always)]
const fn row_at(cx: usize, y: usize, z: usize) -> usize {
    (z * WIDTH + y) * ROW + cx
}

/// Indices of the set bits, from the lowest.
#[inline(always)]
fn bits(mut of: u8) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        (of != 0).then(|| {
            let k = of.trailing_zeros() as usize;
            of &= of - 1;
            k
        })
    })
}

/// Lets `act(cell, gradients)` give the stresses at the points of every cell in use, and adds the forces of those to a tile.
///
/// - `used`: bit set of the cells of the block, x fastest
/// - `input`: tiles of the components, one after the other; absent where `act` needs no gradients
/// - `result`: tiles of the components, added to
/// - gradients and stresses: by component and axis [1/cell]
#[inline(always)]
pub fn sweep<const D: usize>(
    used: u64,
    input: Option<&[f64]>,
    result: &mut [f64],
    lines: &[Lines; 3],
    mut act: impl FnMut(usize, &[[Points; 3]; 3]) -> [[Points; 3]; 3],
) {
    let len = particle_grid::tile::padded_len::<D>();
    let mut rows = [[[Lanes::ZERO; WIDTH]; WIDTH]; 3];
    let mut planes = [[[Lanes::ZERO; 3]; WIDTH]; 3];
    let mut forces = [[[Lanes::ZERO; WIDTH]; WIDTH]; 3];
    let mut plane_forces = [[[Lanes::ZERO; 3]; WIDTH]; 3];
    for cx in 0..BLOCK {
        // Cells of this slice: per y, bits over z. Rows that they need: per plane z, bits over y.
        let mut columns = [0u8; BLOCK];
        let mut needed = [0u8; WIDTH];
        let mut planes_needed = 0u8;
        for (cy, column) in columns.iter_mut().enumerate() {
            for cz in 0..if D > 2 { BLOCK } else { 1 } {
                if used >> ((cz * BLOCK + cy) * BLOCK + cx) & 1 == 1 {
                    *column |= 1 << cz;
                    for z in cz..cz + if D > 2 { 4 } else { 1 } {
                        needed[z] |= STENCIL << cy;
                    }
                }
            }
            planes_needed |= dilated::<D>(*column);
        }
        if planes_needed == 0 {
            continue;
        }
        for c in 0..D {
            for z in bits(planes_needed) {
                for y in bits(needed[z]) {
                    if let Some(input) = input {
                        let row = &input[c * len + row_at(cx, y, z)..][..4];
                        let x = &lines[c].x;
                        rows[c][z][y] = x[0] * row[0] + x[1] * row[1] + (x[2] * row[2] + x[3] * row[3]);
                    }
                    forces[c][z][y] = Lanes::ZERO;
                }
            }
        }
        for (cy, &column) in columns.iter().enumerate() {
            let covered = dilated::<D>(column);
            for c in 0..D {
                for z in bits(covered) {
                    if input.is_some() {
                        planes[c][z] = along_y(&rows[c], cy, z, &lines[c].y);
                    }
                    plane_forces[c][z] = [Lanes::ZERO; 3];
                }
            }
            for cz in bits(column) {
                let mut g = [[NOTHING; 3]; 3];
                if input.is_some() {
                    for c in 0..D {
                        g[c] = along_z::<D>(&planes[c], cz, &lines[c].z);
                    }
                }
                let l = act((cz * BLOCK + cy) * BLOCK + cx, &g);
                for c in 0..D {
                    back_along_z::<D>(&mut plane_forces[c], cz, &lines[c].z, &l[c]);
                }
            }
            for c in 0..D {
                for z in bits(covered) {
                    back_along_y(&mut forces[c], cy, z, &lines[c].y, &plane_forces[c][z]);
                }
            }
        }
        for c in 0..D {
            for z in bits(planes_needed) {
                for y in bits(needed[z]) {
                    let x = &lines[c].x_by_lane;
                    let [a, b, s, t] = forces[c][z][y].0;
                    let sum = (x[0] * a + x[1] * b) + (x[2] * s + x[3] * t);
                    let row = &mut result[c * len + row_at(cx, y, z)..][..4];
                    for i in 0..4 {
                        row[i] += sum.0[i];
                    }
                }
            }
        }
    }
}

/// Planes that the cells of a column reach.
#[inline(always)]
fn dilated<const D: usize>(column: u8) -> u8 {
    if D > 2 { column | column << 1 | column << 2 | column << 3 } else { column }
}

/// What the four points of cell row `cy` get from plane `z`.
#[inline(always)]
fn along_y(rows: &Rows, cy: usize, z: usize, y: &Line) -> Plane {
    let mut value = [Lanes::ZERO; 2];
    let mut slope = [Lanes::ZERO; 2];
    for t in 0..2 {
        for j in y.first[t]..y.first[t] + 3 {
            let row = rows[z][cy + j];
            value[t] += row * y.weight[t][j];
            slope[t] += row * y.slope[t][j];
        }
    }
    let [v, w] = [value[0].0, value[1].0];
    [
        Lanes([v[0], v[1], w[0], w[1]]),
        Lanes([v[2], v[3], w[2], w[3]]),
        Lanes([slope[0].0[0], slope[0].0[1], slope[1].0[0], slope[1].0[1]]),
    ]
}

/// Transpose of [`along_y`].
#[inline(always)]
fn back_along_y(rows: &mut Rows, cy: usize, z: usize, y: &Line, [values, x_slopes, y_slopes]: &Plane) {
    for t in 0..2 {
        let (p, q) = (2 * t, 2 * t + 1);
        let value = Lanes([values.0[p], values.0[q], x_slopes.0[p], x_slopes.0[q]]);
        let slope = Lanes([y_slopes.0[p], y_slopes.0[q], 0.0, 0.0]);
        for j in y.first[t]..y.first[t] + 3 {
            rows[z][cy + j] += value * y.weight[t][j] + slope * y.slope[t][j];
        }
    }
}

/// Gradients at the points of cell `cz` of a column.
#[inline(always)]
fn along_z<const D: usize>(planes: &[Plane; WIDTH], cz: usize, z: &Line) -> [Points; 3] {
    let mut g = [NOTHING; 3];
    if D == 2 {
        g[0][0] = planes[0][1];
        g[1][0] = planes[0][2];
        return g;
    }
    for u in 0..2 {
        for k in z.first[u]..z.first[u] + 3 {
            let [values, x_slopes, y_slopes] = planes[cz + k];
            g[0][u] += x_slopes * z.weight[u][k];
            g[1][u] += y_slopes * z.weight[u][k];
            g[2][u] += values * z.slope[u][k];
        }
    }
    g
}

/// Transpose of [`along_z`].
#[inline(always)]
fn back_along_z<const D: usize>(planes: &mut [Plane; WIDTH], cz: usize, z: &Line, l: &[Points; 3]) {
    if D == 2 {
        planes[0][1] += l[0][0];
        planes[0][2] += l[1][0];
        return;
    }
    for u in 0..2 {
        for k in z.first[u]..z.first[u] + 3 {
            let [values, x_slopes, y_slopes] = &mut planes[cz + k];
            *x_slopes += l[0][u] * z.weight[u][k];
            *y_slopes += l[1][u] * z.weight[u][k];
            *values += l[2][u] * z.slope[u][k];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use numerics::bspline::Weights1;
    use particle_grid::tile::padded_len;

    #[test]
    fn constant_weights_are_those_of_the_kernel() {
        for (faced, l) in [(true, line(true)), (false, line(false))] {
            for point in 0..2 {
                let w = Weights1::new(5.25 + 0.5 * point as f64, if faced { 0.0 } else { 0.5 });
                for i in 0..3 {
                    let node = (w.base - 4) as usize + i;
                    assert!((l.weight[point][node] - w.weight[i]).abs() < 1e-15);
                    assert!((l.slope[point][node] - 4.0 * w.weight[i] * w.distance[i]).abs() < 1e-15);
                }
            }
        }
    }

    /// Gradients of a linear field are its slopes in every cell in use, whichever cells these are, and sweeping there and back is symmetric.
    fn sweeps<const D: usize>(used: u64) {
        let len = padded_len::<D>();
        let mut tiles = vec![0.0; D * len];
        let slope = |c: usize, a: usize| 1.0 + c as f64 - 0.3 * a as f64;
        for c in 0..D {
            for z in 0..if D > 2 { WIDTH } else { 1 } {
                for y in 0..WIDTH {
                    for x in 0..WIDTH {
                        let at = [x, y, z];
                        tiles[c * len + row_at(x, y, z)] =
                            0.7 + (0..D).map(|a| slope(c, a) * at[a] as f64).sum::<f64>();
                    }
                }
            }
        }
        let mut seen = 0u64;
        let mut result = vec![0.0; D * len];
        sweep::<D>(used, Some(&tiles), &mut result, &LINES, |cell, g| {
            seen |= 1 << cell;
            for c in 0..D {
                for a in 0..D {
                    for u in 0..D - 1 {
                        for value in g[c][a][u].0 {
                            assert!((value - slope(c, a)).abs() < 1e-12, "{value} not {}", slope(c, a));
                        }
                    }
                }
            }
            *g
        });
        assert_eq!(seen, used);
        // The work of these stresses on the field is what they are made of.
        let work: f64 = result.iter().zip(&tiles).map(|(r, t)| r * t).sum();
        let each: f64 = (0..D * D).map(|k| slope(k / D, k % D).powi(2)).sum();
        let expected = f64::from(used.count_ones()) * f64::from(1 << D) * each;
        assert!((work - expected).abs() < 1e-11 * expected, "{work} {expected}");
    }

    #[test]
    fn gradients_are_exact_for_linear_fields_in_whatever_cells_are_used() {
        for used in [u64::MAX, 1, 1 << 63, 0x8000_0000_0000_0001, 0x0010_0400_8000_2001, 0x00f0_0000_000f_0000] {
            sweeps::<3>(used);
            sweeps::<2>(used & 0xffff | 2);
        }
    }
}
