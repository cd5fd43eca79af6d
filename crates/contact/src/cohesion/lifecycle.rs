//! When a liquid bridge forms and breaks, how the film is shared, and the cohesive impulse bound it gives.

use super::unequal::{Side, UnequalBridge};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Settings of cohesion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CohesionSettings {
    /// Surface tension `γ` [N/m], ≥ 0. Larger: stronger bridges.
    pub surface_tension: f64,
    /// Consistency `η` of the liquid [Pa sⁿ], ≥ 0: the viscous part of the pull.
    pub consistency: f64,
    /// Flow index `n` [1], > 0.
    pub flow_index: f64,
    /// Yield stress `τ_Y` [Pa], ≥ 0: the plastic part of the pull.
    pub yield_stress: f64,
}

impl Default for CohesionSettings {
    fn default() -> Self {
        CohesionSettings { surface_tension: 0.0, consistency: 0.0, flow_index: 1.0, yield_stress: 0.0 }
    }
}

/// Geometry and wetness of one contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WetContact {
    /// Both sides; a solid is a wall.
    pub sides: [Side; 2],
    /// Distance of the surfaces [m]; negative when they overlap.
    pub clearance: f64,
    /// Film heights of both sides at the contact [m], from the shared areas; 0 when dry.
    pub heights: [f64; 2],
    /// Liquid cross-section shared by this contact, `A_P/n_P + A_Q/n_Q` [m²].
    pub area: f64,
}

/// What the bound needs besides the geometry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CohesionInput {
    /// Time step [s].
    pub dt: f64,
    /// Overlap length [m].
    pub length: f64,
    /// Normal relative speed [m/s], positive when parting.
    pub normal_velocity: f64,
}

/// Share of a film's cross-section that one of `contacts` contacts on the edge may use [m²].
#[must_use]
pub fn contact_share(area: f64, contacts: usize) -> f64 {
    area.max(0.0) / contacts.max(1) as f64
}

impl WetContact {
    /// Clearance below which the films touch and a bridge forms [m].
    #[must_use]
    pub fn formation_clearance(&self) -> f64 {
        self.heights[0].max(0.0) + self.heights[1].max(0.0)
    }

    /// Clearance above which an existing bridge breaks [m]: `(1 + θ/2) √A` (Lian, Thornton and Adams 1993), never below
    /// the formation clearance. The difference is the hysteresis: re-forming cannot gain energy.
    #[must_use]
    pub fn rupture_clearance(&self) -> f64 {
        let theta = 0.5 * (self.sides[0].contact_angle + self.sides[1].contact_angle);
        self.formation_clearance().max((1.0 + 0.5 * theta) * self.area.max(0.0).sqrt())
    }

    /// Whether a bridge exists, given whether it existed before.
    #[must_use]
    pub fn bridged(&self, before: bool) -> bool {
        if !(self.area > 0.0) {
            return false;
        }
        self.clearance <= if before { self.rupture_clearance() } else { self.formation_clearance() }
    }

    /// Attraction per length over surface tension; repulsion (contact angles above 90°) gives zero.
    #[must_use]
    pub fn attraction(&self) -> f64 {
        UnequalBridge { sides: self.sides, clearance: self.clearance }.force(self.area).max(0.0)
    }

    /// Root mean square of the radii; a wall counts as the other side.
    #[must_use]
    pub fn mean_radius(&self) -> f64 {
        let [a, b] = self.sides.map(|s| s.radius);
        match (a.is_finite(), b.is_finite()) {
            (true, true) => (0.5 * (a * a + b * b)).sqrt(),
            (true, false) => a,
            (false, true) => b,
            (false, false) => 0.0,
        }
    }
}

/// Whether the contact enters the solve: dry or approaching only when the surfaces touch, wet and parting as long as the
/// bridge lives.
///
/// `velocity_scale` [m/s]: the larger of the body speed and `h‖g‖`; the sign of `u_N` counts from 1e-6 of it.
#[must_use]
pub fn is_active(wet: &WetContact, bridged: bool, normal_velocity: f64, velocity_scale: f64) -> bool {
    let approaching = normal_velocity < -1e-6 * velocity_scale;
    if approaching || !bridged { wet.clearance <= 0.0 } else { true }
}

/// Cohesive impulse bound `c_a` [N s]: capillary plus viscous and plastic pull over the overlap length and the step.
#[must_use]
pub fn cohesive_bound(wet: &WetContact, settings: &CohesionSettings, input: &CohesionInput) -> f64 {
    if !(wet.area > 0.0) {
        return 0.0;
    }
    let radius = wet.mean_radius();
    let gap = wet.sides.iter().filter(|s| s.radius.is_finite()).map(|s| s.radius).sum::<f64>() + wet.clearance;
    let reach = (2.0 * radius).max(gap).max(f64::MIN_POSITIVE);
    let rate = input.normal_velocity.abs() / reach;
    let flow = settings.consistency * rate.powf(settings.flow_index) + (2.0_f64 / 3.0).sqrt() * settings.yield_stress;
    let pull = settings.surface_tension * wet.attraction() + 0.75 * PI * radius * flow;
    let bound = input.dt * input.length * pull.max(0.0);
    if bound.is_finite() { bound.max(0.0) } else { 0.0 }
}

