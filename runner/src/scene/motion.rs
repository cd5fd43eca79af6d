//! Scripted motion: what is prescribed, not how it is evaluated (that is `geometry::motion`).

use super::declare::{choice, section};
use super::field::{Field, Reading, decode_numbers, encode_numbers};
use super::quantity::{Spec, Units, above, at_least};
use super::reference::{Book, Kind};
use super::tree::{Node, Value};
use nalgebra::Vector3;

/// A stretch of time `(start, end)` \[s\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Start \[s\].
    pub start: f64,
    /// End \[s\], after the start.
    pub end: f64,
}

impl Field for Interval {
    fn decode(node: &Node, spec: &Spec, reading: &mut Reading<'_>) -> Option<Interval> {
        let [start, end] = decode_numbers::<2>(node, spec, "an interval `(start, end)`", reading)?;
        if end <= start {
            let message = format!("{} ends at {end} s, not after its start at {start} s", reading.subject());
            let kind = super::error::ProblemKind::Inconsistent;
            reading.problem(kind, node.span, message, "write `(start, end)` with the end after the start");
            return None;
        }
        Some(Interval { start, end })
    }

    fn encode(&self, spec: &Spec, units: Units) -> Node {
        encode_numbers(&[self.start, self.end], spec, units)
    }

    fn describe(_book: &mut Book) -> Kind {
        Kind::Words("`(start, end)`")
    }
}

/// A direction: `X`, `Y`, `Z`, or a vector (which is normalised).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis(pub Vector3<f64>);

impl Axis {
    /// The unit vector along x.
    #[must_use]
    pub fn x() -> Axis {
        Axis(Vector3::x())
    }

    /// The unit vector along y.
    #[must_use]
    pub fn y() -> Axis {
        Axis(Vector3::y())
    }

    /// The unit vector along z.
    #[must_use]
    pub fn z() -> Axis {
        Axis(Vector3::z())
    }
}

impl Field for Axis {
    fn decode(node: &Node, _spec: &Spec, reading: &mut Reading<'_>) -> Option<Axis> {
        if let Value::Name(name) = &node.value {
            match name.as_str() {
                "X" => return Some(Axis::x()),
                "Y" => return Some(Axis::y()),
                "Z" => return Some(Axis::z()),
                _ => {}
            }
        }
        if !matches!(node.value, Value::List(_) | Value::Group(_)) {
            return reading.expected(node, "a direction", "`X`, `Y`, `Z` or a vector `[x, y, z]`");
        }
        let vector = Vector3::from(decode_numbers::<3>(node, &Spec::PLAIN, "a direction `[x, y, z]`", reading)?);
        let largest = vector.amax();
        if largest == 0.0 {
            let message = format!("{} has length zero and is no direction", reading.subject());
            let kind = super::error::ProblemKind::Inconsistent;
            reading.problem(kind, node.span, message, "write `X`, `Y`, `Z` or a vector that is not zero");
            return None;
        }
        // Scaled first, so that neither tiny nor huge vectors under- or overflow; unit vectors keep their bits.
        let scaled = if (vector.norm_squared() - 1.0).abs() < 1e-15 { vector } else { (vector / largest).normalize() };
        Some(Axis(scaled))
    }

    fn encode(&self, _spec: &Spec, units: Units) -> Node {
        for (name, axis) in [("X", Axis::x()), ("Y", Axis::y()), ("Z", Axis::z())] {
            if *self == axis {
                return Node::made(Value::Name(name.to_owned()));
            }
        }
        encode_numbers(self.0.as_slice(), &Spec::PLAIN, units)
    }

    fn describe(_book: &mut Book) -> Kind {
        Kind::Words("`X`, `Y`, `Z` or `[x, y, z]`")
    }
}

/// A factor for all directions, or one per axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScaleFactor(pub Vector3<f64>);

