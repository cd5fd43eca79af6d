//! Strands: their shapes, sections, rest shapes, clamps and starting motion.

use super::declare::{choice, section};
use super::error::ProblemKind;
use super::field::{Field, FileName, Reading};
use super::film::StrandFilm;
use super::motion::{Axis, ScaleFactor, Script};
use super::quantity::{Spec, Units, above, at_least};
use super::reference::{Book, Kind};
use super::tree::{Group, Node, Value};
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// A quantity along a strand: one number, `Taper(root, tip)`, or one number per vertex.
#[derive(Clone, Debug, PartialEq)]
pub enum Along {
    /// The same everywhere.
    Constant(f64),
    /// Linear in arc length from root (first vertex) to tip (last).
    Taper(f64, f64),
    /// One value per vertex.
    Values(Vec<f64>),
}

impl Along {
    /// The value at a vertex: `fraction` of the arc length from the root, and its index.
    ///
    /// Lists shorter than the strand repeat their last value; `check` refuses them before.
    #[must_use]
    pub fn at(&self, fraction: f64, vertex: usize) -> f64 {
        match self {
            Along::Constant(value) => *value,
            Along::Taper(root, tip) => root + (tip - root) * fraction,
            Along::Values(values) => values.get(vertex).or(values.last()).copied().unwrap_or(0.0),
        }
    }
}

impl Field for Along {
    fn decode(node: &Node, spec: &Spec, reading: &mut Reading<'_>) -> Option<Along> {
        match &node.value {
            Value::Number(_) => f64::decode(node, spec, reading).map(Along::Constant),
            Value::List(items) if items.is_empty() => {
                let message = format!("{} is an empty list", reading.subject());
                reading.problem(
                    ProblemKind::Inconsistent,
                    node.span,
                    message,
                    "give one number per vertex, or only one",
                );
                None
            }
            Value::List(_) => Vec::decode(node, spec, reading).map(Along::Values),
            Value::Group(Group { name: Some((name, _)), items, fields }) if name == "Taper" && fields.is_empty() => {
                match items.as_slice() {
                    [root, tip] => {
                        let root = f64::decode(root, spec, reading);
                        let tip = f64::decode(tip, spec, reading);
                        Some(Along::Taper(root?, tip?))
                    }
                    _ => reading.expected(node, "`Taper(root, tip)`", "two numbers, `Taper(0.01, 0.002)`"),
                }
            }
            _ => reading.expected(
                node,
                "a number, `Taper(root, tip)` or a list with one number per vertex",
                "for example `0.005` or `Taper(0.005, 0.001)`",
            ),
        }
    }

    fn encode(&self, spec: &Spec, units: Units) -> Node {
        match self {
            Along::Constant(value) => value.encode(spec, units),
            Along::Values(values) => values.encode(spec, units),
            Along::Taper(root, tip) => Node::made(Value::Group(Group {
                name: Some(("Taper".to_owned(), None)),
                items: vec![root.encode(spec, units), tip.encode(spec, units)],
                fields: Vec::new(),
            })),
        }
    }

    fn describe(_book: &mut Book) -> Kind {
        Kind::Words("number, `Taper(root, tip)`, or list with one number per vertex")
    }
}

section! {
    /// Vertices one by one.
    pub struct Polyline {
        /// The vertices, root first; at least two.
        points: Vec<Vector3<f64>> = [required] (Length) "";
    }
}

section! {
    /// A straight strand.
    pub struct Straight {
        /// Root.
        from: Vector3<f64> = [required] (Length) "";
        /// Tip.
        to: Vector3<f64> = [required] (Length) "";
        /// Number of vertices.
        vertices: usize = [required] (Number, at_least(2.0)) "Error falls with the square of the number; cost grows with it.";
        /// Edge lengths relative to each other, one per edge; default: all equal.
        spacing: Option<Vec<f64>> = [None] (Number, above(0.0)) "For strands with unequal edges.";
    }
}

choice! {
    /// The sense of a helix.
    pub enum Handedness {
        /// Turns like a common screw.
        Right;
        /// Turns against it.
        Left;
    }
}