/// Overlap length [m]: half the sum of the edge lengths, each weighted by the fraction of the edge whose distance to the
/// other stays below `reach` (linear between its vertices).
#[must_use]
pub fn overlap_length(lengths: [f64; 2], vertex_distances: [[f64; 2]; 2], reach: f64) -> f64 {
    let fraction = |d: [f64; 2]| {
        let (lo, hi) = (d[0].min(d[1]), d[0].max(d[1]));
        if hi <= reach {
            1.0
        } else if lo >= reach {
            0.0
        } else {
            (reach - lo) / (hi - lo)
        }
    };
    0.5 * (lengths[0] * fraction(vertex_distances[0]) + lengths[1] * fraction(vertex_distances[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wet(clearance: f64, area: f64) -> WetContact {
        let side = Side { radius: 1e-3, contact_angle: 0.4 };
        WetContact { sides: [side; 2], clearance, heights: [1e-4; 2], area }
    }

    /// A bridge forms when films touch, lives on until the rupture distance, and does not re-form in between.
    #[test]
    fn hysteresis() {
        let area = 1e-7;
        let w = |c| wet(c, area);
        let (form, rupture) = (w(0.0).formation_clearance(), w(0.0).rupture_clearance());
        assert!(rupture > form);
        let between = 0.5 * (form + rupture);
        assert!(w(0.9 * form).bridged(false) && !w(between).bridged(false));
        assert!(w(between).bridged(true) && !w(1.01 * rupture).bridged(true));
        assert!(!wet(0.0, 0.0).bridged(true));
    }

    /// Hard case 31: as the liquid goes, the bound vanishes without a jump, because the overlap length shrinks with the
    /// rupture distance (the force of a bridge about to rupture is finite).
    #[test]
    fn the_bound_vanishes_with_the_liquid() {
        let s = CohesionSettings { surface_tension: 0.03, ..Default::default() };
        let clearance = 2e-5;
        let bound = |area: f64| {
            let w = WetContact { heights: [0.05 * area.sqrt(); 2], ..wet(clearance, area) };
            let d = [[0.5 * clearance, 1.5 * clearance]; 2];
            let length = overlap_length([1e-2; 2], d, w.rupture_clearance());
            cohesive_bound(&w, &s, &CohesionInput { dt: 1e-3, length, normal_velocity: 0.0 })
        };
        let largest = bound(1e-7);
        let mut last = bound(1e-9);
        let mut area = 1e-9;
        while area > 1e-12 {
            area *= 0.98;
            let c = bound(area);
            assert!(c >= 0.0 && (c - last).abs() < 0.1 * largest, "{area} {last} {c}");
            last = c;
        }
        assert_eq!(last, 0.0);
        assert_eq!(bound(0.0), 0.0);
    }

    /// Hard case 33: contact angles above 90° repel, which is clamped; viscous and plastic pull stay.
    #[test]
    fn repulsion_is_clamped() {
        let mut w = wet(2e-5, 1e-7);
        w.sides = [Side { radius: 1e-3, contact_angle: 2.4 }; 2];
        let input = CohesionInput { dt: 1e-3, length: 1e-2, normal_velocity: 0.1 };
        let dry = CohesionSettings { surface_tension: 0.03, ..Default::default() };
        assert_eq!(cohesive_bound(&w, &dry, &input), 0.0);
        let mud = CohesionSettings { consistency: 5.0, flow_index: 0.5, yield_stress: 10.0, ..dry };
        let reach: f64 = 2e-3 + 2e-5;
        let expected = 1e-5 * 0.75 * PI * 1e-3 * (5.0 * (0.1 / reach).sqrt() + (2.0f64 / 3.0).sqrt() * 10.0);
        assert!((cohesive_bound(&w, &mud, &input) / expected - 1.0).abs() < 1e-12);
    }

    #[test]
    fn activity_and_overlap() {
        let w = wet(2e-5, 1e-7);
        assert!(!is_active(&w, true, -1.0, 1.0) && is_active(&w, true, 1.0, 1.0) && !is_active(&w, false, 1.0, 1.0));
        assert!(is_active(&wet(-1e-6, 0.0), false, 1.0, 1.0));
        assert_eq!(overlap_length([2.0, 4.0], [[0.0, 2.0], [3.0, 5.0]], 1.0), 0.5);
        assert_eq!(contact_share(6.0, 3), 2.0);
    }
}
