//! Bridges between cylinders of different radius or contact angle, and between a cylinder and a wall.
//!
//! Unknowns `(α₁, α₂, 1/R)`: both contact points lie on one arc that meets each surface at its contact angle, and the
//! liquid has the given area. Written with the inclination `φ_i = θ_i + α_i` of the meniscus at each end against the axis
//! that joins the centres; the arc turns by `φ₁ + φ₂ − π` and stays regular when that is zero (flat meniscus).

use super::bridge::{Bridge, arc_over_chord, segment_shape};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// One side of a bridge.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Side {
    /// Radius [m]; infinite for a wall.
    pub radius: f64,
    /// Contact angle [rad].
    pub contact_angle: f64,
}

/// A bridge between two parallel surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct UnequalBridge {
    /// Both sides; the second may be a wall (infinite radius), the first not.
    pub sides: [Side; 2],
    /// Shortest distance of the surfaces [m]; negative counts as touching.
    pub clearance: f64,
}

/// Solved bridge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnequalMeniscus {
    /// Wetting half-angle on the first side [rad].
    pub first_angle: f64,
    /// Wetting half-angle on the second side [rad]; on a wall half the wetted width [m].
    pub second: f64,
    /// Attraction per length over surface tension [1].
    pub force: f64,
    /// Area held [m²].
    pub area: f64,
    /// Surface energy per length over surface tension, up to a constant [m].
    pub energy: f64,
}

/// Height and axial depth of a contact point, circular segment between chord and surface, inclination of the meniscus.
struct End {
    height: f64,
    depth: f64,
    segment: f64,
    inclination: f64,
}

impl UnequalBridge {
    /// `second` is the wetting angle on a cylinder, half the wetted width on a wall.
    fn end(&self, side: usize, value: f64) -> End {
        let s = self.sides[side];
        if s.radius.is_finite() {
            End {
                height: s.radius * value.sin(),
                depth: s.radius * (1.0 - value.cos()),
                segment: 0.5 * s.radius * s.radius * (2.0 * value - (2.0 * value).sin()),
                inclination: s.contact_angle + value,
            }
        } else {
            End { height: value, depth: 0.0, segment: 0.0, inclination: s.contact_angle }
        }
    }

    fn measures(&self, first: f64, second: f64) -> UnequalMeniscus {
        let (a, b) = (self.end(0, first), self.end(1, second));
        let axial = self.clearance.max(0.0) + a.depth + b.depth;
        let chord = axial.hypot(b.height - a.height);
        // half-angle of the arc, positive when the meniscus bulges inward
        let delta = 0.5 * (PI - a.inclination - b.inclination);
        let area = axial * (a.height + b.height) - a.segment - b.segment - 0.5 * chord * chord * segment_shape(delta);
        let curvature = if chord > 0.0 { 2.0 * delta.sin() / chord } else { 0.0 };
        let force = 2.0 * a.inclination.sin() + 2.0 * a.height * curvature;
        let wetted = |side: usize, value: f64| {
            let s = self.sides[side];
            2.0 * s.contact_angle.cos() * if s.radius.is_finite() { s.radius * value } else { value }
        };
        let energy = 2.0 * chord * arc_over_chord(delta) - wetted(0, first) - wetted(1, second);
        UnequalMeniscus { first_angle: first, second, force, area, energy }
    }

    /// Second wetting parameter that closes the arc for a first one, by bisection; `None` where none exists.
    fn second_of(&self, first: f64) -> Option<f64> {
        let a = self.end(0, first);
        let gap = |value: f64| -> f64 {
            let b = self.end(1, value);
            let axial = self.clearance.max(0.0) + a.depth + b.depth;
            let tilt = 0.5 * (a.inclination - b.inclination);
            // chord direction against the axis must equal the mean of the tangent directions at its ends
            (b.height - a.height) * tilt.cos() - axial * tilt.sin()
        };
        let s = self.sides[1];
        let (mut lo, mut hi) = if s.radius.is_finite() {
            (0.0, (PI - s.contact_angle) * (1.0 - 1e-9))
        } else {
            (0.0, 4.0 * (self.sides[0].radius + self.clearance.max(0.0)))
        };
        let (flo, fhi) = (gap(lo), gap(hi));
        if flo * fhi > 0.0 {
            return None;
        }
        for _ in 0..200 {
            let mid = 0.5 * (lo + hi);
            if mid <= lo || mid >= hi {
                break;
            }
            if gap(mid) * flo > 0.0 { lo = mid } else { hi = mid }
        }
        Some(0.5 * (lo + hi))
    }

