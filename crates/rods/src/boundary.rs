//! What is held: prescribed positions and angles at the end of the step, and springs to goals.

use crate::error::RodError;
use crate::state::RodSet;
use nalgebra::Vector3;
use numerics::transport::{parallel_transport, signed_angle};

/// A vertex whose position at the end of the step is prescribed, in all or some components.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FixedVertex {
    /// Vertex index in the whole set.
    pub vertex: usize,
    /// Position at the end of the step \[m\].
    pub position: Vector3<f64>,
    /// Which components are prescribed.
    pub components: [bool; 3],
}

/// How the angle of an edge is prescribed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FixedAngle {
    /// The twist angle itself \[rad\].
    Angle(f64),
    /// The first material director at the end of the step, as a moving clamp carries it; both end vertices of the edge
    /// must be prescribed too. The angle nearest to the present one is taken.
    Director(Vector3<f64>),
}

/// An edge whose angle at the end of the step is prescribed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FixedEdge {
    /// Edge index in the whole set.
    pub edge: usize,
    /// Its angle at the end of the step.
    pub angle: FixedAngle,
}

/// A spring from a vertex to a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// Vertex index in the whole set.
    pub vertex: usize,
    /// Point \[m\].
    pub position: Vector3<f64>,
    /// Stiffness \[N/m\].
    pub stiffness: f64,
}

/// Boundary conditions of one step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Boundary {
    /// Prescribed vertices.
    pub vertices: Vec<FixedVertex>,
    /// Prescribed edges.
    pub edges: Vec<FixedEdge>,
    /// Springs.
    pub goals: Vec<Goal>,
}

/// One end of a strand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The first vertex.
    Root,
    /// The last vertex.
    Tip,
}

impl Boundary {
    /// Prescribes a position.
    pub fn fix_vertex(&mut self, vertex: usize, position: Vector3<f64>) {
        self.vertices.push(FixedVertex { vertex, position, components: [true; 3] });
    }

    /// Clamps an end where it is: the two end vertices and the angle of the end edge.
    pub fn clamp(&mut self, rods: &RodSet, strand: usize, end: End) {
        let (v, e) = (rods.vertices(strand), rods.edges(strand));
        let (pair, edge) = match end {
            End::Root => ([v.start, v.start + 1], e.start),
            End::Tip => ([v.end - 2, v.end - 1], e.end - 1),
        };
        for i in pair {
            self.fix_vertex(i, rods.position[i]);
        }
        self.edges.push(FixedEdge { edge, angle: FixedAngle::Angle(rods.twist_angle[edge]) });
    }

    /// Clamps an end that a body carries: end vertices at `points` (root to tip order) and the first material director.
    pub fn clamp_to(&mut self, rods: &RodSet, strand: usize, end: End, points: [Vector3<f64>; 2], director: Vector3<f64>) {
        let (v, e) = (rods.vertices(strand), rods.edges(strand));
        let (first, edge) = match end {
            End::Root => (v.start, e.start),
            End::Tip => (v.end - 2, e.end - 1),
        };
        self.fix_vertex(first, points[0]);
        self.fix_vertex(first + 1, points[1]);
        self.edges.push(FixedEdge { edge, angle: FixedAngle::Director(director) });
    }

    /// Refuses indices out of range and numbers that are not finite.
    pub fn check(&self, rods: &RodSet) -> Result<(), RodError> {
        let range = |what, got, expected| {
            if got < expected { Ok(()) } else { Err(RodError::Argument { what, expected, got }) }
        };
        let finite = |what, vertex: usize, ok: bool| {
            let (strand, vertex) = rods.locate_vertex(vertex);
            if ok { Ok(()) } else { Err(RodError::NonFinite { strand, vertex, what }) }
        };
        for f in &self.vertices {
            range("boundary vertex", f.vertex, rods.vertex_count())?;
            let ok = (0..3).all(|c| !f.components[c] || f.position[c].is_finite());
            finite("a prescribed position", f.vertex, ok)?;
        }
        for f in &self.edges {
            range("boundary edge", f.edge, rods.edge_count())?;
            let (ok, vertex) = match f.angle {
                FixedAngle::Angle(a) => (a.is_finite(), rods.vertex_of_edge(f.edge)),
                FixedAngle::Director(d) => {
                    (d.iter().all(|v| v.is_finite()) && d.norm() > 1e-6, rods.vertex_of_edge(f.edge))
                }
            };
            finite("a prescribed angle", vertex, ok)?;
        }
        for g in &self.goals {
            range("boundary goal", g.vertex, rods.vertex_count())?;
            let ok = g.position.iter().all(|v| v.is_finite()) && g.stiffness.is_finite() && g.stiffness >= 0.0;
            finite("a goal", g.vertex, ok)?;
        }
        Ok(())
    }
}

/// Twist angle, nearest to `present`, at which the first material director is `director` once the reference director
/// `d1` has been carried from the tangent `from` to the tangent `to` (spec 4.6: a moving clamp carries its frame).
#[must_use]
pub(crate) fn angle_of_director(
    director: &Vector3<f64>,
    d1: &Vector3<f64>,
    from: &Vector3<f64>,
    to: &Vector3<f64>,
    present: f64,
) -> f64 {
    let (reference, _) = parallel_transport(d1, from, to);
    let angle = signed_angle(&reference, director, to);
    let turn = std::f64::consts::TAU;
    angle + turn * ((present - angle) / turn).round()
}
