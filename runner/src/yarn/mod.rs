//! Yarns under the common stepper.
//!
//! ```text
//! scene.yarn, solids, gravity, motions ─► settings (of the library) ─► system: plane or space
//!                                                                     ├► series.csv (record), summary
//!                                                                     └► frames (picture), checkpoints
//! ```
//! The stepper asks for steps within the limits of the library; larger ones (fixed steps, say) the library divides or
//! refuses, as the scene says.

mod picture;
mod record;
mod settings;
mod system;

pub use settings::{SettingsError, group_sizes, settings};
pub use system::{YarnScene, system};

use crate::scene::Scene;

/// Memory of a run per vertex [bytes]: state, snapshot, transfer arrays and grid.
pub const BYTES_PER_VERTEX: f64 = 2600.0;

/// What happens in a step, in words.
#[must_use]
pub fn program(scene: &Scene) -> Vec<String> {
    use crate::scene::yarn::YarnIntegrator;
    let Some(yarn) = &scene.yarn else { return Vec::new() };
    let mut lines = vec!["follow the yarns with the grid".to_owned()];
    if yarn.integrator == YarnIntegrator::Explicit {
        lines.push("forces of stretch, shear, contact and bending, to the nodes with mass and momentum".to_owned());
        lines.push("velocities of nodes: loads, then solids, pins and walls".to_owned());
    } else {
        lines.push("mass and momentum to the nodes".to_owned());
        lines
            .push("velocities of nodes: Newton and conjugate gradients, with loads, solids, pins and walls".to_owned());
    }
    lines.push("velocities back to vertices and middles of segments".to_owned());
    if yarn.hand_back && !yarn.compat {
        lines.push("momentum of the middles handed back to the vertices".to_owned());
    }
    if !yarn.drives.is_empty() || yarn.groups.iter().any(|g| g.first.is_some() || g.last.is_some()) {
        lines.push("vertices that are held or led".to_owned());
    }
    lines.push("motion of vertices, deformation of segments".to_owned());
    if yarn.plastic {
        lines.push("return to the friction cone".to_owned());
    }
    lines
}
