//! Strands: fibres, vertices, clamps, films.

use super::Translation;
use crate::import::assets;
use crate::import::document::{Number, Sited};
use crate::import::notes::Heading;
use crate::import::original::strands::{HairObject, Particle, StrandParameters};
use crate::import::replay::unit_axis;
use crate::import::ron;
use crate::scene::error::ProblemKind;
use crate::scene::tree::{Node, Span};
use nalgebra::{UnitQuaternion, Vector3};
use std::collections::{BTreeMap, BTreeSet};

/// Positions beyond this are no scene \[cm\].
const FARTHEST: f64 = 1e8;

/// A vertex as far as clamps and films are concerned.
#[derive(Clone, Copy)]
struct Vertex {
    held: bool,
    twist_held: bool,
    group: i64,
    film: Number,
}

impl Vertex {
    fn of(particle: &Particle) -> Vertex {
        Vertex {
            held: particle.held(),
            twist_held: particle.twist_held(),
            group: particle.group.value,
            film: particle.film,
        }
    }
}

impl Translation<'_, '_> {
    fn parameters(&self, index: Sited<i64>) -> Option<(usize, &StrandParameters)> {
        let place = usize::try_from(index.value).ok();
        let found = place.and_then(|place| Some((place, self.original.parameters.get(place)?)));
        if found.is_none() {
            let count = self.original.parameters.len();
            let message = format!("there are no StrandParameters {}; the file has {count}", index.value);
            let help = "they are counted from 0 in the order of the file";
            self.document.problem(ProblemKind::UnknownReference, index.span, message, help);
        }
        found
    }

    fn fibre_name(&self, index: usize) -> String {
        if self.original.parameters.len() == 1 { "fibre".to_owned() } else { format!("fibre {index}") }
    }

    /// A fibre per parameter set that a strand uses.
    pub(super) fn fibres(&self) -> Vec<(String, Node)> {
        let hairs = self.original.hairs.iter().map(|hair| hair.parameters.value);
        let used: BTreeSet<i64> = hairs.chain(self.original.objects.iter().map(|o| o.parameters.value)).collect();
        let mut fibres = Vec::new();
        for (index, set) in self.original.parameters.iter().enumerate() {
            if !used.contains(&i64::try_from(index).unwrap_or(-1)) {
                self.document.note(
                    Heading::Ignored,
                    set.span,
                    format!("StrandParameters {index}"),
                    "no strand has them",
                );
                continue;
            }
            let mut fields = vec![
                ("density", ron::number(set.density)),
                ("young_modulus", ron::number(set.young_modulus)),
                ("poisson_ratio", ron::number(set.poisson_ratio)),
                ("viscosity", ron::number(set.viscosity)),
            ];
            if set.stretch_factor.value != 1.0 {
                fields.push(("stretch_factor", ron::number(set.stretch_factor)));
            }
            fibres.push((self.fibre_name(index), ron::group(set.span, "Fibre", fields)));
        }
        fibres
    }

