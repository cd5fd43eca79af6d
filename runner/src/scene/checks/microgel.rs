//! Scenes of soft grains: nothing else beside them, settings that fit together, size.

use super::Checker;
use crate::microgel::{Schedule, memory, settings};
use crate::scene::edit::Path;
use crate::scene::error::ProblemKind;
use crate::scene::expand::{MEMORY_LIMIT, show_bytes};
use crate::scene::microgel::Microgel;
use granular::GranularError;

/// More steps than this are refused.
const MAX_STEPS: u64 = 1_000_000_000_000;

impl Checker<'_> {
    pub(super) fn microgel(&mut self, microgel: &Microgel) {
        let root = Path::default();
        let place = root.field("microgel");
        let scene = self.scene;
        if !scene.time.is_left_open() {
            let message = "a scene with `microgel` takes its time span and step from the experiment";
            self.inconsistent(&root.field("time"), message, "leave `time` out");
        }
        let others = [
            ("strands", !scene.strands.is_empty()),
            ("solids", !scene.solids.is_empty()),
            ("liquid", scene.liquid.is_some()),
        ];
        for (name, there) in others {
            if there {
                let message = format!("`microgel` and `{name}` cannot be in one scene");
                self.inconsistent(&root.field(name), message, "put the grains into a scene of their own");
            }
        }
        let settings = match settings(scene, microgel) {
            Ok(settings) => settings,
            Err(GranularError::Setting { name, allowed, .. }) if name.starts_with("table") => {
                let message = "the table of the law cannot be used";
                self.inconsistent(&place.field("law"), message, allowed);
                return;
            }
            Err(GranularError::Setting { name, value, allowed }) => {
                let at = self.find(&place, name);
                let message = format!("`{name}` = {value} is out of range");
                self.refuse(ProblemKind::OutOfRange, &at, message, format!("it must be {allowed}"));
                return;
            }
            Err(error) => {
                let help = "change one of the two, or take the default";
                self.inconsistent(&place, error.to_string().replace("inconsistent state: ", ""), help);
                return;
            }
        };
        let schedule = Schedule::new(&settings);
        if schedule.steps > MAX_STEPS {
            let message = format!("the run would take {:.1e} steps", schedule.steps as f64);
            let help =
                format!("at most {MAX_STEPS:e} are allowed: shorten the experiment or raise its frequency or rate");
            self.refuse(ProblemKind::TooLarge, &place.field("experiment"), message, help);
            return;
        }
        let measured = (schedule.steps - schedule.prepared) as f64;
        let rows = measured / microgel.record_every as f64;
        let bytes = memory(microgel.grains as f64, f64::from(microgel.seeds), measured, rows);
        if bytes > MEMORY_LIMIT {
            let message = format!(
                "this needs about {} of memory: {} grains in {} samples, {measured:.1e} steps each",
                show_bytes(bytes),
                microgel.grains,
                microgel.seeds
            );
            let help = format!("at most {} are allowed: use fewer grains or seeds", show_bytes(MEMORY_LIMIT));
            self.refuse(ProblemKind::TooLarge, &place.field("grains"), message, help);
        }
    }

    /// The place of a setting somewhere inside the section, or the section.
    fn find(&self, place: &Path, name: &str) -> Path {
        let inner: [&[&str]; 7] = [
            &[],
            &["preparation"],
            &["preparation", "cut"],
            &["rules"],
            &["law"],
            &["experiment"],
            &["experiment", "base"],
        ];
        let whole = self.span(place);
        inner
            .iter()
            .map(|steps| steps.iter().fold(place.clone(), |path, step| path.field(step)).field(name))
            .find(|path| crate::scene::edit::follow(self.root, path).1 == path.0.len() && self.span(path) != whole)
            .unwrap_or_else(|| place.clone())
    }
}
