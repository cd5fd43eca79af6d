//! The liquid of a film, constants prepared.

use constitutive::{Liquid, ShearFlow};

use crate::error::FilmError;

/// Numbers of the liquid that the film solver needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilmLiquid {
    /// Density [kg/m³].
    pub density: f64,
    /// Shear modulus [Pa]; 0: no elastic strain.
    pub shear_modulus: f64,
    /// Plastic flow of the strain.
    pub flow: ShearFlow,
    /// `(τ_s [Pa], K [Pa·sⁿ], n)` of simple shear, for the lubrication law.
    pub shear: (f64, f64, f64),
    /// `(yield stress, consistency, n)` as the published wall law takes them.
    pub paper: (f64, f64, f64),
}

impl FilmLiquid {
    /// Prepares a liquid.
    ///
    /// # Errors
    /// [`FilmError::Liquid`] if a number of it is out of range.
    pub fn new(liquid: &Liquid) -> Result<Self, FilmError> {
        liquid.check()?;
        Ok(FilmLiquid {
            density: liquid.density,
            shear_modulus: liquid.shear_modulus,
            flow: ShearFlow::new(&liquid.flow)?,
            shear: liquid.flow.rheometer(),
            paper: liquid.flow.boundary(),
        })
    }
}
