//! What must fit together in a scene, beyond the range of each single number.

use super::edit::{Path, follow_loosely};
use super::error::{Problem, ProblemKind, SourceFile, suggest};
use super::expand::{
    BYTES_PER_PARTICLE, BYTES_PER_VERTEX, MEMORY_LIMIT, centrelines, counts, held_vertices, show_bytes, usual_radius,
};
use super::liquid::{Dimensions, Liquid};
use super::materials::{Fibre, LiquidMaterial, Material};
use super::motion::{Motion, Script};
use super::output::{Clock, Probe};
use super::quantity::{Quantity, show_number};
use super::solids::Volume;
use super::strands::{Along, Clamp, RestShape, StrandGroup, StrandShape};
use super::time::StepControl;
use super::tree::{Node, Span};
use super::{Scene, presets};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// More frames than this are refused.
const MAX_FRAMES: f64 = 1e7;
/// More steps than this are refused.
const MAX_STEPS: f64 = 1e12;

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
    checker.time();
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

    // --- materials -------------------------------------------------------------------------------------------------

    fn materials(&mut self) {
        for (name, material) in &self.scene.materials {
            let place = Path::default().field("materials").field(name);
            match material {
                Material::Fibre(fibre) => self.fibre(&place, name, fibre),
                Material::Liquid(liquid) => self.liquid_material(&place, name, liquid),
            }
        }
    }

    fn fibre(&mut self, place: &Path, name: &str, fibre: &Fibre) {
        if let Err(missing) = fibre.properties() {
            self.incomplete(place, name, missing, fibre.preset.as_deref(), "fibre", &presets::FIBRE_NAMES);
        }
    }

    fn liquid_material(&mut self, place: &Path, name: &str, liquid: &LiquidMaterial) {
        if let Err(missing) = liquid.properties() {
            self.incomplete(place, name, missing, liquid.preset.as_deref(), "liquid", &presets::LIQUID_NAMES);
        }
    }

    fn incomplete(
        &mut self,
        place: &Path,
        name: &str,
        missing: &str,
        preset: Option<&str>,
        kind: &str,
        known: &[&str],
    ) {
        match (missing, preset) {
            ("preset", Some(preset)) => self.refuse(
                ProblemKind::UnknownReference,
                &place.field("preset"),
                format!("there is no {kind} preset \"{preset}\""),
                suggest(preset, "preset", known),
            ),
            (field, Some(preset)) => self.refuse(
                ProblemKind::MissingField,
                &place.field("flow"),
                format!("the flow of \"{name}\" needs `{field}`: the preset \"{preset}\" states its flow in the other reading"),
                "give `yield_stress`, `consistency` and `index` together, or use the preset's reading",
            ),
            (field, None) => self.refuse(
                ProblemKind::MissingField,
                place,
                format!("the {kind} \"{name}\" needs `{field}`"),
                format!("add `{field}: …`, or start from a preset: {}", super::field::list_names(known)),
            ),
        }
    }

    /// The material `name` as a fibre or liquid, or a problem.
    fn material_of_kind(&mut self, place: &Path, name: &str, liquid: bool) -> bool {
        let wanted = |material: &Material| matches!(material, Material::Liquid(_)) == liquid;
        let kind = if liquid { "liquid" } else { "fibre" };
        let known: Vec<&str> = self
            .scene
            .materials
            .iter()
            .filter(|(_, material)| wanted(material))
            .map(|(name, _)| name.as_str())
            .collect();
        match self.scene.materials.get(name) {
            Some(material) if wanted(material) => true,
            Some(_) => {
                let other = if liquid { "a fibre" } else { "a liquid" };
                let message = format!("the material \"{name}\" is {other}; a {kind} is needed here");
                self.refuse(ProblemKind::UnknownReference, place, message, suggest(name, kind, &known));
                false
            }
            None => {
                let message = format!("there is no material \"{name}\" in `materials`");
                let help = if known.is_empty() {
                    let variant = if liquid { "Liquid(preset: \"water\")" } else { "Fibre(preset: \"hair\")" };
                    format!("add it: `materials: {{ \"{name}\": {variant} }}`")
                } else {
                    suggest(name, kind, &known)
                };
                self.refuse(ProblemKind::UnknownReference, place, message, help);
                false
            }
        }
    }

    // --- motion ----------------------------------------------------------------------------------------------------

    fn motions(&mut self) {
        for (name, motions) in &self.scene.motions {
            self.motion_list(&Path::default().field("motions").field(name), motions);
        }
    }

    fn script(&mut self, place: &Path, script: &Script) {
        match script {
            Script::Inline(motions) => self.motion_list(place, motions),
            Script::Named(name) if !self.scene.motions.contains_key(name) => {
                let known: Vec<&str> = self.scene.motions.keys().map(String::as_str).collect();
                self.refuse(
                    ProblemKind::UnknownReference,
                    place,
                    format!("there is no motion \"{name}\" in `motions`"),
                    suggest(name, "motion", &known),
                );
            }
            Script::Named(_) => {}
        }
    }

    fn motion_list(&mut self, place: &Path, motions: &[Motion]) {
        for (i, motion) in motions.iter().enumerate() {
            let Motion::Keyframes(keyframes) = motion else { continue };
            let poses = place.index(i).field("poses");
            if keyframes.poses.is_empty() {
                self.inconsistent(&poses, "there are no poses", "give at least one `(time: …, translate: […])`");
            }
            for (k, pair) in keyframes.poses.windows(2).enumerate() {
                if pair[1].time <= pair[0].time {
                    self.inconsistent(
                        &poses.index(k + 1).field("time"),
                        format!("pose {} is at {} s, not after pose {k} at {} s", k + 1, pair[1].time, pair[0].time),
                        "write the poses in order of time",
                    );
                }
            }
        }
    }

    // --- strands ---------------------------------------------------------------------------------------------------

    fn strand_group(&mut self, place: &Path, group: &StrandGroup) {
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
    fn crowded(&mut self, place: &Path, group: &StrandGroup) {
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
    fn written_lines(&mut self, place: &Path, group: &StrandGroup) {
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
            self.edges(place, group, strand, line);
            self.vertices(place, group, line.len());
            if self.problems.len() > before {
                return; // the other strands have the same faults more often than others
            }
        }
    }

    /// Checks everything that is counted by vertices.
    fn vertices(&mut self, place: &Path, group: &StrandGroup, vertices: usize) {
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
    fn shape(&mut self, place: &Path, shape: &StrandShape) -> bool {
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

    fn edges(&mut self, place: &Path, group: &StrandGroup, strand: usize, line: &[Vector3<f64>]) {
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

    fn per_vertex(&mut self, place: &Path, group: &StrandGroup, vertices: usize) {
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

    fn clamps(&mut self, place: &Path, group: &StrandGroup, vertices: usize) {
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

    fn strand_film(&mut self, place: &Path, group: &StrandGroup) {
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

    // --- volumes and liquid ----------------------------------------------------------------------------------------

    fn volume(&mut self, place: &Path, volume: &Volume) {
        match volume {
            Volume::Torus(torus) if torus.minor_radius >= torus.major_radius => {
                let message = format!(
                    "the ring's cross-section ({}) is not thinner than the ring ({})",
                    self.show(Quantity::Length, torus.minor_radius),
                    self.show(Quantity::Length, torus.major_radius)
                );
                self.inconsistent(
                    &place.field("minor_radius"),
                    message,
                    "make `minor_radius` smaller than `major_radius`",
                );
            }
            Volume::Mesh(mesh) => {
                let known = mesh
                    .file
                    .path
                    .extension()
                    .is_some_and(|ending| ending.eq_ignore_ascii_case("obj") || ending.eq_ignore_ascii_case("stl"));
                if let Err(error) = std::fs::File::open(&mesh.file.path) {
                    let message = format!("cannot read the mesh {}: {error}", mesh.file.path.display());
                    self.refuse(
                        ProblemKind::File,
                        &place.field("file"),
                        message,
                        "the name is relative to the scene file",
                    );
                } else if !known {
                    let message = format!("{} is neither an OBJ nor an STL file", mesh.file.path.display());
                    self.refuse(
                        ProblemKind::File,
                        &place.field("file"),
                        message,
                        "meshes are read from `.obj` and `.stl` files",
                    );
                }
            }
            _ => {}
        }
    }

    fn liquid(&mut self, liquid: &Liquid) {
        let place = Path::default().field("liquid");
        let wet_strands = self.scene.strands.iter().any(|group| group.film.is_some());
        if liquid.tanks.is_empty() && liquid.sources.is_empty() && !wet_strands {
            self.inconsistent(
                &place,
                "there is no liquid in `liquid`: no tanks, no sources, and no strand with a film",
                "add `tanks: […]` or `sources: […]`, or remove the section",
            );
        }
        for (i, tank) in liquid.tanks.iter().enumerate() {
            let at = place.field("tanks").index(i);
            self.material_of_kind(&at.field("material"), &tank.material, true);
            self.volume(&at.field("shape"), &tank.shape);
            self.bounded(&at.field("shape"), &tank.shape, liquid.domain.is_some());
        }
        for (i, source) in liquid.sources.iter().enumerate() {
            let at = place.field("sources").index(i);
            self.material_of_kind(&at.field("material"), &source.material, true);
            self.volume(&at.field("shape"), &source.shape);
            self.bounded(&at.field("shape"), &source.shape, false);
            self.script(&at.field("motion"), &source.motion);
        }
        for (i, drain) in liquid.drains.iter().enumerate() {
            let at = place.field("drains").index(i);
            self.volume(&at.field("shape"), &drain.shape);
            self.script(&at.field("motion"), &drain.motion);
        }
        if let Some(domain) = &liquid.domain {
            let at = place.field("domain");
            let size = domain.high - domain.low;
            if size.min() <= 0.0 {
                self.inconsistent(
                    &at.field("high"),
                    "`high` must exceed `low` in every direction",
                    "swap them, or make the box larger",
                );
            }
            for (i, axis) in domain.periodic.iter().enumerate() {
                let direction = axis.0.iamax();
                if axis.0[direction].abs() != 1.0 {
                    self.inconsistent(
                        &at.field("periodic").index(i),
                        "only `X`, `Y` and `Z` can be periodic",
                        "write `X`, `Y` or `Z`",
                    );
                    continue;
                }
                let cells = size[direction] / liquid.cell;
                if cells > 0.0 && (cells - cells.round()).abs() > 1e-6 * cells.max(1.0) {
                    let message = format!("the periodic size is {} cells, not a whole number", show_number(cells));
                    self.inconsistent(
                        &place.field("cell"),
                        message,
                        "choose `cell` so that it divides the size of the domain",
                    );
                }
            }
        }
    }

    fn bounded(&mut self, place: &Path, volume: &Volume, in_domain: bool) {
        if matches!(volume, Volume::HalfSpace(_)) && !in_domain {
            self.inconsistent(
                place,
                "a half-space holds an infinite amount of liquid",
                "use a bounded shape, such as `Box(…)`, or give the liquid a `domain`",
            );
        }
    }

    // --- time, memory, output --------------------------------------------------------------------------------------

    fn time(&mut self) {
        let time = &self.scene.time;
        let place = Path::default().field("time");
        let (step, at) = match &time.step {
            StepControl::Fixed(step) => (*step, place.field("step")),
            StepControl::Adaptive(step) => {
                let at = place.field("step");
                if let Some(min) = step.min
                    && min > step.max
                {
                    let message = format!("the smallest step ({min} s) exceeds the largest ({} s)", step.max);
                    self.inconsistent(&at.field("min"), message, "make `min` smaller than `max`");
                }
                (step.max, at.field("max"))
            }
        };
        if step > time.end {
            let message = format!("the step of {step} s is longer than the run, which ends at {} s", time.end);
            self.inconsistent(&at, message, "make the step smaller or the run longer");
        } else if time.end / step > MAX_STEPS {
            let message = format!("the run would take {:.1e} steps", time.end / step);
            self.refuse(
                ProblemKind::TooLarge,
                &at,
                message,
                format!("at most {MAX_STEPS:e} are allowed: make the step larger or the run shorter"),
            );
        }
    }

    fn memory(&mut self) {
        let limit = show_bytes(MEMORY_LIMIT);
        let mut total = 0.0;
        for (i, group) in self.scene.strands.iter().enumerate() {
            let Some((strands, vertices)) = counts(&group.shape) else { continue };
            #[allow(clippy::cast_precision_loss)]
            let vertices = strands as f64 * vertices as f64;
            total += vertices * BYTES_PER_VERTEX;
            if total > MEMORY_LIMIT {
                let message = format!("this needs about {} of memory: {vertices:.3e} vertices", show_bytes(total));
                let place = Path::default().field("strands").index(i).field("shape");
                self.refuse(
                    ProblemKind::TooLarge,
                    &place,
                    message,
                    format!("at most {limit} are allowed: use fewer strands or vertices"),
                );
                return;
            }
        }
        let Some(liquid) = &self.scene.liquid else { return };
        #[allow(clippy::cast_precision_loss)]
        let (per_cell, dimension) = match liquid.dimensions {
            Dimensions::Three => (liquid.particles_per_cell as f64, 3),
            Dimensions::Two => (liquid.particles_per_cell as f64, 2),
        };
        for (i, tank) in liquid.tanks.iter().enumerate() {
            let particles =
                extent(&tank.shape, dimension).map_or(0.0, |size| size / liquid.cell.powi(dimension)) * per_cell;
            total += particles * BYTES_PER_PARTICLE;
            if total > MEMORY_LIMIT {
                let message = format!("this needs about {} of memory: {particles:.3e} particles", show_bytes(total));
                let place = Path::default().field("liquid").field("tanks").index(i).field("shape");
                let cell = self.show(Quantity::Length, liquid.cell);
                self.refuse(
                    ProblemKind::TooLarge,
                    &place,
                    message,
                    format!("at most {limit} are allowed: make the tank smaller or the cell ({cell}) larger"),
                );
                return;
            }
        }
    }

    fn output(&mut self) {
        let place = Path::default().field("output");
        let output = &self.scene.output;
        let clocks = [("frames", &output.frames), ("series", &output.series), ("checkpoint", &output.checkpoint)];
        for (name, clock) in clocks {
            let at = place.field(name);
            let end = self.scene.time.end;
            #[allow(clippy::cast_precision_loss)]
            let count = match clock {
                Clock::Every(period) => end / period,
                Clock::Count(count) => *count as f64,
                Clock::At(times) => {
                    if let Some(late) = times.iter().find(|&&time| time > end) {
                        let message = format!("`{name}` asks for {late} s, but the run ends at {end} s");
                        self.inconsistent(&at, message, "remove the time, or make the run longer");
                    }
                    if times.windows(2).any(|pair| pair[1] <= pair[0]) {
                        self.inconsistent(
                            &at,
                            format!("the times of `{name}` are not in order"),
                            "write them from early to late, each once",
                        );
                    }
                    times.len() as f64
                }
                Clock::Steps(_) | Clock::Never => 0.0,
            };
            if name != "series" && count > MAX_FRAMES {
                let message = format!("`{name}` would write {count:.1e} files");
                self.refuse(
                    ProblemKind::TooLarge,
                    &at,
                    message,
                    format!("at most {MAX_FRAMES:e} are allowed: write them less often"),
                );
            }
        }
        if output.formats.is_empty() && output.frames != Clock::Never {
            self.inconsistent(
                &place.field("formats"),
                "frames need a format",
                "write `formats: [Vtk]`, or `frames: Never`",
            );
        }
        if self.problems.is_empty() {
            self.probes(&place.field("probes"));
        }
    }

    fn probes(&mut self, place: &Path) {
        let mut names = Vec::new();
        for (i, probe) in self.scene.output.probes.iter().enumerate() {
            let at = place.index(i);
            match probe {
                Probe::Point(probe) => names.push(probe.name.clone()),
                Probe::Vertex(probe) => {
                    names.push(probe.name.clone());
                    match vertices_of(self.scene, probe.strand) {
                        Err(strands) => {
                            let message = format!("there is no strand {}; the scene has {strands}", probe.strand);
                            self.refuse(
                                ProblemKind::UnknownReference,
                                &at.field("strand"),
                                message,
                                "strands are counted from 0 over all groups",
                            );
                        }
                        Ok(vertices) if probe.vertex.is_some_and(|vertex| vertex >= vertices) => {
                            let message =
                                format!("strand {} has {vertices} vertices (0 to {})", probe.strand, vertices - 1);
                            self.refuse(
                                ProblemKind::UnknownReference,
                                &at.field("vertex"),
                                message,
                                "leave `vertex` out for the tip",
                            );
                        }
                        Ok(_) => {}
                    }
                }
            }
        }
        self.unique_names(place, &names);
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

/// The number of vertices of a strand counted over all groups, or how many strands there are.
fn vertices_of(scene: &Scene, strand: usize) -> Result<usize, usize> {
    let mut before = 0;
    for (i, group) in scene.strands.iter().enumerate() {
        let (strands, vertices) = match counts(&group.shape) {
            Some((strands, vertices)) => (strands, vec![vertices; 1]),
            None => {
                let lines = centrelines(scene, i, group).unwrap_or_default();
                (lines.len(), lines.iter().map(|(line, _)| line.len()).collect())
            }
        };
        if strand - before < strands {
            let place = if vertices.len() == 1 { 0 } else { strand - before };
            return Ok(vertices[place]);
        }
        before += strands;
    }
    Err(before)
}

/// The volume (area in two dimensions) of a bounded shape without a file.
fn extent(volume: &Volume, dimension: i32) -> Option<f64> {
    use std::f64::consts::PI;
    Some(match (volume, dimension) {
        (Volume::Sphere(ball), 3) => 4.0 / 3.0 * PI * ball.radius.powi(3),
        (Volume::Sphere(ball), _) => PI * ball.radius.powi(2),
        (Volume::Box(cuboid), 3) => 8.0 * cuboid.half_size.product(),
        (Volume::Box(cuboid), _) => 4.0 * cuboid.half_size.x * cuboid.half_size.y,
        (Volume::Cylinder(cylinder), 3) => 2.0 * PI * cylinder.radius.powi(2) * cylinder.half_length,
        (Volume::Cylinder(cylinder), _) => 4.0 * cylinder.radius * cylinder.half_length,
        (Volume::Capsule(capsule), 3) => {
            PI * capsule.radius.powi(2) * (2.0 * capsule.half_length + 4.0 / 3.0 * capsule.radius)
        }
        (Volume::Capsule(capsule), _) => capsule.radius * (4.0 * capsule.half_length + PI * capsule.radius),
        (Volume::Torus(torus), _) => 2.0 * PI.powi(2) * torus.major_radius * torus.minor_radius.powi(2),
        (Volume::HalfSpace(_) | Volume::Mesh(_), _) => return None,
    })
}
