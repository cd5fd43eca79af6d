//! From nothing to a sample in the rheometer: packing, relaxation, links, particles, plates.
//!
//! ```text
//! packing    random discs of two sizes
//! schedule   step sizes and the order of all operations, as a program that can be saved at any step
//! cutting    Voronoi cells or straight lines cut the links into particles
//! links      connected components, bridges, removal of non-essential links, joining of isolated grains
//! ```

mod cutting;
pub mod links;
mod packing;
pub mod schedule;

pub use cutting::cut_into_particles;
pub use packing::random_packing;

use crate::error::{GranularError, require};
use serde::{Deserialize, Serialize};

/// How the cross-linked sample is cut into particles.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Cut {
    /// Not at all: one body.
    None,
    /// Every grain belongs to the nearest of random points.
    Voronoi {
        /// Number of points [-]; 0 and 1 leave one body.
        points: usize,
        /// Random addition to the distance, in largest radii [-]; larger interlocks particles more.
        edge_fuzziness: f64,
    },
    /// Straight lines through random points.
    Lines {
        /// Number of lines.
        count: usize,
        /// Cuts closer to the horizontal than this are drawn again [degrees], 0 … 80.
        avoid_horizontal: f64,
    },
}

impl Default for Cut {
    fn default() -> Self {
        Self::Voronoi { points: 5, edge_fuzziness: 0.0 }
    }
}

impl Cut {
    /// Number of points or lines.
    pub fn count(&self) -> usize {
        match *self {
            Self::None => 0,
            Self::Voronoi { points, .. } => points,
            Self::Lines { count, .. } => count,
        }
    }
}

/// How the sample is prepared.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PreparationSettings {
    /// Cross-links all contacts after the first relaxation.
    pub links: bool,
    /// How the cross-linked sample is cut.
    pub cut: Cut,
    /// Cuts along the plates as well.
    pub cut_top_bottom: bool,
    /// Draws the cuts again while a particle is taller than 0.9 of the box; without effect for fewer than two points or one line.
    pub avoid_tall: bool,
    /// Fraction of the remaining links to remove at random where connection is kept otherwise [-], 0 … 1.
    pub remove_links: f64,
    /// Length of all relaxations relative to the published ones [-], 0.01 … 100; below 1 the sample keeps stress and moves.
    pub relaxation: f64,
}

impl Default for PreparationSettings {
    fn default() -> Self {
        Self {
            links: true,
            cut: Cut::default(),
            cut_top_bottom: false,
            avoid_tall: true,
            remove_links: 0.0,
            relaxation: 1.0,
        }
    }
}

impl PreparationSettings {
    /// Checks every field.
    ///
    /// # Errors
    /// [`GranularError::Setting`] naming the first field out of range.
    pub fn check(&self) -> Result<(), GranularError> {
        require("remove_links", self.remove_links, |v| (0.0..=1.0).contains(&v), "0 … 1")?;
        require("relaxation", self.relaxation, |v| (0.01..=100.0).contains(&v), "0.01 … 100")?;
        match self.cut {
            Cut::Voronoi { edge_fuzziness, .. } => {
                require("edge_fuzziness", edge_fuzziness, |v| (0.0..=100.0).contains(&v), "0 … 100")
            }
            Cut::Lines { avoid_horizontal, .. } => {
                require("avoid_horizontal", avoid_horizontal, |v| (0.0..=80.0).contains(&v), "0 … 80 degrees")
            }
            Cut::None => Ok(()),
        }
    }
}