    /// All strand groups: one per hair, one per file.
    pub(super) fn strands(&mut self) -> Option<Node> {
        let mut groups = Vec::new();
        let original = self.original;
        let mut used = vec![false; original.particles.len()];
        for hair in &original.hairs {
            let Some((index, _)) = self.parameters(hair.parameters) else { continue };
            let mut particles = Vec::with_capacity(hair.particles.len());
            let mut sound = true;
            for &number in &hair.particles {
                match usize::try_from(number).ok().and_then(|place| Some((place, original.particles.get(place)?))) {
                    Some((place, particle)) => {
                        used[place] = true;
                        particles.push(particle);
                    }
                    None => {
                        let count = original.particles.len();
                        let message = format!("a strand names particle {number}, but there are {count}");
                        let help = "particles are counted from 0 in the order of the file";
                        self.document.problem(ProblemKind::UnknownReference, hair.span, message, help);
                        sound = false;
                        break;
                    }
                }
            }
            if !sound {
                continue;
            }
            if particles.len() < 2 {
                let message = format!("a strand with {} vertices", particles.len());
                self.document.problem(ProblemKind::Inconsistent, hair.span, message, "a strand needs two or more");
                continue;
            }
            let vertices: Vec<Vertex> = particles.iter().map(|particle| Vertex::of(particle)).collect();
            let points: Vec<Node> = particles.iter().filter_map(|particle| self.point(particle)).collect();
            if particles.iter().any(|particle| particle.angle != 0.0) {
                let why = "the material frame starts where it would without; it matters for flat sections only";
                self.document.note(Heading::NotHonoured, particles[0].span, "particle: theta", why);
            }
            let shape = ron::group(hair.span, "Polyline", vec![("points", ron::list(points))]);
            groups.push(self.group(hair.span, index, shape, None, &vertices));
        }
        for (particle, used) in original.particles.iter().zip(used) {
            if !used {
                self.document.note(Heading::Ignored, particle.span, "particle of no strand", "nothing is made of it");
            }
        }
        for object in &original.objects {
            groups.extend(self.object(object));
        }
        self.contact_radii();
        (!groups.is_empty()).then(|| ron::list(groups))
    }

    fn point(&self, particle: &Particle) -> Option<Node> {
        let position = particle.position;
        if position.value.iter().any(|x| x.abs() > FARTHEST) {
            let message = format!("a particle at {:e} cm", position.value.iter().fold(0.0, |a: f64, b| a.max(b.abs())));
            self.document.problem(ProblemKind::OutOfRange, position.span, message, "lengths are in cm");
            return None;
        }
        position.value.iter().all(|x| x.is_finite()).then(|| ron::vector(position))
    }

    /// A group of strands that are alike in their vertices.
    fn group(&mut self, span: Span, index: usize, shape: Node, placement: Option<Node>, vertices: &[Vertex]) -> Node {
        let set = &self.original.parameters[index];
        let mut fields = vec![("material", ron::text(&self.fibre_name(index))), ("radius", ron::number(set.radius))];
        if let Some(second) = set.second_radius.filter(|second| second.value != set.radius.value) {
            fields.push(("second_radius", ron::number(second)));
            let why = "the first director is chosen by the program; `director` sets it";
            self.document.note(Heading::Changed, second.span, "StrandParameters/biradius", why);
            if set.base_rotation.value != 0.0 {
                fields.push(("section_angle", ron::number(set.base_rotation.map(f64::to_degrees))));
            }
        } else if set.base_rotation.value != 0.0 {
            let why = "round sections look the same from all sides";
            self.document.note(Heading::Machinery, set.base_rotation.span, "StrandParameters/baseRotation", why);
        }
        fields.push(("shape", shape));
        fields.extend(placement.map(|placement| ("placement", placement)));
        let clamps = self.clamps(vertices, span);
        if !clamps.is_empty() {
            fields.push(("clamp", ron::list(clamps)));
        }
        fields.push(("friction", ron::number(self.original.switches.strand_friction)));
        if self.films_wanted() {
            fields.push(("film", self.film(vertices, span)));
        }
        ron::group(span, "", fields)
    }

    fn film(&self, vertices: &[Vertex], span: Span) -> Node {
        let mut fields = Vec::new();
        if self.original.liquid.components.len() > 1 {
            fields.push(("material", ron::text(&self.liquid_name(0))));
        }
        let first = vertices.first().map_or(Sited::made(0.0), |vertex| vertex.film);
        if vertices.iter().any(|vertex| vertex.film.value != first.value) {
            fields.push(("height", ron::list(vertices.iter().map(|vertex| ron::number(vertex.film)).collect())));
        } else if first.value != 0.0 {
            fields.push(("height", ron::number(first)));
        }
        ron::group(span, "", fields)
    }

