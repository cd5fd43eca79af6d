//! Walls: layers of grid nodes at the sides of the domain.

use nalgebra::SVector;

use super::obstacle::rub;
use crate::YarnError;
use crate::settings::{DomainSettings, WallKind, vector};

/// The walls of a box.
#[derive(Clone, Debug)]
pub(crate) struct Walls<const D: usize> {
    /// Low corner [m].
    pub low: SVector<f64, D>,
    /// High corner [m].
    pub high: SVector<f64, D>,
    cells: [i32; D],
    layers: i32,
    sides: [[WallKind; 2]; D],
}

impl<const D: usize> Walls<D> {
    pub fn build(domain: &DomainSettings, cell: f64) -> Result<Self, YarnError> {
        let low: SVector<f64, D> = vector("domain.origin", &domain.origin)?;
        let cells: [i32; D] = std::array::from_fn(|a| domain.cells[a] as i32);
        Ok(Self {
            low,
            high: SVector::from_fn(|a, _| low[a] + f64::from(cells[a]) * cell),
            cells,
            layers: domain.layers as i32,
            sides: std::array::from_fn(|a| [domain.walls.side(a, false), domain.walls.side(a, true)]),
        })
    }

    /// Whether a point lies in the box.
    #[inline]
    pub fn contains(&self, x: &SVector<f64, D>) -> bool {
        (0..D).all(|a| x[a] >= self.low[a] && x[a] <= self.high[a])
    }

    /// The wall a node lies on in direction `axis`, with the sign of the direction out of the box.
    #[inline]
    pub fn on(&self, node: &[i32; D], axis: usize) -> Option<(WallKind, f64)> {
        if node[axis] < self.layers {
            Some((self.sides[axis][0], -1.0))
        } else if node[axis] > self.cells[axis] - self.layers {
            Some((self.sides[axis][1], 1.0))
        } else {
            None
        }
    }

    /// Velocity of a node after the walls.
    #[inline]
    pub fn contact(&self, node: &[i32; D], mut velocity: SVector<f64, D>) -> SVector<f64, D> {
        for axis in 0..D {
            let Some((kind, out)) = self.on(node, axis) else { continue };
            let into = out * velocity[axis];
            match kind {
                WallKind::Open => {}
                WallKind::Stick => return SVector::zeros(),
                WallKind::Slip => velocity[axis] = 0.0,
                WallKind::Separate => {
                    if into > 0.0 {
                        velocity[axis] = 0.0;
                    }
                }
                WallKind::Friction(friction) => {
                    if into > 0.0 {
                        velocity[axis] = 0.0;
                        velocity = rub(velocity, friction * into);
                    }
                }
            }
        }
        velocity
    }
}
