//! The films of many strands in flat arrays, and what they see of their strands.

use std::f64::consts::PI;
use std::ops::Range;

use nalgebra::Vector3;
use numerics::reduce::compensated_sum;
use serde::{Deserialize, Serialize};

use crate::error::FilmError;

/// What happens at the end of a strand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum End {
    /// Nothing passes (a root, a clamp).
    #[default]
    Closed,
    /// Film flows out into the reservoir of that end (a tip that drips).
    Open,
}

/// Films of all strands. Vertex quantities of strand `s` lie at [`FilmState::vertices`], edge quantities at
/// [`FilmState::edges`]; edge `j` of a strand joins its vertices `j` and `j + 1`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FilmState {
    /// First vertex of each strand, and the number of vertices at the end.
    start: Vec<usize>,
    /// Cross-section of the film [m²], one per vertex, ≥ 0.
    pub area: Vec<f64>,
    /// Axial elastic logarithmic strain `ϑ = ln b_xx`, one per vertex.
    pub log_strain: Vec<f64>,
    /// Speed along the tangent relative to the strand [m/s], one per edge.
    pub velocity: Vec<f64>,
    /// Volume waiting at both ends of each strand [m³], ≥ 0.
    pub reservoir: Vec<[f64; 2]>,
    /// What both ends of each strand do.
    pub ends: Vec<[End; 2]>,
}

/// What the films see of their strands, for all strands in the same order.
#[derive(Clone, Copy, Debug)]
pub struct StrandSlices<'a> {
    /// Length of each edge [m].
    pub edge_length: &'a [f64],
    /// Unit tangent of each edge.
    pub tangent: &'a [Vector3<f64>],
    /// Semi-axes `a`, `b` of the strand at each vertex [m].
    pub semi_axes: &'a [[f64; 2]],
    /// Acceleration of the strand at each vertex [m/s²].
    pub acceleration: &'a [Vector3<f64>],
}

/// Height of a film of cross-section `area` [m²] around a strand whose semi-axes add up to `axes` [m].
#[inline]
#[must_use]
pub fn film_height(area: f64, axes: f64) -> f64 {
    // ½(√(s² + 4A/π) − s), without the difference of near-equal numbers
    let q = 4.0 * area / PI;
    0.5 * q / ((axes * axes + q).sqrt() + axes)
}

/// Cross-section [m²] of a film of the given height [m] around a strand whose semi-axes add up to `axes` [m].
#[inline]
#[must_use]
pub fn film_area(height: f64, axes: f64) -> f64 {
    PI * height * (height + axes)
}

/// The arrays of a state, borrowed apart.
pub(crate) struct Parts<'a> {
    pub start: &'a [usize],
    pub area: &'a mut [f64],
    pub log_strain: &'a mut [f64],
    pub velocity: &'a mut [f64],
    pub reservoir: &'a mut [[f64; 2]],
    pub ends: &'a [[End; 2]],
}

