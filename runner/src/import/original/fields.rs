//! `distancefield`: solids, sources and terminators.

use super::{Element, Number, Sited};
use crate::import::notes::Heading;
use crate::scene::error::{ProblemKind, suggest};
use crate::scene::tree::Span;

/// What a field is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Usage {
    /// Strands and liquid meet it.
    Solid,
    /// Liquid flows out of it.
    Source,
    /// Liquid disappears in it.
    Terminator,
}

/// A shape [CGS], before its turn.
pub enum Shape {
    /// Ball.
    Sphere {
        /// Radius.
        radius: Number,
    },
    /// Box with rounded edges.
    Box {
        /// Half sides without the rounding.
        half: Sited<[f64; 3]>,
        /// Rounding, added outside.
        rounding: f64,
    },
    /// Cylinder with round ends, along x.
    Capsule {
        /// Radius.
        radius: Number,
        /// Half of the length between the centres of the ends.
        half_length: Number,
    },
    /// Cylinder along y with rounded rims.
    Cylinder {
        /// Radius, rounding included.
        radius: Number,
        /// Half length without the rounding.
        half_length: Number,
        /// Rounding.
        rounding: f64,
    },
    /// Triangle mesh from an OBJ file.
    Mesh {
        /// File as written.
        file: Sited<String>,
        /// Factor on its coordinates.
        scale: Number,
    },
}

/// A stretch of time in which a source emits.
pub struct Emission {
    /// Where it stands.
    pub span: Span,
    /// Start and end [s].
    pub during: [Number; 2],
    /// Velocity [cm/s].
    pub velocity: Sited<[f64; 3]>,
}

/// One field.
pub struct DistanceField {
    /// Where it stands.
    pub span: Span,
    /// What it is for.
    pub usage: Usage,
    /// Shape.
    pub shape: Shape,
    /// Centre [cm].
    pub center: Sited<[f64; 3]>,
    /// Axis of its turn.
    pub axis: Sited<[f64; 3]>,
    /// Angle of its turn [rad].
    pub angle: f64,
    /// Group that moves with scripts.
    pub group: Sited<i64>,
    /// Which liquid it emits.
    pub colour: Sited<i64>,
    /// Outside is inside.
    pub inverted: Sited<bool>,
    /// When it emits.
    pub emissions: Vec<Emission>,
    /// Without emissions a source fills once, at the start, with this velocity [cm/s].
    pub fill_velocity: Sited<[f64; 3]>,
}

/// Reads all fields; `end` is the end of the run [s].
pub fn read(root: &Element<'_, '_>, end: f64) -> Vec<DistanceField> {
    root.children("distancefield").iter().filter_map(|element| field(element, end)).collect()
}

fn field(element: &Element<'_, '_>, end: f64) -> Option<DistanceField> {
    let document = element.document();
    let usage = match element.text("usage") {
        None => Usage::Solid,
        Some(text) => match text.value {
            "solid" => Usage::Solid,
            "source" => Usage::Source,
            "terminator" => Usage::Terminator,
            other => {
                let message = format!("there is no usage `{other}` of a distancefield");
                let help = suggest(other, "usage", &["solid", "source", "terminator"]);
                document.problem(ProblemKind::UnknownName, text.span, message, help);
                return None;
            }
        },
    };
    let shape = shape(element)?;
    let here = |value| Sited { value, span: element.span() };
    for name in ["cx", "cy", "cz"] {
        if element.text(name).is_none() {
            let what = format!("distancefield without `{name}`");
            document.note(Heading::Fault, element.span(), what, "taken as 0; the original takes whatever is in memory");
        }
    }
    let mut field = DistanceField {
        span: element.span(),
        usage,
        shape,
        center: element.vector_of(["cx", "cy", "cz"], [0.0; 3]),
        axis: element.vector_of(["rx", "ry", "rz"], [0.0, 1.0, 0.0]),
        angle: element.number("rw").map_or(0.0, |number| number.value),
        group: element.integer("group").unwrap_or(here(0)),
        colour: element.integer("colorIndex").unwrap_or(Sited { value: 0, span: element.span() }),
        inverted: element.flag("inverted").unwrap_or(Sited { value: false, span: element.span() }),
        emissions: Vec::new(),
        fill_velocity: Sited { value: [0.0; 3], span: element.span() },
    };
    if field.group.value < 0 || field.colour.value < 0 {
        let message = "groups and colours of a distancefield are counted from 0";
        document.problem(ProblemKind::OutOfRange, element.span(), message, "write 0 or more");
    }
    if usage == Usage::Source {
        field.emissions = element.children("emit").iter().map(|emit| emission(emit, end)).collect();
        if field.emissions.is_empty() {
            field.fill_velocity = element.vector_of(["vx", "vy", "vz"], [0.0; 3]);
        }
    }
    others(element, usage);
    Some(field)
}

