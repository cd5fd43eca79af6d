//! What a run records, and when.

use super::declare::{choice, section};
use super::motion::Axis;
use super::quantity::{above, at_least};
use super::yarn::YarnVertex;
use nalgebra::Vector3;

choice! {
    /// When something is recorded. The start and the end always are, except with `Never`.
    pub enum Clock {
        /// Every so many seconds.
        Every(f64) (Time, above(0.0));
        /// Every so many steps.
        Steps(u64) (Number, at_least(1.0));
        /// At given times.
        At(Vec<f64>) (Time, at_least(0.0));
        /// So many times over the run, evenly.
        Count(u64) (Number, at_least(1.0));
        /// Not at all.
        Never;
    }
}

choice! {
    /// A file format of frames.
    pub enum Format {
        /// VTK XML, for ParaView.
        Vtk;
        /// Binary PLY, for Houdini and Blender.
        Ply;
    }
}

section! {
    /// A vertex of a strand whose place and velocity go into the series.
    pub struct VertexProbe {
        /// Name of the column.
        name: Option<String> = [None] () "";
        /// Strand, counted over all groups in order.
        strand: usize = [required] () "";
        /// Vertex; default: the tip.
        vertex: Option<usize> = [None] () "";
    }
}

section! {
    /// A point in space whose liquid velocity, pressure and stress go into the series.
    pub struct PointProbe {
        /// Name of the column.
        name: Option<String> = [None] () "";
        /// Where.
        at: Vector3<f64> = [required] (Length) "";
    }
}

section! {
    /// A vertex of a yarn whose place and velocity go into the series.
    pub struct YarnProbe {
        /// Name of the column.
        name: Option<String> = [None] () "";
        /// Yarn, counted over all groups in order.
        yarn: usize = [required] () "";
        /// Vertex along the yarn.
        vertex: YarnVertex = [YarnVertex::Last] () "";
    }
}

choice! {
    /// Something that is followed step by step.
    pub enum Probe {
        /// A vertex of a strand.
        Vertex(VertexProbe) ();
        /// A point in space.
        Point(PointProbe) ();
        /// A vertex of a yarn.
        Yarn(YarnProbe) ();
    }
}

section! {
    /// A plane in which frames show the liquid on its grid: speed, velocity, pressure, liquid fraction, volume ratio.
    pub struct Slice {
        /// Name, for files.
        name: Option<String> = [None] () "";
        /// Direction of the normal: `X`, `Y` or `Z`; in two dimensions the plane itself is shown.
        normal: Axis = [Axis::z()] () "";
        /// Place of the plane along its normal.
        at: f64 = [0.0] (Length) "";
    }
}

section! {
    /// What is recorded.
    pub struct Output {
        /// Frames for viewing.
        frames: Clock = [Clock::Count(100)] () "The main user of disk space; see `viscose check`.";
        /// Formats of the frames.
        formats: Vec<Format> = [vec![Format::Vtk]] () "";
        /// Rows of `series.csv`.
        series: Clock = [Clock::Steps(1)] () "";
        /// Checkpoints, from which a run can go on.
        checkpoint: Clock = [Clock::Count(20)] () "A run that is cut short loses at most the time since the last one.";
        /// How many checkpoints are kept.
        keep: usize = [2] (Number, at_least(1.0).up_to(1e6)) "With 2 a damaged one does not lose the run.";
        /// Vertices and points followed step by step.
        probes: Vec<Probe> = [Vec::new()] () "";
        /// Cuts through the liquid that frames show.
        slices: Vec<Slice> = [Vec::new()] () "";
    }
}