    /// The clamps of a strand: one for every run of vertices that are held and move alike.
    fn clamps(&mut self, vertices: &[Vertex], span: Span) -> Vec<Node> {
        let count = vertices.len();
        let mut parts: BTreeMap<i64, Vec<usize>> = BTreeMap::new();
        for (i, vertex) in vertices.iter().enumerate() {
            if vertex.held {
                parts.entry(vertex.group).or_default().push(i);
            } else if vertex.twist_held {
                let why = "twist is held between two held vertices only";
                self.document.note(Heading::NotHonoured, span, "vertex with its twist held and its place free", why);
            }
        }
        let mut clamps = Vec::new();
        for (group, held) in parts {
            let (motion, until) = self.motion_of_vertices(group);
            // runs of edges whose ends and twist are held
            let mut runs: Vec<Vec<usize>> = Vec::new();
            let mut free: Vec<usize> = Vec::new();
            for (k, &i) in held.iter().enumerate() {
                let joined = |a: usize| vertices[a].twist_held && held.binary_search(&(a + 1)).is_ok();
                let by_next = joined(i);
                let by_last = k > 0 && held[k - 1] + 1 == i && joined(held[k - 1]);
                match (by_last, by_next) {
                    (true, _) => runs.last_mut().into_iter().for_each(|run| run.push(i)),
                    (false, true) => runs.push(vec![i]),
                    (false, false) => free.push(i),
                }
                if vertices[i].twist_held && !by_next && i + 1 < count {
                    let why = "twist is held between two held vertices only";
                    self.document.note(Heading::NotHonoured, span, "twist of an edge with one held end", why);
                }
            }
            let turned = !runs.is_empty() && motion.is_some() && self.turns(group);
            if turned {
                let why = "held twist turns with the clamp; in the original it stays behind when the group turns";
                self.document.note(Heading::Changed, span, format!("held twist of group {group}"), why);
            }
            // vertices without held twist move alike: one clamp, unless they are neighbours at one end
            for (run, held_twist) in runs.into_iter().map(|run| (run, true)).chain([(free, false)]) {
                if !run.is_empty() {
                    clamps.push(clamp(&run, count, held_twist, motion.clone(), until));
                }
            }
        }
        clamps
    }

    fn turns(&self, group: i64) -> bool {
        use crate::import::original::scripts::Kind;
        let turning = |kind| matches!(kind, Kind::Rotate | Kind::Swirl);
        self.original.scripts.iter().any(|script| script.group.value == group && turning(script.kind))
    }

    /// The strands of a file: as a file where all take part and have equally many vertices, else one by one.
    fn object(&mut self, object: &HairObject) -> Vec<Node> {
        let Some((index, _)) = self.parameters(object.parameters) else { return Vec::new() };
        let turn = unit_axis(object.axis.value)
            .map_or(UnitQuaternion::identity(), |axis| UnitQuaternion::from_axis_angle(&axis, object.angle));
        let shift = Vector3::from(object.translate.value);
        let lines = match assets::find(&object.file.value, self.source, &self.options.assets) {
            Some(path) => match crate::scene::obj::read(&path) {
                Ok(lines) => Some(lines),
                Err(message) => {
                    let help = "strands are the `l` lines of an OBJ file";
                    self.document.problem(ProblemKind::File, object.file.span, message, help);
                    return Vec::new();
                }
            },
            None => None,
        };
        let known = object.film.iter().map(|r| r.end).chain(object.fixed.iter().map(|r| r.end)).max().unwrap_or(1);
        let known = usize::try_from(known + 1).unwrap_or(2);
        let counts: BTreeSet<usize> = lines.iter().flatten().map(Vec::len).collect();
        let one_by_one = !object.selection.is_empty() || counts.len() > 1;
        match lines {
            Some(lines) if one_by_one => {
                let wanted = |i: &usize| object.selection.is_empty() || object.selection.contains(i);
                let mut groups = Vec::new();
                for (_, line) in lines.iter().enumerate().filter(|(i, _)| wanted(i)) {
                    let Some(vertices) = self.object_vertices(object, line.len()) else { break };
                    let points = line.iter().map(|point| ron::plain_vector((turn * point + shift).into())).collect();
                    let shape = ron::group(object.span, "Polyline", vec![("points", ron::list(points))]);
                    groups.push(self.group(object.span, index, shape, None, &vertices));
                }
                groups
            }
            lines => {
                let count = lines.as_ref().and_then(|lines| lines.first()).map_or(known, Vec::len);
                let Some(vertices) = self.object_vertices(object, count) else { return Vec::new() };
                let file = self.file(&object.file.value, object.file.span);
                let mut placement = Vec::new();
                if shift != Vector3::zeros() {
                    placement.push(("translate", ron::vector(object.translate)));
                }
                if turn.angle() != 0.0 {
                    placement.push(("rotate", ron::plain_vector(turn.scaled_axis().map(f64::to_degrees).into())));
                }
                let placement = (!placement.is_empty()).then(|| ron::group(object.span, "", placement));
                let shape = ron::group(object.span, "Obj", vec![("file", file)]);
                vec![self.group(object.span, index, shape, placement, &vertices)]
            }
        }
    }