section! {
    /// A helix about an axis.
    pub struct Helix {
        /// Where its axis starts.
        center: Vector3<f64> = [Vector3::zeros()] (Length) "";
        /// Direction of its axis.
        axis: Axis = [Axis::y()] () "";
        /// Radius of the helix (of its centreline).
        radius: f64 = [required] (Length, above(0.0)) "";
        /// Advance along the axis per turn.
        pitch: f64 = [required] (Length, at_least(0.0)) "";
        /// Number of turns.
        turns: f64 = [required] (Number, above(0.0).up_to(1e5)) "";
        /// Number of vertices.
        vertices: usize = [required] (Number, at_least(2.0)) "At least ten per turn resolve the curvature to a few per cent.";
        /// Sense of the turns.
        hand: Handedness = [Handedness::Right] () "";
        /// Angle about the axis at which it starts.
        start: f64 = [0.0] (Angle) "";
    }
}

section! {
    /// A full circle; the last vertex coincides with the first, and the strand stays open there.
    pub struct Circle {
        /// Centre.
        center: Vector3<f64> = [required] (Length) "";
        /// Normal of its plane.
        axis: Axis = [Axis::z()] () "";
        /// Radius.
        radius: f64 = [required] (Length, above(0.0)) "";
        /// Number of vertices.
        vertices: usize = [required] (Number, at_least(4.0)) "";
        /// Angle about the axis at which it starts.
        start: f64 = [0.0] (Angle) "";
    }
}

section! {
    /// A piece of a circle.
    pub struct Arc {
        /// Centre of the circle.
        center: Vector3<f64> = [required] (Length) "";
        /// Normal of its plane.
        axis: Axis = [Axis::z()] () "";
        /// Radius of the circle.
        radius: f64 = [required] (Length, above(0.0)) "";
        /// Angle about the axis at which it starts.
        start: f64 = [0.0] (Angle) "";
        /// Angle it spans; negative runs the other way.
        angle: f64 = [required] (Angle, at_least(-TAU).up_to(TAU)) "";
        /// Number of vertices.
        vertices: usize = [required] (Number, at_least(2.0)) "";
    }
}

section! {
    /// Straight parallel strands on a hexagonal pattern, filled from the middle outwards.
    pub struct HexBundle {
        /// Number of strands.
        count: usize = [required] (Number, at_least(1.0)) "7, 19, 37, … fill whole rings.";
        /// Distance between the axes of neighbours.
        spacing: f64 = [required] (Length, above(0.0)) "";
        /// Root of the middle strand.
        from: Vector3<f64> = [required] (Length) "";
        /// Tip of the middle strand.
        to: Vector3<f64> = [required] (Length) "";
        /// Number of vertices of each.
        vertices: usize = [required] (Number, at_least(2.0)) "";
    }
}

section! {
    /// How much the strands of a group differ, as fractions of the mean: `0.1` draws evenly from 90 % to 110 %. Drawn from the scene's `seed`.
    pub struct Spread {
        /// Of the radius.
        radius: f64 = [0.0] (Number, at_least(0.0).below(1.0)) "";
        /// Of the length.
        length: f64 = [0.0] (Number, at_least(0.0).below(1.0)) "";
        /// Of the radius and pitch of the curl.
        curl: f64 = [0.0] (Number, at_least(0.0).below(1.0)) "";
        /// Largest angle between a strand and the direction of the group.
        direction: f64 = [0.0] (Angle, at_least(0.0).below(std::f64::consts::FRAC_PI_2)) "";
    }
}

section! {
    /// A curl: a helix about the strand's own line.
    pub struct Curl {
        /// Radius of the curl.
        radius: f64 = [required] (Length, above(0.0)) "";
        /// Advance per turn.
        pitch: f64 = [required] (Length, above(0.0)) "";
        /// Length over which the curl grows from nothing at the root.
        onset: f64 = [0.0] (Length, at_least(0.0)) "";
        /// Turn of each strand's curl about its line: none (all in step) up to 360° (at random).
        phase_spread: f64 = [TAU] (Angle, at_least(0.0).up_to(TAU)) "";
    }
}