    /// The meniscus that holds `area` [m²]; an area out of range is clamped. `None` only for a first side that is a wall.
    #[must_use]
    pub fn meniscus(&self, area: f64) -> Option<UnequalMeniscus> {
        if !self.sides[0].radius.is_finite() {
            return None;
        }
        let at = |first: f64| self.second_of(first).map(|second| self.measures(first, second));
        let top = (PI - self.sides[0].contact_angle) * (1.0 - 1e-9);
        // first closed arc from below, then bisection on the area, which grows with the wetting angle
        let steps = 256;
        let mut below: Option<UnequalMeniscus> = None;
        for i in 0..=steps {
            let Some(m) = at(top * i as f64 / steps as f64) else { continue };
            if m.area >= area {
                let Some(start) = below else { return Some(m) };
                let (mut lo, mut hi) = (start.first_angle, m.first_angle);
                let mut best = m;
                for _ in 0..100 {
                    let mid = 0.5 * (lo + hi);
                    if mid <= lo || mid >= hi {
                        break;
                    }
                    let Some(x) = at(mid) else { break };
                    if x.area < area {
                        lo = mid;
                    } else {
                        hi = mid;
                    }
                    best = x;
                }
                return Some(best);
            }
            below = Some(m);
        }
        below
    }

    /// Attraction per length over surface tension; zero for no liquid or where no bridge can form.
    #[must_use]
    pub fn force(&self, area: f64) -> f64 {
        let [a, b] = self.sides;
        if !(area > 0.0) {
            return 0.0;
        }
        if a == b && a.radius.is_finite() {
            let gap = 2.0 * a.radius + self.clearance;
            return Bridge { radius: a.radius, contact_angle: a.contact_angle, gap }.force(area);
        }
        self.meniscus(area).map_or(0.0, |m| m.force)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Spec 7.7: r = .004/.006, θ = .5/.9, g = .0112, A = 9.294335e-6 → 2.785058, the derivative of the energy.
    #[test]
    fn unequal_reference_and_symmetry() {
        let (a, b) = (Side { radius: 0.004, contact_angle: 0.5 }, Side { radius: 0.006, contact_angle: 0.9 });
        let bridge = |sides, c| UnequalBridge { sides, clearance: c };
        let c = 0.0112 - 0.010;
        let area = 9.294335e-6;
        let f = bridge([a, b], c).force(area);
        let swapped = bridge([b, a], c).force(area);
        assert!((f - 2.785058).abs() < 2e-6, "{f}");
        assert!((f - swapped).abs() < 1e-9, "{f} {swapped}");
        let h = 1e-7;
        let e = |c: f64| bridge([a, b], c).meniscus(area).unwrap().energy;
        assert!(((e(c + h) - e(c - h)) / (2.0 * h) - f).abs() < 1e-6);
    }

    /// With equal sides it is the symmetric bridge, and a wall is its mirror plane: a neutral wall (θ = π/2) carries half
    /// the area of the mirrored pair with the same force.
    #[test]
    fn equal_sides_and_mirror() {
        let s = Side { radius: 0.004, contact_angle: 0.6 };
        let pair = UnequalBridge { sides: [s, s], clearance: 0.0012 };
        let m = pair.meniscus(2e-5).unwrap();
        let symmetric = Bridge { radius: 0.004, contact_angle: 0.6, gap: 0.0092 }.meniscus(2e-5);
        assert!((m.force - symmetric.force).abs() < 1e-9 && (m.energy - symmetric.energy).abs() < 1.0);
        let wall = Side { radius: f64::INFINITY, contact_angle: std::f64::consts::FRAC_PI_2 };
        let half = UnequalBridge { sides: [s, wall], clearance: 0.0006 };
        let w = half.meniscus(1e-5).unwrap();
        assert!((w.force - symmetric.force).abs() < 1e-8, "{} {}", w.force, symmetric.force);
        assert!((w.area - 1e-5).abs() < 1e-12);
    }
}
