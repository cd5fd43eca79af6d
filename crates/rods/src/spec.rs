//! What a strand is before it joins a set.

use crate::material::StrandMaterial;
use nalgebra::Vector3;

/// Shape in which a strand is free of stress.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum RestShape {
    /// The given shape.
    #[default]
    AsGiven,
    /// Straight and untwisted, with the given edge lengths.
    Straight,
    /// Uniform natural curvature and twist, with the given edge lengths.
    Uniform {
        /// Curvature \[1/m\]: components of the Darboux vector along the material directors m1 and m2 (a bend about m2 turns
        /// the tangent towards m1).
        curvature: [f64; 2],
        /// Twist rate \[rad/m\].
        twist: f64,
    },
    /// Discrete rest curvatures (four per vertex) and rest twists \[rad\] (one per vertex); those of the end vertices are ignored.
    Explicit {
        /// Four curvatures per vertex.
        curvature: Vec<[f64; 4]>,
        /// Twist per vertex \[rad\].
        twist: Vec<f64>,
    },
}

/// One strand: geometry, thickness, material, rest shape.
#[derive(Clone, Debug)]
pub struct StrandSpec {
    /// Vertex positions \[m\], at least two, consecutive ones distinct.
    pub positions: Vec<Vector3<f64>>,
    /// Semi-axes `(a, b)` per vertex \[m\], or a single pair for all; `a` lies along the first material director.
    pub radii: Vec<[f64; 2]>,
    /// Material.
    pub material: StrandMaterial,
    /// Stress-free shape.
    pub rest: RestShape,
    /// Rest edge lengths \[m\]; the given lengths where `None`.
    pub rest_lengths: Option<Vec<f64>>,
    /// Multiplier of all stiffnesses per vertex; one where `None`.
    pub stiffness_scale: Option<Vec<f64>>,
    /// Initial velocities \[m/s\]; rest where `None`.
    pub velocities: Option<Vec<Vector3<f64>>>,
    /// Direction near which the first reference director of the first edge lies; some normal where `None`.
    pub director: Option<Vector3<f64>>,
    /// Initial twist angles per edge \[rad\]; zero where `None`. The base rotation is added.
    pub twist_angles: Option<Vec<f64>>,
}

impl StrandSpec {
    /// A strand of circular cross-section, stress-free as given.
    #[must_use]
    pub fn new(positions: Vec<Vector3<f64>>, radius: f64, material: StrandMaterial) -> Self {
        Self {
            positions,
            radii: vec![[radius, radius]],
            material,
            rest: RestShape::AsGiven,
            rest_lengths: None,
            stiffness_scale: None,
            velocities: None,
            director: None,
            twist_angles: None,
        }
    }

    /// A straight strand of `vertices` vertices from `start` to `end`.
    #[must_use]
    pub fn straight(
        start: Vector3<f64>,
        end: Vector3<f64>,
        vertices: usize,
        radius: f64,
        material: StrandMaterial,
    ) -> Self {
        let n = vertices.max(2) - 1;
        let positions = (0..=n).map(|i| start + (end - start) * (i as f64 / n as f64)).collect();
        Self::new(positions, radius, material)
    }

    /// Replaces the rest shape.
    #[must_use]
    pub fn with_rest(mut self, rest: RestShape) -> Self {
        self.rest = rest;
        self
    }

    /// Replaces the first director.
    #[must_use]
    pub fn with_director(mut self, director: Vector3<f64>) -> Self {
        self.director = Some(director);
        self
    }
}
