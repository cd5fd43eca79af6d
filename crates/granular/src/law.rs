//! Central (normal) elastic laws of a contact: force, stiffness and stored energy of one pair.
//!
//! Sign: the force is that on a grain along the direction to its partner, so repulsion is negative. All laws scale with the
//! spring constant `k`, which is why they know no modulus.

use crate::error::{GranularError, require};
use serde::{Deserialize, Serialize};

/// Compression law of a contact.
///
/// Every law takes the distance of centres `d`, the rest distance `d0` (sum of radii) and the spring constant `k`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum CentralLaw {
    /// Blend of a linear spring (`repulsion` 0) and one that diverges as centres meet (`repulsion` 1).
    ///
    /// `F = -k (1-c)(d0-d) - k c d0 (d0/max(d, d0/1000) - 1)`; slope at first touch `-k` for every `c`. Source: manual S1-4 … S1-6.
    Blend {
        /// Central repulsion coefficient `c` [-], 0 … 1.
        repulsion: f64,
    },
    /// Sponge: the blend evaluated at a distance that hardly shrinks between `begin` and `end` of the rest distance.
    Plateau {
        /// Central repulsion coefficient [-], 0 … 1.
        repulsion: f64,
        /// Relative distance below which the sponge is crushed [-]; must be less than `end`.
        begin: f64,
        /// Relative distance at which the plateau starts under growing compression [-], at most 1.
        end: f64,
        /// Slope of the effective distance on the plateau [-]; 1 gives the blend back.
        slope: f64,
    },
    /// `F = -coefficient · k (d0-d)^{3/2} / sqrt(d0/2)` (manual S1-10 … S1-13 with the layered estimate).
    Hertz {
        /// Dimensionless factor; [`HERTZ_LAYERED`] reproduces the manual's comparison curve.
        coefficient: f64,
    },
    /// Measured law: `-F/(k d0)` against relative compression `1 - d/d0`, interpolated by monotone cubics.
    Tabulated(Table),
}

/// Coefficient of [`CentralLaw::Hertz`] for stacked layers of spheres: `(Z/4) √2/3 · (√3/2) · 8/π` with `Z = 10.7` (manual S1-13).
pub const HERTZ_LAYERED: f64 =
    10.7 / 4.0 * std::f64::consts::SQRT_2 / 3.0 * 0.866_025_403_784_438_6 * 8.0 / std::f64::consts::PI;

impl Default for CentralLaw {
    fn default() -> Self {
        Self::Blend { repulsion: 1.0 }
    }
}

/// Force magnitude and stiffness of the blend; positive numbers.
#[inline(always)]
fn blend(c: f64, d: f64, d0: f64, k: f64) -> f64 {
    -k * (1.0 - c) * (d0 - d) - k * c * d0 * (d0 / d.max(d0 * 0.001) - 1.0)
}

#[inline(always)]
fn blend_stiffness(c: f64, d: f64, d0: f64, k: f64) -> f64 {
    let q = d0 / d.max(d0 * 0.001);
    k * (1.0 - c) + k * c * q * q
}

/// Effective distance of the plateau law and its derivative.
#[inline(always)]
fn plateau_distance(d: f64, d0: f64, begin: f64, end: f64, slope: f64) -> (f64, f64) {
    if d >= end * d0 {
        (d, 1.0)
    } else if d >= begin * d0 {
        (end * d0 + (d - end * d0) * slope, slope)
    } else {
        let low = end * d0 + (begin - end) * d0 * slope;
        (d / (begin * d0) * low, low / (begin * d0))
    }
}

impl CentralLaw {
    /// Returns the force `F ≤ 0` on a grain towards its partner [µm mg s⁻² per m depth]; zero at `d ≥ d0`.
    #[inline(always)]
    pub fn force(&self, d: f64, d0: f64, k: f64) -> f64 {
        if d > d0 {
            return 0.0;
        }
        match self {
            Self::Blend { repulsion } => blend(*repulsion, d, d0, k),
            Self::Plateau { repulsion, begin, end, slope } => {
                blend(*repulsion, plateau_distance(d, d0, *begin, *end, *slope).0, d0, k)
            }
            Self::Hertz { coefficient } => {
                let x = d0 - d;
                -coefficient * k * x * x.sqrt() / (0.5 * d0).sqrt()
            }
            Self::Tabulated(table) => -k * d0 * table.value(1.0 - d / d0),
        }
    }

