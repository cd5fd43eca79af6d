//! The stencil of one point anywhere: for strand vertices, probes and tests, not for the particles.

use crate::blocks::{BlockGrid, NONE};
use numerics::bspline::Weights;
use numerics::tensor::Vector;

/// One node of a stencil.
#[derive(Clone, Copy, Debug)]
pub struct StencilNode<const D: usize> {
    /// Index of the node in its field.
    pub node: usize,
    /// Weight [1].
    pub weight: f64,
    /// Node minus point [m].
    pub displacement: Vector<D>,
    /// Gradient of the weight with respect to the point [1/m].
    pub gradient: Vector<D>,
}

/// Calls `visit` for the active nodes of the stencil of `x` in a field of the given offset [cells], in a fixed order.
///
/// Returns the sum of the weights of the active nodes: one where the whole stencil is active.
pub fn stencil<const D: usize>(
    grid: &BlockGrid<D>,
    x: &Vector<D>,
    offset: &[f64; D],
    mut visit: impl FnMut(StencilNode<D>),
) -> f64 {
    let lattice = &grid.lattice;
    let weights = Weights::<D>::new(&lattice.to_cells(x), offset);
    let mut total = 0.0;
    for k in 0..Weights::<D>::COUNT {
        let (index, weight, distance) = weights.node(k);
        let node = grid.node(&index);
        if node != NONE {
            total += weight;
            let gradient = weights.gradient(k);
            visit(StencilNode {
                node: node as usize,
                weight,
                displacement: Vector::from_fn(|a, _| distance[a] * lattice.dx),
                gradient: Vector::from_fn(|a, _| gradient[a] / lattice.dx),
            });
        }
    }
    total
}
