//! Yarns: shapes, the grid they live on, what moves and holds them, and how they step.
//!
//! Solids, gravity and motion scripts are those of the scene; everything that only yarns have is here. Defaults are those of
//! the library.

use super::declare::{choice, section};
use super::error::ProblemKind;
use super::field::{Field, FileName, Reading};
use super::liquid::Dimensions;
use super::motion::{Axis, Script};
use super::quantity::{Spec, Units, above, at_least};
use super::reference::{Book, Kind};
use super::tree::{Node, Value};
use nalgebra::Vector3;

choice! {
    /// How yarns resist bending.
    pub enum YarnBending {
        /// Not at all: chains.
        Flexible;
        /// As discrete elastic rods (`E = B/2 Σ κ² l`, `κ = 2 tan(θ/2)/l`); the number is `B` over that of a solid section of the stretch modulus. Quadratic at small angles.
        Rod(f64) (Number, at_least(0.0).up_to(100.0));
        /// By the note's spring between vertices two apart; the number is its stiffness over that of a segment along the yarn. No stiffness against small angles.
        Spring(f64) (Number, at_least(0.0).up_to(100.0));
    }
}

section! {
    /// What yarns are made of: a bundle of fibres, stiff along, soft across, with Coulomb friction inside and between yarns.
    pub struct YarnMaterial {
        /// Mass density.
        density: f64 = [1.0] (Density, above(0.0).up_to(1e6)) "";
        /// Diameter (in two dimensions the width); default: half a cell.
        width: Option<f64> = [None] (Length, above(0.0)) "Decides mass and stiffness of a length of yarn; contact reaches over a cell whatever it is.";
        /// Modulus against stretch.
        stretch_modulus: f64 = [1000.0] (Pressure, above(0.0).up_to(1e14)) "Strain is tension over modulus and area; explicit steps shrink with its root.";
        /// Modulus against sliding of fibres along each other.
        shear_modulus: f64 = [500.0] (Pressure, at_least(0.0).up_to(1e14)) "0 leaves sliding free.";
        /// Young's modulus of the cross-section: stiffness of contact.
        young_modulus: f64 = [1000.0] (Pressure, above(0.0).up_to(1e14)) "Softer yarns are pressed flatter.";
        /// Poisson ratio of the cross-section.
        poisson_ratio: f64 = [0.3] (Number, at_least(0.0).up_to(0.49)) "";
        /// Coulomb coefficient of sliding along the yarns.
        friction: f64 = [0.05] (Number, at_least(0.0).up_to(10.0)) "";
        /// Coulomb coefficient of yarns that pass each other sideways (three dimensions); default: as `friction`.
        section_friction: Option<f64> = [None] (Number, at_least(0.0).up_to(10.0)) "Below about 2 a lone yarn under a plate flows aside and loses its load; sheets and bundles hold themselves.";
        /// Resistance against bending.
        bending: YarnBending = [YarnBending::Rod(0.01)] () "The default is that of a hundred fibres that slide freely.";
    }
}

section! {
    /// One straight yarn.
    pub struct YarnLine {
        /// First end.
        from: Vector3<f64> = [required] (Length) "";
        /// Last end.
        to: Vector3<f64> = [required] (Length) "";
    }
}

section! {
    /// Straight yarns side by side.
    pub struct YarnLines {
        /// First end of the first yarn.
        from: Vector3<f64> = [required] (Length) "";
        /// Last end of the first yarn.
        to: Vector3<f64> = [required] (Length) "";
        /// Number of yarns.
        count: usize = [required] (Number, at_least(1.0)) "";
        /// From one yarn to the next.
        step: Vector3<f64> = [required] (Length) "Less than a cell starts them pressed together.";
    }
}

section! {
    /// A circle or a part of one; the ends of a full turn stay apart by one segment.
    pub struct YarnCircle {
        /// Centre.
        center: Vector3<f64> = [required] (Length) "";
        /// Radius.
        radius: f64 = [required] (Length, above(0.0)) "";
        /// Normal of its plane (three dimensions).
        axis: Axis = [Axis::z()] () "";
        /// Angle of the first vertex.
        start: f64 = [0.0] (Angle) "";
        /// Angle it spans; default: a full turn less one segment.
        angle: Option<f64> = [None] (Angle) "";
    }
}

