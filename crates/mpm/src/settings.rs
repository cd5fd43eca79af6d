//! Settings of the bulk liquid.

use crate::LiquidError;
use numerics::multigrid::MultigridSettings;
use numerics::pcg::PcgSettings;
use serde::{Deserialize, Serialize};

/// Where the shear operator takes its material from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ShearOperator {
    /// Points in cells where the step is short enough against the elastic waves for them to be safe, particles elsewhere: see
    /// [`crate::shear_solve::SAFE_STIFFNESS`].
    #[default]
    Automatic,
    /// Every product goes through every particle: the reference.
    Particles,
    /// Tangents are summed once per solve into `2^D` points a cell; products cost some tens of times less.
    CellQuadrature,
}

/// Which tangent of the return map the shear solve uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Tangent {
    /// Symmetrised, with the geometric part; falls back to [`Tangent::PositiveDefinite`] where it breaks down.
    #[default]
    Symmetric,
    /// Positive semi-definite part only: never breaks down, a little less exact at large elastic strain.
    PositiveDefinite,
    /// Secant of the flow: stiffest, never overshoots where flowing liquid stops within a step, follows changes more slowly.
    Secant,
}

/// The implicit shear solve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ShearSettings {
    /// Off: stresses are neither computed nor applied.
    pub enabled: bool,
    /// Where products take their material from.
    pub operator: ShearOperator,
    /// Which tangent.
    pub tangent: Tangent,
    /// Most Newton iterations on the true stress [1], 1 to 20. One linearises about the motion of the last step and does not look
    /// back: cheaper by a third, but strongly shear-thinning liquids that stop within a step then overshoot without bound.
    pub newton_iterations: usize,
    /// Residual of the nonlinear problem, relative to that of the first iteration, at which Newton stops [1]; used with more than
    /// one iteration.
    pub newton_tolerance: f64,
    /// Solve once more after the pressure, as the published method does. That leaves velocities whose divergence the pressure has
    /// not seen: where elastic strains are large, a layer under shear then grows unstable unless `pressure.project_last` is on
    /// too. Off is as accurate and costs half; the shear stress then lags the pressure by a step.
    pub after_pressure: bool,
    /// The conjugate gradients.
    pub pcg: PcgSettings,
}

impl Default for ShearSettings {
    fn default() -> Self {
        Self {
            enabled: true,
            operator: ShearOperator::default(),
            tangent: Tangent::default(),
            newton_iterations: 4,
            newton_tolerance: 0.05,
            after_pressure: false,
            pcg: PcgSettings::default(),
        }
    }
}

/// The pressure solve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PressureSettings {
    /// Off: the liquid neither resists compression nor keeps its volume.
    pub enabled: bool,
    /// Smallest distance of the free surface from a cell centre, in cells [1]; keeps the equation definite.
    pub ghost_floor: f64,
    /// Solve for the pressure of the free motion first, so that the shear solve knows what the pressure will balance. Without it,
    /// walls that hold the liquid drag on its free fall and liquid at rest creeps by up to `g dt`.
    pub predict: bool,
    /// Share of a cell that liquid must fill for the cell to count as liquid [1], 0 to 1; one half puts the surface where the
    /// volume says.
    pub liquid_threshold: f64,
    /// Project once more at the end, so that velocities are free of divergence after the second shear solve.
    pub project_last: bool,
    /// Multigrid and its stopping rule.
    pub multigrid: MultigridSettings,
}

impl Default for PressureSettings {
    fn default() -> Self {
        Self {
            enabled: true,
            ghost_floor: 0.01,
            predict: true,
            liquid_threshold: 0.5,
            project_last: false,
            multigrid: MultigridSettings::default(),
        }
    }
}

/// Splitting, merging and spreading of particles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ResampleSettings {
    /// Off: particles are never split, merged or moved apart.
    pub enabled: bool,
    /// Steps between passes [1]; 0 never. A pass spreads particles for all the steps since the last.
    pub every: usize,
    /// Rate at which crowded particles inside the liquid are moved apart [1/s]; 0 not at all.
    pub relaxation_rate: f64,
}

