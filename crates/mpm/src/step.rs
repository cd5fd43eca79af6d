//! One step of a bulk liquid by itself: the stages in their order.
//!
//! The order is that of the twelve stages without strands: 2, 3, 4, 5, 6 (shear, pressure, shear), 7, 8, 9, 10, 12. A coupled run
//! calls the same stage functions from its own table.

use crate::deformation::PreviousStrain;
use crate::resample::{ResampleReport, ResampleScratch, resample};
use crate::settings::LiquidSettings;
use crate::solid::Solid;
use crate::{
    AdvectReport, DeformationReport, FaceCoupling, LiquidError, LiquidGrid, LiquidMaterial, Particles,
    PlasticityReport, PressureReport, PressureSolver, ShearReport, ShearSolver, WeightsReport, advect, deformation,
    grid_to_particles, liquid_plasticity, particles_to_grid, pressure_solve, recovery, shear_solve, tearing, tension,
    weights,
};
use numerics::tensor::Vector;
use particle_grid::Lattice;
use serde::{Deserialize, Serialize};

/// What one step did, stage by stage.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepReport {
    /// Maintenance of particles.
    pub resample: ResampleReport,
    /// Blocks and mass on the grid.
    pub transfer: particles_to_grid::TransferReport,
    /// Solids and free surface.
    pub weights: WeightsReport,
    /// Torn particles.
    pub torn: usize,
    /// Pressure before the shear solve, where it was predicted.
    pub prediction: Option<PressureReport>,
    /// First shear solve.
    pub shear: ShearReport,
    /// Pressure, where it is on and there is liquid.
    pub pressure: Option<PressureReport>,
    /// Second shear solve, where there was one.
    pub shear_again: Option<ShearReport>,
    /// Final projection, where there was one.
    pub projection: Option<PressureReport>,
    /// Rounds of shear and pressure after the first.
    pub rounds: usize,
    /// Deformation of the particles.
    pub deformation: DeformationReport,
    /// Particles in no liquid cell whose volume had to be set to that of no pressure.
    pub released: usize,
    /// Advection.
    pub advect: AdvectReport,
    /// Plastic flow.
    pub plasticity: PlasticityReport,
}

/// A bulk liquid with its scratch; the state is the particles and the step count, all else is rebuilt.
#[derive(Clone, Debug)]
pub struct LiquidStepper<const D: usize> {
    /// The grid of the last step.
    pub grid: LiquidGrid<D>,
    /// Shear solve.
    pub shear: ShearSolver<D>,
    /// Pressure solve.
    pub pressure: PressureSolver<D>,
    previous: PreviousStrain<D>,
    maintenance: ResampleScratch<D>,
}

impl<const D: usize> LiquidStepper<D> {
    /// A stepper on a lattice.
    #[must_use]
    pub fn new(lattice: Lattice<D>) -> Self {
        Self {
            grid: LiquidGrid::new(lattice),
            shear: ShearSolver::default(),
            pressure: PressureSolver::default(),
            previous: PreviousStrain::default(),
            maintenance: ResampleScratch::default(),
        }
    }

