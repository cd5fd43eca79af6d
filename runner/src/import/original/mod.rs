//! What a scene of the C++ reference code says, as its own reader understands it: names, defaults, quirks.
//!
//! One file per part of the scene. Numbers stay in CGS as written and keep their place in the file. A reader marks what
//! it takes and notes what the original takes but nobody here can use; it records problems and goes on, so that a user
//! sees all of them at once.

pub mod fields;
pub mod liquid;
pub mod run;
pub mod scripts;
pub mod strands;
pub mod switches;

use super::document::{Document, Element, Number, Sited};
use super::notes::Heading;

/// A whole scene of the original.
pub struct Original {
    /// Time, step, gravity, grid.
    pub run: run::Run,
    /// Strand parameter sets, in order.
    pub parameters: Vec<strands::StrandParameters>,
    /// Particles, in order; strands are made of them.
    pub particles: Vec<strands::Particle>,
    /// Strands of particles.
    pub hairs: Vec<strands::Hair>,
    /// Strands from OBJ files.
    pub objects: Vec<strands::HairObject>,
    /// Simulation and collision parameters.
    pub switches: switches::Switches,
    /// The liquid.
    pub liquid: liquid::LiquidInfo,
    /// Solids, sources and terminators, in order.
    pub fields: Vec<fields::DistanceField>,
    /// Motion scripts, in order.
    pub scripts: Vec<scripts::Script>,
}

impl Original {
    /// Reads a document; what is wrong goes to its problems.
    #[must_use]
    pub fn read(document: &Document<'_>) -> Original {
        let root = document.root();
        let run = run::Run::read(&root);
        let scripts = scripts::read(&root, run.end.value);
        let original = Original {
            parameters: strands::read_parameters(&root),
            particles: strands::read_particles(&root),
            hairs: strands::read_hairs(&root),
            objects: strands::read_objects(&root),
            switches: switches::Switches::read(&root),
            liquid: liquid::LiquidInfo::read(&root),
            fields: fields::read(&root, run.end.value),
            run,
            scripts,
        };
        for (name, why) in [
            ("pose", "strands start where their particles are"),
            ("checkpoint", "a run goes on from checkpoints of its own"),
            ("collisionfree", "which vertices may touch cannot be said vertex by vertex"),
        ] {
            for element in root.children(name) {
                document.note(Heading::NotHonoured, element.span(), name, why);
                element.skip();
            }
        }
        original
    }

    /// One more than the largest group: the groups the original makes.
    #[must_use]
    pub fn group_count(&self) -> i64 {
        let particles = self.particles.iter().map(|particle| particle.group.value);
        let objects = self.objects.iter().map(|object| object.group.value);
        let fields = self.fields.iter().map(|field| field.group.value);
        particles.chain(objects).chain(fields).fold(0, i64::max) + 1
    }
}

/// Reads a parameter that becomes part of the scene; where it is absent its default is noted.
fn number_or(
    section: Option<&Element<'_, '_>>,
    document: &Document<'_>,
    place: &str,
    name: &str,
    default: f64,
) -> Number {
    let given = section.and_then(|element| element.parameter_number(name));
    given.unwrap_or_else(|| {
        document.assumed(place, name, default);
        Sited::made(default)
    })
}

/// Reads a switch that becomes part of the scene; its default needs no note.
fn flag_or(section: Option<&Element<'_, '_>>, name: &str, default: bool) -> Sited<bool> {
    section.and_then(|element| element.parameter_flag(name)).unwrap_or(Sited::made(default))
}

/// Takes parameters that have no counterpart and lists them with their values.
fn list(section: Option<&Element<'_, '_>>, heading: Heading, names: &[(&str, &str)]) {
    let Some(section) = section else { return };
    for (name, why) in names {
        if let Some(child) = section.child(name) {
            let value = child.text("value").map_or(String::new(), |text| format!(" = {}", text.value.trim()));
            section.document().note(heading, child.span(), format!("{}/{name}{value}", section.name()), *why);
            child.skip();
        }
    }
}

/// A switch that is used by the original, but matters only when it is not at its usual value.
fn only_if(
    section: Option<&Element<'_, '_>>,
    name: &str,
    usual: bool,
    heading: Heading,
    otherwise: &str,
    as_usual: &str,
) {
    let Some(section) = section else { return };
    if let Some(flag) = section.parameter_flag(name) {
        let what = format!("{}/{name} = {}", section.name(), u8::from(flag.value));
        let (heading, why) = if flag.value == usual { (Heading::Machinery, as_usual) } else { (heading, otherwise) };
        section.document().note(heading, flag.span, what, why);
    }
}