impl Default for ResampleSettings {
    fn default() -> Self {
        Self { enabled: true, every: 4, relaxation_rate: 10.0 }
    }
}

/// Damping of what particles take from the grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TransferDamping {
    /// Share of the velocity lost per step [1].
    pub velocity: f64,
    /// Share of the symmetric affine part lost per step [1].
    pub stretch: f64,
    /// Share of the skew affine part lost per step [1].
    pub rotation: f64,
}

/// Limits of the step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StepSettings {
    /// Cells that the fastest particle may cross in a step [1]; smaller is closer and costlier.
    pub cfl: f64,
    /// Largest product of step and affine norm [1]: the deformation a particle may see in a step.
    pub deformation: f64,
}

impl Default for StepSettings {
    fn default() -> Self {
        Self { cfl: 1.0, deformation: 0.5 }
    }
}

/// All settings of the bulk liquid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LiquidSettings {
    /// Particles per cell along each direction [1], 1 to 8; four give 64 per cell in space.
    pub particles_per_axis: usize,
    /// Particles move with the flow.
    pub advection: bool,
    /// Strain relaxes by plastic flow.
    pub plastic_flow: bool,
    /// Liquids that tear do so.
    pub tearing: bool,
    /// Volume ratios follow the flow (off: every liquid keeps its volume ratio).
    pub compressibility: bool,
    /// Implicit shear.
    pub shear: ShearSettings,
    /// Pressure.
    pub pressure: PressureSettings,
    /// Particle maintenance.
    pub resample: ResampleSettings,
    /// Damping of transfers.
    pub damping: TransferDamping,
    /// Limits of the step.
    pub step: StepSettings,
}

impl Default for LiquidSettings {
    fn default() -> Self {
        Self {
            particles_per_axis: 4,
            advection: true,
            plastic_flow: true,
            tearing: true,
            compressibility: true,
            shear: ShearSettings::default(),
            pressure: PressureSettings::default(),
            resample: ResampleSettings::default(),
            damping: TransferDamping::default(),
            step: StepSettings::default(),
        }
    }
}

impl LiquidSettings {
    /// Width of the room that a particle stands for [cells].
    #[must_use]
    pub fn particle_width(&self) -> f64 {
        1.0 / self.particles_per_axis as f64
    }

    /// Checks all ranges.
    ///
    /// # Errors
    /// Names the first setting outside its range.
    pub fn check(&self) -> Result<(), LiquidError> {
        let require = |name, value: f64, passes: bool, allowed| {
            if value.is_finite() && passes { Ok(()) } else { Err(LiquidError::Setting { name, value, allowed }) }
        };
        let share = |name, value: f64| require(name, value, (0.0..=1.0).contains(&value), "0 to 1");
        let positive = |name, value: f64| require(name, value, value > 0.0, "above 0");
        let n = self.particles_per_axis;
        require("particles_per_axis", n as f64, (1..=8).contains(&n), "1 to 8")?;
        let n = self.shear.newton_iterations;
        require("shear.newton_iterations", n as f64, (1..=20).contains(&n), "1 to 20")?;
        positive("shear.newton_tolerance", self.shear.newton_tolerance)?;
        positive("shear.pcg.tolerance", self.shear.pcg.tolerance)?;
        positive("pressure.multigrid.tolerance", self.pressure.multigrid.tolerance)?;
        let floor = self.pressure.ghost_floor;
        require("pressure.ghost_floor", floor, floor > 0.0 && floor <= 1.0, "above 0, at most 1")?;
        let threshold = self.pressure.liquid_threshold;
        require("pressure.liquid_threshold", threshold, threshold > 0.0 && threshold < 1.0, "between 0 and 1")?;
        require(
            "resample.relaxation_rate",
            self.resample.relaxation_rate,
            self.resample.relaxation_rate >= 0.0,
            "at least 0",
        )?;
        share("damping.velocity", self.damping.velocity)?;
        share("damping.stretch", self.damping.stretch)?;
        share("damping.rotation", self.damping.rotation)?;
        positive("step.cfl", self.step.cfl)?;
        positive("step.deformation", self.step.deformation)
    }
}
