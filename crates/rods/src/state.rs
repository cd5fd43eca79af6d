//! The state of many strands: contiguous arrays, vertex by vertex and edge by edge in scene order.

use crate::error::RodError;
use crate::material::StrandMaterial;
use crate::spec::{RestShape, StrandSpec};
use constitutive::curvature::{CurvatureElement, MIN_CHI, directors, reference_twist};
use nalgebra::Vector3;
use numerics::lanes::V3;
use numerics::transport::{any_normal, parallel_transport};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Many strands. Vertex `i` of strand `s` is entry `first_vertex[s] + i` of every vertex array; edge `j` (from vertex `j`
/// to `j + 1`) is entry `first_vertex[s] − s + j` of every edge array.
///
/// A clone is a snapshot; continuing from a deserialised one gives the same bits.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RodSet {
    /// First vertex of each strand, and the vertex count at the end.
    pub first_vertex: Vec<usize>,
    /// Material, one per strand.
    pub material: Vec<StrandMaterial>,
    /// Position \[m\], one per vertex.
    pub position: Vec<Vector3<f64>>,
    /// Velocity \[m/s\], one per vertex.
    pub velocity: Vec<Vector3<f64>>,
    /// Twist angle from the reference to the material director \[rad\], one per edge.
    pub twist_angle: Vec<f64>,
    /// Rate of the twist angle \[rad/s\], one per edge.
    pub twist_rate: Vec<f64>,
    /// Reference director (unit, normal to the edge), one per edge.
    pub reference_director: Vec<Vector3<f64>>,
    /// Twist of the reference directors \[rad\], one per vertex (zero at the ends); continuous over whole turns.
    pub reference_twist: Vec<f64>,
    /// Semi-axes `(a, b)` \[m\], one pair per vertex.
    pub radius: Vec<[f64; 2]>,
    /// Multiplier of all stiffnesses, one per vertex.
    pub stiffness_scale: Vec<f64>,
    /// Rest length \[m\], one per edge.
    pub rest_length: Vec<f64>,
    /// Four rest curvatures, one set per vertex (zero at the ends).
    pub rest_curvature: Vec<[f64; 4]>,
    /// Rest twist \[rad\], one per vertex (zero at the ends).
    pub rest_twist: Vec<f64>,
    /// What a two-step integrator remembers.
    pub history: Option<History>,
}

/// The previous accepted state, kept by [`Integrator::Bdf2`](crate::Integrator::Bdf2).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct History {
    /// Length of the step that led from there to the present state \[s\].
    pub dt: f64,
    /// Position \[m\] per vertex.
    pub position: Vec<Vector3<f64>>,
    /// Velocity \[m/s\] per vertex.
    pub velocity: Vec<Vector3<f64>>,
    /// Twist angle \[rad\] per edge.
    pub twist_angle: Vec<f64>,
    /// Twist rate \[rad/s\] per edge.
    pub twist_rate: Vec<f64>,
    /// Four curvatures and the twist per vertex, for internal viscosity.
    pub strain: Vec<[f64; 5]>,
}

impl RodSet {
    /// A set without strands.
    #[must_use]
    pub fn new() -> Self {
        Self { first_vertex: vec![0], ..Self::default() }
    }

    /// Number of strands.
    #[must_use]
    pub fn strand_count(&self) -> usize {
        self.material.len()
    }

    /// Number of vertices.
    #[must_use]
    pub fn vertex_count(&self) -> usize {
        self.position.len()
    }

    /// Number of edges.
    #[must_use]
    pub fn edge_count(&self) -> usize {
        self.twist_angle.len()
    }

    /// Vertices of a strand, as indices into the vertex arrays.
    #[must_use]
    pub fn vertices(&self, strand: usize) -> Range<usize> {
        self.first_vertex[strand]..self.first_vertex[strand + 1]
    }

    /// Edges of a strand, as indices into the edge arrays.
    #[must_use]
    pub fn edges(&self, strand: usize) -> Range<usize> {
        self.first_vertex[strand] - strand..self.first_vertex[strand + 1] - strand - 1
    }

    /// Strand and vertex within the strand of a vertex index.
    #[must_use]
    pub fn locate_vertex(&self, vertex: usize) -> (usize, usize) {
        let strand = self.first_vertex.partition_point(|f| *f <= vertex).saturating_sub(1);
        let strand = strand.min(self.strand_count().saturating_sub(1));
        (strand, vertex - self.first_vertex.get(strand).copied().unwrap_or(0).min(vertex))
    }

