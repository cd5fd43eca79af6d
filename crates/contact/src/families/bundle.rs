//! A bundle of nearly parallel strands in hexagonal packing: what detection and assembly are measured on.

use crate::assembly::{InverseDynamics, assemble};
use crate::block::Vec3;
use crate::detection::{DetectionSettings, Detector, Strands};
use crate::problem::ContactProblem;
use nalgebra::DMatrix;

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

/// Inverse dynamics of identical straight beams along z, held at both ends, three freedoms per vertex: implicit steps of a
/// hair with bending across and stretching along, `K = m + h² (EI/ℓ³ D₂ᵀD₂, EA/ℓ D₁ᵀD₁)`.
#[derive(Clone, Debug)]
pub struct Beams {
    /// Vertices of every beam.
    pub vertices: usize,
    across: DMatrix<f64>,
    along: DMatrix<f64>,
}

impl Beams {
    /// Hairs of radius 50 µm and edges of 1 mm (4 GPa, 1300 kg/m³), two vertices held at either end, for a step `dt` [s].
    #[must_use]
    pub fn hairs(vertices: usize, dt: f64) -> Self {
        let (radius, edge, young, density) = (5e-5_f64, 1e-3_f64, 4e9, 1300.0);
        let area = std::f64::consts::PI * radius * radius;
        let inertia = 0.25 * area * radius * radius;
        let (bend, stretch) = (dt * dt * young * inertia / edge.powi(3), dt * dt * young * area / edge);
        let n = vertices;
        let mut across = DMatrix::from_diagonal_element(n, n, density * area * edge);
        let mut along = across.clone();
        let spread = |matrix: &mut DMatrix<f64>, first: usize, stencil: &[f64], k: f64| {
            for (i, a) in stencil.iter().enumerate() {
                for (j, b) in stencil.iter().enumerate() {
                    matrix[(first + i, first + j)] += k * a * b;
                }
            }
        };
        for i in 0..n.saturating_sub(2) {
            spread(&mut across, i, &[1.0, -2.0, 1.0], bend);
        }
        for i in 0..n.saturating_sub(1) {
            spread(&mut along, i, &[1.0, -1.0], stretch);
        }
        let inverse = |mut matrix: DMatrix<f64>| {
            for i in (0..n).filter(|i| *i < 2 || i + 2 >= n) {
                matrix.row_mut(i).fill(0.0);
                matrix.column_mut(i).fill(0.0);
                matrix[(i, i)] = 1.0;
            }
            let mut inverse = matrix.cholesky().map_or_else(|| DMatrix::zeros(n, n), |factor| factor.inverse());
            for i in (0..n).filter(|i| *i < 2 || i + 2 >= n) {
                inverse[(i, i)] = 0.0;
            }
            inverse
        };
        Beams { vertices, across: inverse(across), along: inverse(along) }
    }
}

impl InverseDynamics for Beams {
    fn dofs(&self, _: usize) -> usize {
        3 * self.vertices
    }

    fn apply(&self, _: usize, x: &mut [f64]) {
        let n = self.vertices;
        for c in 0..3 {
            let part: Vec<f64> = (0..n).map(|i| x[3 * i + c]).collect();
            let inverse = if c == 2 { &self.along } else { &self.across };
            for i in 0..n {
                x[3 * i + c] = (0..n).map(|j| inverse[(j, i)] * part[j]).sum();
            }
        }
    }
}

/// A bundle of hairs with 41 vertices that is squeezed over `pressed` [m] about its middle and rubbed: what a step of such
/// a scene poses. Contacts are many per strand and feel each other along it, so `W` is nearly singular.
///
/// - `squeeze`: speed towards the axis at the rim [m/s]; a few times 0.01 closes all gaps in the step of 1 ms
#[must_use]
pub fn squeezed_bundle(strands: usize, pressed: f64, squeeze: f64, friction: f64) -> ContactProblem {
    let (vertices, dt) = (41, 1e-3);
    let mut b = bundle(strands, vertices);
    b.end.clone_from(&b.start);
    let middle = b.start.iter().map(|x| x[2]).sum::<f64>() / b.start.len() as f64;
    let rim = b.start.iter().map(|x| x[0].hypot(x[1])).fold(f64::MIN_POSITIVE, f64::max);
    let velocity: Vec<f64> = b
        .start
        .iter()
        .enumerate()
        .flat_map(|(v, x)| {
            let share = (-((x[2] - middle) / pressed).powi(2)).exp();
            // the upper half is drawn along, the lower half the other way, each strand by a little more or less
            let drawn = 0.02 * share * x[1] / rim * (1.0 + 0.2 * (v as f64).sin());
            [-squeeze * share * x[0] / rim, -squeeze * share * x[1] / rim, drawn]
        })
        .collect();
    let mut contacts = Vec::new();
    if Detector::default().detect(&b.strands(), None, &[], &DetectionSettings::default(), &mut contacts).is_err() {
        contacts.clear();
    }
    let near = |c: &crate::detection::Contact| {
        let v = (b.first_vertex[c.key.a.0 as usize] + c.key.a.1) as usize;
        (b.start[v][2] - middle).abs() < 1.5 * pressed
    };
    let posed: Vec<_> = contacts.iter().filter(|c| near(c)).map(|c| c.posed(friction, 0.0, 3)).collect();
    let velocities: Vec<&[f64]> =
        b.first_vertex.windows(2).map(|w| &velocity[3 * w[0] as usize..3 * w[1] as usize]).collect();
    let dynamics = Beams::hairs(vertices, dt);
    assemble(&posed, &dynamics, strands, &velocities, dt, 0.2).map_or_else(
        |_| ContactProblem {
            dimension: 3,
            delassus: crate::problem::BlockMatrix::default(),
            free_velocity: Vec::new(),
            friction: Vec::new(),
            cohesion: Vec::new(),
        },
        |system| system.problem,
    )
}
