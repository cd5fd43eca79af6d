//! How much a group will make, without making it.

use super::{YarnGroup, YarnShape};

impl YarnGroup {
    /// Number of yarns and, within a few per cent for textiles, of vertices on a grid of the given cell [m].
    ///
    /// As real numbers, so that absurd requests are seen before anything is allocated.
    #[must_use]
    pub fn size(&self, cell: f64) -> (f64, f64) {
        let segment = self.segment_length.unwrap_or(0.5 * cell);
        let vertices = |length: f64| (length / segment).round().max(1.0) + 1.0;
        let between =
            |from: &[f64], to: &[f64]| from.iter().zip(to).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
        let alike = |count: f64, length: f64| (count, count * vertices(length));
        match &self.shape {
            YarnShape::Line { from, to } => alike(1.0, between(from, to)),
            YarnShape::Lines { from, to, count, .. } => alike(*count as f64, between(from, to)),
            YarnShape::Circle { radius, sweep, .. } => {
                alike(1.0, radius * sweep.map_or(std::f64::consts::TAU, f64::abs))
            }
            YarnShape::Helix { from, to, radius, turns } => {
                alike(1.0, between(from, to).hypot(std::f64::consts::TAU * radius * turns))
            }
            YarnShape::Weave { count, spacing, amplitude, overhang, .. } => {
                let slope = std::f64::consts::PI * amplitude / spacing;
                let longer = (1.0 + 0.5 * slope * slope).sqrt();
                let ends = 2.0 * overhang.unwrap_or(0.5 * spacing);
                let length = |others: usize| ((others as f64 - 1.0) * spacing + ends) * longer;
                let (warps, wefts) = (count.0 as f64, count.1 as f64);
                (warps + wefts, warps * vertices(length(count.1)) + wefts * vertices(length(count.0)))
            }
            YarnShape::Knit { rows, loops, width, height, depth, .. } => {
                // Arc length of one loop, by the chords of a fine polygon.
                let point = |t: f64| {
                    let x = width * t / std::f64::consts::TAU + 0.25 * width * (2.0 * t).sin();
                    [x, height * t.cos(), depth * (2.0 * t).cos()]
                };
                let fine = 64;
                let at = |i: i32| point(std::f64::consts::TAU * f64::from(i) / f64::from(fine));
                let one: f64 = (0..fine).map(|i| between(&at(i), &at(i + 1))).sum();
                alike(*rows as f64, *loops as f64 * one)
            }
            YarnShape::HairBall { count, length, .. } | YarnShape::CutPile { count, length, .. } => {
                alike(*count as f64, *length)
            }
            YarnShape::Polyline { points, .. } => (1.0, points.len() as f64),
            YarnShape::Polylines { yarns } => (yarns.len() as f64, yarns.iter().map(|y| y.len() as f64).sum()),
        }
    }
}