impl FilmState {
    pub(crate) fn parts(&mut self) -> Parts<'_> {
        Parts {
            start: &self.start,
            area: &mut self.area,
            log_strain: &mut self.log_strain,
            velocity: &mut self.velocity,
            reservoir: &mut self.reservoir,
            ends: &self.ends,
        }
    }

    /// Dry films on strands with the given numbers of vertices, ends closed.
    #[must_use]
    pub fn new(vertex_counts: &[usize]) -> Self {
        let mut start = vec![0];
        let mut edges = 0;
        for &count in vertex_counts {
            start.push(start[start.len() - 1] + count);
            edges += count.saturating_sub(1);
        }
        let vertices = start[start.len() - 1];
        FilmState {
            area: vec![0.0; vertices],
            log_strain: vec![0.0; vertices],
            velocity: vec![0.0; edges],
            reservoir: vec![[0.0; 2]; vertex_counts.len()],
            ends: vec![[End::Closed; 2]; vertex_counts.len()],
            start,
        }
    }

    /// Number of strands.
    #[must_use]
    pub fn strands(&self) -> usize {
        self.start.len() - 1
    }

    /// First vertex of each strand, and the number of vertices at the end.
    #[must_use]
    pub fn starts(&self) -> &[usize] {
        &self.start
    }

    /// Vertices of a strand.
    #[must_use]
    pub fn vertices(&self, strand: usize) -> Range<usize> {
        self.start[strand]..self.start[strand + 1]
    }

    /// Edges of a strand.
    #[must_use]
    pub fn edges(&self, strand: usize) -> Range<usize> {
        let first = self.first_edge(strand);
        first..first + self.vertices(strand).len().saturating_sub(1)
    }

    /// First edge of a strand: every strand before it with at least one vertex has one edge less than vertices.
    fn first_edge(&self, strand: usize) -> usize {
        // strands of no vertex at all would break this count; they are refused by the check of shapes
        self.start[strand] - strand
    }

    /// Volume of the film of one strand, reservoirs included [m³]: `Σ A L` with `L` half the adjacent edges.
    #[must_use]
    pub fn volume(&self, strand: usize, edge_length: &[f64]) -> f64 {
        let area = &self.area[self.vertices(strand)];
        let length = &edge_length[self.edges(strand)];
        let film = (0..length.len()).map(|j| 0.5 * (area[j] + area[j + 1]) * length[j]);
        compensated_sum(film.chain(self.reservoir[strand]))
    }

    /// Volume of all films, reservoirs included [m³].
    #[must_use]
    pub fn total_volume(&self, edge_length: &[f64]) -> f64 {
        compensated_sum((0..self.strands()).map(|s| self.volume(s, edge_length)))
    }

    /// Momentum of one film along its strand, relative to the strand [kg·m/s].
    #[must_use]
    pub fn momentum(&self, strand: usize, edge_length: &[f64], density: f64) -> f64 {
        let area = &self.area[self.vertices(strand)];
        let (length, speed) = (&edge_length[self.edges(strand)], &self.velocity[self.edges(strand)]);
        compensated_sum((0..length.len()).map(|j| density * 0.5 * (area[j] + area[j + 1]) * length[j] * speed[j]))
    }

    /// Checks that the slices fit the films.
    ///
    /// # Errors
    /// [`FilmError::Shape`] naming the first that does not.
    pub fn check_shapes(&self, strands: &StrandSlices<'_>) -> Result<(), FilmError> {
        let vertices = self.start[self.strands()];
        let edges = vertices - self.strands().min(vertices);
        let require = |what, expected, found| {
            if expected == found { Ok(()) } else { Err(FilmError::Shape { what, expected, found }) }
        };
        for s in 0..self.strands() {
            if self.vertices(s).is_empty() {
                return Err(FilmError::Shape { what: "a strand", expected: 1, found: 0 });
            }
        }
        require("area", vertices, self.area.len())?;
        require("log strain", vertices, self.log_strain.len())?;
        require("velocity", edges, self.velocity.len())?;
        require("reservoir", self.strands(), self.reservoir.len())?;
        require("ends", self.strands(), self.ends.len())?;
        require("edge length", edges, strands.edge_length.len())?;
        require("tangent", edges, strands.tangent.len())?;
        require("semi-axes", vertices, strands.semi_axes.len())?;
        require("acceleration", vertices, strands.acceleration.len())
    }

    /// Checks that every number is finite and no volume negative.
    ///
    /// # Errors
    /// [`FilmError::NonFinite`].
    pub fn check(&self) -> Result<(), FilmError> {
        let mut bad = (0..self.strands()).filter(|&s| {
            let positive = |x: &f64| x.is_finite() && *x >= 0.0;
            !(self.area[self.vertices(s)].iter().all(positive)
                && self.reservoir[s].iter().all(positive)
                && self.log_strain[self.vertices(s)].iter().all(|x| x.is_finite())
                && self.velocity[self.edges(s)].iter().all(|x| x.is_finite()))
        });
        match bad.next() {
            None => Ok(()),
            Some(first) => Err(FilmError::NonFinite { strands: 1 + bad.count(), first }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn height_and_area_are_inverse_down_to_the_thinnest_film() {
        for height in [1e-15, 1e-9, 1e-5, 1e-3, 1.0] {
            let area = film_area(height, 1e-4);
            approx::assert_relative_eq!(film_height(area, 1e-4), height, max_relative = 1e-14);
        }
        assert_eq!(film_height(0.0, 1e-4), 0.0);
    }

    #[test]
    fn ranges_of_unequal_strands() {
        let state = FilmState::new(&[3, 1, 5]);
        assert_eq!((state.vertices(0), state.vertices(1), state.vertices(2)), (0..3, 3..4, 4..9));
        assert_eq!((state.edges(0), state.edges(1), state.edges(2)), (0..2, 2..2, 2..6));
        assert_eq!(state.velocity.len(), 6);
    }
}