    /// Returns `dF/dd` at compression, the stiffness that limits the time step; zero at `d > d0`.
    #[inline(always)]
    pub fn stiffness(&self, d: f64, d0: f64, k: f64) -> f64 {
        if d > d0 {
            return 0.0;
        }
        match self {
            Self::Blend { repulsion } => blend_stiffness(*repulsion, d, d0, k),
            Self::Plateau { repulsion, begin, end, slope } => {
                let (x, dx) = plateau_distance(d, d0, *begin, *end, *slope);
                blend_stiffness(*repulsion, x, d0, k) * dx
            }
            Self::Hertz { coefficient } => 1.5 * coefficient * k * (d0 - d).sqrt() / (0.5 * d0).sqrt(),
            Self::Tabulated(table) => k * table.slope(1.0 - d / d0),
        }
    }

    /// Returns the energy stored by compressing from touch to `d` [µm² mg s⁻² per m depth].
    ///
    /// Closed form for the blend and Hertz laws; composite Gauss quadrature for the others.
    pub fn energy(&self, d: f64, d0: f64, k: f64) -> f64 {
        if d >= d0 {
            return 0.0;
        }
        match self {
            Self::Blend { repulsion: c } if d >= 0.001 * d0 => {
                let x = d0 - d;
                0.5 * k * (1.0 - c) * x * x + k * c * d0 * (d0 * (d0 / d).ln() - x)
            }
            Self::Hertz { coefficient } => {
                let x = d0 - d;
                0.4 * coefficient * k * x * x * x.sqrt() / (0.5 * d0).sqrt()
            }
            _ => {
                let (n, half) = (64, 0.5 / 3.0_f64.sqrt());
                let w = (d0 - d) / n as f64;
                (0..n)
                    .map(|i| {
                        let mid = d + (i as f64 + 0.5) * w;
                        -0.5 * w * (self.force(mid - half * w, d0, k) + self.force(mid + half * w, d0, k))
                    })
                    .sum()
            }
        }
    }

    /// Checks the parameters.
    ///
    /// # Errors
    /// [`GranularError::Setting`] naming the parameter that is out of range.
    pub fn check(&self) -> Result<(), GranularError> {
        match self {
            Self::Blend { repulsion } => require("repulsion", *repulsion, |c| (0.0..=1.0).contains(&c), "0 … 1"),
            Self::Plateau { repulsion, begin, end, slope } => {
                require("repulsion", *repulsion, |c| (0.0..=1.0).contains(&c), "0 … 1")?;
                require("begin", *begin, |b| b > 0.0 && b < *end, "between 0 and end")?;
                require("end", *end, |e| e <= 1.0, "at most 1")?;
                require("slope", *slope, |s| s > 0.0 && s <= 1.0, "0 (excluded) … 1")
            }
            Self::Hertz { coefficient } => require("coefficient", *coefficient, |c| c > 0.0, "positive"),
            Self::Tabulated(table) => table.check(),
        }
    }
}

/// Monotone cubic through measured points (Fritsch & Carlson 1980); linear beyond the last one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Points", into = "Points")]
pub struct Table {
    compression: Vec<f64>,
    force: Vec<f64>,
    slopes: Vec<f64>,
}

/// What a table looks like in a file.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Points {
    /// Relative compression `1 - d/d0` [-], ascending from 0.
    compression: Vec<f64>,
    /// Dimensionless force `-F/(k d0)` [-], ascending from 0.
    force: Vec<f64>,
}

impl TryFrom<Points> for Table {
    type Error = GranularError;
    fn try_from(points: Points) -> Result<Self, GranularError> {
        Self::new(points.compression, points.force)
    }
}

impl From<Table> for Points {
    fn from(table: Table) -> Self {
        Self { compression: table.compression, force: table.force }
    }
}

