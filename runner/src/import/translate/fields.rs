//! Shapes and solids.

use super::Translation;
use crate::import::assets;
use crate::import::document::Sited;
use crate::import::notes::Heading;
use crate::import::original::fields::{DistanceField, Shape, Usage};
use crate::import::replay::unit_axis;
use crate::import::ron;
use crate::scene::tree::{Node, Span};
use nalgebra::{UnitQuaternion, Vector3};

/// The turn of a field at the start.
pub(super) fn turn(field: &DistanceField) -> UnitQuaternion<f64> {
    unit_axis(field.axis.value)
        .map_or(UnitQuaternion::identity(), |axis| UnitQuaternion::from_axis_angle(&axis, field.angle))
}

impl Translation<'_, '_> {
    /// The solids of the scene.
    pub(super) fn solids(&mut self) -> Option<Node> {
        let switches = &self.original.switches;
        let (mine, theirs) = (switches.strand_friction, switches.solid_friction);
        // a pair takes the geometric mean of its coefficients
        let exact = if theirs.value == 0.0 || mine.value == 0.0 { 0.0 } else { theirs.value.powi(2) / mine.value };
        let friction: f64 = format!("{exact:.12e}").parse().unwrap_or(exact);
        if theirs.value != 0.0 && mine.value == 0.0 {
            let what = format!("hairMeshFrictionCoefficient = {}", theirs.value);
            let why = "a pair takes the geometric mean of both sides, and strands have none";
            self.document.note(Heading::NotHonoured, theirs.span, what, why);
        }
        let mut solids = Vec::new();
        for (index, field) in self.original.fields.iter().enumerate() {
            if field.usage != Usage::Solid {
                continue;
            }
            let Some(shape) = self.volume(field) else { continue };
            let mut fields = vec![("shape", shape)];
            if field.inverted.value {
                fields.push(("inverted", ron::flag(true)));
            }
            fields.extend(self.motion_of_field(index).map(|motion| ("motion", motion)));
            fields.push(("friction", ron::number(theirs.map(|_| friction))));
            let liquid = self.original.liquid.boundary_friction;
            if self.is_wet() && liquid.value != 1.0 {
                fields.push(("liquid_friction", ron::number(liquid)));
            }
            solids.push(ron::group(field.span, "", fields));
        }
        if !solids.is_empty() && theirs.value != 0.0 && mine.value != 0.0 {
            let what = format!("hairMeshFrictionCoefficient = {}", theirs.value);
            let why = format!(
                "solids have {friction:.6}: a pair takes the geometric mean with the {} of strands",
                mine.value
            );
            self.document.note(Heading::Changed, theirs.span, what, why);
        }
        (!solids.is_empty()).then(|| ron::list(solids))
    }

    /// The shape of a field where it is at the start; `None` where its file is missing.
    pub(super) fn volume(&self, field: &DistanceField) -> Option<Node> {
        let length = Vector3::from(field.axis.value).norm();
        if field.angle != 0.0 && (length - 1.0).abs() > 1e-6 {
            let what = format!("distancefield with an axis of length {length}");
            let why = "taken as a direction; the original turns and distorts by it";
            self.document.note(Heading::Fault, field.axis.span, what, why);
        }
        let turn = turn(field);
        let turned = turn.angle() != 0.0;
        let degrees = |rotation: UnitQuaternion<f64>| {
            let vector = rotation.scaled_axis().map(f64::to_degrees);
            ron::vector(Sited { value: vector.into(), span: field.axis.span })
        };
        let direction = |own: Vector3<f64>| ron::axis(if turned { (turn * own).into() } else { own.into() });
        let center = ("center", ron::vector(field.center));
        let plain = |value: f64| ron::number(Sited { value, span: field.span });
        Some(match &field.shape {
            Shape::Sphere { radius } => {
                ron::group(field.span, "Sphere", vec![center, ("radius", ron::number(*radius))])
            }
            Shape::Box { half, rounding } => {
                let size = half.map(|half| half.map(|side| side + rounding));
                let mut fields = vec![center, ("half_size", ron::vector(size))];
                if turned {
                    fields.push(("rotate", degrees(turn)));
                }
                if *rounding != 0.0 {
                    fields.push(("rounding", plain(*rounding)));
                }
                ron::group(field.span, "Box", fields)
            }
            Shape::Capsule { radius, half_length } => {
                let fields = vec![
                    center,
                    ("axis", direction(Vector3::x())),
                    ("radius", ron::number(*radius)),
                    ("half_length", ron::number(*half_length)),
                ];
                ron::group(field.span, "Capsule", fields)
            }
            Shape::Cylinder { radius, half_length, rounding } => {
                let mut fields = vec![
                    center,
                    ("axis", direction(Vector3::y())),
                    ("radius", ron::number(*radius)),
                    ("half_length", ron::number(half_length.map(|half| half + rounding))),
                ];
                if *rounding != 0.0 {
                    fields.push(("rounding", plain(*rounding)));
                }
                ron::group(field.span, "Cylinder", fields)
            }
            Shape::Mesh { file, scale } => {
                let path = self.file(&file.value, file.span);
                let mut fields = vec![("file", path)];
                if scale.value != 1.0 {
                    fields.push(("scale", ron::number(*scale)));
                }
                fields.push(("translate", ron::vector(field.center)));
                if turned {
                    fields.push(("rotate", degrees(turn)));
                }
                ron::group(field.span, "Mesh", fields)
            }
        })
    }

    /// The name of a file as seen from the new scene; noted where it is missing.
    pub(super) fn file(&self, name: &str, span: Span) -> Node {
        let found = assets::find(name, self.source, &self.options.assets);
        let shown = match &found {
            Some(path) => assets::relative(path, &self.folder),
            None => {
                let why = "not beside the file, nor in a folder above it; give its folder with --assets, or put it \
                           where the scene looks for it";
                self.document.note(Heading::Missing, span, name, why);
                name.replace('\\', "/")
            }
        };
        let mut node = ron::text(&shown);
        node.span = span;
        node
    }
}
