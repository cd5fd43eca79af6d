//! From what the original says to a scene of ours, as a tree of scene text.
//!
//! One file per part of the scene. Numbers go over as they stand, in CGS; what cannot go over is noted.

mod fields;
mod motion;
mod run;
mod strands;
mod wet;

use super::ImportOptions;
use super::document::{Document, Sited};
use super::original::Original;
use super::original::fields::Usage;
use super::ron;
use crate::scene::tree::{Node, Span};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Everything that the parts of a translation share.
pub(super) struct Translation<'a, 'i> {
    /// The file, its notes and problems.
    pub document: &'a Document<'i>,
    /// What it says.
    pub original: &'a Original,
    /// How to import.
    pub options: &'a ImportOptions,
    /// The foreign file.
    pub source: &'a Path,
    /// Folder of the new scene; file names in it start from there.
    pub folder: PathBuf,
    /// Motions by name, as they were needed.
    motions: Vec<(String, Node)>,
    /// Of every group whose vertices were asked for: the motion, and when it is let go.
    held_groups: BTreeMap<i64, (Option<Node>, Option<Sited<f64>>)>,
}

/// Translates a whole scene. Problems and notes go to the document.
pub(super) fn translate(
    document: &Document<'_>,
    original: &Original,
    options: &ImportOptions,
    source: &Path,
    folder: PathBuf,
) -> Node {
    let mut translation =
        Translation { document, original, options, source, folder, motions: Vec::new(), held_groups: BTreeMap::new() };
    translation.scene()
}

impl Translation<'_, '_> {
    fn scene(&mut self) -> Node {
        self.check_groups();
        if !self.is_wet() && !self.films_wanted() {
            self.document.forget_assumed("liquidinfo");
            self.document.forget_assumed("bucketinfo");
        }
        let title = self.source.file_stem().map_or(String::new(), |stem| stem.to_string_lossy().into_owned());
        let strands = self.strands();
        let solids = self.solids();
        let liquid = self.liquid();
        let mut fields = vec![("title", ron::text(&title)), ("units", ron::name("Cgs"))];
        fields.push(("time", self.time()));
        fields.push(("gravity", ron::vector(self.original.run.gravity)));
        let mut add = |name, node: Option<Node>| fields.extend(node.map(|node| (name, node)));
        add("air_drag", self.air_drag());
        add("materials", self.materials());
        add("motions", (!self.motions.is_empty()).then(|| ron::map(std::mem::take(&mut self.motions))));
        add("strands", strands);
        add("film", self.film_model());
        add("solids", solids);
        add("contact", self.contact());
        add("liquid", liquid);
        add("disable", self.disable());
        ron::group(Span::NONE, "Scene", fields)
    }

    /// Whether liquid flows into the scene.
    fn has_sources(&self) -> bool {
        self.original.fields.iter().any(|field| field.usage == Usage::Source)
    }

    /// Whether a strand carries a film at the start.
    fn has_films(&self) -> bool {
        self.original.particles.iter().any(|particle| particle.film.value > 0.0)
            || self.original.objects.iter().any(|object| object.film.iter().any(|range| range.value > 0.0))
    }

    /// Whether liquid is computed at all: bulk, or film on strands.
    fn is_wet(&self) -> bool {
        self.original.switches.solve_liquids.value && (self.has_sources() || self.has_films())
    }

    /// Whether strands carry films, or may come to.
    fn films_wanted(&self) -> bool {
        self.has_films() || (self.is_wet() && self.original.liquid.capture.value)
    }
}
