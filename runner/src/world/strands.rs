//! Strands of a scene as rods with their clamps.

use geometry::Motion;
use nalgebra::Vector3;
use rods::{Boundary, FixedAngle, FixedEdge, FixedVertex, Loads, RestShape, RodSet, StrandMaterial, StrandSpec};

use super::{BuildError, script};
use crate::scene::Scene;
use crate::scene::expand::{ClampGeometry, RestGeometry, StrandGeometry};

/// Vertices and edges that are held or moved by script.
#[derive(Clone, Debug)]
pub struct HeldPart {
    /// Strand they belong to.
    pub strand: usize,
    /// Index in the whole set and position at time zero [m] of each held vertex.
    pub vertices: Vec<(usize, Vector3<f64>)>,
    /// Index in the whole set and first material director at time zero of each held edge.
    pub edges: Vec<(usize, Vector3<f64>)>,
    /// How they move.
    pub motion: Motion,
    /// Point about which turns that name none are made [m].
    pub center: Vector3<f64>,
    /// When they are let go [s].
    pub until: Option<f64>,
}

/// The strands of a scene: rods in their initial state, and what holds them.
#[derive(Clone, Debug)]
pub struct BuiltStrands {
    /// All strands in scene order.
    pub rods: RodSet,
    /// What is held.
    pub held: Vec<HeldPart>,
    /// Friction coefficient per strand.
    pub friction: Vec<f64>,
    /// Group in the scene per strand.
    pub group: Vec<usize>,
}

/// Builds the strands of a scene.
///
/// # Errors
/// When a strand cannot be built; the message names it.
pub fn build(scene: &Scene, strands: &[StrandGeometry]) -> Result<BuiltStrands, BuildError> {
    let mut built = BuiltStrands { rods: RodSet::new(), held: Vec::new(), friction: Vec::new(), group: Vec::new() };
    for geometry in strands {
        let description = &scene.strands[geometry.group];
        let fibre = scene.fibre(&description.material).ok_or_else(|| BuildError::Strand {
            group: geometry.group,
            index: geometry.index,
            what: format!("its material `{}` is not a complete fibre", description.material),
        })?;
        let refuse = |what: String| BuildError::Strand { group: geometry.group, index: geometry.index, what };
        let material = StrandMaterial {
            young_modulus: fibre.young_modulus,
            poisson_ratio: fibre.poisson_ratio,
            density: fibre.density,
            viscosity: fibre.viscosity,
            stretch_multiplier: fibre.stretch_factor,
            air_drag: scene.air_drag,
            base_rotation: geometry.section_angle,
        };
        let edges = geometry.positions.len() - 1;
        let mut spec = StrandSpec::new(geometry.positions.clone(), 0.0, material);
        spec.radii = geometry.radius.iter().zip(&geometry.second_radius).map(|(a, b)| [*a, *b]).collect();
        spec.stiffness_scale = Some(geometry.stiffness.clone());
        spec.velocities = Some(geometry.velocities.clone());
        spec.director = geometry.director;
        if geometry.twist != 0.0 {
            let part = geometry.twist / edges.saturating_sub(1).max(1) as f64;
            spec.twist_angles = Some((0..edges).map(|j| part * j as f64).collect());
        }
        // twist put in at the start is strain, whatever the rest shape
        spec.rest = match &geometry.rest {
            RestGeometry::AsGiven => as_given(&spec).map_err(|e| refuse(e.to_string()))?,
            RestGeometry::Sagfree => {
                let (rest, lengths) = sag_free(&spec, geometry, scene).map_err(|e| refuse(e.to_string()))?;
                spec.rest_lengths = Some(lengths);
                rest
            }
            RestGeometry::Straight => RestShape::Straight,
            RestGeometry::Curvature { first, second, twist } => {
                RestShape::Uniform { curvature: [*first, *second], twist: *twist }
            }
            RestGeometry::Polyline(points) => {
                spec.rest_lengths = Some(points.windows(2).map(|pair| (pair[1] - pair[0]).norm()).collect());
                let mut at_rest = spec.clone();
                at_rest.positions.clone_from(points);
                at_rest.rest_lengths = None;
                at_rest.director = None;
                as_given(&at_rest).map_err(|e| refuse(e.to_string()))?
            }
        };
        let strand = built.rods.add_strand(&spec).map_err(|error| refuse(error.to_string()))?;
        built.friction.push(description.friction);
        built.group.push(geometry.group);
        for clamp in &geometry.clamps {
            built.held.push(hold(&built.rods, strand, clamp, scene.time.end)?);
        }
    }
    Ok(built)
}