section! {
    /// A helix (three dimensions).
    pub struct YarnHelix {
        /// Foot of the axis.
        from: Vector3<f64> = [required] (Length) "";
        /// Head of the axis.
        to: Vector3<f64> = [required] (Length) "";
        /// Radius.
        radius: f64 = [required] (Length, above(0.0)) "";
        /// Turns between foot and head; negative turns the other way.
        turns: f64 = [required] (Number) "";
    }
}

section! {
    /// A plain woven sheet: warp and weft pass each other alternately above and below (three dimensions).
    pub struct WovenSheet {
        /// Centre of the sheet.
        center: Vector3<f64> = [required] (Length) "";
        /// Direction of the warp.
        warp: Axis = [Axis::x()] () "";
        /// Direction of the weft, made normal to the warp.
        weft: Axis = [Axis::y()] () "";
        /// Number of warp yarns.
        warp_count: usize = [required] (Number, at_least(1.0)) "";
        /// Number of weft yarns.
        weft_count: usize = [required] (Number, at_least(1.0)) "";
        /// Distance of neighbouring yarns.
        spacing: f64 = [required] (Length, above(0.0)) "";
        /// Height of the crossings above and below the middle plane.
        amplitude: f64 = [required] (Length, at_least(0.0)) "Half a cell lets crossing yarns just touch.";
        /// Length of the yarns beyond the outermost crossing; default: half the spacing.
        overhang: Option<f64> = [None] (Length, at_least(0.0)) "";
    }
}

section! {
    /// Rows of plain jersey in the x–y plane, each row one yarn (three dimensions).
    pub struct KnitRows {
        /// Centre of the swatch.
        center: Vector3<f64> = [required] (Length) "";
        /// Number of rows.
        rows: usize = [required] (Number, at_least(1.0)) "";
        /// Loops per row.
        loops: usize = [required] (Number, at_least(1.0)) "";
        /// Width of a loop.
        width: f64 = [required] (Length, above(0.0)) "";
        /// Distance from row to row; a loop is twice as high.
        height: f64 = [required] (Length, above(0.0)) "";
        /// Depth of the loops; neighbouring rows pass at about 0.45 of it.
        depth: f64 = [required] (Length, at_least(0.0)) "Two cells and more keep the rows apart at the start.";
    }
}

section! {
    /// Yarns of random course in a ball (a disc in two dimensions), drawn from the scene's `seed`.
    pub struct HairBall {
        /// Centre.
        center: Vector3<f64> = [required] (Length) "";
        /// Radius.
        radius: f64 = [required] (Length, above(0.0)) "";
        /// Number of yarns.
        count: usize = [required] (Number, at_least(1.0)) "";
        /// Length of each.
        length: f64 = [required] (Length, above(0.0)) "";
        /// Length over which the course forgets its direction.
        curl: f64 = [required] (Length, above(0.0)) "";
    }
}

section! {
    /// Straight cut pieces of random place and direction in a box, drawn from the scene's `seed`.
    pub struct CutPile {
        /// Low corner.
        low: Vector3<f64> = [required] (Length) "";
        /// High corner.
        high: Vector3<f64> = [required] (Length) "";
        /// Number of pieces.
        count: usize = [required] (Number, at_least(1.0)) "";
        /// Length of each.
        length: f64 = [required] (Length, above(0.0)) "";
    }
}

section! {
    /// One yarn, vertex by vertex.
    pub struct YarnPoints {
        /// The vertices; at least two, between 0.25 and 1.5 cells apart.
        points: Vec<Vector3<f64>> = [required] (Length) "";
        /// Rest length of each segment; default: as given.
        rest_lengths: Vec<f64> = [Vec::new()] (Length, above(0.0)) "";
    }
}

section! {
    /// Yarns from a text file: one vertex per line, coordinates separated by commas or blanks, an empty line between yarns.
    pub struct YarnFile {
        /// File, relative to the scene file.
        file: FileName = [required] () "";
        /// Factor on its coordinates, which are read in the units of the scene.
        scale: f64 = [1.0] (Number, above(0.0)) "";
    }
}

