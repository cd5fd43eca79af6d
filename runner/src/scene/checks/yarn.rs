//! Scenes of yarns: nothing else beside them but solids, materials that exist, settings that fit together, size.

use super::Checker;
use crate::scene::edit::Path;
use crate::scene::error::{ProblemKind, suggest};
use crate::scene::materials::Material;
use crate::scene::yarn::{YarnGroup, Yarns};
use crate::yarn::{group_sizes, settings, system};

/// Up to this number of vertices the yarns are made to see whether they can be; larger ones are looked at when the run starts.
const TRIED: f64 = 1e5;

impl Checker<'_> {
    pub(super) fn yarn(&mut self, section: &Yarns) {
        let root = Path::default();
        let place = root.field("yarn");
        let scene = self.scene;
        let others = [
            ("strands", !scene.strands.is_empty()),
            ("liquid", scene.liquid.is_some()),
            ("microgel", scene.microgel.is_some()),
        ];
        for (name, there) in others {
            if there {
                let message = format!("`yarn` and `{name}` cannot be in one scene");
                self.inconsistent(&root.field(name), message, "put the yarns into a scene of their own");
            }
        }
        if scene.air_drag != 0.0 {
            let message = "`air_drag` acts on strands, and a scene with `yarn` has none";
            self.inconsistent(&root.field("air_drag"), message, "leave `air_drag` out");
        }
        for (i, group) in section.groups.iter().enumerate() {
            self.yarn_group(&place.field("groups").index(i), group);
        }
        let names: Vec<_> = section.groups.iter().map(|group| group.name.clone()).collect();
        self.unique_names(&place.field("groups"), &names);
        for (i, pin) in section.pins.iter().enumerate() {
            self.script(&place.field("pins").index(i).field("motion"), &pin.motion);
        }
        for (i, drive) in section.drives.iter().enumerate() {
            self.script(&place.field("drives").index(i).field("motion"), &drive.motion);
        }
        if !self.problems.is_empty() {
            return;
        }
        let tried = settings(scene, section).and_then(|settings| {
            let vertices: f64 = group_sizes(&settings).iter().map(|size| size.1).sum();
            if vertices <= TRIED { system(scene, section).map(|_| ()) } else { Ok(()) }
        });
        if let Err(error) = tried {
            let at = if error.place.starts_with("output.") {
                parsed(&root, &error.place)
            } else {
                parsed(&place, &error.place)
            };
            let help = "change this value; see `viscose schema` for what is allowed";
            self.refuse(error.kind, &at, error.problem, help);
        }
    }

    fn yarn_group(&mut self, place: &Path, group: &YarnGroup) {
        let known: Vec<&str> = self
            .scene
            .materials
            .iter()
            .filter(|(_, material)| matches!(material, Material::Yarn(_)))
            .map(|(name, _)| name.as_str())
            .collect();
        match self.scene.materials.get(&group.material) {
            Some(Material::Yarn(_)) => {}
            Some(_) => {
                let message = format!("the material \"{}\" is not a yarn", group.material);
                self.refuse(
                    ProblemKind::UnknownReference,
                    &place.field("material"),
                    message,
                    suggest(&group.material, "yarn", &known),
                );
            }
            None => {
                let message = format!("there is no material \"{}\" in `materials`", group.material);
                let help = if known.is_empty() {
                    format!("add it: `materials: {{ \"{}\": Yarn() }}`", group.material)
                } else {
                    suggest(&group.material, "yarn", &known)
                };
                self.refuse(ProblemKind::UnknownReference, &place.field("material"), message, help);
            }
        }
        for (name, script) in [("first", &group.first), ("last", &group.last)] {
            if let Some(script) = script {
                self.script(&place.field(name), script);
            }
        }
    }
}

/// A place inside `base` by its name, as in `groups[2].shape.radius`.
fn parsed(base: &Path, name: &str) -> Path {
    let mut path = base.clone();
    if let Ok(inner) = Path::parse(name) {
        path.0.extend(inner.0);
    }
    path
}
