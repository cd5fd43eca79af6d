//! Strands: vertices, clamps, rest shapes, films.

use super::Checker;
use crate::scene::edit::Path;
use crate::scene::error::ProblemKind;
use crate::scene::expand::{BYTES_PER_VERTEX, MEMORY_LIMIT, held_vertices, usual_radius};
use crate::scene::generators::{centrelines, counts};
use crate::scene::materials::Material;
use crate::scene::quantity::Quantity;
use crate::scene::strands::{Along, Clamp, RestShape, StrandGroup, StrandShape};
use nalgebra::Vector3;
use std::collections::BTreeMap;

impl Checker<'_> {
    pub(super) fn strand_group(&mut self, place: &Path, group: &StrandGroup) {
        let known = self.material_of_kind(&place.field("material"), &group.material, false);
        if known && group.radius.is_none() && usual_radius(self.scene, group).is_none() {
            let message = format!(
                "the strands need a `radius`: their material \"{}\" has no preset that names one",
                group.material
            );
            self.refuse(ProblemKind::MissingField, place, message, "add `radius: …`");
        }
        self.script(&place.field("motion"), &group.motion);
        let sound = self.shape(&place.field("shape"), &group.shape);
        let too_large = counts(&group.shape).is_some_and(|(strands, vertices)| needs_too_much(strands, vertices));
        if !sound || too_large {
            return;
        }
        match counts(&group.shape) {
            // A generator's edges have a length by construction, and its strands are all alike.
            Some((_, vertices)) if !matches!(group.shape, StrandShape::Polyline(_)) => {
                self.vertices(place, group, vertices)
            }
            _ => self.written_lines(place, group),
        }
        self.crowded(place, group);
        self.strand_film(place, group);
    }

    /// Neighbours of a hexagonal bundle must not overlap.
    pub(super) fn crowded(&mut self, place: &Path, group: &StrandGroup) {
        let StrandShape::HexBundle(shape) = &group.shape else { return };
        let radius = match &group.radius {
            Some(Along::Constant(radius)) => Some(*radius),
            Some(Along::Taper(root, tip)) => Some(root.max(*tip)),
            Some(Along::Values(values)) => values.iter().copied().reduce(f64::max),
            None => usual_radius(self.scene, group),
        };
        if let Some(radius) = radius
            && shape.count > 1
            && shape.spacing < 2.0 * radius
        {
            let message = format!(
                "the strands overlap: they are {} apart and {} thick",
                self.show(Quantity::Length, shape.spacing),
                self.show(Quantity::Length, 2.0 * radius)
            );
            self.inconsistent(
                &place.field("shape").field("spacing"),
                message,
                "make the spacing at least twice the radius",
            );
        }
    }

    /// Checks strands whose vertices are given one by one, in the scene or in a file.
    pub(super) fn written_lines(&mut self, place: &Path, group: &StrandGroup) {
        let lines = match centrelines(self.scene, 0, group) {
            Ok(lines) => lines,
            Err(problem) => {
                let at = place.field("shape").field("file");
                self.refuse(problem.kind, &at, problem.message, "the name is relative to the scene file");
                return;
            }
        };
        for (strand, (line, _)) in lines.iter().enumerate() {
            let before = self.problems.len();
            if !line.iter().all(|point| point.iter().all(|x| x.is_finite())) {
                let message = format!("strand {strand} of the group reaches beyond all numbers");
                self.refuse(ProblemKind::OutOfRange, &place.field("shape"), message, "make its lengths smaller");
                return;
            }
            self.edges(place, group, strand, line);
            self.vertices(place, group, line.len());
            if self.problems.len() > before {
                return; // the other strands have the same faults more often than others
            }
        }
    }

    /// Checks everything that is counted by vertices.
    pub(super) fn vertices(&mut self, place: &Path, group: &StrandGroup, vertices: usize) {
        self.per_vertex(place, group, vertices);
        self.clamps(place, group, vertices);
        let RestShape::Polyline(rest) = &group.rest else { return };
        let at = place.field("rest").field("points");
        if rest.points.len() != vertices {
            let message = format!("the rest shape has {} vertices, the strand {vertices}", rest.points.len());
            self.inconsistent(&at, message, "give one rest vertex per vertex");
        } else if let Some(edge) = short_edge(&rest.points) {
            let message = format!("edge {edge} of the rest shape has no length");
            self.inconsistent(&at.index(edge + 1), message, "neighbouring vertices must differ");
        }
    }

    /// Whether the generator's own numbers make sense.
    pub(super) fn shape(&mut self, place: &Path, shape: &StrandShape) -> bool {
        let before = self.problems.len();
        let apart = |from: Vector3<f64>, to: Vector3<f64>| {
            let length = (to - from).norm();
            length.is_finite() && length > 0.0
        };
        match shape {
            StrandShape::Polyline(shape) if shape.points.len() < 2 => {
                let message = format!("a strand needs at least two vertices, found {}", shape.points.len());
                self.inconsistent(&place.field("points"), message, "add vertices: `Polyline([[0, 0, 0], [1, 0, 0]])`");
            }
            StrandShape::Straight(shape) => {
                if !apart(shape.from, shape.to) {
                    self.inconsistent(
                        &place.field("to"),
                        "the strand starts and ends at the same point",
                        "give `to` another place than `from`",
                    );
                }
                if let Some(spacing) = &shape.spacing
                    && spacing.len() + 1 != shape.vertices
                {
                    let message = format!("`spacing` has {} entries for {} edges", spacing.len(), shape.vertices - 1);
                    self.inconsistent(
                        &place.field("spacing"),
                        message,
                        "give one entry per edge, one less than vertices",
                    );
                }
            }
            StrandShape::HexBundle(shape) if !apart(shape.from, shape.to) => {
                self.inconsistent(
                    &place.field("to"),
                    "the strands start and end at the same point",
                    "give `to` another place than `from`",
                );
            }
            StrandShape::Bundle(shape) if !apart(shape.from, shape.to) => {
                self.inconsistent(
                    &place.field("to"),
                    "the strands start and end at the same point",
                    "give `to` another place than `from`",
                );
            }
            StrandShape::Arc(shape) if shape.angle == 0.0 => {
                self.inconsistent(&place.field("angle"), "an arc of 0° has no length", "give it an angle");
            }
            _ => {}
        }
        self.problems.len() == before
    }

    pub(super) fn edges(&mut self, place: &Path, group: &StrandGroup, strand: usize, line: &[Vector3<f64>]) {
        if let Some(edge) = short_edge(line) {
            let (at, which) = match &group.shape {
                StrandShape::Polyline(_) => (place.field("shape").field("points").index(edge + 1), String::new()),
                StrandShape::Obj(_) => (place.field("shape").field("file"), format!(" of strand {strand}")),
                _ => (place.field("shape"), String::new()),
            };
            let message =
                format!("edge {edge}{which} has no length: vertices {edge} and {} are at the same point", edge + 1);
            self.inconsistent(&at, message, "remove one of the two vertices, or move it");
        }
    }

    pub(super) fn per_vertex(&mut self, place: &Path, group: &StrandGroup, vertices: usize) {
        let lists = [
            ("radius", group.radius.as_ref()),
            ("second_radius", group.second_radius.as_ref()),
            ("stiffness", Some(&group.stiffness)),
        ];
        let film = group.film.as_ref().map(|film| (place.field("film").field("height"), &film.height));
        let lists = lists.into_iter().filter_map(|(name, list)| Some((place.field(name), list?))).chain(film);
        for (at, list) in lists.collect::<Vec<_>>() {
            if let Along::Values(values) = list
                && values.len() != vertices
            {
                let message = format!("this list has {} numbers for {vertices} vertices", values.len());
                self.inconsistent(
                    &at,
                    message,
                    "give one number per vertex, one number for all, or `Taper(root, tip)`",
                );
            }
        }
    }

    pub(super) fn clamps(&mut self, place: &Path, group: &StrandGroup, vertices: usize) {
        let mut owner: BTreeMap<usize, usize> = BTreeMap::new();
        for (i, clamp) in group.clamp.iter().enumerate() {
            let at = place.field("clamp").index(i);
            let motion = match clamp {
                Clamp::First(end) | Clamp::Last(end) => {
                    if end.count > vertices {
                        let message = format!("this clamp holds {} vertices, but the strand has {vertices}", end.count);
                        self.inconsistent(
                            &at,
                            message,
                            format!("hold at most {vertices}; two build an end in, one is a ball joint"),
                        );
                    }
                    &end.motion
                }
                Clamp::Vertices(list) => {
                    if let Some(outside) = list.vertices.iter().find(|&&vertex| vertex >= vertices) {
                        let message = format!(
                            "this clamp holds vertex {outside}, but the strand has {vertices} (0 to {})",
                            vertices - 1
                        );
                        self.inconsistent(&at, message, "the root is vertex 0; hold the tip with `Last(1)`");
                    }
                    if list.vertices.is_empty() {
                        self.inconsistent(&at, "this clamp holds no vertex", "name vertices, or remove it");
                    }
                    &list.motion
                }
            };
            if let Some(motion) = motion {
                self.script(&at.field("motion"), motion);
            }
            for vertex in held_vertices(clamp, vertices) {
                if let Some(first) = owner.insert(vertex, i) {
                    let message = format!("vertex {vertex} is held by two clamps, clamp[{first}] and clamp[{i}]");
                    self.inconsistent(
                        &at,
                        message,
                        format!("let each vertex be held once; the strand has {vertices} vertices"),
                    );
                    return;
                }
            }
        }
    }

    pub(super) fn strand_film(&mut self, place: &Path, group: &StrandGroup) {
        let Some(film) = &group.film else { return };
        let at = place.field("film");
        match &film.material {
            Some(name) => {
                self.material_of_kind(&at.field("material"), name, true);
            }
            None => {
                let liquids =
                    self.scene.materials.values().filter(|material| matches!(material, Material::Liquid(_))).count();
                if liquids != 1 {
                    let message = format!("the film needs a `material`: the scene has {liquids} liquids");
                    self.refuse(
                        ProblemKind::MissingField,
                        &at,
                        message,
                        "add `material: \"…\"` with the name of a liquid in `materials`",
                    );
                }
            }
        }
    }
}

fn needs_too_much(strands: usize, vertices: usize) -> bool {
    #[allow(clippy::cast_precision_loss)]
    let bytes = strands as f64 * vertices as f64 * BYTES_PER_VERTEX;
    bytes > MEMORY_LIMIT
}

/// The first edge without a length (or with one that is not finite).
fn short_edge(line: &[Vector3<f64>]) -> Option<usize> {
    line.windows(2).position(|pair| {
        let length = (pair[1] - pair[0]).norm();
        !(length.is_finite() && length > 0.0)
    })
}