section! {
    /// Strands that grow from a disc in one direction: a hair wisp.
    pub struct Wisp {
        /// Number of strands.
        count: usize = [required] (Number, at_least(1.0)) "";
        /// Centre of the disc of roots.
        root: Vector3<f64> = [required] (Length) "";
        /// Direction of growth.
        direction: Axis = [Axis(Vector3::new(0.0, -1.0, 0.0))] () "";
        /// Mean length of a strand (of its line; a curl makes the strand longer).
        length: f64 = [required] (Length, above(0.0)) "";
        /// Radius of the disc of roots.
        disc: f64 = [0.0] (Length, at_least(0.0)) "";
        /// Radius of the wisp at its tips; default: as at the roots.
        tip_disc: Option<f64> = [None] (Length, at_least(0.0)) "";
        /// Number of vertices of each strand.
        vertices: usize = [required] (Number, at_least(2.0)) "";
        /// How roots and directions are chosen.
        arrangement: Arrangement = [Arrangement::Random] () "`Even` for many strands that may not overlap at the start.";
        /// Curl; default: none.
        curl: Option<Curl> = [None] () "";
        /// Differences between strands.
        spread: Spread = [blank] () "";
    }
}

choice! {
    /// How the strands of a wisp stand.
    pub enum Arrangement {
        /// Roots at random over the disc, directions at random within the spread: strands may cross.
        Random;
        /// Roots as far apart as the disc lets them (a sunflower's pattern), leaning outward in proportion to their distance from the
        /// middle, the outermost by the spread: straight strands do not cross.
        Even;
    }
}

section! {
    /// Straight strands whose roots and tips fill a disc evenly: a bundle.
    pub struct Bundle {
        /// Number of strands.
        count: usize = [required] (Number, at_least(1.0)) "";
        /// Centre of the disc of roots.
        from: Vector3<f64> = [required] (Length) "";
        /// Centre of the disc of tips.
        to: Vector3<f64> = [required] (Length) "";
        /// Radius of the discs.
        disc: f64 = [required] (Length, at_least(0.0)) "";
        /// Number of vertices of each strand.
        vertices: usize = [required] (Number, at_least(2.0)) "";
        /// Curl; default: none.
        curl: Option<Curl> = [None] () "";
        /// Differences between strands.
        spread: Spread = [blank] () "";
    }
}

section! {
    /// The polylines (`l` elements) of a Wavefront OBJ file; without `l` elements, all its vertices as one strand.
    pub struct ObjFile {
        /// File, relative to the scene file.
        file: FileName = [required] () "";
        /// Factor on its coordinates, which are read in the units of the scene.
        scale: f64 = [1.0] (Number, above(0.0)) "";
    }
}

choice! {
    /// The shape of the strands of a group at the start.
    pub enum StrandShape {
        /// One strand, vertex by vertex.
        Polyline(Polyline) ();
        /// One straight strand.
        Straight(Straight) ();
        /// One helix.
        Helix(Helix) ();
        /// One circle.
        Circle(Circle) ();
        /// One piece of a circle.
        Arc(Arc) ();
        /// Parallel strands on a hexagonal pattern.
        HexBundle(HexBundle) ();
        /// Strands that grow from a disc.
        Wisp(Wisp) ();
        /// Straight strands that fill a disc.
        Bundle(Bundle) ();
        /// Strands from a file.
        Obj(ObjFile) ();
    }
}

section! {
    /// Moves the generated strands into place: scaled, then turned about the origin, then moved.
    pub struct Placement {
        /// Displacement.
        translate: Vector3<f64> = [Vector3::zeros()] (Length) "";
        /// Turn, as axis times angle: `[0, 90, 0]` is 90° about y.
        rotate: Vector3<f64> = [Vector3::zeros()] (Angle) "";
        /// Factor on all coordinates (radii are not scaled).
        scale: ScaleFactor = [ScaleFactor(Vector3::repeat(1.0))] (Number, above(0.0)) "";
    }
}

section! {
    /// Curvature and twist of a strand without load, the same along its length.
    pub struct NaturalCurvature {
        /// Curvature towards the first material director.
        first: f64 = [0.0] (Curvature) "";
        /// Curvature towards the second material director.
        second: f64 = [0.0] (Curvature) "";
        /// Twist per length (radians).
        twist: f64 = [0.0] (Curvature) "";
    }
}

choice! {
    /// The shape a strand has without load.
    pub enum RestShape {
        /// The shape it is given in.
        AsGiven;
        /// Straight and untwisted, edges as long as given.
        Straight;
        /// Given curvature and twist, edges as long as given.
        Curvature(NaturalCurvature) ();
        /// The shape for which the given one is in equilibrium under gravity.
        Sagfree;
        /// Another polyline with as many vertices.
        Polyline(Polyline) ();
    }
}