    /// Strand and edge within the strand of an edge index.
    #[must_use]
    pub fn locate_edge(&self, edge: usize) -> (usize, usize) {
        let (mut low, mut high) = (0, self.strand_count());
        while low + 1 < high {
            let mid = usize::midpoint(low, high);
            if self.first_vertex[mid] - mid <= edge {
                low = mid;
            } else {
                high = mid;
            }
        }
        (low, edge - (self.first_vertex[low] - low))
    }

    /// First vertex of an edge.
    #[must_use]
    pub fn vertex_of_edge(&self, edge: usize) -> usize {
        edge + self.locate_edge(edge).0
    }

    /// Adds a strand and returns its index.
    pub fn add_strand(&mut self, spec: &StrandSpec) -> Result<usize, RodError> {
        let strand = self.strand_count();
        let nv = spec.positions.len();
        let bad = |vertex, reason| Err(RodError::Geometry { strand, vertex, reason });
        if nv < 2 {
            return bad(0, "a strand needs at least two vertices");
        }
        spec.material.check()?;
        let count = |what, got: Option<usize>, expected| match got {
            Some(got) if got != expected => Err(RodError::Argument { what, expected, got }),
            _ => Ok(()),
        };
        if spec.radii.len() != 1 {
            count("strand radii", Some(spec.radii.len()), nv)?;
        }
        count("strand rest lengths", spec.rest_lengths.as_ref().map(Vec::len), nv - 1)?;
        count("strand stiffness scales", spec.stiffness_scale.as_ref().map(Vec::len), nv)?;
        count("strand velocities", spec.velocities.as_ref().map(Vec::len), nv)?;
        count("strand twist angles", spec.twist_angles.as_ref().map(Vec::len), nv - 1)?;
        if let RestShape::Explicit { curvature, twist } = &spec.rest {
            count("strand rest curvatures", Some(curvature.len()), nv)?;
            count("strand rest twists", Some(twist.len()), nv)?;
        }
        if let Some(i) = spec.positions.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
            return bad(i, "position is not finite");
        }
        let radii = if spec.radii.len() == 1 { vec![spec.radii[0]; nv] } else { spec.radii.clone() };
        if let Some(i) = radii.iter().position(|r| !r.iter().all(|c| c.is_finite() && *c > 0.0)) {
            return bad(i, "radii must be positive");
        }
        let scale = spec.stiffness_scale.clone().unwrap_or_else(|| vec![1.0; nv]);
        if let Some(i) = scale.iter().position(|s| !(s.is_finite() && *s > 0.0)) {
            return bad(i, "stiffness scale must be positive");
        }
        let velocity = spec.velocities.clone().unwrap_or_else(|| vec![Vector3::zeros(); nv]);
        if let Some(i) = velocity.iter().position(|v| !v.iter().all(|c| c.is_finite())) {
            return bad(i, "velocity is not finite");
        }

        let edges: Vec<_> = spec.positions.windows(2).map(|w| w[1] - w[0]).collect();
        let total: f64 = edges.iter().map(Vector3::norm).sum();
        if let Some(i) = edges.iter().position(|e| e.norm() <= 1e-9 * total) {
            return bad(i, "two consecutive vertices coincide");
        }
        let tangents: Vec<_> = edges.iter().map(Vector3::normalize).collect();
        if let Some(i) = tangents.windows(2).position(|t| 1.0 + t[0].dot(&t[1]) < 2.0 * MIN_CHI) {
            return bad(i + 1, "the strand folds back on itself (a turn above 178.8 degrees)");
        }
        let rest_length = match &spec.rest_lengths {
            Some(l) => l.clone(),
            None => edges.iter().map(Vector3::norm).collect(),
        };
        if let Some(i) = rest_length.iter().position(|l| !(l.is_finite() && *l > 0.0)) {
            return bad(i, "rest length must be positive");
        }

