//! The grid around vertices and quadrature points: one sorted list of both, one scatter, one gather.
//!
//! Points `0..n` are the vertices, `n..2n` the quadrature points (that of segment `i` at `n + i`). Yarn arrays are never
//! permuted, so that a vertex keeps its neighbours; the sorted order is looked up.

use nalgebra::{SMatrix, SVector};
use particle_grid::{
    BlockGrid, Contribution, Lanes, Lattice, ParticleOrder, ScatterScratch, cells_per_block, gather, scatter,
};
use rayon::prelude::*;

use crate::YarnError;
use crate::forces::CHUNK;
use crate::model::YarnModel;

/// Lane that carries the mass; the others carry momentum, then velocity.
pub(crate) const MASS: usize = 3;

/// Grid, order and transfer arrays, kept between steps.
#[derive(Clone, Debug)]
pub(crate) struct Transfer<const D: usize> {
    /// Blocks.
    pub grid: BlockGrid<D>,
    order: ParticleOrder<D>,
    points: Vec<SVector<f64, D>>,
    sorted: Vec<SVector<f64, D>>,
    place: Vec<u32>,
    scratch: ScatterScratch,
    /// Momentum (or velocity) and mass of nodes.
    pub nodes: Vec<Lanes>,
    fields: [Vec<f64>; D],
    values: Vec<SVector<f64, D>>,
    gradients: Vec<SMatrix<f64, D, D>>,
}

/// Momentum lanes and mass from a vector and a mass.
#[inline(always)]
pub(crate) fn lanes<const D: usize>(v: &SVector<f64, D>, mass: f64) -> Lanes {
    let mut lanes = [0.0; 4];
    for a in 0..D {
        lanes[a] = v[a];
    }
    lanes[MASS] = mass;
    Lanes(lanes)
}

/// The vector in the momentum lanes.
#[inline(always)]
pub(crate) fn momentum<const D: usize>(lanes: &Lanes) -> SVector<f64, D> {
    SVector::from_fn(|a, _| lanes.0[a])
}

impl<const D: usize> Transfer<D> {
    pub fn new(lattice: Lattice<D>) -> Self {
        Self {
            grid: BlockGrid::new(lattice),
            order: ParticleOrder::new(),
            points: Vec::new(),
            sorted: Vec::new(),
            place: Vec::new(),
            scratch: ScatterScratch::default(),
            nodes: Vec::new(),
            fields: std::array::from_fn(|_| Vec::new()),
            values: Vec::new(),
            gradients: Vec::new(),
        }
    }

    /// Lets the grid follow the vertices; quadrature points lie midway between theirs.
    pub fn rebuild(&mut self, model: &YarnModel<D>, position: &[SVector<f64, D>]) -> Result<(), YarnError> {
        let n = model.len();
        self.points.resize(2 * n, SVector::zeros());
        let (vertices, quadrature) = self.points.split_at_mut(n);
        vertices.copy_from_slice(position);
        quadrature.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, points)| {
            for (k, point) in points.iter_mut().enumerate() {
                let i = chunk * CHUNK + k;
                *point = if model.has_segment(i) { (position[i] + position[i + 1]) * 0.5 } else { position[i] };
            }
        });
        self.order.build(&self.grid.lattice, &self.points)?;
        self.grid.rebuild(&self.order, &[]);
        let index = self.order.index();
        self.sorted.resize(2 * n, SVector::zeros());
        let points = &self.points;
        self.sorted.par_chunks_mut(CHUNK).zip(index.par_chunks(CHUNK)).for_each(|(sorted, index)| {
            for (x, &i) in sorted.iter_mut().zip(index) {
                *x = points[i as usize];
            }
        });
        self.place.resize(2 * n, 0);
        for (place, &i) in index.iter().enumerate() {
            self.place[i as usize] = place as u32;
        }
        self.nodes.resize(self.grid.node_count(), Lanes::ZERO);
        for field in &mut self.fields {
            field.resize(self.grid.node_count(), 0.0);
        }
        self.values.resize(2 * n, SVector::zeros());
        self.gradients.resize(2 * n, SMatrix::zeros());
        Ok(())
    }

    /// Sums `contribution(point)` over all points into `self.nodes`.
    pub fn scatter(&mut self, contribution: impl Fn(usize) -> Contribution<D> + Sync) {
        let index = self.order.index();
        scatter(
            &self.grid,
            &self.order,
            &self.sorted,
            &[0.0; D],
            0.0,
            |p| contribution(index[p] as usize),
            &mut self.scratch,
            &mut self.nodes,
        );
    }

    /// Interpolates the momentum lanes of `nodes` and their affine matrices at all points.
    pub fn gather_from(&mut self, nodes: &[Lanes]) {
        let per = cells_per_block::<D>();
        for (a, field) in self.fields.iter_mut().enumerate() {
            field.par_chunks_mut(16 * per).zip(nodes.par_chunks(16 * per)).for_each(|(field, nodes)| {
                for (value, node) in field.iter_mut().zip(nodes) {
                    *value = node.0[a];
                }
            });
        }
        let fields: [&[f64]; D] = std::array::from_fn(|a| self.fields[a].as_slice());
        gather(&self.grid, &self.order, &self.sorted, fields, [[0.0; D]; D], &mut self.values, &mut self.gradients);
    }

    /// Interpolates `self.nodes`.
    pub fn gather(&mut self) {
        let nodes = std::mem::take(&mut self.nodes);
        self.gather_from(&nodes);
        self.nodes = nodes;
    }

    /// Gathered value at a point.
    #[inline(always)]
    pub fn value(&self, point: usize) -> &SVector<f64, D> {
        &self.values[self.place[point] as usize]
    }

    /// Gathered affine matrix at a point [1/s].
    #[inline(always)]
    pub fn gradient(&self, point: usize) -> &SMatrix<f64, D, D> {
        &self.gradients[self.place[point] as usize]
    }
}