/// Attributes that the original reads and that have no counterpart.
fn others(element: &Element<'_, '_>, usage: Usage) {
    let document = element.document();
    if let Some(params) = element.text("params") {
        document.note(Heading::Machinery, params.span, "distancefield: params", "read, but used nowhere");
    }
    if let Some(flow) = element.flag("surfflow")
        && flow.value
    {
        document.note(Heading::NotHonoured, flow.span, "distancefield: surfflow = 1", "there are no films on solids");
    }
    if let Some(height) = element.number("flowheight")
        && height.value != 0.0
    {
        let what = format!("distancefield: flowheight = {}", height.value);
        document.note(Heading::NotHonoured, height.span, what, "there are no films on solids");
    }
    if let Some(clamped) = element.flag("clamped")
        && usage == Usage::Source
        && !clamped.value
    {
        let what = "distancefield: clamped = 0";
        document.note(Heading::NotHonoured, clamped.span, what, "a source never emits inside a solid");
    }
}

fn shape(element: &Element<'_, '_>) -> Option<Shape> {
    let document = element.document();
    let Some(kind) = element.text("type") else {
        document.note(Heading::Ignored, element.span(), "distancefield without type", "it has no shape");
        element.skip();
        return None;
    };
    let size = |name: &str| {
        if element.text(name).is_none() {
            let message = format!("a {} needs `{name}`", kind.value);
            document.problem(ProblemKind::MissingField, element.span(), message, format!("add `{name}=\"…\"`"));
        }
        element.number(name).unwrap_or(Sited { value: 1.0, span: element.span() })
    };
    let rounding = |name: &str| element.number(name).map_or(0.0, |number| number.value);
    Some(match kind.value {
        "sphere" => Shape::Sphere { radius: size("radius") },
        "box" => {
            let half = [size("ex"), size("ey"), size("ez")];
            let half = Sited { value: half.map(|number| number.value), span: half[0].span };
            Shape::Box { half, rounding: rounding("radius") }
        }
        "capsule" => Shape::Capsule { radius: size("radius"), half_length: size("halflength") },
        "cylinder" => {
            Shape::Cylinder { radius: size("radius"), half_length: size("halflength"), rounding: rounding("corner") }
        }
        "file" => {
            let Some(file) = element.text("filename").filter(|file| !file.value.trim().is_empty()) else {
                document.note(Heading::Ignored, element.span(), "distancefield of type file without filename", "");
                element.skip();
                return None;
            };
            for name in ["cached", "cachename", "dx"] {
                if let Some(text) = element.text(name) {
                    let what = format!("distancefield: {name}");
                    document.note(Heading::Machinery, text.span, what, "distances to meshes are exact, without a grid");
                }
            }
            let file = Sited { value: file.value.trim().to_owned(), span: file.span };
            Shape::Mesh { file, scale: element.number("scale").unwrap_or(Sited::made(1.0)) }
        }
        "sequence" => {
            let why = "meshes that change shape have no counterpart; the field is left out";
            document.note(Heading::NotHonoured, element.span(), "distancefield of type sequence", why);
            element.skip();
            return None;
        }
        other => {
            let message = format!("there is no type `{other}` of a distancefield");
            let known = ["sphere", "box", "capsule", "cylinder", "file", "sequence"];
            document.problem(ProblemKind::UnknownName, kind.span, message, suggest(other, "type", &known));
            return None;
        }
    })
}

fn emission(element: &Element<'_, '_>, end: f64) -> Emission {
    let document = element.document();
    let time = |name: &str, otherwise: f64| match element.number(name) {
        Some(time) => time,
        None => {
            let what = format!("emit without `{name}`");
            let why = format!("taken as {otherwise} s; the original takes whatever is in memory");
            document.note(Heading::Fault, element.span(), what, why);
            Sited { value: otherwise, span: element.span() }
        }
    };
    for name in ["evx", "evy", "evz"] {
        if element.text(name).is_none() {
            let what = format!("emit without `{name}`");
            document.note(Heading::Fault, element.span(), what, "taken as 0; the original takes whatever is in memory");
        }
    }
    let emission = Emission {
        span: element.span(),
        during: [time("start", 0.0), time("end", end)],
        velocity: element.vector_of(["evx", "evy", "evz"], [0.0; 3]),
    };
    if let Some(volume) = element.number("maxvol") {
        let what = format!("emit: maxvol = {}", volume.value);
        document.note(Heading::NotHonoured, volume.span, what, "a source flows for its whole time");
    }
    emission
}
