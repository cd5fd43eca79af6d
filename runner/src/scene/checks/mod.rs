//! What must fit together in a scene, beyond the range of each single number.

mod limits;
mod materials;
mod microgel;
mod motions;
mod strands;
mod volumes;
mod yarn;

use super::Scene;
use super::edit::{Path, follow_loosely};
use super::error::{Problem, ProblemKind, SourceFile};
use super::quantity::Quantity;
use super::solids::Volume;
use super::strands::StrandShape;
use super::tree::{Node, Span};
use super::yarn::YarnShape;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Every inconsistency of a scene, each at its place in the text.
#[must_use]
pub fn check(scene: &Scene, root: &Node, files: &[SourceFile]) -> Vec<Problem> {
    let mut checker = Checker { scene, root, files, problems: Vec::new() };
    checker.materials();
    checker.motions();
    for (i, group) in scene.strands.iter().enumerate() {
        checker.strand_group(&Path::default().field("strands").index(i), group);
    }
    let strand_names: Vec<_> = scene.strands.iter().map(|group| group.name.clone()).collect();
    let solid_names: Vec<_> = scene.solids.iter().map(|solid| solid.name.clone()).collect();
    checker.unique_names(&Path::default().field("strands"), &strand_names);
    checker.unique_names(&Path::default().field("solids"), &solid_names);
    for (i, solid) in scene.solids.iter().enumerate() {
        let place = Path::default().field("solids").index(i);
        checker.volume(&place.field("shape"), &solid.shape);
        checker.script(&place.field("motion"), &solid.motion);
    }
    if let Some(liquid) = &scene.liquid {
        checker.liquid(liquid);
    }
    if let Some(microgel) = &scene.microgel {
        checker.microgel(microgel);
    } else {
        checker.time();
    }
    if let Some(yarn) = &scene.yarn {
        checker.yarn(yarn);
    }
    checker.memory();
    checker.output();
    checker.problems
}

/// The files that a scene refers to besides included ones.
#[must_use]
pub fn external_files(scene: &Scene) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for group in &scene.strands {
        if let StrandShape::Obj(shape) = &group.shape {
            files.push(shape.file.path.clone());
        }
    }
    let yarns = scene.yarn.iter().flat_map(|yarn| &yarn.groups);
    files.extend(yarns.filter_map(|group| match &group.shape {
        YarnShape::File(shape) => Some(shape.file.path.clone()),
        _ => None,
    }));
    let liquid = scene.liquid.iter().flat_map(|liquid| {
        let tanks = liquid.tanks.iter().map(|tank| &tank.shape);
        tanks
            .chain(liquid.sources.iter().map(|source| &source.shape))
            .chain(liquid.drains.iter().map(|drain| &drain.shape))
    });
    for volume in scene.solids.iter().map(|solid| &solid.shape).chain(liquid) {
        if let Volume::Mesh(mesh) = volume {
            files.push(mesh.file.path.clone());
        }
    }
    files
}

struct Checker<'a> {
    scene: &'a Scene,
    root: &'a Node,
    files: &'a [SourceFile],
    problems: Vec<Problem>,
}

impl Checker<'_> {
    fn span(&self, place: &Path) -> Span {
        follow_loosely(self.root, place).span
    }

    fn refuse(&mut self, kind: ProblemKind, place: &Path, message: impl Into<String>, help: impl Into<String>) {
        let problem = Problem::new(kind, message, self.span(place), self.files).at(place.to_string()).help(help);
        self.problems.push(problem);
    }

    fn inconsistent(&mut self, place: &Path, message: impl Into<String>, help: impl Into<String>) {
        self.refuse(ProblemKind::Inconsistent, place, message, help);
    }

    /// An SI value in the units of the file.
    fn show(&self, quantity: Quantity, value: f64) -> String {
        quantity.show(value, self.scene.unit_system())
    }

    fn unique_names(&mut self, list: &Path, names: &[Option<String>]) {
        let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
        for (i, name) in names.iter().enumerate() {
            let Some(name) = name else { continue };
            if let Some(first) = seen.insert(name, i) {
                let place = list.index(i).field("name");
                self.inconsistent(
                    &place,
                    format!("the name \"{name}\" is used twice: by {list}[{first}] and {list}[{i}]"),
                    "give one of them another name",
                );
            }
        }
    }
}
