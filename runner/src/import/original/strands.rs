//! Strands: `StrandParameters`, `particle`, `hair`, `hairobj`.

use super::{Element, Number, Sited, list, number_or};
use crate::import::document::shorten;
use crate::import::notes::Heading;
use crate::scene::error::ProblemKind;
use crate::scene::tree::Span;

/// One set of strand parameters [CGS].
pub struct StrandParameters {
    /// Where it stands.
    pub span: Span,
    /// Half-width along the first director [cm].
    pub radius: Number,
    /// Half-width along the second director [cm], where it differs.
    pub second_radius: Option<Number>,
    /// Young's modulus [Ba].
    pub young_modulus: Number,
    /// Poisson ratio.
    pub poisson_ratio: Number,
    /// Density [g/cm³].
    pub density: Number,
    /// Internal viscosity [Ba s].
    pub viscosity: Number,
    /// Turn of the section [rad].
    pub base_rotation: Number,
    /// Factor on the stretching stiffness.
    pub stretch_factor: Number,
}

/// A particle: a vertex of a strand.
pub struct Particle {
    /// Where it stands.
    pub span: Span,
    /// Position [cm].
    pub position: Sited<[f64; 3]>,
    /// Angle of the material frame of the edge that begins here [rad].
    pub angle: f64,
    /// Held: bit 0 in place, bit 1 in twist.
    pub fixed: i64,
    /// Film height [cm].
    pub film: Number,
    /// Group that moves with scripts.
    pub group: Sited<i64>,
}

impl Particle {
    /// Whether its place is held.
    #[must_use]
    pub fn held(&self) -> bool {
        self.fixed & 1 != 0
    }

    /// Whether the twist of the edge that begins here is held.
    #[must_use]
    pub fn twist_held(&self) -> bool {
        self.fixed & 2 != 0
    }
}

/// A strand of particles.
pub struct Hair {
    /// Where it stands.
    pub span: Span,
    /// Index of its parameters.
    pub parameters: Sited<i64>,
    /// Indices of its particles.
    pub particles: Vec<i64>,
}

/// A value for a range of vertices of every strand of a file, ends included.
#[derive(Clone, Copy)]
pub struct Range<T> {
    /// Where it stands.
    pub span: Span,
    /// First vertex.
    pub start: i64,
    /// Last vertex.
    pub end: i64,
    /// Value.
    pub value: T,
}

/// Strands from an OBJ file.
pub struct HairObject {
    /// Where it stands.
    pub span: Span,
    /// File as written.
    pub file: Sited<String>,
    /// Index of the parameters.
    pub parameters: Sited<i64>,
    /// Group of the held vertices.
    pub group: Sited<i64>,
    /// Displacement [cm].
    pub translate: Sited<[f64; 3]>,
    /// Axis of the turn about the origin.
    pub axis: Sited<[f64; 3]>,
    /// Angle of the turn [rad].
    pub angle: f64,
    /// Film heights [cm].
    pub film: Vec<Range<f64>>,
    /// Held vertices.
    pub fixed: Vec<Range<i64>>,
    /// Strands to take; empty: all.
    pub selection: Vec<usize>,
}

/// Reads all parameter sets.
pub fn read_parameters(root: &Element<'_, '_>) -> Vec<StrandParameters> {
    let document = root.document();
    let sets = root.children("StrandParameters");
    let single = sets.len() == 1;
    let mut list_of = Vec::new();
    for (i, element) in sets.iter().enumerate() {
        let place = if single { "StrandParameters".to_owned() } else { format!("StrandParameters {i}") };
        let number = |name, default| number_or(Some(element), document, &place, name, default);
        let quiet = |name, default| element.parameter_number(name).unwrap_or(Sited::made(default));
        let set = StrandParameters {
            span: element.span(),
            radius: number("radius", 0.018),
            second_radius: element.parameter_number("biradius"),
            young_modulus: number("youngsModulus", 6.687e5),
            poisson_ratio: number("poissonRatio", 0.35),
            density: number("density", 1.3),
            viscosity: quiet("viscosity", 0.0),
            base_rotation: quiet("baseRotation", 0.0),
            stretch_factor: quiet("stretchMultiplier", 1.0),
        };
        list(
            Some(element),
            Heading::NotHonoured,
            &[
                ("fixingMultiplier", "held vertices are held exactly"),
                ("minBendingAngle", "no extra spring against sharp folds: bending itself resists them"),
                ("minBendingMultiplier", "no extra spring against sharp folds: bending itself resists them"),
                ("maxFlowGradientRatio", "films are smoothed by `film.steepness` instead"),
            ],
        );
        list_of.push(set);
    }
    list_of
}

