//! Material of a yarn.

use constitutive::yarn::{YarnForm, YarnLaw};
use serde::{Deserialize, Serialize};

use super::{positive, range};
use crate::YarnError;

/// Contact stiffness of the cross-section.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum ContactModuli {
    /// By Young's modulus and Poisson's ratio.
    Engineering {
        /// Young's modulus [Pa], positive.
        young_modulus: f64,
        /// Poisson's ratio, 0 to 0.49.
        poisson_ratio: f64,
    },
    /// By the two Lamé moduli [Pa].
    Lame {
        /// Shear modulus [Pa], positive.
        mu: f64,
        /// First modulus [Pa], not negative.
        lambda: f64,
    },
}

/// Resistance against bending.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Bending {
    /// None: a chain. Segments shorter than a cell still keep some resistance from the grid.
    None,
    /// Discrete elastic rod, `E = B/2 Σ κ² l` with `κ = 2 tan(θ/2)/l`: quadratic in the angle when that is small, without limit as a segment folds back.
    Rod {
        /// Bending stiffness `B` [N m²] ([N m] per metre of depth in 2-D), not negative. Left out: one hundredth of a solid section of the stretch modulus,
        /// as for a bundle of a hundred fibres that slide freely.
        #[serde(default)]
        stiffness: Option<f64>,
    },
    /// The note's spring between vertices two apart. It is of second order in the angle (`l = 2 l₀ (1 − θ²/8)`): no stiffness
    /// against small bends, and it adds to the stretch modulus.
    Spring {
        /// Stiffness [N/m], not negative. Left out: 0.05 k V/l₀² of the mean segment of the whole scene.
        #[serde(default)]
        stiffness: Option<f64>,
    },
    /// [`Bending::Rod`] by its stiffness over that of a solid section of the stretch modulus.
    RodShare {
        /// Share, not negative; 0.01 is a bundle of a hundred fibres that slide freely.
        share: f64,
    },
    /// [`Bending::Spring`] by its stiffness over that of the mean segment along the yarn, `k V/l₀²`.
    SpringShare {
        /// Share, not negative; the note's is 0.05.
        share: f64,
    },
}

/// What a yarn is made of.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct YarnMaterial {
    /// Density [kg/m³] ([kg/m²] in 2-D), positive.
    pub density: f64,
    /// Width in 2-D, diameter in 3-D [m]; left out: half a cell. The section area is the width, or `π/4` of its square.
    pub width: Option<f64>,
    /// Stretch modulus `k` [Pa], positive: strain under a tension `T` is `T/(k A)`. A yarn is "inextensible" only as far as this is large.
    pub stretch_modulus: f64,
    /// Shear modulus along the fibres `γ` [Pa], not negative; zero: sideways sliding is free.
    pub shear_modulus: f64,
    /// Contact stiffness.
    pub contact: ContactModuli,
    /// Coulomb coefficient of sliding along the yarns, 0 to 10.
    pub friction: f64,
    /// Coulomb coefficient against a change of shape of the cross-section (3-D), 0 to 10; left out: as `friction`.
    pub section_friction: Option<f64>,
    /// Resistance against bending.
    pub bending: Bending,
}

impl Default for YarnMaterial {
    fn default() -> Self {
        Self {
            density: 1.0,
            width: None,
            stretch_modulus: 1000.0,
            shear_modulus: 500.0,
            contact: ContactModuli::Engineering { young_modulus: 1000.0, poisson_ratio: 0.3 },
            friction: 0.05,
            section_friction: None,
            bending: Bending::Rod { stiffness: None },
        }
    }
}

impl YarnMaterial {
    /// Checks every number.
    ///
    /// # Errors
    /// The first one out of range; `path` is put before its name.
    pub fn check(&self, path: &str) -> Result<(), YarnError> {
        let at = |name: &str| format!("{path}.{name}");
        positive(&at("density"), self.density)?;
        positive(&at("stretch_modulus"), self.stretch_modulus)?;
        range(&at("shear_modulus"), self.shear_modulus, 0.0, f64::MAX)?;
        range(&at("friction"), self.friction, 0.0, 10.0)?;
        if let Some(friction) = self.section_friction {
            range(&at("section_friction"), friction, 0.0, 10.0)?;
        }
        if let Some(width) = self.width {
            positive(&at("width"), width)?;
        }
        match self.contact {
            ContactModuli::Engineering { young_modulus, poisson_ratio } => {
                positive(&at("contact.young_modulus"), young_modulus)?;
                range(&at("contact.poisson_ratio"), poisson_ratio, 0.0, 0.49)?;
            }
            ContactModuli::Lame { mu, lambda } => {
                positive(&at("contact.mu"), mu)?;
                range(&at("contact.lambda"), lambda, 0.0, f64::MAX)?;
            }
        }
        match self.bending {
            Bending::Rod { stiffness: Some(b) } | Bending::Spring { stiffness: Some(b) } => {
                range(&at("bending.stiffness"), b, 0.0, f64::MAX)
            }
            Bending::RodShare { share } | Bending::SpringShare { share } => {
                range(&at("bending.share"), share, 0.0, f64::MAX)
            }
            _ => Ok(()),
        }
    }

    /// The two Lamé moduli of the contact [Pa].
    #[must_use]
    pub fn lame(&self) -> (f64, f64) {
        match self.contact {
            ContactModuli::Engineering { young_modulus: e, poisson_ratio: nu } => {
                (e / (2.0 * (1.0 + nu)), e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)))
            }
            ContactModuli::Lame { mu, lambda } => (mu, lambda),
        }
    }

    /// The law of a material point.
    #[must_use]
    pub fn law(&self, min_section: f64, form: YarnForm) -> YarnLaw {
        let (mu, lambda) = self.lame();
        YarnLaw {
            stretch_modulus: self.stretch_modulus,
            shear_modulus: self.shear_modulus,
            mu,
            lambda,
            friction: self.friction,
            section_friction: self.section_friction.unwrap_or(self.friction),
            min_section,
            form,
        }
    }

    /// Width or diameter [m] on a grid of the given cell.
    #[must_use]
    pub fn width(&self, cell: f64) -> f64 {
        self.width.unwrap_or(0.5 * cell)
    }

    /// Section area: width in 2-D [m], disc in 3-D [m²].
    #[must_use]
    pub fn area(&self, cell: f64, dimension: usize) -> f64 {
        let width = self.width(cell);
        if dimension == 2 { width } else { std::f64::consts::FRAC_PI_4 * width * width }
    }

    /// Rod bending stiffness of one hundredth of a solid section [N m²].
    #[must_use]
    pub fn bundle_bending_stiffness(&self, cell: f64, dimension: usize) -> f64 {
        0.01 * self.solid_bending_stiffness(cell, dimension)
    }

    /// Rod bending stiffness of a solid section of the stretch modulus [N m²].
    #[must_use]
    pub fn solid_bending_stiffness(&self, cell: f64, dimension: usize) -> f64 {
        let width = self.width(cell);
        let second_moment =
            if dimension == 2 { width.powi(3) / 12.0 } else { std::f64::consts::PI * width.powi(4) / 64.0 };
        self.stretch_modulus * second_moment
    }
}
