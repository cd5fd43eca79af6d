//! Solids, and where liquid is, comes from and goes.

use super::Checker;
use crate::scene::edit::Path;
use crate::scene::error::ProblemKind;
use crate::scene::liquid::Liquid;
use crate::scene::quantity::{Quantity, show_number};
use crate::scene::solids::Volume;

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
        }
        for (i, drain) in liquid.drains.iter().enumerate() {
            let at = place.field("drains").index(i);
            self.volume(&at.field("shape"), &drain.shape);
            self.script(&at.field("motion"), &drain.motion);
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
                let cells = size[direction] / liquid.cell;
                if cells > 0.0 && (cells - cells.round()).abs() > 1e-6 * cells.max(1.0) {
                    let message = format!("the periodic size is {} cells, not a whole number", show_number(cells));
                    self.inconsistent(
                        &place.field("cell"),
                        message,
                        "choose `cell` so that it divides the size of the domain",
                    );
                }
            }
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