impl Table {
    /// Creates a table of relative compression [-] against dimensionless force `-F/(k d0)` [-].
    ///
    /// # Errors
    /// [`GranularError::Setting`] unless both columns start at 0, have equal length ≥ 2 and never decrease.
    pub fn new(compression: Vec<f64>, force: Vec<f64>) -> Result<Self, GranularError> {
        let n = compression.len();
        require("table length", n as f64, |_| n >= 2 && force.len() == n, "two equal columns of at least two points")?;
        let h: Vec<f64> = compression.windows(2).map(|w| w[1] - w[0]).collect();
        let secant: Vec<f64> = force.windows(2).zip(&h).map(|(w, h)| (w[1] - w[0]) / h).collect();
        let mut slopes = vec![0.0; n];
        slopes[0] = secant[0];
        slopes[n - 1] = secant[n - 2];
        for i in 1..n - 1 {
            let (a, b) = (secant[i - 1], secant[i]);
            if a * b > 0.0 {
                let (p, q) = (2.0 * h[i] + h[i - 1], h[i] + 2.0 * h[i - 1]);
                slopes[i] = (p + q) / (p / a + q / b);
            }
        }
        let table = Self { compression, force, slopes };
        table.check()?;
        Ok(table)
    }

    fn check(&self) -> Result<(), GranularError> {
        let ascending = |v: &[f64], strict: bool| {
            v[0] == 0.0 && v.windows(2).all(|w| if strict { w[1] > w[0] } else { w[1] >= w[0] })
        };
        let fits = ascending(&self.compression, true) && ascending(&self.force, false);
        let last = self.force[self.force.len() - 1];
        require("table", last, |_| fits, "both columns must ascend from 0")
    }

    fn segment(&self, x: f64) -> usize {
        self.compression.partition_point(|&c| c <= x).clamp(1, self.compression.len() - 1) - 1
    }

    /// Dimensionless force at relative compression `x ≥ 0`.
    pub fn value(&self, x: f64) -> f64 {
        let n = self.compression.len();
        if x >= self.compression[n - 1] {
            return self.force[n - 1] + self.slopes[n - 1] * (x - self.compression[n - 1]);
        }
        let i = self.segment(x);
        let h = self.compression[i + 1] - self.compression[i];
        let t = (x - self.compression[i]) / h;
        let (t2, t3) = (t * t, t * t * t);
        (2.0 * t3 - 3.0 * t2 + 1.0) * self.force[i]
            + (t3 - 2.0 * t2 + t) * h * self.slopes[i]
            + (3.0 * t2 - 2.0 * t3) * self.force[i + 1]
            + (t3 - t2) * h * self.slopes[i + 1]
    }

    /// Derivative of [`Self::value`].
    pub fn slope(&self, x: f64) -> f64 {
        let n = self.compression.len();
        if x >= self.compression[n - 1] {
            return self.slopes[n - 1];
        }
        let i = self.segment(x);
        let h = self.compression[i + 1] - self.compression[i];
        let t = (x - self.compression[i]) / h;
        6.0 * (t * t - t) / h * (self.force[i] - self.force[i + 1])
            + (3.0 * t * t - 4.0 * t + 1.0) * self.slopes[i]
            + (3.0 * t * t - 2.0 * t) * self.slopes[i + 1]
    }
}

/// Tension law of a stretched permanent link.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub enum Tension {
    /// `F = k (d - d_eq)`.
    #[default]
    Linear,
    /// `F = k d_eq d_x (1 - exp(-(d - d_eq)/(d_eq d_x)))`.
    Saturating {
        /// Relative extension `d_x` at which the force levels off [-], positive.
        strain: f64,
    },
}

impl Tension {
    /// Returns the pull `F ≥ 0` of a link of rest length `rest` stretched to `d ≥ rest`.
    #[inline(always)]
    pub fn force(&self, d: f64, rest: f64, k: f64) -> f64 {
        match *self {
            Self::Linear => k * (d - rest),
            Self::Saturating { strain } => k * rest * strain * (1.0 - (-(d - rest) / (rest * strain)).exp()),
        }
    }