    /// Advances the particles by one step.
    ///
    /// - `solids_before`, `solids_after`: the solids at the start and at the end of the step
    /// - `body`: acceleration by body forces [m/s²]
    /// - `step_index`: number of the step, which seeds the maintenance of particles
    ///
    /// # Errors
    /// Any error of a stage; the particles are then partly advanced and the caller restores its snapshot.
    #[expect(
        clippy::too_many_arguments,
        reason = "state, materials, surroundings, step and settings are all separate things"
    )]
    pub fn advance<S: Solid<D>>(
        &mut self,
        particles: &mut Particles<D>,
        materials: &[LiquidMaterial],
        solids_before: &[S],
        solids_after: &[S],
        body: &Vector<D>,
        dt: f64,
        step_index: u64,
        settings: &LiquidSettings,
    ) -> Result<StepReport, LiquidError> {
        let Self { grid, shear, pressure, previous, maintenance } = self;
        let coupling = FaceCoupling::default();
        let mut report = StepReport {
            resample: ResampleReport::default(),
            transfer: particles_to_grid::TransferReport::default(),
            weights: WeightsReport::default(),
            torn: 0,
            shear: ShearReport {
                solve: numerics::SolveReport::TRIVIAL,
                newton_iterations: 0,
                nonlinear_residual: 0.0,
                fell_back: false,
                diagonal: true,
            },
            prediction: None,
            pressure: None,
            shear_again: None,
            projection: None,
            rounds: 0,
            deformation: DeformationReport::default(),
            released: 0,
            advect: AdvectReport::default(),
            plasticity: PlasticityReport::default(),
        };
        if particles.is_empty() {
            return Ok(report);
        }
        shear.lend(grid);
        let maintain = settings.resample.every as u64;
        if settings.resample.enabled && maintain > 0 && step_index.is_multiple_of(maintain) {
            report.resample = resample(
                particles,
                materials,
                grid,
                solids_before,
                dt * maintain as f64,
                step_index,
                settings,
                maintenance,
            )?;
        }
        grid.particle_width = settings.particle_width();
        particles_to_grid::activate(particles, materials, &[], grid)?;
        if settings.tearing {
            report.torn = tearing::tearing(particles, materials)?;
        }
        shear.reclaim(grid);
        let resists = shear.prepare(particles, materials, dt, &settings.shear)?;
        report.transfer =
            particles_to_grid::particles_to_grid(particles, materials, resists.then_some(&shear.state), grid);
        report.weights = weights::weights(grid, solids_before, None, &settings.pressure)?;
        shear_solve::impose_walls(grid);
        shear.begin(particles, grid, &coupling, dt, &settings.shear);
        let again = resists && settings.shear.after_pressure;
        let predict = settings.pressure.enabled && settings.pressure.predict && resists && !again;
        if settings.pressure.enabled {
            pressure.build(grid, None, dt, &settings.pressure);
        }
        if predict {
            report.prediction = Some(pressure.predict(grid, body, None, dt, &settings.pressure)?);
        }
        report.shear = shear.solve(particles, materials, grid, &coupling, body, dt, predict, &settings.shear)?;
        if predict {
            report.pressure = Some(pressure.correct(grid, None, dt, &settings.pressure)?);
            if let Some((again, corrected, rounds)) =
                shear.settle(pressure, particles, materials, grid, body, None, dt, settings)?
            {
                (report.shear_again, report.projection, report.rounds) = (Some(again), Some(corrected), rounds);
            }
        } else if settings.pressure.enabled {
            report.pressure = Some(pressure.solve(grid, None, dt, &settings.pressure)?);
            if again {
                report.shear_again =
                    Some(shear.solve(particles, materials, grid, &coupling, body, dt, true, &settings.shear)?);
                if settings.pressure.project_last {
                    report.projection = Some(pressure.correct(grid, None, dt, &settings.pressure)?);
                }
            } else {
                pressure_solve::correct_velocities(grid, dt);
            }
        }
        grid_to_particles::grid_to_particles(particles, grid, &settings.damping);
        report.deformation = deformation::deformation(particles, materials, previous, dt, settings.compressibility)?;
        report.released = tension::settle_volume(particles, materials, grid, settings);
        tension::release_loners(particles, grid);
        if settings.advection {
            report.advect = advect::advect(particles, grid, solids_after, dt);
        }
        if settings.plastic_flow {
            report.plasticity = liquid_plasticity::liquid_plasticity(particles, materials, previous, dt)?;
        }
        recovery::recovery(particles, materials, dt)?;
        Ok(report)
    }

    /// Bytes held besides the particles.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.grid.bytes() + self.shear.bytes()
    }
}
