//! From one cell system to the next coarser one: cells of `2^D`, couplings rediscretised, trilinear interpolation.
//!
//! *Couplings.* A coarse face collects the conductances of its fine faces at half strength, since its cells lie twice as far
//! apart. A zero face keeps its place in space: seen from the coarse centre the free surface lies half a fine cell further
//! away, which is what keeps the convergence independent of the resolution at curved surfaces.
//!
//! *Interpolation.* A fine cell takes ¾ of its parent and ¼ of the parent's neighbour on its own side, per direction. Across a
//! wall the neighbour is replaced by the cell itself (zero slope), towards a zero region it counts as zero.

use crate::multigrid_level::{Link, Links};
use crate::multigrid_system::{CellRow, CellSystem, NO_CELL};

/// The coarse system and the parent of each fine cell.
pub(crate) fn coarsen<const D: usize>(fine: &CellSystem<D>) -> (CellSystem<D>, Vec<u32>) {
    let n = fine.cells.len();
    let mut keyed: Vec<([i32; D], u32)> =
        fine.cells.iter().enumerate().map(|(i, c)| (c.map(|x| x.div_euclid(2)), i as u32)).collect();
    // The index breaks ties, so that the order of the children does not depend on the sorting method.
    keyed.sort_unstable_by_key(|(c, i)| (reversed(c), *i));
    let mut coarse = CellSystem::<D>::default();
    let mut parent = vec![NO_CELL; n];
    for (c, i) in &keyed {
        if coarse.cells.last() != Some(c) {
            coarse.cells.push(*c);
            coarse.rows.push(CellRow::default());
        }
        parent[*i as usize] = (coarse.cells.len() - 1) as u32;
    }
    let mut inverse_fraction = vec![[[0.0f64; 2]; D]; coarse.rows.len()];
    for i in 0..n {
        let p = parent[i] as usize;
        let row = &fine.rows[i];
        coarse.rows[p].own += row.own;
        for a in 0..D {
            for side in 0..2 {
                let j = row.neighbour[a][side];
                if j != NO_CELL && row.conductance[a][side] > 0.0 {
                    let q = parent[j as usize];
                    if q as usize != p {
                        coarse.rows[p].neighbour[a][side] = q;
                        coarse.rows[p].conductance[a][side] += 0.5 * row.conductance[a][side];
                    }
                }
                let zero = row.zero[a][side];
                if zero.conductance > 0.0 {
                    let outer = fine.cells[i][a].rem_euclid(2) == side as i32;
                    let fraction = 0.5 * (zero.fraction + if outer { 0.5 } else { 0.0 });
                    coarse.rows[p].zero[a][side].conductance += 0.5 * zero.conductance;
                    inverse_fraction[p][a][side] += 0.5 * zero.conductance / fraction;
                }
            }
        }
    }
    for (row, inverse) in coarse.rows.iter_mut().zip(&inverse_fraction) {
        for a in 0..D {
            for side in 0..2 {
                if row.zero[a][side].conductance > 0.0 {
                    row.zero[a][side].fraction = row.zero[a][side].conductance / inverse[a][side];
                }
            }
        }
    }
    (coarse, parent)
}

fn reversed<const D: usize>(c: &[i32; D]) -> [i32; D] {
    std::array::from_fn(|a| c[D - 1 - a])
}

/// Where a step from a coarse cell leads.
#[derive(Clone, Copy, PartialEq)]
enum Step {
    Cell(u32),
    Wall,
    Zero,
}

fn step<const D: usize>(coarse: &CellSystem<D>, from: u32, axis: usize, side: usize) -> Step {
    let row = &coarse.rows[from as usize];
    if row.neighbour[axis][side] != NO_CELL {
        Step::Cell(row.neighbour[axis][side])
    } else if row.zero[axis][side].conductance > 0.0 {
        Step::Zero
    } else {
        Step::Wall
    }
}

/// Interpolation links of the fine cells listed in `rows`, in that order.
pub(crate) fn interpolation<const D: usize>(
    fine: &CellSystem<D>,
    coarse: &CellSystem<D>,
    parent: &[u32],
    rows: &[u32],
    place: &[u32],
) -> Links {
    let mut links = Links { start: Vec::with_capacity(rows.len() + 1), link: Vec::with_capacity(rows.len() << D) };
    links.start.push(0);
    for &i in rows {
        let i = i as usize;
        let first = links.link.len();
        for combination in 0..1usize << D {
            let mut weight = 1.0f32;
            let mut at = Some(parent[i]);
            for a in 0..D {
                if combination >> a & 1 == 0 {
                    weight *= 0.75;
                    continue;
                }
                weight *= 0.25;
                let side = fine.cells[i][a].rem_euclid(2) as usize;
                at = match at.map(|c| step(coarse, c, a, side)) {
                    Some(Step::Cell(c)) => Some(c),
                    Some(Step::Wall) => at,
                    Some(Step::Zero) | None => None,
                };
            }
            let Some(cell) = at else { continue };
            let cell = place[cell as usize];
            match links.link[first..].iter_mut().find(|l| l.cell == cell) {
                Some(l) => l.weight += weight,
                None => links.link.push(Link { cell, weight }),
            }
        }
        links.start.push(links.link.len() as u32);
    }
    links
}
