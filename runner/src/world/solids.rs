//! Solids of a scene as moving signed-distance solids.

use std::path::Path;

use geometry::{Axis, MovingSolid, ShapeDescription, Surface};

use super::{BuildError, script};
use crate::scene::solids::{Solid, Volume};
use crate::scene::{Scene, UnitSystem};

/// A solid with the name and coefficients that the scene gives it.
#[derive(Clone, Debug)]
pub struct SceneSolid {
    /// Name for records; `solid 0` and so on where the scene gives none.
    pub name: String,
    /// Shape and motion.
    pub solid: MovingSolid,
    /// Coefficient of friction with strands.
    pub friction: f64,
    /// What it does to liquid along it: 0 slips, 1 sticks.
    pub liquid_friction: f64,
    /// Fraction of the approach velocity that strands keep.
    pub restitution: f64,
}

/// Builds the solids of a scene.
///
/// # Errors
/// When a shape, a mesh or a script cannot be used; the message names the solid.
pub fn build(scene: &Scene) -> Result<Vec<SceneSolid>, BuildError> {
    scene.solids.iter().enumerate().map(|(index, solid)| one(scene, solid, index)).collect()
}

fn one(scene: &Scene, solid: &Solid, index: usize) -> Result<SceneSolid, BuildError> {
    let name = solid.name.clone().unwrap_or_else(|| format!("solid {index}"));
    let refuse = |what: String| BuildError::Solid { name: name.clone(), what };
    let description = describe(&solid.shape, mesh_unit(scene));
    let description = if solid.inverted { ShapeDescription::Complement(Box::new(description)) } else { description };
    let shape = description.build(Path::new("")).map_err(|error| refuse(error.to_string()))?;
    let motion = script::motion(scene.script(&solid.motion), scene.time.end)?;
    let surface = Surface { friction: solid.friction, sticky: solid.liquid_friction > 0.0 };
    let solid_of = MovingSolid::new(shape, motion, surface).map_err(|error| refuse(error.to_string()))?;
    Ok(SceneSolid {
        name,
        solid: solid_of,
        friction: solid.friction,
        liquid_friction: solid.liquid_friction,
        restitution: solid.restitution,
    })
}

/// Length [m] of one unit of mesh files: they are read in the units of the scene.
#[must_use]
pub fn mesh_unit(scene: &Scene) -> f64 {
    match scene.units {
        UnitSystem::Si => 1.0,
        UnitSystem::Cgs => 0.01,
    }
}

/// A shape of the scene as `geometry` describes it; `mesh_unit` is the length of one unit of mesh files [m].
#[must_use]
pub fn describe(volume: &Volume, mesh_unit: f64) -> ShapeDescription {
    match volume {
        Volume::Sphere(s) => ShapeDescription::Sphere { center: s.center, radius: s.radius },
        Volume::Box(b) => ShapeDescription::Box {
            center: b.center,
            half_extents: b.half_size,
            rotation: b.rotate,
            rounding: b.rounding,
        },
        Volume::Cylinder(c) => ShapeDescription::Cylinder {
            center: c.center,
            axis: Axis::Along(c.axis.0),
            radius: c.radius,
            half_length: c.half_length,
            rounding: c.rounding,
        },
        Volume::Capsule(c) => {
            let half = c.axis.0.normalize() * c.half_length;
            ShapeDescription::Capsule { from: c.center - half, to: c.center + half, radius: c.radius }
        }
        Volume::HalfSpace(h) => ShapeDescription::HalfSpace { point: h.point, normal: h.normal.0 },
        Volume::Torus(t) => ShapeDescription::Torus {
            center: t.center,
            axis: Axis::Along(t.axis.0),
            major_radius: t.major_radius,
            minor_radius: t.minor_radius,
        },
        Volume::Mesh(m) => ShapeDescription::Mesh {
            file: m.file.path.clone(),
            scale: m.scale * mesh_unit,
            rotation: m.rotate,
            translation: m.translate,
        },
    }
}
