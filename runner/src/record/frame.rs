//! What one moment of a run looks like, whatever the physics: pieces of points, lines or triangles with named fields.
//!
//! Systems build a [`Frame`]; writers (`vtk`, `ply`), the picture renderer and the report read it. SI throughout.

use serde::{Deserialize, Serialize};

/// The visible state at one moment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Simulated time [s].
    pub time: f64,
    /// Steps accepted so far.
    pub step: u64,
    /// Parts of the picture, each with one topology and one set of fields.
    pub pieces: Vec<Piece>,
}

/// One part of a frame: `strands`, `particles`, `contacts`, `solids`, `grains`, `links`, `yarns`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Piece {
    /// Name used for files and colours.
    pub name: String,
    /// How the points hang together.
    pub topology: Topology,
    /// Positions [m], one per point; two-dimensional systems put zero in the third place.
    pub positions: Vec<[f64; 3]>,
    /// Values per point (`id`, `radius` [m], `velocity` [m/s] …).
    pub point_fields: Vec<Field>,
    /// Values per cell: per line for polylines and segments, per triangle for meshes, empty for points.
    pub cell_fields: Vec<Field>,
}

/// How the points of a piece hang together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Topology {
    /// Loose points.
    Points,
    /// Lines: line `i` is `positions[offsets[i]..offsets[i + 1]]`.
    Polylines {
        /// One more entry than lines, first entry zero.
        offsets: Vec<u32>,
    },
    /// Pairs of points.
    Segments(Vec<[u32; 2]>),
    /// Triangles, counter-clockwise seen from outside.
    Triangles(Vec<[u32; 3]>),
    /// Points of a regular lattice, x fastest: an image.
    Lattice {
        /// First point [m].
        origin: [f64; 3],
        /// Distance of neighbours [m].
        spacing: f64,
        /// Points along each direction.
        counts: [u32; 3],
    },
}

/// A named value on every point or cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Field {
    /// Name as it appears in files, with the SI unit in the documentation of the system that writes it.
    pub name: String,
    /// Numbers per point or cell: 1 scalar, 3 vector, 9 tensor (row by row).
    pub components: usize,
    /// The numbers, point after point.
    pub values: FieldValues,
}

/// The numbers of a field.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum FieldValues {
    /// Real numbers.
    F64(Vec<f64>),
    /// Whole numbers (identities, states).
    I64(Vec<i64>),
}

impl Field {
    /// A real scalar field.
    #[must_use]
    pub fn scalar(name: &str, values: Vec<f64>) -> Field {
        Field { name: name.to_owned(), components: 1, values: FieldValues::F64(values) }
    }

    /// A whole-number field.
    #[must_use]
    pub fn integer(name: &str, values: Vec<i64>) -> Field {
        Field { name: name.to_owned(), components: 1, values: FieldValues::I64(values) }
    }

    /// A vector field, one triple per point or cell.
    #[must_use]
    pub fn vector(name: &str, values: &[[f64; 3]]) -> Field {
        Field { name: name.to_owned(), components: 3, values: FieldValues::F64(values.as_flattened().to_vec()) }
    }

    /// How many points or cells the field covers.
    #[must_use]
    pub fn count(&self) -> usize {
        let numbers = match &self.values {
            FieldValues::F64(values) => values.len(),
            FieldValues::I64(values) => values.len(),
        };
        numbers / self.components.max(1)
    }
}

impl Piece {
    /// The point field of that name.
    #[must_use]
    pub fn point_field(&self, name: &str) -> Option<&Field> {
        self.point_fields.iter().find(|field| field.name == name)
    }

    /// How many cells (lines, segments, triangles) the piece has; zero for loose points.
    #[must_use]
    pub fn cell_count(&self) -> usize {
        match &self.topology {
            Topology::Points | Topology::Lattice { .. } => 0,
            Topology::Polylines { offsets } => offsets.len().saturating_sub(1),
            Topology::Segments(pairs) => pairs.len(),
            Topology::Triangles(triangles) => triangles.len(),
        }
    }
}