    /// Energy stored by the stretch.
    pub fn energy(&self, d: f64, rest: f64, k: f64) -> f64 {
        let x = d - rest;
        match *self {
            Self::Linear => 0.5 * k * x * x,
            Self::Saturating { strain } => {
                let a = rest * strain;
                k * a * (x - a * (1.0 - (-x / a).exp()))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn laws() -> Vec<CentralLaw> {
        vec![
            CentralLaw::Blend { repulsion: 0.0 },
            CentralLaw::Blend { repulsion: 0.4 },
            CentralLaw::Blend { repulsion: 1.0 },
            CentralLaw::Plateau { repulsion: 1.0, begin: 0.3, end: 0.8, slope: 0.1 },
            CentralLaw::Hertz { coefficient: HERTZ_LAYERED },
            CentralLaw::Tabulated(Table::new(vec![0.0, 0.1, 0.3, 0.6, 0.9], vec![0.0, 0.1, 0.35, 1.4, 8.0]).unwrap()),
        ]
    }

    proptest! {
        #[test]
        fn stiffness_is_the_slope_of_the_force_and_energy_its_integral(x in 0.02..0.99f64, d0 in 1.0..200.0f64) {
            let (k, d, e) = (3.0, x * d0, 1e-6 * d0);
            for law in laws() {
                if let CentralLaw::Plateau { begin, end, .. } = law
                    && ((x - begin).abs() < 1e-5 || (x - end).abs() < 1e-5) { continue; }
                if let CentralLaw::Tabulated(t) = &law
                    && t.compression.iter().any(|c| (1.0 - x - c).abs() < 1e-5) { continue; }
                let slope = (law.force(d + e, d0, k) - law.force(d - e, d0, k)) / (2.0 * e);
                let stiffness = law.stiffness(d, d0, k);
                prop_assert!((slope - stiffness).abs() < 1e-5 * stiffness.max(k), "{law:?} {slope} {stiffness}");
                // A small interval, so that quadrature and kinks of the tabulated law agree.
                let work = -0.5 * e * (law.force(d, d0, k) + law.force(d + e, d0, k));
                if matches!(law, CentralLaw::Blend { .. } | CentralLaw::Hertz { .. }) {
                    let gain = law.energy(d, d0, k) - law.energy(d + e, d0, k);
                    prop_assert!((work - gain).abs() < 1e-6 * work + 1e-12 * law.energy(d, d0, k), "{law:?}");
                }
            }
        }
    }

    #[test]
    fn laws_agree_at_touch_and_the_divergent_one_is_capped() {
        for law in laws() {
            assert_eq!(law.force(100.0, 100.0, 2.0), 0.0);
            assert_eq!(law.force(100.1, 100.0, 2.0), 0.0);
            assert!(law.check().is_ok());
        }
        let capped = CentralLaw::default().force(0.0, 100.0, 2.0);
        assert!((capped + 999.0 * 200.0).abs() < 1e-6);
        let flat = CentralLaw::Plateau { repulsion: 1.0, begin: 0.3, end: 0.8, slope: 1.0 };
        for d in [10.0, 50.0, 90.0] {
            assert!((flat.force(d, 100.0, 1.0) - CentralLaw::default().force(d, 100.0, 1.0)).abs() < 1e-10);
        }
        let sponge = &laws()[3];
        assert_eq!(plateau_distance(0.0, 100.0, 0.3, 0.8, 0.1).0, 0.0);
        assert!((sponge.force(30.0 - 1e-9, 100.0, 1.0) - sponge.force(30.0, 100.0, 1.0)).abs() < 1e-6);
    }

    #[test]
    fn quadrature_energy_matches_a_fine_sum() {
        let sponge = CentralLaw::Plateau { repulsion: 1.0, begin: 0.3, end: 0.8, slope: 0.1 };
        let (d, d0, n) = (20.0, 100.0, 200_000);
        let w = (d0 - d) / f64::from(n);
        let sum: f64 = (0..n).map(|i| -w * sponge.force(d + (f64::from(i) + 0.5) * w, d0, 1.0)).sum();
        assert!((sum / sponge.energy(d, d0, 1.0) - 1.0).abs() < 1e-4);
    }
}