choice! {
    /// The shape of the yarns of a group at the start.
    pub enum YarnShape {
        /// One straight yarn.
        Line(YarnLine) ();
        /// Parallel yarns.
        Lines(YarnLines) ();
        /// A circle.
        Circle(YarnCircle) ();
        /// A helix.
        Helix(YarnHelix) ();
        /// A woven sheet.
        Weave(WovenSheet) ();
        /// A knit swatch.
        Knit(KnitRows) ();
        /// A ball of hair.
        HairBall(HairBall) ();
        /// A pile of cut pieces.
        CutPile(CutPile) ();
        /// Vertex by vertex.
        Polyline(YarnPoints) ();
        /// From a file.
        File(YarnFile) ();
    }
}

section! {
    /// Yarns of one material and one shape.
    pub struct YarnGroup {
        /// Name, for messages and records.
        name: Option<String> = [None] () "";
        /// A yarn in `materials`.
        material: String = [required] () "";
        /// Where the yarns are.
        shape: YarnShape = [required] () "";
        /// Length of a segment; default: half a cell. `Polyline` and `File` keep their own.
        segment_length: Option<f64> = [None] (Length, above(0.0)) "0.3 to 1 cell: longer yarns fall apart, shorter ones have motions that the grid cannot see.";
        /// Stretch at the start: rest lengths are the built ones divided by it.
        stretch: f64 = [1.0] (Number, at_least(1e-3).up_to(1e3)) "";
        /// Velocity of every vertex at the start.
        velocity: Vector3<f64> = [Vector3::zeros()] (Velocity) "";
        /// How the first vertex of every yarn is led; `[]` holds it; default: free.
        first: Option<Script> = [None] () "";
        /// How the last vertex of every yarn is led; `[]` holds it; default: free.
        last: Option<Script> = [None] () "";
    }
}

/// A vertex along a yarn: `First`, `Last`, or its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum YarnVertex {
    /// The first one.
    First,
    /// The last one.
    Last,
    /// Counted from the first, which is 0.
    At(usize),
}

impl Field for YarnVertex {
    fn decode(node: &Node, spec: &Spec, reading: &mut Reading<'_>) -> Option<YarnVertex> {
        match &node.value {
            Value::Name(name) if name == "First" => Some(YarnVertex::First),
            Value::Name(name) if name == "Last" => Some(YarnVertex::Last),
            Value::Name(name) => {
                let message = format!("{} cannot be `{name}`", reading.subject());
                reading.problem(
                    ProblemKind::UnknownName,
                    node.span,
                    message,
                    "write `First`, `Last` or a whole number",
                );
                None
            }
            _ => usize::decode(node, spec, reading).map(YarnVertex::At),
        }
    }

    fn encode(&self, spec: &Spec, units: Units) -> Node {
        match self {
            YarnVertex::First => Node::made(Value::Name("First".to_owned())),
            YarnVertex::Last => Node::made(Value::Name("Last".to_owned())),
            YarnVertex::At(vertex) => vertex.encode(spec, units),
        }
    }

    fn describe(_book: &mut Book) -> Kind {
        Kind::Words("`First`, `Last` or a whole number")
    }
}

section! {
    /// A vertex of one of the yarns.
    pub struct YarnPlace {
        /// Yarn, counted over all groups in order.
        yarn: usize = [required] () "";
        /// Vertex along the yarn.
        vertex: YarnVertex = [YarnVertex::Last] () "";
    }
}

choice! {
    /// Where a pin sits.
    pub enum PinPlace {
        /// At a point.
        Point(Vector3<f64>) (Length);
        /// Where a vertex is at the start.
        Vertex(YarnPlace) ();
    }
}

section! {
    /// A box in which the grid is held, or led by a script; every yarn that passes there is held with it.
    pub struct YarnPin {
        /// Its centre.
        at: PinPlace = [required] () "";
        /// Half of its sides; default: 1.5 cells.
        half_size: Option<Vector3<f64>> = [None] (Length, at_least(0.0)) "Below 1.5 cells a yarn is held only in part.";
        /// Motion.
        motion: Script = [Script::still()] () "";
    }
}

