//! Choices of the film solver.

use constitutive::FlowMap;
use serde::{Deserialize, Serialize};

use crate::error::FilmError;

/// How volume, momentum and strain are carried along a strand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Advection {
    /// Finite volumes: volume and momentum conserved to round-off, cross-section never negative, second order in space. The
    /// default.
    #[default]
    Conservative,
    /// Back-traced values and one rescaling of the volume: the published form, for comparisons.
    SemiLagrangian,
}

/// How the film rubs on the strand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum WallLaw {
    /// Exact wall stress of a plane Herschel–Bulkley film of the given mean speed, with slip. The default.
    #[default]
    Lubrication,
    /// The published law `h/(b + h/3) (σ_Y + η (u/h)ⁿ)`: exact for a Newtonian film, 2.5 times the yield stress too stiff for
    /// a paste.
    Paper,
}

/// Choices of the film solver.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FilmSettings {
    /// How the film is carried along.
    pub advection: Advection,
    /// How the film rubs on the strand.
    pub wall: WallLaw,
    /// Navier slip length [m], ≥ 0: distance inside the strand at which the velocity profile would vanish. Lets very thin
    /// films move. Default 2e-6.
    pub slip_length: f64,
    /// Sub-steps of advection keep the Courant number below this, 0.05 to 0.5: smaller is smoother and slower. Default 0.5.
    pub courant: f64,
    /// Cross-sections below this fraction of the strand's count as dry, 1e-12 to 1e-2. Default 1e-6.
    pub dry_fraction: f64,
    /// Largest speed in edge lengths per step; the excess is removed. Default 3.
    pub speed_limit: f64,
    /// A bulge is steep where its cross-section (strand included) is this many times the mean of its neighbours', 2 or more;
    /// inflow on both sides is then evened out. None: no limiter. Default 10.
    pub steepness: Option<f64>,
    /// Sweeps of the steepness limiter. Default 5.
    pub steepness_sweeps: usize,
    /// How plastic flow of the strain is integrated.
    pub flow_map: FlowMap,
    /// Whether the elastic force acts (shear of the film). Default on.
    pub elasticity: bool,
    /// Whether the strain flows plastically. Default on.
    pub plasticity: bool,
}

impl Default for FilmSettings {
    fn default() -> Self {
        FilmSettings {
            advection: Advection::default(),
            wall: WallLaw::default(),
            slip_length: 2e-6,
            courant: 0.5,
            dry_fraction: 1e-6,
            speed_limit: 3.0,
            steepness: Some(10.0),
            steepness_sweeps: 5,
            flow_map: FlowMap::default(),
            elasticity: true,
            plasticity: true,
        }
    }
}

impl FilmSettings {
    /// Checks the ranges.
    ///
    /// # Errors
    /// [`FilmError::Parameter`] naming the first setting out of range.
    pub fn check(&self) -> Result<(), FilmError> {
        let require = |name, value: f64, passes: bool, allowed| {
            if value.is_finite() && passes { Ok(()) } else { Err(FilmError::Parameter { name, value, allowed }) }
        };
        require("slip length", self.slip_length, self.slip_length >= 0.0, "finite, at least 0 m")?;
        require("courant", self.courant, (0.05..=0.5).contains(&self.courant), "0.05 to 0.5")?;
        let dry = self.dry_fraction;
        require("dry fraction", dry, (1e-12..=1e-2).contains(&dry), "1e-12 to 1e-2")?;
        require("speed limit", self.speed_limit, self.speed_limit > 0.0, "above 0 edge lengths per step")?;
        let steepness = self.steepness.unwrap_or(10.0);
        require("steepness", steepness, steepness >= 2.0, "at least 2, or none")
    }
}
