//! What the cases share: liquids, blocks of particles, and a run.

use constitutive::{FlowCurve, LawSettings, Liquid};
use mpm::{
    LiquidError, LiquidMaterial, LiquidSettings, LiquidStepper, Particle, Particles, Solid, StepReport, Vector, fill,
};
use particle_grid::Lattice;

use crate::case::{CaseError, Params};

/// Standard gravity of the reference values [m/s²].
pub const GRAVITY: f64 = 9.81;

/// The preset named by the parameter `material`.
pub fn preset(p: &Params) -> Result<Liquid, CaseError> {
    Liquid::preset(p.text("material")?).map_err(|_| {
        p.reject("material", &format!("the name of a liquid: {}", constitutive::presets::LIQUID_NAMES.join(", ")))
    })
}

/// The material of a liquid with default law settings and without shear damping.
pub fn material(liquid: &Liquid) -> Result<LiquidMaterial, CaseError> {
    let mut material = LiquidMaterial::new(liquid, LawSettings::default()).map_err(CaseError::failed)?;
    material.shear_damping = 0.0;
    material.tearing_strain = None;
    material.recovery_time = None;
    Ok(material)
}

/// A liquid given by numbers, incompressible.
pub fn liquid(density: f64, shear_modulus: f64, flow: FlowCurve) -> Result<Liquid, CaseError> {
    let mut l = Liquid::preset("water").map_err(CaseError::failed)?;
    l.density = density;
    l.shear_modulus = shear_modulus;
    l.flow = flow;
    Ok(l)
}

/// How often shear and pressure are solved in a step, by the parameter `coupling`.
pub fn couple(settings: &mut LiquidSettings, p: &Params) -> Result<(), CaseError> {
    let (again, last) = match p.text("coupling")? {
        "once" => (false, false),
        "twice" => (true, false),
        "projected" => (true, true),
        _ => return Err(p.reject("coupling", "once, twice or projected")),
    };
    settings.shear.after_pressure = again;
    settings.pressure.project_last = last;
    Ok(())
}

/// Particles on the sub-lattice of a region.
pub fn region<const D: usize>(
    lattice: &Lattice<D>,
    per_axis: usize,
    low: Vector<D>,
    high: Vector<D>,
    inside: impl Fn(&Vector<D>) -> bool,
    materials: &[LiquidMaterial],
) -> Particles<D> {
    let volume = fill::sample_volume(lattice, per_axis);
    let mut particles = Particles::new(materials);
    for x in fill::fill(lattice, per_axis, &low, &high, inside) {
        particles.push(Particle::new(x, volume, 0, materials[0].density));
    }
    particles
}

/// A run of a bulk liquid between resting solids.
pub struct Run<'a, const D: usize, S: Solid<D>> {
    pub particles: Particles<D>,
    pub materials: Vec<LiquidMaterial>,
    pub solids: &'a [S],
    pub body: Vector<D>,
    pub stepper: LiquidStepper<D>,
    pub settings: LiquidSettings,
    pub time: f64,
    pub steps: u64,
}

impl<'a, const D: usize, S: Solid<D>> Run<'a, D, S> {
    pub fn new(
        lattice: Lattice<D>,
        particles: Particles<D>,
        materials: Vec<LiquidMaterial>,
        solids: &'a [S],
        body: Vector<D>,
        settings: LiquidSettings,
    ) -> Self {
        Run { particles, materials, solids, body, stepper: LiquidStepper::new(lattice), settings, time: 0.0, steps: 0 }
    }

    /// One step; halved up to six times where the liquid refuses it.
    pub fn step(&mut self, dt: f64) -> Result<StepReport, CaseError> {
        let mut dt = dt;
        for _ in 0..6 {
            let before = self.particles.clone();
            let result = self.stepper.advance(
                &mut self.particles,
                &self.materials,
                self.solids,
                self.solids,
                &self.body,
                dt,
                self.steps,
                &self.settings,
            );
            match result {
                Ok(report) => {
                    self.time += dt;
                    self.steps += 1;
                    return Ok(report);
                }
                Err(error) if LiquidError::is_retryable(&error) => {
                    self.particles = before;
                    dt *= 0.5;
                }
                Err(error) => return Err(CaseError::failed(error)),
            }
        }
        Err(CaseError::Failed(format!("no step was small enough at {} s", self.time)))
    }

    /// The largest step the flow allows, at most `most`.
    pub fn allowed(&self, most: f64) -> f64 {
        mpm::step_limit(&self.particles, self.stepper.grid.lattice().dx, 0.0, &self.settings.step).step().min(most)
    }
}

/// Processor time of the calling thread [s], which other programs do not lengthen; wall clock where the system does not say.
pub fn processor_seconds() -> f64 {
    static START: std::sync::LazyLock<std::time::Instant> = std::sync::LazyLock::new(std::time::Instant::now);
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    let spent: Option<f64> = text.split(' ').next().and_then(|word| word.parse().ok());
    spent.map_or_else(|| START.elapsed().as_secs_f64(), |nanoseconds| 1e-9 * nanoseconds)
}

/// Runs a case on one thread of its own, so that its processor time is known.
pub fn alone<R: Send>(work: impl FnOnce() -> Result<R, CaseError> + Send) -> Result<R, CaseError> {
    rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(CaseError::failed)?.install(work)
}