    /// What a file's strands of `count` vertices have at each of them; later settings count.
    fn object_vertices(&self, object: &HairObject, count: usize) -> Option<Vec<Vertex>> {
        let dry = Sited { value: 0.0, span: object.span };
        let blank = Vertex { held: false, twist_held: false, group: object.group.value, film: dry };
        let mut vertices = vec![blank; count];
        let mut settings: Vec<(Span, i64, i64)> = object.film.iter().map(|r| (r.span, r.start, r.end)).collect();
        settings.extend(object.fixed.iter().map(|r| (r.span, r.start, r.end)));
        if let Some((span, _, end)) =
            settings.into_iter().find(|(_, _, end)| usize::try_from(*end).is_ok_and(|e| e >= count))
        {
            let message = format!("vertex {end} of strands with {count} vertices (0 to {})", count.saturating_sub(1));
            self.document.problem(ProblemKind::Inconsistent, span, message, "the original writes past the strand here");
            return None;
        }
        let places = |start: i64, end: i64| usize::try_from(start).unwrap_or(0)..usize::try_from(end + 1).unwrap_or(0);
        for range in &object.film {
            for i in places(range.start, range.end) {
                vertices[i].film = Sited { value: range.value, span: range.span };
            }
        }
        for range in &object.fixed {
            for i in places(range.start, range.end) {
                vertices[i].held |= range.value & 1 != 0;
                vertices[i].twist_held |= range.value & 2 != 0;
            }
        }
        Some(vertices)
    }

    fn contact_radii(&self) {
        let switches = &self.original.switches;
        for set in &self.original.parameters {
            for (radius, what, skipped) in [
                (switches.strand_contact_radius, "selfCollisionsRadius", switches.skip_strand_strand.value),
                (switches.solid_contact_radius, "externalCollisionsRadius", switches.skip_strand_solid.value),
            ] {
                if radius.span != Span::NONE && !skipped && (radius.value - set.radius.value).abs() > 1e-12 {
                    let what = format!("CollisionParameters/{what} = {}", radius.value);
                    let why = format!("contacts form at the strands' own radius, {}", set.radius.value);
                    self.document.note(Heading::NotHonoured, radius.span, what, why);
                }
            }
        }
    }
}

/// A clamp of these vertices of a strand of `count`.
fn clamp(held: &[usize], count: usize, twist: bool, motion: Option<Node>, until: Option<Number>) -> Node {
    let first = held.iter().enumerate().all(|(k, &i)| k == i);
    let last = held.iter().enumerate().all(|(k, &i)| i + held.len() == count + k);
    let (variant, place) = match (first, last) {
        (true, _) => ("First", ("count", ron::whole(held.len()))),
        (_, true) => ("Last", ("count", ron::whole(held.len()))),
        _ => ("Vertices", ("vertices", ron::list(held.iter().map(|&i| ron::whole(i)).collect()))),
    };
    let mut fields = vec![place];
    if !twist && held.len() > 1 {
        fields.push(("twist", ron::name("Free")));
    }
    fields.extend(motion.map(|motion| ("motion", motion)));
    fields.extend(until.map(|until| ("until", ron::number(until))));
    ron::group(until.map_or(Span::NONE, |until| until.span), variant, fields)
}
