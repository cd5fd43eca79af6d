//! Motion scripts must exist and be in order.

use super::Checker;
use crate::scene::edit::Path;
use crate::scene::error::{ProblemKind, suggest};
use crate::scene::motion::{Motion, Script};

impl Checker<'_> {
    pub(super) fn motions(&mut self) {
        for (name, motions) in &self.scene.motions {
            self.motion_list(&Path::default().field("motions").field(name), motions);
        }
    }

    pub(super) fn script(&mut self, place: &Path, script: &Script) {
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

    pub(super) fn motion_list(&mut self, place: &Path, motions: &[Motion]) {
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
}