section! {
    /// A vertex that is held, or led by a script.
    pub struct YarnDrive {
        /// Yarn, counted over all groups in order.
        yarn: usize = [required] () "";
        /// Vertex along the yarn.
        vertex: YarnVertex = [required] () "";
        /// Motion; empty holds the vertex.
        motion: Script = [Script::still()] () "";
    }
}

choice! {
    /// What a side of the domain does to yarns.
    pub enum YarnWall {
        /// Nothing: a yarn that leaves there stops the run.
        Open;
        /// Holds them.
        Stick;
        /// Lets them slide along, not away.
        Slip;
        /// Lets them slide along and away.
        Separate;
        /// Lets them away, and rubs with this coefficient.
        Friction(f64) (Number, at_least(0.0).up_to(10.0));
    }
}

section! {
    /// The box that the yarns live in. Each side is a whole number of cells.
    pub struct YarnDomain {
        /// Low corner.
        low: Vector3<f64> = [required] (Length) "";
        /// High corner.
        high: Vector3<f64> = [required] (Length) "";
        /// What its sides do.
        walls: YarnWall = [YarnWall::Stick] () "";
        /// The side of low x, where it differs.
        left: Option<YarnWall> = [None] () "";
        /// The side of high x, where it differs.
        right: Option<YarnWall> = [None] () "";
        /// The side of low y, where it differs.
        bottom: Option<YarnWall> = [None] () "";
        /// The side of high y, where it differs.
        top: Option<YarnWall> = [None] () "";
        /// The side of low z, where it differs.
        back: Option<YarnWall> = [None] () "";
        /// The side of high z, where it differs.
        front: Option<YarnWall> = [None] () "";
        /// Thickness of the walls in cells.
        layers: usize = [3] (Number, at_least(1.0).up_to(1e4)) "3 keep whole stencils in the wall.";
    }
}

section! {
    /// A point of a path.
    pub struct PathPoint {
        /// When.
        time: f64 = [required] (Time) "";
        /// Where.
        at: Vector3<f64> = [required] (Length) "";
    }
}

section! {
    /// A path through given points, at rest before the first and after the last.
    pub struct PathPoints {
        /// The points, in order of time.
        points: Vec<PathPoint> = [required] () "";
        /// Rounds the path with continuous velocity (Catmull–Rom) instead of straight lines.
        smooth: bool = [false] () "";
    }
}

section! {
    /// An ellipse in the x–y plane, run through at constant angular velocity.
    pub struct PathOrbit {
        /// Centre.
        center: Vector3<f64> = [required] (Length) "";
        /// Half axis along x.
        radius_x: f64 = [required] (Length) "";
        /// Half axis along y.
        radius_y: f64 = [required] (Length) "";
        /// Angular velocity.
        rate: f64 = [required] (AngularVelocity) "";
        /// Angle at the start.
        phase: f64 = [0.0] (Angle) "";
    }
}

section! {
    /// A straight line at constant velocity.
    pub struct PathLine {
        /// Where it starts.
        from: Vector3<f64> = [required] (Length) "";
        /// Velocity.
        velocity: Vector3<f64> = [required] (Velocity) "";
    }
}

choice! {
    /// A moving point.
    pub enum AttractorPath {
        /// At rest.
        Fixed(Vector3<f64>) (Length);
        /// Through points.
        Points(PathPoints) ();
        /// On an ellipse.
        Orbit(PathOrbit) ();
        /// On a line.
        Line(PathLine) ();
    }
}

section! {
    /// A strength at a moment.
    pub struct StrengthKey {
        /// When.
        time: f64 = [required] (Time) "";
        /// Acceleration far from the point.
        strength: f64 = [required] (Acceleration) "";
    }
}

choice! {
    /// How strong an attractor is over time.
    pub enum AttractorStrength {
        /// Always the same; negative repels.
        Constant(f64) (Acceleration);
        /// Linear between given moments.
        Keys(Vec<StrengthKey>) ();
    }
}

