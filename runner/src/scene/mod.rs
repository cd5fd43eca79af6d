//! Scene files: what they may say, how they are read, and how they are refused.
//!
//! ```text
//! tree, edit      ── text ↔ tree with places; paths, --set, writing
//! quantity        ── units and ranges
//! field, declare  ── from tree to typed values in SI; the macros that declare sections
//! strands, materials, solids, motion, time, output, film, contact, liquid, microgel, yarn   ── the sections
//! presets         ── materials by name
//! checks          ── what must fit together; sizes
//! expand          ── single strands from their groups (with generators, obj and random)
//! load            ── files, includes, overrides → LoadedScene
//! reference       ── the reference page and the JSON schema, from the same declarations
//! error           ── messages with file, line, column and help
//! ```
//!
//! Data flow: text → tree (`tree`) → overrides and includes (`load`) → `Scene` in SI (`field`) → checks → `LoadedScene`;
//! the world is built from that and from [`expand()`](expand::expand).

pub mod checks;
pub mod contact;
mod declare;
pub mod edit;
pub mod error;
pub mod expand;
pub mod field;
pub mod film;
mod generators;
pub mod liquid;
pub mod load;
pub mod materials;
pub mod microgel;
pub mod motion;
pub(crate) mod obj;
pub mod output;
pub mod parity;
pub mod presets;
pub mod quantity;
pub mod random;
pub mod reference;
pub mod solids;
pub mod strands;
pub mod time;
pub mod tree;
pub mod yarn;

pub use error::{Problem, ProblemKind, SceneError};
pub use expand::{StrandGeometry, expand};
pub use load::{LoadedScene, load, load_str};
pub use quantity::Units;

use contact::Contact;
use declare::{choice, section};
use field::Field;
use film::FilmModel;
use liquid::Liquid;
use materials::{FibreProperties, Material};
use microgel::Microgel;
use motion::{Motion, Script};
use nalgebra::Vector3;
use output::Output;
use parity::Parity;
use presets::LiquidProperties;
use quantity::{Spec, above, at_least};
use solids::Solid;
use std::collections::BTreeMap;
use strands::StrandGroup;
use time::{Component, Solver, TimeSpan};
use tree::{Node, Value};
use yarn::Yarns;

choice! {
    /// The unit system of the numbers in the file.
    pub enum UnitSystem {
        /// Metre, kilogram, second, newton, pascal.
        Si;
        /// Centimetre, gram, second, dyne, barye (0.1 Pa).
        Cgs;
    }
}

section! {
    /// A scene: everything a run depends on.
    pub struct Scene {
        /// What it shows.
        title: String = [String::new()] () "";
        /// Unit system of every number in the file.
        units: UnitSystem = [required] () "";
        /// Other scene files whose lists and maps are added to this one; where both say something, this file counts.
        include: Vec<String> = [Vec::new()] () "";
        /// Seed of everything drawn at random.
        seed: u64 = [0] () "Same scene and seed give the same bytes.";
        /// Time span and step; required, but for a scene with `microgel`, where the experiment decides them.
        time: TimeSpan = [TimeSpan::left_open()] () "";
        /// Gravity.
        gravity: Vector3<f64> = [Vector3::new(0.0, -9.81, 0.0)] (Acceleration) "";
        /// Drag of still air on strands: force per length and velocity.
        air_drag: f64 = [0.0] (LineDrag, at_least(0.0).up_to(1e3)) "3e-5 kg/(m·s) is usual for hair in air; 0 conserves energy.";
        /// Materials by name.
        materials: BTreeMap<String, Material> = [BTreeMap::new()] () "";
        /// Motion scripts by name, for use by several things.
        motions: BTreeMap<String, Vec<Motion>> = [BTreeMap::new()] () "";
        /// Strands.
        strands: Vec<StrandGroup> = [Vec::new()] () "";
        /// How films on strands are computed.
        film: FilmModel = [blank] () "";
        /// Solids.
        solids: Vec<Solid> = [Vec::new()] () "";
        /// Frictional contact.
        contact: Contact = [blank] () "";
        /// Bulk liquid.
        liquid: Option<Liquid> = [None] () "";
        /// Soft grains in the rheometer; a scene of its own kind, without strands, solids or liquid.
        microgel: Option<Microgel> = [None] () "";
        /// Yarns on a grid; a scene of its own kind, with solids, without strands or liquid.
        yarn: Option<Yarns> = [None] () "";
        /// Solvers.
        solver: Solver = [blank] () "";
        /// Components to switch off.
        disable: Vec<Component> = [Vec::new()] () "To see what each is worth, or to save its time.";
        /// What is done as the reference code does it.
        parity: Parity = [blank] () "For comparison; see the page on errata.";
        /// Solves every so many steps' contact problem again with an independent solver and records the difference.
        cross_check: Option<u64> = [None] (Number, above(0.0)) "Costs several contact solves each time.";
        /// What is recorded.
        output: Output = [blank] () "";
    }
}

impl Scene {
    /// The properties of a fibre of this scene; `None` if there is no such fibre or it lacks a value.
    #[must_use]
    pub fn fibre(&self, name: &str) -> Option<FibreProperties> {
        match self.materials.get(name)? {
            Material::Fibre(fibre) => fibre.properties().ok(),
            Material::Liquid(_) | Material::Yarn(_) => None,
        }
    }

    /// The properties of a liquid of this scene; `None` if there is no such liquid or it lacks a value.
    #[must_use]
    pub fn liquid_material(&self, name: &str) -> Option<LiquidProperties> {
        match self.materials.get(name)? {
            Material::Liquid(liquid) => liquid.properties().ok(),
            Material::Fibre(_) | Material::Yarn(_) => None,
        }
    }

    /// The motions of a script, looked up by name where it is one.
    #[must_use]
    pub fn script<'a>(&'a self, script: &'a Script) -> &'a [Motion] {
        match script {
            Script::Inline(motions) => motions,
            Script::Named(name) => self.motions.get(name).map_or(&[], Vec::as_slice),
        }
    }

    /// Whether a component is switched off.
    #[must_use]
    pub fn is_disabled(&self, component: &Component) -> bool {
        self.disable.contains(component)
    }

    /// The scene as text in the given units; loading it gives the same scene.
    ///
    /// In SI the numbers are the same to the last bit; in CGS all but a few, which differ in the last.
    #[must_use]
    pub fn to_ron(&self, units: Units) -> String {
        let mut scene = self.clone();
        scene.include.clear(); // what they hold is in the scene already
        scene.units = match units {
            Units::Si => UnitSystem::Si,
            Units::Cgs => UnitSystem::Cgs,
        };
        let mut node: Node = scene.encode(&Spec::PLAIN, units);
        if let Value::Group(group) = &mut node.value {
            group.name = Some(("Scene".to_owned(), None));
        }
        edit::write(&node)
    }
}

impl Scene {
    /// The unit system the file was written in.
    #[must_use]
    pub fn unit_system(&self) -> Units {
        match self.units {
            UnitSystem::Si => Units::Si,
            UnitSystem::Cgs => Units::Cgs,
        }
    }
}
