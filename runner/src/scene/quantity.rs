//! Units and ranges: what every number of a scene file measures, and how far it may go.
//!
//! Scenes are written in SI or CGS; after loading everything is SI. The factors below are powers of ten, applied
//! as one correctly rounded division or multiplication, so that `0.005` cm becomes exactly the `f64` nearest to
//! `0.005 / 100`.

use std::f64::consts::PI;

/// The unit system of the numbers in a scene file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Units {
    /// Metre, kilogram, second, newton, pascal.
    Si,
    /// Centimetre, gram, second, dyne, barye (0.1 Pa).
    Cgs,
}

/// What a number measures. Decides its unit and its conversion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// A pure number or a count.
    Number,
    /// Length: m or cm.
    Length,
    /// Time: s in both systems.
    Time,
    /// Inverse time: 1/s in both systems.
    Rate,
    /// Velocity: m/s or cm/s.
    Velocity,
    /// Acceleration: m/s² or cm/s².
    Acceleration,
    /// Density: kg/m³ or g/cm³.
    Density,
    /// Pressure, stress, modulus: Pa or Ba.
    Pressure,
    /// Dynamic viscosity: Pa·s or Ba·s.
    Viscosity,
    /// Consistency of a power law: Pa·sⁿ or Ba·sⁿ.
    Consistency,
    /// Surface tension: N/m or dyn/cm.
    SurfaceTension,
    /// Curvature, or twist per length (radians): 1/m or 1/cm.
    Curvature,
    /// Drag force per length and velocity: kg/(m·s) or g/(cm·s).
    LineDrag,
    /// An angle, in degrees in the file and in radians after loading, in both systems.
    Angle,
    /// Angular velocity: rad/s in both systems.
    AngularVelocity,
}

impl Quantity {
    /// Multiplier and divisor from `units` to SI; one of them is 1.
    fn scale(self, units: Units) -> (f64, f64) {
        if self == Quantity::Angle {
            return (PI / 180.0, 1.0);
        }
        if units == Units::Si {
            return (1.0, 1.0);
        }
        match self {
            Quantity::Length | Quantity::Velocity | Quantity::Acceleration => (1.0, 100.0),
            Quantity::Density => (1000.0, 1.0),
            Quantity::Pressure | Quantity::Viscosity | Quantity::Consistency | Quantity::LineDrag => (1.0, 10.0),
            Quantity::SurfaceTension => (1.0, 1000.0),
            Quantity::Curvature => (100.0, 1.0),
            Quantity::Number | Quantity::Time | Quantity::Rate | Quantity::Angle | Quantity::AngularVelocity => {
                (1.0, 1.0)
            }
        }
    }

    /// Converts a number of a scene file to SI.
    #[must_use]
    pub fn to_si(self, value: f64, units: Units) -> f64 {
        let (multiplier, divisor) = self.scale(units);
        value * multiplier / divisor
    }

    /// Converts an SI number to the units of a scene file.
    #[must_use]
    pub fn from_si(self, value: f64, units: Units) -> f64 {
        let (multiplier, divisor) = self.scale(units);
        value * divisor / multiplier
    }

    /// Converts an SI number to the units of a scene file so that it comes back to the same bits: the short decimal near
    /// it if there is one, else a neighbour of the quotient.
    #[must_use]
    pub fn from_si_exact(self, value: f64, units: Units) -> f64 {
        let plain = self.from_si(value, units);
        let short = format!("{plain:.11e}").parse().unwrap_or(plain);
        [short, plain, plain.next_up(), plain.next_down()]
            .into_iter()
            .find(|&candidate| self.to_si(candidate, units) == value)
            .unwrap_or(plain)
    }

    /// The unit as written in messages and on the reference page; empty for pure numbers.
    #[must_use]
    pub fn unit(self, units: Units) -> &'static str {
        match (self, units) {
            (Quantity::Number, _) => "",
            (Quantity::Length, Units::Si) => "m",
            (Quantity::Length, Units::Cgs) => "cm",
            (Quantity::Time, _) => "s",
            (Quantity::Rate, _) => "1/s",
            (Quantity::Velocity, Units::Si) => "m/s",
            (Quantity::Velocity, Units::Cgs) => "cm/s",
            (Quantity::Acceleration, Units::Si) => "m/s²",
            (Quantity::Acceleration, Units::Cgs) => "cm/s²",
            (Quantity::Density, Units::Si) => "kg/m³",
            (Quantity::Density, Units::Cgs) => "g/cm³",
            (Quantity::Pressure, Units::Si) => "Pa",
            (Quantity::Pressure, Units::Cgs) => "Ba",
            (Quantity::Viscosity, Units::Si) => "Pa·s",
            (Quantity::Viscosity, Units::Cgs) => "Ba·s",
            (Quantity::Consistency, Units::Si) => "Pa·sⁿ",
            (Quantity::Consistency, Units::Cgs) => "Ba·sⁿ",
            (Quantity::SurfaceTension, Units::Si) => "N/m",
            (Quantity::SurfaceTension, Units::Cgs) => "dyn/cm",
            (Quantity::Curvature, Units::Si) => "1/m",
            (Quantity::Curvature, Units::Cgs) => "1/cm",
            (Quantity::LineDrag, Units::Si) => "kg/(m·s)",
            (Quantity::LineDrag, Units::Cgs) => "g/(cm·s)",
            (Quantity::Angle, _) => "°",
            (Quantity::AngularVelocity, _) => "rad/s",
        }
    }

    /// The units of both systems as one text, `m or cm`; one only where they agree.
    #[must_use]
    pub fn both_units(self) -> String {
        let (si, cgs) = (self.unit(Units::Si), self.unit(Units::Cgs));
        if si == cgs { si.to_owned() } else { format!("{si} or {cgs}") }
    }

    /// A number with its unit as a reader wants to see it: at most twelve digits, `1e-5` rather than `0.00001`.
    #[must_use]
    pub fn show(self, si_value: f64, units: Units) -> String {
        let number = show_number(self.from_si(si_value, units));
        match self.unit(units) {
            "" => number,
            "°" => format!("{number}°"),
            unit => format!("{number} {unit}"),
        }
    }
}