section! {
    /// An acceleration `s (p − x)/(|p − x| + softening)` towards a moving point: the note's mouse, made repeatable.
    pub struct YarnAttractor {
        /// Where it is.
        path: AttractorPath = [required] () "";
        /// How strong it is.
        strength: AttractorStrength = [required] () "";
        /// Length over which the pull fades near the point.
        softening: f64 = [0.01] (Length, above(0.0)) "";
    }
}

section! {
    /// How implicit steps are solved.
    pub struct YarnNewton {
        /// Residual at which Newton stops, over the change of momentum it started from.
        tolerance: f64 = [1e-4] (Number, at_least(1e-12).up_to(0.1)) "";
        /// Newton iterations after which the step is rejected.
        max_newton: usize = [40] (Number, at_least(1.0).up_to(1e4)) "";
        /// Conjugate-gradient iterations in each.
        max_cg: usize = [400] (Number, at_least(1.0).up_to(1e6)) "";
    }
}

choice! {
    /// How the grid velocities are advanced.
    pub enum YarnIntegrator {
        /// Symplectic Euler: cheap steps, bounded by the fastest wave.
        Explicit;
        /// Backward Euler: steps bounded by motion alone; damps waves that the step does not resolve.
        Implicit(YarnNewton) ();
    }
}

choice! {
    /// What happens to a step that is larger than the yarns allow (a `Fixed` one, say).
    pub enum OversizedYarnStep {
        /// It is divided into at most this many equal parts.
        Divide(usize) (Number, at_least(1.0).up_to(1e9));
        /// It is refused.
        Refuse;
    }
}

section! {
    /// Yarns by the material point method: contact and friction come from the material, nothing looks for contacts. A scene of
    /// its own kind, without strands, liquid or grains; `solids` are its obstacles, `gravity` acts on it.
    pub struct Yarns {
        /// Plane or space. In the plane z is left out of everything, and all quantities are per metre of depth.
        dimensions: Dimensions = [Dimensions::Three] () "";
        /// Edge of a cell of the grid.
        cell: f64 = [required] (Length, above(0.0)) "The resolution of everything: yarns touch from about one cell on.";
        /// The yarns.
        groups: Vec<YarnGroup> = [required] () "";
        /// Box with walls; default: open space.
        domain: Option<YarnDomain> = [None] () "";
        /// Attractor; default: none.
        attractor: Option<YarnAttractor> = [None] () "";
        /// Boxes in which the grid is held or led.
        pins: Vec<YarnPin> = [Vec::new()] () "";
        /// Vertices that are held or led.
        drives: Vec<YarnDrive> = [Vec::new()] () "";
        /// How velocities are advanced.
        integrator: YarnIntegrator = [YarnIntegrator::Explicit] () "";
        /// Share of the proved stability limit that explicit steps use.
        safety: f64 = [0.7] (Number, at_least(0.01).up_to(1.0)) "";
        /// Cells that a vertex, solid, pin or drive may cross in one step.
        motion: f64 = [0.3] (Number, at_least(0.01).up_to(1.0)) "";
        /// What happens to larger steps.
        oversized: OversizedYarnStep = [OversizedYarnStep::Divide(1000)] () "";
        /// Friction and separation of yarns.
        plastic: bool = [true] () "Without, yarns are elastic and stick.";
        /// Share of the mass in the middle of segments.
        middle_mass: f64 = [0.5] (Number, at_least(0.0).up_to(0.9)) "0 keeps angular momentum exactly and loses forces on nodes without mass.";
        /// Gives the momentum that the middles of segments gather back to the vertices.
        hand_back: bool = [true] () "Keeps momentum to round-off; without, it drifts by a per cent.";
        /// Share of the symmetric part of the affine velocity kept per step.
        affine_damping: f64 = [1.0] (Number, at_least(0.0).up_to(1.0)) "1 damps least, 0 most.";
        /// Smallest stretch of a cross-section; flatter ones are lifted to it and counted.
        min_section: f64 = [0.05] (Number, at_least(1e-3).up_to(0.9)) "Smaller needs smaller steps under hard compression.";
        /// Puts vertices found inside a solid on its surface after each step.
        push_out: bool = [false] () "The depth is recorded either way.";
        /// Follows the printed note (two dimensions), with its faults: to compare, not to use.
        compat: bool = [false] () "";
    }
}
