//! What records show: energies, momenta, curvature, twist, tension.

use crate::coefficients::{bend_twist_stiffness, edge_inertia, stretch_stiffness, vertex_length, vertex_mass};
use crate::loads::Loads;
use crate::state::RodSet;
use constitutive::curvature::{CurvatureElement, CurvatureLaw};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Energies by kind \[J\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RodEnergy {
    /// Stretching.
    pub stretch: f64,
    /// Bending.
    pub bend: f64,
    /// Twisting.
    pub twist: f64,
    /// Of motion, turning about the tangent included.
    pub kinetic: f64,
    /// In the gravity field, zero at the origin.
    pub gravity: f64,
}

impl RodEnergy {
    /// Stored elastically.
    #[must_use]
    pub fn elastic(&self) -> f64 {
        self.stretch + self.bend + self.twist
    }

    /// Sum of all.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.elastic() + self.kinetic + self.gravity
    }

    /// Sum by kind.
    #[must_use]
    pub fn plus(&self, o: &RodEnergy) -> RodEnergy {
        RodEnergy {
            stretch: self.stretch + o.stretch,
            bend: self.bend + o.bend,
            twist: self.twist + o.twist,
            kinetic: self.kinetic + o.kinetic,
            gravity: self.gravity + o.gravity,
        }
    }
}

/// Mass, momenta and centre of mass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RodMomentum {
    /// Mass \[kg\].
    pub mass: f64,
    /// Linear momentum \[kg m/s\].
    pub linear: Vector3<f64>,
    /// Angular momentum about the origin \[kg m²/s\], turning about the tangents included.
    pub angular: Vector3<f64>,
    /// Mass times centre of mass \[kg m\].
    pub first_moment: Vector3<f64>,
}

impl RodSet {
    /// The elastic law of the element at interior vertex `i` of a strand.
    #[must_use]
    pub fn law(&self, strand: usize, i: usize) -> CurvatureLaw<f64> {
        let (c0, c1, cm) = bend_twist_stiffness(self, strand, i);
        let v = self.first_vertex[strand] + i;
        CurvatureLaw { c0, c1, cm, rest: self.rest_curvature[v], rest_twist: self.rest_twist[v] }
    }

    /// Energies of one strand; of the loads only gravity and film count.
    #[must_use]
    pub fn strand_energy(&self, strand: usize, loads: &Loads) -> RodEnergy {
        let mut out = RodEnergy::default();
        let n = self.edges(strand).len();
        for (i, v) in self.vertices(strand).enumerate() {
            let mass = vertex_mass(self, strand, i) + loads.film_mass.map_or(0.0, |m| m[v]);
            out.kinetic += 0.5 * mass * self.velocity[v].norm_squared();
            out.gravity -= mass * loads.gravity.dot(&self.position[v]);
            if i > 0 && i < n {
                let (x, m): (CurvatureElement<f64>, f64) = self.element(strand, i);
                let law = self.law(strand, i);
                let bend = law.energy(&x, law.rest_twist);
                out.bend += bend;
                let dm = m - law.rest_twist;
                out.twist += 0.5 * law.cm * dm * dm;
            }
            if i < n {
                let e = self.edges(strand).start + i;
                let strain = self.tangent(strand, i).1 / self.rest_length[e] - 1.0;
                out.stretch += 0.5 * stretch_stiffness(self, strand, i) * self.rest_length[e] * strain * strain;
                let inertia = edge_inertia(self, strand, i, loads.film_mass, loads.film_height);
                out.kinetic += 0.5 * inertia * self.twist_rate[e] * self.twist_rate[e];
            }
        }
        out
    }

    /// Energies of all strands, summed strand by strand.
    #[must_use]
    pub fn energy(&self, loads: &Loads) -> RodEnergy {
        (0..self.strand_count()).fold(RodEnergy::default(), |sum, s| sum.plus(&self.strand_energy(s, loads)))
    }

    /// Mass and momenta of one strand.
    #[must_use]
    pub fn strand_momentum(&self, strand: usize, loads: &Loads) -> RodMomentum {
        let mut out = RodMomentum::default();
        for (i, v) in self.vertices(strand).enumerate() {
            let mass = vertex_mass(self, strand, i) + loads.film_mass.map_or(0.0, |m| m[v]);
            let p = self.velocity[v] * mass;
            out.mass += mass;
            out.linear += p;
            out.angular += self.position[v].cross(&p);
            out.first_moment += self.position[v] * mass;
        }
        for (j, e) in self.edges(strand).enumerate() {
            let inertia = edge_inertia(self, strand, j, loads.film_mass, loads.film_height);
            out.angular += self.tangent(strand, j).0 * (inertia * self.twist_rate[e]);
        }
        out
    }

    /// Mass and momenta of all strands, summed strand by strand.
    #[must_use]
    pub fn momentum(&self, loads: &Loads) -> RodMomentum {
        (0..self.strand_count()).fold(RodMomentum::default(), |mut sum, s| {
            let m = self.strand_momentum(s, loads);
            sum.mass += m.mass;
            sum.linear += m.linear;
            sum.angular += m.angular;
            sum.first_moment += m.first_moment;
            sum
        })
    }

    /// Mass \[kg\] of a vertex without film.
    #[must_use]
    pub fn vertex_mass(&self, strand: usize, i: usize) -> f64 {
        vertex_mass(self, strand, i)
    }

    /// Rest length \[m\] that belongs to a vertex: half of the adjacent edges.
    #[must_use]
    pub fn vertex_length(&self, strand: usize, i: usize) -> f64 {
        vertex_length(self, strand, i)
    }

    /// Magnitude of the curvature \[1/m\] at each vertex of a strand (zero at the ends).
    #[must_use]
    pub fn curvature(&self, strand: usize) -> Vec<f64> {
        self.interior(strand, |i| {
            let x = self.element(strand, i).0;
            x.binormal.dot(x.binormal).sqrt() / vertex_length(self, strand, i)
        })
    }

    /// Twist \[rad/m\] at each vertex of a strand (zero at the ends).
    #[must_use]
    pub fn twist(&self, strand: usize) -> Vec<f64> {
        self.interior(strand, |i| self.element(strand, i).1 / vertex_length(self, strand, i))
    }

    /// Bending moment \[N m\] at each vertex of a strand (zero at the ends).
    #[must_use]
    pub fn bending_moment(&self, strand: usize) -> Vec<f64> {
        self.interior(strand, |i| {
            let (x, m) = self.element(strand, i);
            let (w, _) = self.law(strand, i).weights(&x, m);
            // mean of the moments seen from the two edges, whose weights are halves
            (w[0] + w[2]).hypot(w[1] + w[3])
        })
    }

    /// Tension \[N\] of each edge of a strand, positive in extension.
    #[must_use]
    pub fn tension(&self, strand: usize) -> Vec<f64> {
        self.edges(strand)
            .enumerate()
            .map(|(j, e)| stretch_stiffness(self, strand, j) * (self.tangent(strand, j).1 / self.rest_length[e] - 1.0))
            .collect()
    }

    fn interior(&self, strand: usize, f: impl Fn(usize) -> f64) -> Vec<f64> {
        let n = self.vertices(strand).len();
        (0..n).map(|i| if i > 0 && i + 1 < n { f(i) } else { 0.0 }).collect()
    }
}
