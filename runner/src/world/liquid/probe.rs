//! A point in space at which the liquid is followed step by step.

use mpm::Vector;
use particle_grid::{CENTRE, stencil};

use super::{Flow, FlowState, lower};
use crate::scene::Scene;
use crate::scene::output::Probe;
use crate::system::Column;

/// A point that is followed.
#[derive(Clone, Debug, PartialEq)]
pub struct PointProbe {
    /// Name of its columns.
    pub name: String,
    /// Where [m].
    pub at: Vector<3>,
}

/// The points that a scene follows.
#[must_use]
pub fn build(scene: &Scene) -> Vec<PointProbe> {
    let one = |(k, probe): (usize, &Probe)| match probe {
        Probe::Point(p) => Some(PointProbe { name: p.name.clone().unwrap_or_else(|| format!("point{k}")), at: p.at }),
        Probe::Vertex(_) | Probe::Yarn(_) => None,
    };
    scene.output.probes.iter().enumerate().filter_map(one).collect()
}

impl PointProbe {
    /// The columns of the probe.
    pub fn columns(&self, columns: &mut Vec<Column>) {
        for (part, unit, meaning) in [
            ("vx", "m/s", "velocity of the liquid at the point"),
            ("vy", "m/s", "velocity of the liquid at the point"),
            ("vz", "m/s", "velocity of the liquid at the point"),
            ("pressure", "Pa", "pressure at the point"),
            ("shear_stress", "Pa", "norm of the shear stress at the point"),
            ("fraction", "1", "share of the neighbourhood filled with liquid"),
        ] {
            columns.push(Column::new(format!("{}_{part}", self.name), unit, meaning));
        }
    }
}

/// What the liquid does at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AtPoint {
    /// Velocity [m/s].
    pub velocity: [f64; 3],
    /// Pressure [Pa].
    pub pressure: f64,
    /// Norm of the shear stress [Pa].
    pub stress: f64,
    /// Share of the neighbourhood filled with liquid [1].
    pub fraction: f64,
}

impl<const D: usize> Flow<D> {
    /// The liquid at a point, from the grid of the last step; zeros where there is none, and before the first step.
    #[must_use]
    pub fn at_point(&self, state: &FlowState<D>, place: &Vector<3>) -> AtPoint {
        let mut seen = AtPoint::default();
        let x = lower::<D>(place);
        if state.particles.is_empty() || self.grid.blocks.block_count() == 0 {
            return seen;
        }
        let (velocity, known) = self.grid.velocity_at(&x);
        if known <= 0.0 {
            return seen;
        }
        for a in 0..D {
            seen.velocity[a] = velocity[a];
        }
        let cell = &self.grid.cell;
        let (mut weight, mut pressure) = (0.0, 0.0);
        stencil(&self.grid.blocks, &x, &[CENTRE; D], |s| {
            seen.fraction += s.weight * cell.liquid_fraction[s.node];
            if cell.liquid_distance[s.node] < 0.0 {
                weight += s.weight;
                pressure += s.weight * cell.pressure[s.node];
            }
        });
        seen.pressure = if weight > 0.0 { pressure / weight } else { 0.0 };
        seen.stress = self.stress_around(state, &x);
        seen
    }

    /// Norm of the shear stress of the particles around a point, weighted by a hat of one cell's radius [Pa].
    fn stress_around(&self, state: &FlowState<D>, x: &Vector<D>) -> f64 {
        let particles = &state.particles;
        if !particles.carried.strain {
            return 0.0;
        }
        let lattice = self.grid.lattice();
        let (mut sum, mut weight) = (0.0, 0.0);
        for (p, y) in particles.position.iter().enumerate() {
            let d = lattice.displacement(y, x);
            if d.amax() >= lattice.dx {
                continue;
            }
            let w = d.iter().map(|d| 1.0 - d.abs() / lattice.dx).product::<f64>() * particles.volume(p);
            let law = &self.materials[particles.material[p] as usize].law;
            sum += w * law.shear_stress_norm(&particles.elastic_strain[p]);
            weight += w;
        }
        if weight > 0.0 { sum / weight } else { 0.0 }
    }
}
