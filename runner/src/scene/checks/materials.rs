//! Materials must be complete, and references to them right.

use super::Checker;
use crate::scene::edit::Path;
use crate::scene::error::{ProblemKind, suggest};
use crate::scene::field::list_names;
use crate::scene::materials::{Fibre, LiquidMaterial, Material};
use crate::scene::presets;

impl Checker<'_> {
    pub(super) fn materials(&mut self) {
        for (name, material) in &self.scene.materials {
            let place = Path::default().field("materials").field(name);
            match material {
                Material::Fibre(fibre) => self.fibre(&place, name, fibre),
                Material::Liquid(liquid) => self.liquid_material(&place, name, liquid),
                Material::Yarn(_) => {}
            }
        }
    }

    pub(super) fn fibre(&mut self, place: &Path, name: &str, fibre: &Fibre) {
        if let Err(missing) = fibre.properties() {
            self.incomplete(place, name, missing, fibre.preset.as_deref(), "fibre", &presets::FIBRE_NAMES);
        }
    }

    pub(super) fn liquid_material(&mut self, place: &Path, name: &str, liquid: &LiquidMaterial) {
        if let Err(missing) = liquid.properties() {
            self.incomplete(place, name, missing, liquid.preset.as_deref(), "liquid", &presets::LIQUID_NAMES);
        }
    }

    pub(super) fn incomplete(
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
                format!("add `{field}: …`, or start from a preset: {}", list_names(known)),
            ),
        }
    }

    /// The material `name` as a fibre or liquid, or a problem.
    pub(super) fn material_of_kind(&mut self, place: &Path, name: &str, liquid: bool) -> bool {
        let wanted = |material: &Material| match material {
            Material::Liquid(_) => liquid,
            Material::Fibre(_) => !liquid,
            Material::Yarn(_) => false,
        };
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
            Some(found) => {
                let other = match found {
                    Material::Fibre(_) => "a fibre",
                    Material::Liquid(_) => "a liquid",
                    Material::Yarn(_) => "a yarn",
                };
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
}
