//! Solids, and where liquid is, comes from and goes.

use super::Checker;
use crate::scene::edit::Path;
use crate::scene::error::ProblemKind;
use crate::scene::liquid::{Dimensions, Liquid};
use crate::scene::motion::{Motion, Script};
use crate::scene::quantity::{Quantity, show_number};
use crate::scene::solids::Volume;
use crate::world::liquid::build::{dimensions, particles_per_axis};
use crate::world::liquid::planar;
use nalgebra::Vector3;
use particle_grid::BLOCK;

impl Checker<'_> {
    pub(super) fn volume(&mut self, place: &Path, volume: &Volume) {
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

    pub(super) fn liquid(&mut self, liquid: &Liquid) {
        let place = Path::default().field("liquid");
        let wet_strands = self.scene.strands.iter().any(|group| group.film.is_some());
        if liquid.tanks.is_empty() && liquid.sources.is_empty() && !wet_strands {
            self.inconsistent(
                &place,
                "there is no liquid in `liquid`: no tanks, no sources, and no strand with a film",
                "add `tanks: […]` or `sources: […]`, or remove the section",
            );
        }
        if particles_per_axis(liquid).is_none() {
            let powers: Vec<String> = (1..=8u32).map(|n| n.pow(dimensions(liquid)).to_string()).collect();
            let message = format!("{} particles cannot be spread evenly over a cell", liquid.particles_per_cell);
            self.inconsistent(
                &place.field("particles_per_cell"),
                message,
                format!("write one of {}: so many along each direction", powers.join(", ")),
            );
        }
        if liquid.dimensions == Dimensions::Two {
            self.in_the_plane(liquid);
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
            self.keeps_its_size(&at.field("motion"), &source.motion);
        }
        for (i, drain) in liquid.drains.iter().enumerate() {
            let at = place.field("drains").index(i);
            self.volume(&at.field("shape"), &drain.shape);
            self.script(&at.field("motion"), &drain.motion);
            self.keeps_its_size(&at.field("motion"), &drain.motion);
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
                if liquid.dimensions == Dimensions::Two && direction == 2 {
                    self.inconsistent(
                        &at.field("periodic").index(i),
                        "liquid in two dimensions has no direction `Z`",
                        "write `X` or `Y`",
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
                } else if cells > 0.0 && !(cells.round() as u64).is_multiple_of(BLOCK as u64) {
                    let message = format!("the periodic size is {} cells, not a multiple of {BLOCK}", cells.round());
                    self.inconsistent(
                        &place.field("cell"),
                        message,
                        format!(
                            "choose `cell` so that the size of the domain is {BLOCK}, {}, {} … cells",
                            2 * BLOCK,
                            3 * BLOCK
                        ),
                    );
                }
            }
        }
    }

    /// Liquid in two dimensions: no strands, and nothing that has no meaning in the plane.
    fn in_the_plane(&mut self, liquid: &Liquid) {
        let scene = self.scene;
        let root = Path::default();
        if !scene.strands.is_empty() {
            let at = root.field("liquid").field("dimensions");
            self.inconsistent(&at, "strands live in space, this liquid in the plane", "write `dimensions: Three`");
        }
        let mut things = Vec::new();
        for (i, solid) in scene.solids.iter().enumerate() {
            things.push((root.field("solids").index(i), &solid.shape, Some(&solid.motion)));
        }
        let place = root.field("liquid");
        for (i, tank) in liquid.tanks.iter().enumerate() {
            things.push((place.field("tanks").index(i), &tank.shape, None));
        }
        for (i, source) in liquid.sources.iter().enumerate() {
            things.push((place.field("sources").index(i), &source.shape, Some(&source.motion)));
        }
        for (i, drain) in liquid.drains.iter().enumerate() {
            things.push((place.field("drains").index(i), &drain.shape, Some(&drain.motion)));
        }
        for (at, shape, motion) in things {
            if let Err(what) = planar::shape(shape) {
                self.inconsistent(&at.field("shape"), what, "in two dimensions bodies go on for ever along z");
            }
            if let Some(Err(what)) = motion.map(|script| planar::check_motion(scene.script(script))) {
                self.inconsistent(&at.field("motion"), what, "write `axis: Z`");
            }
        }
    }

    /// Liquid cannot flow in and out of what grows or shrinks.
    fn keeps_its_size(&mut self, place: &Path, script: &Script) {
        let grows = |part: &Motion| match part {
            Motion::Scale(_) => true,
            Motion::Keyframes(frames) => frames.poses.iter().any(|pose| pose.scale.0 != Vector3::repeat(1.0)),
            _ => false,
        };
        if self.scene.script(script).iter().any(grows) {
            let message = "what liquid flows in and out of cannot grow or shrink";
            self.inconsistent(place, message, "move or turn it only");
        }
    }

    pub(super) fn bounded(&mut self, place: &Path, volume: &Volume, in_domain: bool) {
        if matches!(volume, Volume::HalfSpace(_)) && !in_domain {
            self.inconsistent(
                place,
                "a half-space holds an infinite amount of liquid",
                "use a bounded shape, such as `Box(…)`, or give the liquid a `domain`",
            );
        }
    }
}
