//! `script`: prescribed motion of groups.

use super::{Element, Sited};
use crate::import::document::shorten;
use crate::import::notes::Heading;
use crate::scene::error::{ProblemKind, suggest};
use crate::scene::tree::Span;

/// What a script does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Moves along a line.
    Translate,
    /// Turns, the body with it.
    Rotate,
    /// Carries round, without turning the body of a field.
    Swirl,
    /// Grows or shrinks.
    Scale,
    /// Lets held vertices go, or holds free ones.
    Switch,
}

/// How it is distributed over time.
#[derive(Clone, Debug, PartialEq)]
pub enum Progress {
    /// Speed that rises smoothly, stays, and falls smoothly.
    Cubic,
    /// A harmonic swing with smooth ends: amplitude, frequency [1/s].
    Cosine(f64, f64),
    /// Through places given at even times: the places, their distance in time [s].
    Path(Vec<f64>, f64),
}

/// One script.
#[derive(Clone, Debug)]
pub struct Script {
    /// Where it stands.
    pub span: Span,
    /// What it does.
    pub kind: Kind,
    /// How it is distributed over time.
    pub progress: Progress,
    /// Displacement, axis or factors.
    pub vector: [f64; 3],
    /// Angle [rad].
    pub angle: f64,
    /// Point about which it turns; without one, the place of the group.
    pub origin: Option<[f64; 3]>,
    /// Start and end [s].
    pub during: [f64; 2],
    /// Time to reach full speed, and to lose it again [s].
    pub ramps: [f64; 2],
    /// Which group.
    pub group: Sited<i64>,
    /// Which holds a switch changes: bit 0 places, bit 1 twist.
    pub mask: i64,
    /// Axes and centres are those of the world.
    pub global: bool,
}

/// Reads all scripts; `end` is the end of the run [s].
pub fn read(root: &Element<'_, '_>, end: f64) -> Vec<Script> {
    root.children("script").iter().filter_map(|element| script(element, end)).collect()
}

fn script(element: &Element<'_, '_>, end: f64) -> Option<Script> {
    let document = element.document();
    let kinds = ["translate", "rotate", "swirl", "scale", "switch"];
    let kind = match element.text("type") {
        None => {
            let message = "a script does not say what it does";
            let help = format!("add `type`: {}", kinds.join(", "));
            document.problem(ProblemKind::MissingField, element.span(), message, help);
            return None;
        }
        Some(text) => match text.value {
            "translate" => Kind::Translate,
            "rotate" => Kind::Rotate,
            "swirl" => Kind::Swirl,
            "scale" => Kind::Scale,
            "switch" => Kind::Switch,
            other => {
                let message = format!("there is no script of type `{}`", shorten(other));
                document.problem(ProblemKind::UnknownName, text.span, message, suggest(other, "type", &kinds));
                return None;
            }
        },
    };
    let number = |name: &str, otherwise: f64| element.number(name).map_or(otherwise, |number| number.value);
    let during = [number("start", 0.0), number("end", end)];
    let third = (during[1] - during[0]) / 3.0;
    let origin = ["ox", "oy", "oz"].map(|name| element.number(name));
    let given = origin.iter().flatten().count();
    if (1..3).contains(&given) {
        let why = "the others are taken as 0; the original takes whatever is in memory";
        document.note(Heading::Fault, element.span(), "script with a part of `ox`, `oy`, `oz`", why);
    }
    if kind == Kind::Swirl && given == 0 {
        let why = "it swirls about 0 0 0 here; the original takes whatever is in memory";
        document.note(Heading::Fault, element.span(), "swirl without `ox`, `oy`, `oz`", why);
    }
    let missing = if kind == Kind::Scale { 1.0 } else { 0.0 };
    let vector = ["x", "y", "z"].map(|name| {
        if element.text(name).is_none() && kind != Kind::Switch {
            let why = format!("taken as {missing}; the original takes whatever is in memory");
            document.note(Heading::Fault, element.span(), format!("script without `{name}`"), why);
        }
        number(name, missing)
    });
    let read = Script {
        span: element.span(),
        kind,
        progress: progress(element)?,
        vector,
        angle: number("w", 0.0),
        origin: (given > 0 || kind == Kind::Swirl).then(|| origin.map(|part| part.map_or(0.0, |part| part.value))),
        during,
        ramps: [number("easestart", third), number("easeend", third)],
        group: element.integer("group").unwrap_or(Sited { value: 0, span: element.span() }),
        mask: element.integer("mask").map_or(0, |mask| mask.value),
        global: element.flag("global").is_some_and(|flag| flag.value),
    };
    let largest = read.vector.iter().chain(&read.during).chain([&read.angle]).fold(0.0, |a: f64, b| a.max(b.abs()));
    if largest > 1e12 {
        let message = format!("a script with the number {largest:e}");
        document.problem(
            ProblemKind::OutOfRange,
            element.span(),
            message,
            "lengths are in cm, times in s, angles in rad",
        );
        return None;
    }
    if read.group.value < 0 {
        let message = format!("a group must not be negative, found {}", read.group.value);
        document.problem(ProblemKind::OutOfRange, read.group.span, message, "groups are counted from 0");
        return None;
    }
    if read.during[1] <= read.during[0] && kind != Kind::Switch {
        document.note(Heading::Ignored, element.span(), "script that ends before it starts", "it never acts");
        return None;
    }
    Some(read)
}

fn progress(element: &Element<'_, '_>) -> Option<Progress> {
    let document = element.document();
    let number = |name: &str, otherwise: f64| element.number(name).map_or(otherwise, |number| number.value);
    let amplitude = number("amplitude", 1.0);
    let frequency = number("frequency", 1.0);
    let distance = number("dt", 1.0);
    let places = element.text("base");
    let Some(function) = element.text("func") else { return Some(Progress::Cubic) };
    match function.value {
        "cubic" => Some(Progress::Cubic),
        "cosine" => Some(Progress::Cosine(amplitude, frequency)),
        "weno" => {
            let numbers = |text: &str| {
                text.split_whitespace().map(|w| crate::import::stream::number(w).map_or(0.0, |n| n.value)).collect()
            };
            let places: Vec<f64> = places.map_or(Vec::new(), |text| numbers(text.value));
            if places.is_empty() || distance.is_nan() || distance <= 0.0 {
                let message = "a script with func `weno` needs places `base` and their distance in time `dt`";
                let help = "write `base=\"0 1 2\" dt=\"0.5\"`";
                document.problem(ProblemKind::MissingField, element.span(), message, help);
                return None;
            }
            Some(Progress::Path(places, distance))
        }
        other => {
            let message = format!("there is no func `{}` of a script", shorten(other));
            let help = suggest(other, "func", &["cubic", "cosine", "weno"]);
            document.problem(ProblemKind::UnknownName, function.span, message, help);
            None
        }
    }
}
