//! Axis-aligned boxes.

use crate::Vector3;

/// A closed axis-aligned box [m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest coordinates [m].
    pub min: [f64; 3],
    /// Largest coordinates [m].
    pub max: [f64; 3],
}

impl Aabb {
    /// The box that holds nothing; grows by [`Aabb::include`] and [`Aabb::merge`].
    pub const EMPTY: Aabb = Aabb { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };

    /// The box around one point with a margin on every side [m]. What is not finite makes a box that is not valid.
    #[must_use]
    pub fn around(point: &Vector3, margin: f64) -> Aabb {
        Aabb::around_segment(point, point, margin)
    }

    /// The box around a segment with a margin (its radius, say) on every side [m]. What is not finite makes a box that is not
    /// valid.
    #[must_use]
    pub fn around_segment(a: &Vector3, b: &Vector3, margin: f64) -> Aabb {
        // `min` and `max` pass over NaN in silence; the zero product does not.
        let poison = |k: usize| 0.0 * (a[k] + b[k]);
        Aabb {
            min: std::array::from_fn(|k| a[k].min(b[k]) - margin + poison(k)),
            max: std::array::from_fn(|k| a[k].max(b[k]) + margin + poison(k)),
        }
    }

    /// Grows the box to hold a point.
    pub fn include(&mut self, point: &Vector3) {
        for k in 0..3 {
            self.min[k] = self.min[k].min(point[k]);
            self.max[k] = self.max[k].max(point[k]);
        }
    }

    /// The smallest box that holds both.
    #[must_use]
    pub fn merge(&self, other: &Aabb) -> Aabb {
        let mut merged = *self;
        for k in 0..3 {
            merged.min[k] = merged.min[k].min(other.min[k]);
            merged.max[k] = merged.max[k].max(other.max[k]);
        }
        merged
    }

    /// The box with every side moved outward [m].
    #[must_use]
    pub fn inflated(&self, margin: f64) -> Aabb {
        Aabb { min: self.min.map(|x| x - margin), max: self.max.map(|x| x + margin) }
    }

    /// Whether the boxes share a point (touching counts).
    #[inline]
    #[must_use]
    pub fn overlaps(&self, other: &Aabb) -> bool {
        // Without short circuit: six comparisons cost less than one missed branch.
        (self.min[0] <= other.max[0])
            & (other.min[0] <= self.max[0])
            & (self.min[1] <= other.max[1])
            & (other.min[1] <= self.max[1])
            & (self.min[2] <= other.max[2])
            & (other.min[2] <= self.max[2])
    }

    /// Whether the point lies in the box.
    #[must_use]
    pub fn contains(&self, point: &Vector3) -> bool {
        (0..3).all(|k| self.min[k] <= point[k] && point[k] <= self.max[k])
    }

    /// Middle of the box [m].
    #[must_use]
    pub fn center(&self) -> Vector3 {
        Vector3::from_fn(|k, _| 0.5 * (self.min[k] + self.max[k]))
    }

    /// Longest side [m].
    #[must_use]
    pub fn longest_side(&self) -> f64 {
        (0..3).map(|k| self.max[k] - self.min[k]).fold(0.0, f64::max)
    }

    /// Whether all six numbers are finite and in order.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        (0..3).all(|k| self.min[k].is_finite() && self.max[k].is_finite() && self.min[k] <= self.max[k])
    }
}