impl Field for ScaleFactor {
    fn decode(node: &Node, spec: &Spec, reading: &mut Reading<'_>) -> Option<ScaleFactor> {
        match node.value {
            Value::Number(_) => f64::decode(node, spec, reading).map(|factor| ScaleFactor(Vector3::repeat(factor))),
            _ => Vector3::decode(node, spec, reading).map(ScaleFactor),
        }
    }

    fn encode(&self, spec: &Spec, units: Units) -> Node {
        if self.0 == Vector3::repeat(self.0.x) { self.0.x.encode(spec, units) } else { self.0.encode(spec, units) }
    }

    fn describe(_book: &mut Book) -> Kind {
        Kind::Words("number or `[x, y, z]`")
    }
}

section! {
    /// Speed that rises smoothly, stays, and falls smoothly.
    pub struct SmoothRamps {
        /// Share of the time in which speed rises; with `fall` at most 1.
        rise: f64 = [1.0 / 3.0] (Number, at_least(0.0).up_to(1.0)) "";
        /// Share of the time in which speed falls.
        fall: f64 = [1.0 / 3.0] (Number, at_least(0.0).up_to(1.0)) "";
    }
}

choice! {
    /// How a motion is distributed over its time; `s` runs from 0 to 1.
    pub enum Ease {
        /// Constant velocity.
        Linear;
        /// `3s² − 2s³`: starts and stops at rest.
        Smooth;
        /// `6s⁵ − 15s⁴ + 10s³`: starts and stops at rest without a jump in acceleration.
        Smoother;
        /// `s²`: from rest with constant acceleration.
        Accelerate;
        /// `1 − (1 − s)²`: to rest with constant deceleration.
        Decelerate;
        /// Constant velocity between smooth ramps (each `3w² − 2w³` in velocity), at rest at both ends.
        Ramps(SmoothRamps) ();
    }
}

section! {
    /// Moves by a vector.
    pub struct Translate {
        /// Displacement over the whole interval.
        by: Vector3<f64> = [required] (Length) "";
        /// From when to when.
        during: Interval = [required] (Time) "Shorter means faster; the step control sees the velocity.";
        /// How it starts and stops.
        ease: Ease = [Ease::Linear] () "`Linear` starts with a jump in velocity; `Smooth` does not.";
    }
}

section! {
    /// Turns about an axis.
    pub struct Rotate {
        /// Angle over the whole interval; may exceed 360°. Positive turns follow the right hand about `axis`.
        angle: f64 = [required] (Angle) "";
        /// Axis of the turn.
        axis: Axis = [required] () "";
        /// A point on the axis, at the start of the scene; default: the centre of the shape, or the middle of the clamped vertices.
        center: Option<Vector3<f64>> = [None] (Length) "";
        /// From when to when.
        during: Interval = [required] (Time) "";
        /// How it starts and stops.
        ease: Ease = [Ease::Linear] () "";
    }
}

section! {
    /// Turns about an axis at a constant rate.
    pub struct Spin {
        /// Angular velocity; positive turns follow the right hand about `axis`.
        rate: f64 = [required] (AngularVelocity) "";
        /// Axis of the turn.
        axis: Axis = [required] () "";
        /// A point on the axis; default as for `Rotate`.
        center: Option<Vector3<f64>> = [None] (Length) "";
        /// From when to when; default: always.
        during: Option<Interval> = [None] (Time) "";
    }
}

section! {
    /// Moves at a constant velocity.
    pub struct Glide {
        /// Velocity.
        velocity: Vector3<f64> = [required] (Velocity) "";
        /// From when to when; default: always.
        during: Option<Interval> = [None] (Time) "";
    }
}

section! {
    /// Swings about the starting place: displacement `amplitude · sin(2π·frequency·t + phase)`, taken from its value at the start.
    pub struct Oscillate {
        /// Amplitude.
        amplitude: Vector3<f64> = [required] (Length) "";
        /// Frequency.
        frequency: f64 = [required] (Rate, above(0.0)) "";
        /// Phase at the start of the interval.
        phase: f64 = [0.0] (Angle) "";
        /// From when to when; default: always.
        during: Option<Interval> = [None] (Time) "";
    }
}