        // space-parallel reference directors; their twist is then zero by construction
        let mut d1 = match spec.director {
            Some(d) => {
                let n = d - tangents[0] * tangents[0].dot(&d);
                if n.norm() <= 1e-6 * d.norm() || !n.norm().is_finite() {
                    return bad(0, "the director lies along the first edge");
                }
                n.normalize()
            }
            None => any_normal(&tangents[0]),
        };
        let mut reference_director = vec![d1];
        for t in tangents.windows(2) {
            d1 = parallel_transport(&d1, &t[0], &t[1]).0;
            d1 = (d1 - t[1] * t[1].dot(&d1)).normalize();
            reference_director.push(d1);
        }
        let mut twist_angle = spec.twist_angles.clone().unwrap_or_else(|| vec![0.0; nv - 1]);
        if let Some(i) = twist_angle.iter().position(|a| !a.is_finite()) {
            return bad(i, "twist angle is not finite");
        }
        for a in &mut twist_angle {
            *a += spec.material.base_rotation;
        }

        self.first_vertex.push(self.vertex_count() + nv);
        self.material.push(spec.material);
        self.position.extend(&spec.positions);
        self.velocity.extend(velocity);
        self.twist_rate.extend(std::iter::repeat_n(0.0, nv - 1));
        self.twist_angle.extend(twist_angle);
        self.reference_director.extend(reference_director);
        self.reference_twist.extend(std::iter::repeat_n(0.0, nv));
        self.radius.extend(radii);
        self.stiffness_scale.extend(scale);
        self.rest_length.extend(&rest_length);
        self.history = None;
        let first = self.first_vertex[strand];
        let (mut curvature, mut twist) = (vec![[0.0; 4]; nv], vec![0.0; nv]);
        for i in 1..nv - 1 {
            (curvature[i], twist[i]) = match &spec.rest {
                RestShape::AsGiven => self.curvature_twist(strand, i),
                RestShape::Straight => ([0.0; 4], 0.0),
                RestShape::Uniform { curvature, twist } => {
                    let l = 0.5 * (rest_length[i - 1] + rest_length[i]);
                    uniform_rest(*curvature, *twist, l)
                }
                RestShape::Explicit { curvature, twist } => (curvature[i], twist[i]),
            };
            if !curvature[i].iter().chain([&twist[i]]).all(|v| v.is_finite()) {
                return bad(i, "rest curvature or twist is not finite");
            }
        }
        debug_assert_eq!(first + nv, self.vertex_count());
        self.rest_curvature.extend(curvature);
        self.rest_twist.extend(twist);
        Ok(strand)
    }

    /// Unit tangent of edge `j` of a strand, and its length \[m\].
    #[must_use]
    pub fn tangent(&self, strand: usize, j: usize) -> (Vector3<f64>, f64) {
        let i = self.first_vertex[strand] + j;
        let e = self.position[i + 1] - self.position[i];
        let l = e.norm();
        (e / l, l)
    }

    /// Material directors of edge `j` of a strand.
    #[must_use]
    pub fn material_directors(&self, strand: usize, j: usize) -> (Vector3<f64>, Vector3<f64>) {
        let (t, _) = self.tangent(strand, j);
        let e = self.edges(strand).start + j;
        let d1 = self.reference_director[e];
        let (m1, m2) = directors(V3(t.into()), V3(d1.into()), self.twist_angle[e]);
        (m1.0.into(), m2.0.into())
    }

    /// The curvature element at the interior vertex `i` of a strand and its twist \[rad\].
    #[must_use]
    pub fn element(&self, strand: usize, i: usize) -> (CurvatureElement<f64>, f64) {
        let e = self.edges(strand).start + i;
        let ((te, le), (tf, lf)) = (self.tangent(strand, i - 1), self.tangent(strand, i));
        let (te, tf) = (V3(te.into()), V3(tf.into()));
        let (d1e, d1f) = (V3(self.reference_director[e - 1].into()), V3(self.reference_director[e].into()));
        let element = CurvatureElement::new(
            te,
            tf,
            1.0 / le,
            1.0 / lf,
            directors(te, d1e, self.twist_angle[e - 1]),
            directors(tf, d1f, self.twist_angle[e]),
        );
        let reference = reference_twist(self.reference_twist[self.first_vertex[strand] + i], d1e, te, d1f, tf);
        (element, reference + self.twist_angle[e] - self.twist_angle[e - 1])
    }

    /// Four curvatures and the twist \[rad\] at the interior vertex `i` of a strand.
    #[must_use]
    pub fn curvature_twist(&self, strand: usize, i: usize) -> ([f64; 4], f64) {
        let (element, twist) = self.element(strand, i);
        (element.k, twist)
    }

    /// Verifies lengths, finiteness, orthogonality of directors and consistency of the reference twist.
    pub fn check(&self) -> Result<(), RodError> {
        let (ns, nv) = (self.strand_count(), self.vertex_count());
        let length = |what, got, expected| {
            if got == expected { Ok(()) } else { Err(RodError::Argument { what, expected, got }) }
        };
        length("first_vertex", self.first_vertex.len(), ns + 1)?;
        if self.first_vertex[0] != 0 || self.first_vertex.windows(2).any(|w| w[1] < w[0] + 2) {
            return Err(RodError::Argument { what: "first_vertex (increasing by two or more)", expected: 0, got: 1 });
        }
        length("first_vertex end", self.first_vertex[ns], nv)?;
        length("velocity", self.velocity.len(), nv)?;
        length("reference_twist", self.reference_twist.len(), nv)?;
        length("radius", self.radius.len(), nv)?;
        length("stiffness_scale", self.stiffness_scale.len(), nv)?;
        length("rest_curvature", self.rest_curvature.len(), nv)?;
        length("rest_twist", self.rest_twist.len(), nv)?;
        let ne = nv - ns;
        length("twist_angle", self.twist_angle.len(), ne)?;
        length("twist_rate", self.twist_rate.len(), ne)?;
        length("reference_director", self.reference_director.len(), ne)?;
        length("rest_length", self.rest_length.len(), ne)?;
        for s in 0..ns {
            self.material[s].check()?;
            let first = self.first_vertex[s];
            for (i, v) in self.vertices(s).enumerate() {
                let fail = |what| Err(RodError::NonFinite { strand: s, vertex: i, what });
                if !self.position[v].iter().all(|c| c.is_finite()) {
                    return fail("position");
                }
                if !self.velocity[v].iter().all(|c| c.is_finite()) {
                    return fail("velocity");
                }
            }
            for (j, e) in self.edges(s).enumerate() {
                let bad = |reason| Err(RodError::Geometry { strand: s, vertex: j, reason });
                let (t, l) = self.tangent(s, j);
                let d = self.reference_director[e];
                if l <= 0.0 || !l.is_finite() || !self.twist_angle[e].is_finite() || !self.twist_rate[e].is_finite() {
                    return bad("edge without length or angle not finite");
                }
                if !(t.dot(&d).abs() < 1e-6 && (d.norm() - 1.0).abs() < 1e-6) {
                    return bad("reference director not a unit normal");
                }
                if j > 0 {
                    let (_, twist) = self.element(s, j);
                    let stored = self.reference_twist[first + j] + self.twist_angle[e] - self.twist_angle[e - 1];
                    if (twist - stored).abs() > 1e-6 || !twist.is_finite() {
                        return bad("reference twist does not belong to the directors");
                    }
                }
            }
        }
        Ok(())
    }
}

/// Discrete rest curvatures of a uniform natural curvature \[1/m\] and twist \[rad/m\] over the vertex length `l` \[m\].
///
/// A rod whose Darboux vector is constant in the material frame turns, over `l`, by the rotation vector
/// `(κ₁, κ₂, τ) l`; the curvatures are those of the two edge frames that this rotation connects, so that a discrete
/// helix of that Darboux vector is exactly stress-free.
fn uniform_rest(curvature: [f64; 2], twist: f64, l: f64) -> ([f64; 4], f64) {
    let w = Vector3::new(curvature[0], curvature[1], twist) * l;
    let frame = nalgebra::Rotation3::new(w);
    let v = |c: [f64; 3]| V3(c);
    let (te, m1e, m2e) = (v([0.0, 0.0, 1.0]), v([1.0, 0.0, 0.0]), v([0.0, 1.0, 0.0]));
    let column = |i: usize| -> V3<f64> { V3(frame.matrix().column(i).into_owned().into()) };
    let (m1f, m2f, tf) = (column(0), column(1), column(2));
    let x = CurvatureElement::new(te, tf, 1.0, 1.0, (m1e, m2e), (m1f, m2f));
    (x.k, reference_twist(twist * l, m1e, te, m1f, tf))
}