/// Formats a number with at most twelve significant digits, in exponent form when that is shorter to read.
#[must_use]
pub fn show_number(value: f64) -> String {
    let rounded: f64 = format!("{value:.11e}").parse().unwrap_or(value);
    let magnitude = rounded.abs();
    if rounded == 0.0 || (1e-3..1e6).contains(&magnitude) || !rounded.is_finite() {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

/// The allowed interval of a number, in SI. Built as `above(0.0).up_to(0.1)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    low: f64,
    low_open: bool,
    high: f64,
    high_open: bool,
}

/// No limits (the number must still be finite).
#[must_use]
pub const fn any() -> Range {
    Range { low: f64::NEG_INFINITY, low_open: true, high: f64::INFINITY, high_open: true }
}

/// Strictly greater than `low`.
#[must_use]
pub const fn above(low: f64) -> Range {
    Range { low, low_open: true, ..any() }
}

/// At least `low`.
#[must_use]
pub const fn at_least(low: f64) -> Range {
    Range { low, low_open: false, ..any() }
}

impl Range {
    /// And at most `high`.
    #[must_use]
    pub const fn up_to(self, high: f64) -> Range {
        Range { high, high_open: false, ..self }
    }

    /// And strictly less than `high`.
    #[must_use]
    pub const fn below(self, high: f64) -> Range {
        Range { high, high_open: true, ..self }
    }

    /// Whether `value` \[SI\] is allowed.
    #[must_use]
    pub fn contains(&self, value: f64) -> bool {
        let low = if self.low_open { value > self.low } else { value >= self.low };
        let high = if self.high_open { value < self.high } else { value <= self.high };
        low && high
    }

    /// Whether any finite number is allowed.
    #[must_use]
    pub fn is_any(&self) -> bool {
        self.low == f64::NEG_INFINITY && self.high == f64::INFINITY
    }

    /// The finite bounds in SI with whether each is open, lowest first.
    #[must_use]
    pub fn bounds(&self) -> [Option<(f64, bool)>; 2] {
        [
            self.low.is_finite().then_some((self.low, self.low_open)),
            self.high.is_finite().then_some((self.high, self.high_open)),
        ]
    }

    /// The interval in words with the unit of `units`: `in (0, 10] cm`, `above 0 s`, `at least 0`.
    #[must_use]
    pub fn show(&self, quantity: Quantity, units: Units) -> String {
        let number = |value: f64| show_number(quantity.from_si(value, units));
        let unit = match quantity.unit(units) {
            "" => String::new(),
            "°" => "°".to_owned(),
            unit => format!(" {unit}"),
        };
        match self.bounds() {
            [None, None] => "any finite number".to_owned(),
            [Some((low, true)), None] => format!("above {}{unit}", number(low)),
            [Some((low, false)), None] => format!("at least {}{unit}", number(low)),
            [None, Some((high, true))] => format!("below {}{unit}", number(high)),
            [None, Some((high, false))] => format!("at most {}{unit}", number(high)),
            [Some((low, low_open)), Some((high, high_open))] => {
                let open = if low_open { '(' } else { '[' };
                let close = if high_open { ')' } else { ']' };
                format!("in {open}{}, {}{close}{unit}", number(low), number(high))
            }
        }
    }
}

/// What the numbers inside a field measure and how far they may go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spec {
    /// What the numbers measure.
    pub quantity: Quantity,
    /// Their allowed interval \[SI\].
    pub range: Range,
}

impl Spec {
    /// Pure numbers without limits, and everything that is not a number.
    pub const PLAIN: Spec = Spec { quantity: Quantity::Number, range: any() };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cgs_numbers_become_si_by_one_rounding() {
        assert_eq!(Quantity::Length.to_si(0.005, Units::Cgs), 0.005 / 100.0);
        assert_eq!(Quantity::Density.to_si(1.32, Units::Cgs), 1320.0);
        assert_eq!(Quantity::Pressure.to_si(3.7e10, Units::Cgs), 3.7e9);
        assert_eq!(Quantity::SurfaceTension.to_si(72.8, Units::Cgs), 0.0728);
        assert_eq!(Quantity::Angle.to_si(180.0, Units::Si), PI);
        for units in [Units::Si, Units::Cgs] {
            let back = Quantity::Curvature.from_si(Quantity::Curvature.to_si(0.7, units), units);
            assert!((back - 0.7).abs() < 1e-15);
        }
    }

    #[test]
    fn ranges_speak_in_the_units_of_the_scene() {
        let range = above(0.0).up_to(0.1);
        assert_eq!(range.show(Quantity::Length, Units::Cgs), "in (0, 10] cm");
        assert_eq!(range.show(Quantity::Length, Units::Si), "in (0, 0.1] m");
        assert_eq!(above(0.0).show(Quantity::Time, Units::Si), "above 0 s");
        assert!(range.contains(0.1) && !range.contains(0.0) && !range.contains(f64::NAN));
    }
}
