//! Strands as detection sees them, and its settings.

use crate::block::{Vec3, dot};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Strands as polylines of capsules. Vertices of all strands lie back to back.
#[derive(Clone, Copy, Debug)]
pub struct Strands<'a> {
    /// Vertex positions at the start of the step [m].
    pub start: &'a [Vec3],
    /// Vertex positions the step would reach without contact [m].
    pub end: &'a [Vec3],
    /// First vertex of each strand, then the number of vertices: one more entry than strands.
    pub first_vertex: &'a [u32],
    /// Radius of each edge, stored at its first vertex [m]; the entry of a strand's last vertex has no meaning.
    pub radius: &'a [f64],
}

/// How far edges see each other beyond touching: liquid joins strands across a gap.
#[derive(Clone, Copy)]
pub struct Sight<'a> {
    /// Reach of each edge beyond its surface, stored at its first vertex [m].
    pub reach: &'a [f64],
    /// Whether a gap \[m\] between two edges, given as strand and edge, matters, of those that both reach across; the first comes
    /// first in the order of strands. Must give the same answer throughout a step.
    pub matters: &'a (dyn Fn((u32, u32), (u32, u32), f64) -> bool + Sync),
}

/// Settings of detection.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DetectionSettings {
    /// Gap below which two strands count as near, in radii of the thinner [1], ≥ 0. Larger: more contacts ready before
    /// they are needed, more work.
    pub proximity: f64,
    /// Most contacts per edge, nearest first [contacts].
    pub max_per_edge: usize,
    /// Arc length between two points of one strand below which they never touch, in sums of their radii [1]; adjacent edges
    /// never do. A strand cannot fold tighter than half a turn around its own radius, which is `π/2` sums.
    pub self_exclusion: f64,
    /// Follow fast motion through the step; without it only the start is looked at.
    pub continuous: bool,
    /// Strands against strands at all.
    pub strand_strand: bool,
}

impl Default for DetectionSettings {
    fn default() -> Self {
        DetectionSettings {
            proximity: 0.1,
            max_per_edge: 6,
            self_exclusion: std::f64::consts::FRAC_PI_2,
            continuous: true,
            strand_strand: true,
        }
    }
}

/// Why detection cannot run.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum DetectionError {
    /// Arrays that do not belong together.
    #[error("strand arrays do not fit: {0}")]
    Shape(&'static str),
    /// A position or radius is not finite.
    #[error("vertex {vertex} has no finite position or radius")]
    NotFinite {
        /// Which vertex, counted over all strands.
        vertex: usize,
    },
}

impl Strands<'_> {
    /// Number of strands.
    #[must_use]
    pub fn count(&self) -> usize {
        self.first_vertex.len().saturating_sub(1)
    }

    /// Checks lengths, order and finiteness.
    ///
    /// # Errors
    /// The first thing found wrong.
    pub fn check(&self) -> Result<(), DetectionError> {
        let n = self.start.len();
        if self.end.len() != n || self.radius.len() != n {
            return Err(DetectionError::Shape("start, end and radius differ in length"));
        }
        let ordered = self.first_vertex.windows(2).all(|w| w[0] <= w[1]);
        if !ordered
            || self.first_vertex.first().is_some_and(|f| *f != 0)
            || self.first_vertex.last().is_some_and(|l| *l as usize != n)
            || (self.first_vertex.is_empty() && n > 0)
        {
            return Err(DetectionError::Shape(
                "first_vertex must start at 0, ascend and end at the number of vertices",
            ));
        }
        for v in 0..n {
            let finite = (0..3).all(|c| self.start[v][c].is_finite() && self.end[v][c].is_finite());
            if !finite || !(self.radius[v] >= 0.0 && self.radius[v].is_finite()) {
                return Err(DetectionError::NotFinite { vertex: v });
            }
        }
        Ok(())
    }
}

/// Radius of an elliptic cross-section towards a contact: support of the ellipse in the direction of the normal.
///
/// - `half_axes`: half-widths `(a, b)` [m]
/// - `major`: unit direction of `a`, across the strand
/// - `tangent`: unit tangent of the strand
/// - `normal`: contact normal
#[must_use]
pub fn effective_radius(half_axes: (f64, f64), major: &Vec3, tangent: &Vec3, normal: &Vec3) -> f64 {
    let along = dot(normal, tangent);
    let across = [0, 1, 2].map(|c| normal[c] - along * tangent[c]);
    let l = dot(&across, &across).sqrt();
    if l < 1e-9 {
        return half_axes.0.max(half_axes.1);
    }
    let cos = (dot(&across, major) / l).clamp(-1.0, 1.0);
    (half_axes.0 * half_axes.0 * cos * cos + half_axes.1 * half_axes.1 * (1.0 - cos * cos)).sqrt()
}