section! {
    /// Grows or shrinks about a point.
    pub struct Rescale {
        /// Factor reached at the end of the interval.
        factor: ScaleFactor = [required] (Number, above(0.0)) "";
        /// The point that stays; default as for `Rotate`.
        center: Option<Vector3<f64>> = [None] (Length) "";
        /// From when to when.
        during: Interval = [required] (Time) "";
        /// How it starts and stops.
        ease: Ease = [Ease::Linear] () "";
    }
}

section! {
    /// A pose at a moment: turned and scaled about the centre, then moved.
    pub struct Keyframe {
        /// When.
        time: f64 = [required] (Time) "";
        /// Displacement from the starting place.
        translate: Vector3<f64> = [Vector3::zeros()] (Length) "";
        /// Turn from the starting pose, as axis times angle: `[0, 90, 0]` is 90° about y.
        rotate: Vector3<f64> = [Vector3::zeros()] (Angle) "Between keyframes the turn is interpolated along the shortest arc.";
        /// Scale of the starting shape.
        scale: ScaleFactor = [ScaleFactor(Vector3::repeat(1.0))] (Number, above(0.0)) "";
    }
}

section! {
    /// Poses at given moments, interpolated.
    pub struct Keyframes {
        /// The poses, in order of time. Before the first and after the last the pose stays.
        poses: Vec<Keyframe> = [required] () "";
        /// The point about which poses turn and scale; default as for `Rotate`.
        center: Option<Vector3<f64>> = [None] (Length) "";
        /// How each stretch starts and stops.
        ease: Ease = [Ease::Smooth] () "";
    }
}

choice! {
    /// One prescribed motion. The motions of a script add up: translations by sum, turns and scalings in the order of the list.
    pub enum Motion {
        /// By a vector.
        Translate(Translate) ();
        /// By an angle about an axis.
        Rotate(Rotate) ();
        /// At a constant velocity.
        Glide(Glide) ();
        /// At a constant angular velocity.
        Spin(Spin) ();
        /// To and fro.
        Oscillate(Oscillate) ();
        /// Growing or shrinking.
        Scale(Rescale) ();
        /// Through given poses.
        Keyframes(Keyframes) ();
    }
}

/// A motion script: a list of motions, or the name of one in the scene's `motions`.
#[derive(Clone, Debug, PartialEq)]
pub enum Script {
    /// Given in place; an empty list does not move.
    Inline(Vec<Motion>),
    /// Defined in `motions`.
    Named(String),
}

impl Script {
    /// A script that does not move.
    #[must_use]
    pub fn still() -> Script {
        Script::Inline(Vec::new())
    }

    /// Whether there is no motion at all.
    #[must_use]
    pub fn is_still(&self) -> bool {
        matches!(self, Script::Inline(motions) if motions.is_empty())
    }
}

impl Field for Script {
    fn decode(node: &Node, spec: &Spec, reading: &mut Reading<'_>) -> Option<Script> {
        match &node.value {
            Value::Text(name) => Some(Script::Named(name.clone())),
            Value::List(_) => Vec::decode(node, spec, reading).map(Script::Inline),
            _ => reading.expected(node, "a motion script", "a list of motions `[…]`, or the name of one in `motions`"),
        }
    }

    fn encode(&self, spec: &Spec, units: Units) -> Node {
        match self {
            Script::Inline(motions) => motions.encode(spec, units),
            Script::Named(name) => name.encode(spec, units),
        }
    }

    fn describe(book: &mut Book) -> Kind {
        Motion::describe(book);
        Kind::Words("list of [`Motion`](#motion), or a name in `motions`")
    }
}