/// The rest shape in which the given shape, without the twist put in, is free of stress.
fn as_given(spec: &StrandSpec) -> Result<RestShape, rods::RodError> {
    let mut alone = RodSet::new();
    let mut untwisted = spec.clone();
    untwisted.twist_angles = None;
    untwisted.rest = RestShape::AsGiven;
    alone.add_strand(&untwisted)?;
    Ok(RestShape::Explicit { curvature: alone.rest_curvature, twist: alone.rest_twist })
}

/// The rest shape and rest lengths for which the strand as given is in equilibrium under gravity.
fn sag_free(spec: &StrandSpec, geometry: &StrandGeometry, scene: &Scene) -> Result<(RestShape, Vec<f64>), BuildError> {
    let refuse = |error: rods::RodError| BuildError::Sagfree(error.to_string());
    let mut alone = RodSet::new();
    alone.add_strand(spec).map_err(refuse)?;
    let mut boundary = Boundary::default();
    for clamp in &geometry.clamps {
        hold(&alone, 0, clamp, scene.time.end)?.prescribe(0.0, &mut boundary, &alone);
    }
    rods::make_sag_free(&mut alone, &Loads::gravity(scene.gravity), &boundary).map_err(refuse)?;
    Ok((RestShape::Explicit { curvature: alone.rest_curvature, twist: alone.rest_twist }, alone.rest_length))
}

fn hold(rods: &RodSet, strand: usize, clamp: &ClampGeometry, end: f64) -> Result<HeldPart, BuildError> {
    let (first_vertex, first_edge) = (rods.vertices(strand).start, rods.edges(strand).start);
    let vertex = |i: &usize| (first_vertex + i, rods.position[first_vertex + i]);
    let edge = |j: &usize| (first_edge + j, rods.material_directors(strand, *j).0);
    Ok(HeldPart {
        strand,
        vertices: clamp.vertices.iter().map(vertex).collect(),
        edges: clamp.edges.iter().map(edge).collect(),
        motion: script::motion(&clamp.motion, end)?,
        center: clamp.center,
        until: clamp.until,
    })
}

impl HeldPart {
    /// Adds what this part prescribes at `time` [s] to a boundary. A part that was let go before adds nothing.
    pub fn prescribe(&self, time: f64, boundary: &mut Boundary, rods: &RodSet) {
        if self.until.is_some_and(|until| time > until * (1.0 + 1e-12)) {
            return;
        }
        if self.motion.is_still() {
            for (vertex, position) in &self.vertices {
                boundary.fix_vertex(*vertex, *position);
            }
            for (edge, _) in &self.edges {
                let angle = FixedAngle::Angle(rods.twist_angle[*edge]);
                boundary.edges.push(FixedEdge { edge: *edge, angle });
            }
            return;
        }
        let pose = self.motion.pose(&self.center, time);
        for (vertex, position) in &self.vertices {
            boundary.vertices.push(FixedVertex {
                vertex: *vertex,
                position: pose.apply(position),
                components: [true; 3],
            });
        }
        for (edge, director) in &self.edges {
            let angle = FixedAngle::Director(pose.rotation * director);
            boundary.edges.push(FixedEdge { edge: *edge, angle });
        }
    }

    /// Largest speed of the held vertices at `time` [m/s].
    #[must_use]
    pub fn speed(&self, time: f64) -> f64 {
        if self.motion.is_still() || self.until.is_some_and(|until| time > until) {
            return 0.0;
        }
        let (pose, field) = self.motion.evaluate(&self.center, time);
        self.vertices.iter().map(|(_, position)| field.at(&pose.apply(position)).norm()).fold(0.0, f64::max)
    }
}