/// Reads all particles.
pub fn read_particles(root: &Element<'_, '_>) -> Vec<Particle> {
    let document = root.document();
    let read = |element: &Element<'_, '_>| {
        let position = match element.vector("x") {
            Some(position) => position,
            None => {
                if element.text("x").is_none() {
                    let help = "write `<particle x=\"0 9.75 0\"/>`";
                    document.problem(ProblemKind::MissingField, element.span(), "a particle has no position `x`", help);
                }
                Sited { value: [f64::NAN; 3], span: element.span() }
            }
        };
        let here = |value| Sited { value, span: element.span() };
        Particle {
            span: element.span(),
            position,
            angle: element.number("theta").map_or(0.0, |number| number.value),
            fixed: element.integer("fixed").map_or(0, |number| number.value),
            film: element.number("h").unwrap_or(Sited::made(0.0)),
            group: element.integer("group").unwrap_or(here(0)),
        }
    };
    let particles: Vec<Particle> = root.children("particle").iter().map(read).collect();
    for particle in &particles {
        if particle.group.value < 0 {
            let message = format!("a group must not be negative, found {}", particle.group.value);
            document.problem(ProblemKind::OutOfRange, particle.group.span, message, "groups are counted from 0");
        }
    }
    particles
}

/// Reads all strands of particles.
pub fn read_hairs(root: &Element<'_, '_>) -> Vec<Hair> {
    let document = root.document();
    let mut hairs = Vec::new();
    for element in root.children("hair") {
        let Some(parameters) = element.integer("params") else {
            if element.text("params").is_none() {
                let message = "a <hair> does not say which StrandParameters it has";
                document.problem(ProblemKind::MissingField, element.span(), message, "add `params=\"0\"`");
            }
            continue;
        };
        let start = element.integer("start").map_or(0, |number| number.value);
        let count = element.integer("count");
        let particles = match count {
            Some(count) if count.value != 0 => {
                if count.value < 0 || count.value > 10_000_000 {
                    let message = format!("a strand of {} vertices", count.value);
                    document.problem(ProblemKind::OutOfRange, count.span, message, "write how many particles it has");
                    continue;
                }
                (start..start.saturating_add(count.value)).collect()
            }
            _ => {
                let index = |p: &Element<'_, '_>| {
                    if p.text("i").is_none() {
                        let message = "a <p> of a hair names no particle";
                        document.problem(ProblemKind::MissingField, p.span(), message, "add `i=\"…\"`");
                    }
                    p.integer("i").map(|number| number.value)
                };
                element.children("p").iter().filter_map(index).collect()
            }
        };
        if parameters.value == -1 {
            document.note(Heading::Ignored, element.span(), "hair with params = -1", "such a strand is left out");
            continue;
        }
        hairs.push(Hair { span: element.span(), parameters, particles });
    }
    hairs
}

/// Reads all strands from files.
pub fn read_objects(root: &Element<'_, '_>) -> Vec<HairObject> {
    let document = root.document();
    let mut objects = Vec::new();
    for element in root.children("hairobj") {
        let Some(file) = element.text("filename").filter(|file| !file.value.trim().is_empty()) else {
            document.note(Heading::Ignored, element.span(), "hairobj without filename", "it has no strands");
            element.skip();
            continue;
        };
        let here = |value| Sited { value, span: element.span() };
        let ranges = |name: &str| {
            let numbers = |part: &Element<'_, '_>| {
                let start = part.integer("start").map_or(0, |number| number.value);
                let end = part.integer("end").map_or(0, |number| number.value);
                if start < 0 || end > 10_000_000 {
                    let message = format!("vertices {start} to {end}");
                    document.problem(ProblemKind::OutOfRange, part.span(), message, "vertices are counted from 0");
                }
                (part.span(), start.max(0), end.min(10_000_000))
            };
            element.children(name).into_iter().map(move |part| (part, numbers(&part))).collect::<Vec<_>>()
        };
        let film = ranges("flow")
            .into_iter()
            .map(|(part, (span, start, end))| {
                let value = part.number("value").map_or(0.0, |number| number.value);
                Range { span, start, end, value }
            })
            .collect();
        let fixed = ranges("fixed")
            .into_iter()
            .map(|(part, (span, start, end))| {
                let value = part.integer("value").map_or(0, |number| number.value);
                Range { span, start, end, value }
            })
            .collect();
        let mut selection = Vec::new();
        for part in element.children("selection") {
            let Some(text) = part.text("index") else { continue };
            for word in text.value.split_whitespace() {
                match word.parse() {
                    Ok(index) => selection.push(index),
                    Err(_) => {
                        let message = format!("`{}` is not the number of a strand", shorten(word));
                        document.problem(ProblemKind::Type, text.span, message, "strands of a file are counted from 0");
                    }
                }
            }
        }
        let group = element.integer("group").unwrap_or(here(0));
        if group.value < 0 {
            let message = format!("a group must not be negative, found {}", group.value);
            document.problem(ProblemKind::OutOfRange, group.span, message, "groups are counted from 0");
        }
        objects.push(HairObject {
            span: element.span(),
            file: Sited { value: file.value.trim().to_owned(), span: file.span },
            parameters: element.integer("params").unwrap_or(here(0)),
            group,
            translate: element.vector_of(["x", "y", "z"], [0.0; 3]),
            axis: element.vector_of(["rx", "ry", "rz"], [0.0, 1.0, 0.0]),
            angle: element.number("rw").map_or(0.0, |number| number.value),
            film,
            fixed,
            selection,
        });
    }
    objects
}
