//! What changes during a run.

use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use crate::report::Ledger;

/// All state of a yarn system: positions and velocities of vertices, affine velocities, deformation of segments.
///
/// Arrays have one entry per vertex; entries of segments stand at the index of their first vertex, and those of the last vertex of each yarn are unused.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct YarnState<const D: usize> {
    /// Time [s].
    pub time: f64,
    /// Steps (sub-steps counted) taken.
    pub step: u64,
    /// Positions of vertices [m].
    pub position: Vec<SVector<f64, D>>,
    /// Velocities of vertices [m/s].
    pub velocity: Vec<SVector<f64, D>>,
    /// Affine velocity matrices of vertices [1/s].
    pub affine: Vec<SMatrix<f64, D, D>>,
    /// Affine velocity matrices of quadrature points [1/s].
    pub quadrature_affine: Vec<SMatrix<f64, D, D>>,
    /// Elastic deformation gradients of segments; the first column is the edge vector over its rest length.
    pub deformation: Vec<SMatrix<f64, D, D>>,
    /// Sliding between fibres summed over the run, as a distance across the yarn's width [m].
    pub slip: Vec<f64>,
    /// Momentum that entered and left since the start.
    pub ledger: Ledger<D>,
}

impl<const D: usize> YarnState<D> {
    /// Index of the first vertex with an entry that is not finite.
    #[must_use]
    pub fn first_non_finite(&self) -> Option<usize> {
        (0..self.position.len()).find(|&i| {
            !(self.position[i].iter().all(|x| x.is_finite())
                && self.velocity[i].iter().all(|x| x.is_finite())
                && self.affine[i].iter().all(|x| x.is_finite())
                && self.quadrature_affine[i].iter().all(|x| x.is_finite())
                && self.deformation[i].iter().all(|x| x.is_finite()))
        })
    }
}
