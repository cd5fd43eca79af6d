//! A bundle of nearly parallel strands in hexagonal packing: what detection and assembly are measured on.

use crate::assembly::InverseDynamics;
use crate::block::Vec3;
use crate::detection::Strands;

/// Vertices of a bundle, ready for detection.
#[derive(Clone, Debug, PartialEq)]
pub struct Bundle {
    /// Positions at the start of the step [m].
    pub start: Vec<Vec3>,
    /// Positions the step would reach without contact [m].
    pub end: Vec<Vec3>,
    /// First vertex of each strand and the total.
    pub first_vertex: Vec<u32>,
    /// Radii [m].
    pub radius: Vec<f64>,
}

/// A bundle of `strands` strands with `vertices` vertices each: radius 50 µm, edges of 1 mm, spacing 1.98 radii across, a
/// twist that makes neighbours cross at a small angle, and a motion towards the axis of a tenth of a radius per step.
#[must_use]
pub fn bundle(strands: usize, vertices: usize) -> Bundle {
    let radius = 5e-5;
    let (spacing, edge) = (1.98 * radius, 1e-3);
    let across = (strands as f64).sqrt().ceil() as usize;
    let mut b = Bundle { start: Vec::new(), end: Vec::new(), first_vertex: vec![0], radius: Vec::new() };
    for s in 0..strands {
        let (i, j) = (s % across, s / across);
        let x = (i as f64 + if j % 2 == 1 { 0.5 } else { 0.0 } - 0.5 * across as f64) * spacing;
        let y = (j as f64 - 0.5 * across as f64) * spacing * 0.75f64.sqrt();
        for v in 0..vertices {
            let z = edge * v as f64 + 0.37 * edge * ((s * 7 % 11) as f64 / 11.0);
            let phase = 0.15 * v as f64 + s as f64;
            let p = [x + 0.03 * radius * phase.sin(), y + 0.03 * radius * phase.cos(), z];
            b.start.push(p);
            let shrink = 0.1 * radius / (0.5 * across as f64 * spacing);
            b.end.push([p[0] * (1.0 - shrink), p[1] * (1.0 - shrink), z]);
            b.radius.push(radius);
        }
        b.first_vertex.push(b.start.len() as u32);
    }
    b
}

impl Bundle {
    /// The slices detection takes.
    #[must_use]
    pub fn strands(&self) -> Strands<'_> {
        Strands { start: &self.start, end: &self.end, first_vertex: &self.first_vertex, radius: &self.radius }
    }
}

/// Inverse dynamics of identical elastic chains, three freedoms per vertex: `K = m + h²k · (second difference)` per axis,
/// solved by elimination. Stands in for the rods' factors where the rods crate is not at hand.
#[derive(Clone, Copy, Debug)]
pub struct Chains {
    /// Vertices of every chain.
    pub vertices: usize,
    /// Mass of a vertex [kg].
    pub mass: f64,
    /// Coupling of neighbours `h² k` [kg].
    pub coupling: f64,
}

impl InverseDynamics for Chains {
    fn dofs(&self, _: usize) -> usize {
        3 * self.vertices
    }

    fn apply(&self, _: usize, x: &mut [f64]) {
        let n = self.vertices;
        let mut pivot = vec![0.0; n];
        for i in 0..n {
            let ends = f64::from(u8::from(i == 0)) + f64::from(u8::from(i + 1 == n));
            let d = self.mass + self.coupling * (2.0 - ends);
            if i == 0 {
                pivot[0] = d;
            } else {
                let f = self.coupling / pivot[i - 1];
                pivot[i] = d - f * self.coupling;
                for c in 0..3 {
                    x[3 * i + c] += f * x[3 * (i - 1) + c];
                }
            }
        }
        for i in (0..n).rev() {
            for c in 0..3 {
                if i + 1 < n {
                    x[3 * i + c] += self.coupling * x[3 * (i + 1) + c];
                }
                x[3 * i + c] /= pivot[i];
            }
        }
    }
}