choice! {
    /// What a clamp does to the twist of the edges between held vertices.
    pub enum ClampTwist {
        /// Holds it: the ends are built in.
        Held;
        /// Leaves it free: vertices are held in place only.
        Free;
    }
}

section! {
    /// Holds vertices at one end.
    pub struct EndClamp {
        /// How many vertices; one is a ball joint, two build the end in.
        count: usize = [2] (Number, at_least(1.0)) "The effective clamp lies at the middle of the first edge.";
        /// Whether twist is held too.
        twist: ClampTwist = [ClampTwist::Held] () "";
        /// How the clamp moves; default: the motion of the group.
        motion: Option<Script> = [None] () "";
        /// When it lets go; default: never.
        until: Option<f64> = [None] (Time, above(0.0)) "";
    }
}

section! {
    /// Holds any vertices.
    pub struct VertexClamp {
        /// Their indices; the root is 0.
        vertices: Vec<usize> = [required] () "";
        /// Whether the twist of edges between held neighbours is held too.
        twist: ClampTwist = [ClampTwist::Held] () "";
        /// How the clamp moves; default: the motion of the group.
        motion: Option<Script> = [None] () "";
        /// When it lets go; default: never.
        until: Option<f64> = [None] (Time, above(0.0)) "";
    }
}

choice! {
    /// Vertices that are held, or moved as prescribed, on every strand of the group.
    pub enum Clamp {
        /// At the root: `First(2)`.
        First(EndClamp) ();
        /// At the tip: `Last(2)`.
        Last(EndClamp) ();
        /// Anywhere: `Vertices([0, 40])`.
        Vertices(VertexClamp) ();
    }
}

section! {
    /// A rigid rotation at the start.
    pub struct InitialSpin {
        /// Angular velocity.
        rate: f64 = [required] (AngularVelocity) "";
        /// Axis.
        axis: Axis = [required] () "";
        /// A point on the axis; default: the centre of mass of each strand.
        center: Option<Vector3<f64>> = [None] (Length) "";
    }
}

section! {
    /// A group of strands of one material.
    pub struct StrandGroup {
        /// Name, for messages, records and probes.
        name: Option<String> = [None] () "";
        /// A fibre in `materials`.
        material: String = [required] () "";
        /// Radius; of an elliptic section, the half-width along the first material director. Default: the usual radius of the material's preset.
        radius: Option<Along> = [None] (Length, above(0.0).up_to(0.1)) "Bending stiffness grows with its fourth power, mass with its square.";
        /// Half-width along the second material director; default: as `radius` (circular).
        second_radius: Option<Along> = [None] (Length, above(0.0).up_to(0.1)) "Ellipses bend about their thin side.";
        /// Turn of the section about the centreline, from the first director.
        section_angle: f64 = [0.0] (Angle) "";
        /// Direction that the first director of the first edge has, as far as it is at right angles to the edge; default: chosen by the program.
        director: Option<Axis> = [None] () "Matters for elliptic sections and natural curvature.";
        /// Factor on Young's modulus along the strand.
        stiffness: Along = [Along::Constant(1.0)] (Number, above(0.0).up_to(1e6)) "";
        /// Where the strands are.
        shape: StrandShape = [required] () "";
        /// Moves the whole group into place.
        placement: Placement = [blank] () "";
        /// Twist put in at the start, from root to tip, in addition to that of the rest shape.
        twist: f64 = [0.0] (Angle) "360° a turn; many turns are allowed.";
        /// Shape without load.
        rest: RestShape = [RestShape::AsGiven] () "";
        /// Vertices held or moved.
        clamp: Vec<Clamp> = [Vec::new()] () "";
        /// How its clamps move, unless they say otherwise.
        motion: Script = [Script::still()] () "";
        /// Velocity of every vertex at the start.
        velocity: Vector3<f64> = [Vector3::zeros()] (Velocity) "";
        /// Rotation at the start, in addition.
        spin: Option<InitialSpin> = [None] () "";
        /// Coefficient of friction with strands and solids; a pair takes the geometric mean.
        friction: f64 = [0.3] (Number, at_least(0.0).up_to(10.0)) "";
        /// Liquid film on the strands; default: none.
        film: Option<StrandFilm> = [None] () "A film costs some work per vertex; strands without one pay nothing.";
    }
}
