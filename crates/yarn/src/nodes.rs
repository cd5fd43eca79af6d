//! Velocities of grid nodes: momentum over mass, loads, obstacles, pins and walls.

use nalgebra::SVector;
use particle_grid::cells_per_block;
use rayon::prelude::*;

use crate::boundary::{Actor, BoundarySample};
use crate::grid::{MASS, Transfer, lanes, momentum};
use crate::settings::AttractorSample;

/// Loads on every node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Loads<const D: usize> {
    pub gravity: SVector<f64, D>,
    pub attractor: Option<AttractorSample<D>>,
}

impl<const D: usize> Loads<D> {
    /// Acceleration at a position [m/s²].
    #[inline]
    pub fn acceleration(&self, x: &SVector<f64, D>) -> SVector<f64, D> {
        match &self.attractor {
            Some(attractor) => self.gravity + attractor.acceleration(x),
            None => self.gravity,
        }
    }
}

/// Impulses given to the nodes of one block, or of all [N s].
#[derive(Clone, Debug)]
pub(crate) struct Impulses<const D: usize> {
    pub body: SVector<f64, D>,
    pub walls: SVector<f64, D>,
    pub lost: SVector<f64, D>,
    pub massless: usize,
    /// Obstacles and pins that acted, in order of action.
    pub touched: Vec<(Actor, SVector<f64, D>)>,
}

impl<const D: usize> Default for Impulses<D> {
    fn default() -> Self {
        let zero = SVector::zeros();
        Self { body: zero, walls: zero, lost: zero, massless: 0, touched: Vec::new() }
    }
}

/// Totals of all blocks.
#[derive(Clone, Debug)]
pub(crate) struct Totals<const D: usize> {
    pub body: SVector<f64, D>,
    pub walls: SVector<f64, D>,
    pub lost: SVector<f64, D>,
    pub massless: usize,
    pub obstacles: Vec<SVector<f64, D>>,
    pub pins: Vec<SVector<f64, D>>,
    /// What drives gave against the internal forces on their vertices.
    pub drives: Vec<SVector<f64, D>>,
}

impl<const D: usize> Totals<D> {
    pub fn new(obstacles: usize, pins: usize) -> Self {
        let zero = SVector::zeros();
        Self {
            body: zero,
            walls: zero,
            lost: zero,
            massless: 0,
            obstacles: vec![zero; obstacles],
            pins: vec![zero; pins],
            drives: Vec::new(),
        }
    }

    /// Adds the impulses of blocks in their order.
    pub fn add(&mut self, blocks: &[Impulses<D>]) {
        for block in blocks {
            self.body += block.body;
            self.walls += block.walls;
            self.lost += block.lost;
            self.massless += block.massless;
            for (actor, impulse) in &block.touched {
                match actor {
                    Actor::Obstacle(i) => self.obstacles[*i as usize] += impulse,
                    Actor::Pin(i) => self.pins[*i as usize] += impulse,
                    Actor::Wall => self.walls += impulse,
                }
            }
        }
    }

    /// Everything that the boundary gave.
    pub fn boundary(&self) -> SVector<f64, D> {
        self.obstacles.iter().chain(&self.pins).fold(self.walls, |sum, impulse| sum + impulse)
    }
}

/// Turns the momentum of nodes into velocities at the end of the step; nodes of mass up to `least_mass` come to rest.
pub(crate) fn update<const D: usize>(
    transfer: &mut Transfer<D>,
    boundary: &BoundarySample<'_, D>,
    loads: &Loads<D>,
    dt: f64,
    least_mass: f64,
    blocks: &mut Vec<Impulses<D>>,
) {
    let per = cells_per_block::<D>();
    let grid = &transfer.grid;
    let cell = grid.lattice.dx;
    transfer
        .nodes
        .par_chunks_mut(per)
        .enumerate()
        .map_init(Vec::new, |near, (block, nodes)| {
            let mut sums = Impulses::default();
            find_near(grid.lattice.origin, grid.blocks()[block], cell, boundary, near);
            for (k, node) in nodes.iter_mut().enumerate() {
                let mass = node.0[MASS];
                let p = momentum::<D>(node);
                if mass <= least_mass {
                    if p.iter().any(|x| *x != 0.0) {
                        sums.lost -= p;
                        sums.massless += 1;
                    }
                    *node = lanes(&SVector::<f64, D>::zeros(), mass);
                    continue;
                }
                let index = grid.cell(block * per + k);
                let x = grid.lattice.node_position(&index, &[0.0; D]);
                let change = loads.acceleration(&x) * dt;
                sums.body += change * mass;
                let free = p / mass + change;
                let velocity = boundary.constrain(&index, &x, near, free, |actor, change| match actor {
                    Actor::Wall => sums.walls += change * mass,
                    _ => sums.touched.push((actor, change * mass)),
                });
                *node = lanes(&velocity, mass);
            }
            sums
        })
        .collect_into_vec(blocks);
}

/// Obstacles that can touch the nodes of a block.
pub(crate) fn find_near<const D: usize>(
    origin: SVector<f64, D>,
    block: [i32; D],
    cell: f64,
    boundary: &BoundarySample<'_, D>,
    near: &mut Vec<u32>,
) {
    let center = SVector::from_fn(|a, _| origin[a] + (f64::from(block[a] * 4) + 1.5) * cell);
    boundary.near(&center, (1.5 * (D as f64).sqrt() + 1e-9) * cell, near);
}
