//! Walls, obstacles, pins and driven vertices.

use geometry::{Motion, ShapeDescription};
use serde::{Deserialize, Serialize};

use super::{YarnSettings, positive, range};
use crate::YarnError;

/// What a wall allows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum WallKind {
    /// No wall.
    Open,
    /// Nothing moves at the wall.
    #[default]
    Stick,
    /// No motion through the wall in either direction; free along it.
    Slip,
    /// No motion into the wall; free along it and away from it.
    Separate,
    /// As `Separate`, with Coulomb friction along the wall.
    Friction(
        /// Coefficient, not negative.
        f64,
    ),
}

/// Walls on the sides of the domain.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum WallSettings {
    /// The same on all sides.
    All(WallKind),
    /// Low and high side of each direction.
    Sides(Vec<(WallKind, WallKind)>),
    /// Open on all sides: a vertex that leaves the domain stops the run.
    #[default]
    Open,
}

impl WallSettings {
    /// Wall on the low (`false`) or high (`true`) side of a direction.
    #[must_use]
    pub fn side(&self, axis: usize, high: bool) -> WallKind {
        match self {
            Self::All(kind) => *kind,
            Self::Sides(sides) => {
                let (low_wall, high_wall) = sides[axis];
                if high { high_wall } else { low_wall }
            }
            Self::Open => WallKind::Open,
        }
    }
}

/// The box that the yarns must stay in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DomainSettings {
    /// Low corner [m]; grid nodes lie at `origin + i cell`.
    pub origin: Vec<f64>,
    /// Number of cells per direction.
    pub cells: Vec<usize>,
    /// Walls.
    #[serde(default)]
    pub walls: WallSettings,
    /// Thickness of the walls in node layers, from 1. Three keep whole stencils on the wall.
    #[serde(default = "three")]
    pub layers: usize,
}

fn three() -> usize {
    3
}

impl DomainSettings {
    pub(super) fn check(&self, settings: &YarnSettings) -> Result<(), YarnError> {
        settings.vector("domain.origin", &self.origin)?;
        if self.cells.len() != settings.dimension || self.cells.iter().any(|&c| !(4..=1 << 20).contains(&c)) {
            return Err(YarnError::setting(
                "domain.cells",
                format!("needs {} numbers from 4 to 1048576, has {:?}", settings.dimension, self.cells),
            ));
        }
        if let WallSettings::Sides(sides) = &self.walls
            && sides.len() != settings.dimension
        {
            return Err(YarnError::setting("domain.walls", "needs a (low, high) pair per direction"));
        }
        if self.layers == 0 || self.cells.iter().any(|&c| 2 * self.layers > c) {
            return Err(YarnError::setting("domain.layers", "must be at least 1 and leave room between the walls"));
        }
        for axis in 0..settings.dimension {
            for high in [false, true] {
                if let WallKind::Friction(friction) = self.walls.side(axis, high) {
                    range("domain.walls", friction, 0.0, f64::MAX)?;
                }
            }
        }
        Ok(())
    }
}

/// A solid body. In 2-D the shape is cut by the plane `z = 0` and should be symmetric about it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObstacleSettings {
    /// Shape at rest.
    pub shape: ShapeDescription,
    /// Script of its motion.
    #[serde(default)]
    pub motion: Motion,
    /// Coulomb coefficient, not negative.
    #[serde(default = "default_friction")]
    pub friction: f64,
    /// Share of the approach velocity that is returned, 0 to 1.
    #[serde(default)]
    pub restitution: f64,
}

fn default_friction() -> f64 {
    0.3
}

impl ObstacleSettings {
    pub(super) fn check(&self, path: &str) -> Result<(), YarnError> {
        range(&format!("{path}.friction"), self.friction, 0.0, f64::MAX)?;
        range(&format!("{path}.restitution"), self.restitution, 0.0, 1.0)
    }
}

/// Where a pin sits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum PinPlace {
    /// At a point [m].
    Point(Vec<f64>),
    /// Where a vertex is at the start; negative vertices count from the end of the yarn.
    Vertex {
        /// Yarn in scene order.
        yarn: usize,
        /// Vertex along the yarn.
        vertex: i64,
    },
}

/// A place where the grid nodes are held, or led along a script. Every yarn that passes there feels it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pin {
    /// Where.
    pub at: PinPlace,
    /// Half width of the held region in cells, 0.5 to 100; 1.5 holds the whole stencil of the point.
    #[serde(default = "default_half_width")]
    pub half_width: f64,
    /// Half of each side of the held box [m], where it is not a cube of `half_width`; empty: a cube.
    #[serde(default)]
    pub half_size: Vec<f64>,
    /// Script of its motion, from the place above.
    #[serde(default)]
    pub motion: Motion,
}

fn default_half_width() -> f64 {
    1.5
}

impl Pin {
    pub(crate) fn check(&self, path: &str) -> Result<(), YarnError> {
        range(&format!("{path}.half_width"), self.half_width, 0.5, 100.0)?;
        positive(&format!("{path}.half_width"), self.half_width)?;
        self.motion.check().map_err(|e| YarnError::setting(format!("{path}.motion"), e.to_string()))
    }
}

/// A vertex whose motion is prescribed after each grid step. Neighbours feel it through the yarn's tension and, from the next
/// step on, through the grid; to hold the grid itself use a [`Pin`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drive {
    /// Yarn in scene order.
    pub yarn: usize,
    /// Vertex along the yarn; negative counts from the end.
    pub vertex: i64,
    /// Script, from the vertex's initial position; empty holds it there.
    #[serde(default)]
    pub motion: Motion,
}
