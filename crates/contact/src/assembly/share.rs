//! What one strand adds to the Delassus matrix: the blocks of all pairs of contacts on it.

use super::delassus::{AssemblyError, InverseDynamics};
use super::point::ContactSide;
use crate::block::{Block, Vec3, ZERO, dot, transpose};

/// How a contact touches one strand: its velocity there is `Σ weight · velocity[dof .. dof + 3]`, signs included. A contact of
/// the strand with itself has both its sides here.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    pub contact: u32,
    terms: [(u32, f64); 4],
    count: usize,
}

impl Touch {
    pub fn new(contact: u32) -> Touch {
        Touch { contact, terms: [(0, 0.0); 4], count: 0 }
    }

    /// Adds a side of the contact, `+1` for A and `−1` for B.
    pub fn add(&mut self, side: &ContactSide, sign: f64) {
        for (dof, weight) in side.dof.iter().zip(side.weight) {
            self.terms[self.count] = (*dof, sign * weight);
            self.count += 1;
        }
    }

    pub fn terms(&self) -> &[(u32, f64)] {
        &self.terms[..self.count]
    }
}

/// Memory that is used strand after strand.
#[derive(Default)]
pub(super) struct Scratch {
    /// Touched vertices by their first freedom, ascending.
    vertices: Vec<u32>,
    /// The contacts with places in `vertices` in place of freedoms.
    placed: Vec<Touch>,
    /// Three columns of the inverse dynamics.
    columns: Vec<f64>,
    /// Compliance of touched vertices against each other, column by column.
    compliance: Vec<Block>,
    /// Column of one contact at the touched vertices.
    own: Vec<Block>,
}

/// The blocks `s_k s_l E_kᵀ N_k K⁻¹ N_lᵀ E_l` of one strand for all pairs of its contacts, as a triangle: row `l` holds those
/// with `k ≤ l`.
pub(super) struct Share {
    blocks: Vec<Block>,
}

impl Share {
    /// Block of the `i`-th and the `j`-th contact of the strand; the matrix is symmetric to the last bit.
    #[inline]
    pub fn block(&self, i: usize, j: usize) -> Block {
        if i <= j { self.blocks[j * (j + 1) / 2 + i] } else { transpose(&self.blocks[i * (i + 1) / 2 + j]) }
    }

    /// Solves for the columns and forms the blocks. Where a strand has more contacts than touched vertices, columns are solved
    /// for the vertices and combined, which a contact's column is anyway.
    pub fn assemble<D: InverseDynamics>(
        strand: usize,
        touches: &[Touch],
        bases: &[[Vec3; 3]],
        dynamics: &D,
        scratch: &mut Scratch,
    ) -> Result<Share, AssemblyError> {
        let Scratch { vertices, placed, columns, compliance, own } = scratch;
        vertices.clear();
        vertices.extend(touches.iter().flat_map(|touch| touch.terms().iter().map(|term| term.0)));
        vertices.sort_unstable();
        vertices.dedup();
        placed.clear();
        placed.extend(touches.iter().map(|touch| {
            let mut placed = *touch;
            for term in &mut placed.terms[..touch.count] {
                term.0 = vertices.partition_point(|vertex| *vertex < term.0) as u32;
            }
            placed
        }));
        columns.clear();
        columns.resize(3 * dynamics.dofs(strand), 0.0);
        let mut solve = |terms: &[(u32, f64)], out: &mut [Block]| {
            columns.fill(0.0);
            for (place, weight) in terms {
                for c in 0..3 {
                    columns[3 * (vertices[*place as usize] as usize + c) + c] += weight;
                }
            }
            dynamics.apply_three(strand, columns);
            for (out, vertex) in out.iter_mut().zip(&*vertices) {
                out.copy_from_slice(&columns[3 * *vertex as usize..][..9]);
            }
        };
        let count = vertices.len();
        let by_vertex = count < touches.len();
        if by_vertex {
            compliance.clear();
            compliance.resize(count * count, ZERO);
            for (place, column) in compliance.chunks_exact_mut(count).enumerate() {
                solve(&[(place as u32, 1.0)], column);
            }
        }
        own.clear();
        own.resize(count, ZERO);
        let mut blocks = Vec::with_capacity(touches.len() * (touches.len() + 1) / 2);
        for (l, touch_l) in placed.iter().enumerate() {
            if by_vertex {
                own.fill(ZERO);
                for (place, weight) in touch_l.terms() {
                    let column = &compliance[*place as usize * count..][..count];
                    for (own, at) in own.iter_mut().zip(column) {
                        add_scaled(own, *weight, at);
                    }
                }
            } else {
                solve(touch_l.terms(), own);
            }
            let el = &bases[touch_l.contact as usize];
            for at in own.iter_mut() {
                *at = turned(at, el);
            }
            for touch_k in &placed[..=l] {
                let mut world = ZERO;
                for (place, weight) in touch_k.terms() {
                    add_scaled(&mut world, *weight, &own[*place as usize]);
                }
                blocks.push(seen_from(&bases[touch_k.contact as usize], &world));
            }
            if let Some(own) = blocks.last_mut() {
                // symmetric but for round-off
                let t = transpose(own);
                *own = [0, 1, 2, 3, 4, 5, 6, 7, 8].map(|e| 0.5 * (own[e] + t[e]));
            }
        }
        if blocks.iter().flatten().all(|x| x.is_finite()) {
            Ok(Share { blocks })
        } else {
            Err(AssemblyError::NotFinite { strand })
        }
    }
}

#[inline(always)]
fn add_scaled(sum: &mut Block, weight: f64, block: &Block) {
    for e in 0..9 {
        sum[e] += weight * block[e];
    }
}

/// `M E`, with the axes as the columns of `E`.
#[inline(always)]
fn turned(m: &Block, axes: &[Vec3; 3]) -> Block {
    let mut out = ZERO;
    for i in 0..3 {
        let row = [m[3 * i], m[3 * i + 1], m[3 * i + 2]];
        for j in 0..3 {
            out[3 * i + j] = dot(&row, &axes[j]);
        }
    }
    out
}

/// `Eᵀ M`.
#[inline(always)]
fn seen_from(axes: &[Vec3; 3], m: &Block) -> Block {
    let mut out = ZERO;
    for i in 0..3 {
        for j in 0..3 {
            out[3 * i + j] = axes[i][0] * m[j] + axes[i][1] * m[3 + j] + axes[i][2] * m[6 + j];
        }
    }
    out
}
