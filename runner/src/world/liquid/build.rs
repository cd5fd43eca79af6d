//! Builds the liquid of a scene: materials, settings, tanks, sources, drains, domain.

use std::collections::BTreeSet;
use std::path::Path;

use constitutive::{FlowMap, LawSettings};
use mpm::deformation::PreviousStrain;
use mpm::settings::{
    PressureSettings, ResampleSettings, ShearOperator, ShearSettings, StepSettings, Tangent, TransferDamping,
};
use mpm::{
    Ledger, LiquidGrid, LiquidMaterial, LiquidSettings, Particle, Particles, PressureSolver, ResampleScratch,
    ShearSolver, Solid as _, SourceState, Tensor, Vector, fill,
};
use numerics::multigrid::MultigridSettings;
use numerics::pcg::PcgSettings;
use particle_grid::{BLOCK, Lattice};

use super::coupling::Coupling;
use super::solids::{Body, PosedBody};
use super::sources::{Domain, Drain, MovingShape, Source};
use super::{Flow, FlowReport, FlowState, LiquidState, LiquidWorld, lift, lower, picture, planar, probe, solids};
use crate::scene::Scene;
use crate::scene::liquid::{Dimensions, FlowMap as SceneFlowMap, Liquid, Operator, ShearTangent};
use crate::scene::motion::{Interval, Script};
use crate::scene::solids::Volume;
use crate::scene::time::{Component, StepControl};
use crate::world::solids::{SceneSolid, describe, mesh_unit};
use crate::world::{BuildError, script};

/// Newton iterations on the exact balance at most, where the scene asks for them.
const NEWTON_ITERATIONS: usize = 12;

/// Names of the liquids that may become particles: of tanks, sources and films, each once, in alphabetical order.
#[must_use]
pub fn liquid_names(scene: &Scene) -> Vec<String> {
    let mut names = BTreeSet::new();
    if let Some(liquid) = &scene.liquid {
        names.extend(liquid.tanks.iter().map(|tank| tank.material.clone()));
        names.extend(liquid.sources.iter().map(|source| source.material.clone()));
    }
    for film in scene.strands.iter().filter_map(|group| group.film.as_ref()) {
        match &film.material {
            Some(name) => _ = names.insert(name.clone()),
            None => names.extend(scene.materials.keys().filter(|name| scene.liquid_material(name).is_some()).cloned()),
        }
    }
    names.into_iter().collect()
}

/// Particles per cell along each direction; `None` where the number is no power of the dimension.
#[must_use]
pub fn particles_per_axis(liquid: &Liquid) -> Option<usize> {
    let dimensions = dimensions(liquid);
    (1..=8usize).find(|n| n.pow(dimensions) == liquid.particles_per_cell)
}

/// Number of dimensions.
#[must_use]
pub fn dimensions(liquid: &Liquid) -> u32 {
    match liquid.dimensions {
        Dimensions::Two => 2,
        Dimensions::Three => 3,
    }
}

/// Settings of all stages.
#[must_use]
pub fn settings(scene: &Scene, liquid: &Liquid) -> LiquidSettings {
    let on = |component: Component| !scene.is_disabled(&component);
    let (cfl, deformation) = match &scene.time.step {
        StepControl::Adaptive(step) => (step.cfl, step.deformation),
        StepControl::Fixed(_) => (StepSettings::default().cfl, StepSettings::default().deformation),
    };
    let (tangent, newton_iterations) = match liquid.shear.tangent {
        ShearTangent::Symmetric => (Tangent::Symmetric, ShearSettings::default().newton_iterations),
        ShearTangent::Safe => (Tangent::PositiveDefinite, ShearSettings::default().newton_iterations),
        ShearTangent::Newton => (Tangent::Symmetric, NEWTON_ITERATIONS),
    };
    LiquidSettings {
        particles_per_axis: particles_per_axis(liquid).unwrap_or(4),
        advection: on(Component::Advection),
        plastic_flow: on(Component::PlasticFlow),
        tearing: on(Component::PlasticFlow),
        compressibility: on(Component::Compressibility),
        shear: ShearSettings {
            enabled: on(Component::Shear),
            operator: match liquid.shear.operator {
                Operator::Automatic => ShearOperator::Automatic,
                Operator::Cells => ShearOperator::CellQuadrature,
                Operator::Particles => ShearOperator::Particles,
            },
            tangent,
            newton_iterations,
            pcg: PcgSettings {
                tolerance: liquid.shear.tolerance,
                max_iterations: liquid.shear.max_iterations,
                ..PcgSettings::default()
            },
            ..ShearSettings::default()
        },
        pressure: PressureSettings {
            enabled: on(Component::Pressure),
            predict: liquid.pressure.prediction,
            project_last: liquid.pressure.final_projection,
            multigrid: MultigridSettings {
                tolerance: liquid.pressure.tolerance,
                max_iterations: liquid.pressure.max_iterations,
                ..MultigridSettings::default()
            },
            ..PressureSettings::default()
        },
        resample: ResampleSettings { enabled: on(Component::Resampling), ..ResampleSettings::default() },
        damping: TransferDamping {
            velocity: liquid.velocity_damping,
            stretch: liquid.affine_damping,
            rotation: liquid.affine_damping,
        },
        step: StepSettings { cfl, deformation },
    }
}

/// The materials of a liquid with the given settings of its law.
fn materials(scene: &Scene, liquid: &Liquid, names: &[String]) -> Result<Vec<LiquidMaterial>, BuildError> {
    let law = LawSettings {
        flow_map: match liquid.flow_map {
            SceneFlowMap::Implicit => FlowMap::Implicit,
            SceneFlowMap::Split => FlowMap::Exact,
            SceneFlowMap::Forced => FlowMap::Forced,
        },
        ..LawSettings::default()
    };
    let one = |name: &String| {
        let refuse = |what: String| BuildError::Liquid { name: name.clone(), what };
        let properties = scene.liquid_material(name).ok_or_else(|| refuse("it is not a complete liquid".to_owned()))?;
        let mut material = LiquidMaterial::new(&properties, law).map_err(|error| refuse(error.to_string()))?;
        if scene.is_disabled(&Component::Shear) {
            // what bears no stress carries no strain either
            material.law.shear_modulus = 0.0;
            material.law.newtonian_viscosity = 0.0;
            material.shear_damping = 0.0;
        }
        if scene.is_disabled(&Component::Compressibility) {
            material.rigid_volume = true;
        }
        if scene.is_disabled(&Component::PlasticFlow) {
            material.tearing_strain = None;
        }
        Ok(material)
    };
    names.iter().map(one).collect()
}

/// Builds the liquid of a scene, if it has any.
///
/// # Errors
/// When a part cannot be built; the message names it.
pub fn build(scene: &Scene, solids: &[SceneSolid]) -> Result<Option<(LiquidState, LiquidWorld)>, BuildError> {
    let Some(liquid) = &scene.liquid else { return Ok(None) };
    Ok(Some(match liquid.dimensions {
        Dimensions::Two => {
            let (state, flow) = flow::<2>(scene, liquid, solids)?;
            (LiquidState::Two(state), LiquidWorld::Two(Box::new(flow)))
        }
        Dimensions::Three => {
            let (state, flow) = flow::<3>(scene, liquid, solids)?;
            (LiquidState::Three(state), LiquidWorld::Three(Box::new(flow)))
        }
    }))
}

fn flow<const D: usize>(
    scene: &Scene,
    liquid: &Liquid,
    scene_solids: &[SceneSolid],
) -> Result<(FlowState<D>, Flow<D>), BuildError> {
    let names = liquid_names(scene);
    let materials = materials(scene, liquid, &names)?;
    let settings = settings(scene, liquid);
    settings.check().map_err(|error| BuildError::Solver(error.to_string()))?;
    let bodies = bodies::<D>(scene)?;
    let (lattice, domain) = lattice::<D>(liquid);
    let always = (0.0, f64::INFINITY);
    let span = |during: &Option<Interval>| during.map_or(always, |d| (d.start, d.end));
    let mut sources = Vec::new();
    for (k, source) in liquid.sources.iter().enumerate() {
        let name = source.name.clone().unwrap_or_else(|| format!("source {k}"));
        sources.push(Source {
            place: moving::<D>(scene, &source.shape, &source.motion, &name)?,
            velocity: lift(&lower::<D>(&source.velocity)),
            material: index(&names, &source.material),
            during: span(&source.during),
            name,
        });
    }
    let mut drains = Vec::new();
    for (k, drain) in liquid.drains.iter().enumerate() {
        let name = drain.name.clone().unwrap_or_else(|| format!("drain {k}"));
        let place = moving::<D>(scene, &drain.shape, &drain.motion, &name)?;
        drains.push(Drain { place, during: span(&drain.during), name });
    }
    let gravity = lower::<D>(&scene.gravity);
    let mut grid = LiquidGrid::new(lattice);
    grid.particle_width = settings.particle_width();
    let flow = Flow {
        body: gravity + lower::<D>(&liquid.body_force),
        gravity,
        settings,
        largest_step: match &scene.time.step {
            StepControl::Adaptive(step) => step.max,
            StepControl::Fixed(dt) => *dt,
        },
        bodies,
        sources,
        drains,
        domain,
        grid,
        shear: ShearSolver::default(),
        pressure: PressureSolver::default(),
        coupling: Coupling::default(),
        previous: PreviousStrain::default(),
        maintenance: ResampleScratch::default(),
        resists: false,
        report: FlowReport::default(),
        seconds: [0.0; 2],
        slices: picture::slices(scene),
        probes: probe::build(scene),
        materials,
        names,
    };
    let particles = tanks(scene, liquid, &flow, scene_solids)?;
    let totals = particles.totals(&flow.materials, lattice.dx);
    let state = FlowState {
        ledger: Ledger::open(&totals),
        sources: vec![SourceState::default(); flow.sources.len()],
        particles,
        steps: 0,
        pressure_impulse: Vector::zeros(),
    };
    Ok((state, flow))
}

/// Solids as the liquid meets them.
fn bodies<const D: usize>(scene: &Scene) -> Result<Vec<Body>, BuildError> {
    let one = |(k, solid): (usize, &crate::scene::solids::Solid)| {
        let name = solid.name.clone().unwrap_or_else(|| format!("solid {k}"));
        let refuse = |what: String| BuildError::Solid { name: name.clone(), what };
        if D == 3 {
            return Ok(Body { planar: None });
        }
        planar::check_motion(scene.script(&solid.motion)).map_err(refuse)?;
        let shape = planar::shape(&solid.shape).map_err(refuse)?;
        let shape = if solid.inverted { geometry::planar::PlanarShape::Complement(Box::new(shape)) } else { shape };
        shape.check().map_err(|error| refuse(error.to_string()))?;
        Ok(Body { planar: Some(shape) })
    };
    scene.solids.iter().enumerate().map(one).collect()
}

/// Cells and the box of the liquid.
fn lattice<const D: usize>(liquid: &Liquid) -> (Lattice<D>, Option<Domain<D>>) {
    let mut lattice = Lattice::<D>::new(liquid.cell);
    let Some(described) = &liquid.domain else { return (lattice, None) };
    let mut domain = Domain { low: lower::<D>(&described.low), high: lower::<D>(&described.high) };
    for axis in &described.periodic {
        let a = axis.0.iamax();
        if a >= D {
            continue;
        }
        lattice.origin[a] = described.low[a];
        let cells = (described.high[a] - described.low[a]) / liquid.cell;
        lattice.periods[a] = (cells / BLOCK as f64).round().max(1.0) as u32;
        (domain.low[a], domain.high[a]) = (f64::NEG_INFINITY, f64::INFINITY);
    }
    (lattice, Some(domain))
}

/// A shape with its script, for sources and drains.
fn moving<const D: usize>(
    scene: &Scene,
    volume: &Volume,
    motion: &Script,
    name: &str,
) -> Result<MovingShape, BuildError> {
    let refuse = |what: String| BuildError::Liquid { name: name.to_owned(), what };
    let shape = describe(volume, mesh_unit(scene)).build(Path::new("")).map_err(|error| refuse(error.to_string()))?;
    let described = scene.script(motion);
    let planar = if D == 2 {
        planar::check_motion(described).map_err(refuse)?;
        let planar = planar::shape(volume).map_err(refuse)?;
        planar.check().map_err(|error| refuse(error.to_string()))?;
        Some(planar)
    } else {
        None
    };
    let motion = script::motion(described, scene.time.end)?;
    Ok(MovingShape { center: shape.center(), shape, planar, motion })
}

/// The box that a tank is looked for in: that of its shape, cut by the domain (half-spaces need one).
pub fn tank_bounds(liquid: &Liquid, place: &MovingShape) -> Option<(Vector<3>, Vector<3>)> {
    let domain = liquid.domain.as_ref().map(|d| (d.low, d.high));
    match (place.own_bounds(), domain) {
        (Some((low, high)), Some(box_)) => Some((low.sup(&box_.0), high.inf(&box_.1))),
        (Some(bounds), None) => Some(bounds),
        (None, domain) => domain,
    }
}

/// Fills the tanks: outside solids, inside the domain, and no place twice.
fn tanks<const D: usize>(
    scene: &Scene,
    liquid: &Liquid,
    flow: &Flow<D>,
    scene_solids: &[SceneSolid],
) -> Result<Particles<D>, BuildError> {
    let lattice = *flow.grid.lattice();
    let per_axis = flow.settings.particles_per_axis;
    let volume = fill::sample_volume(&lattice, per_axis);
    let posed: Vec<PosedBody<'_, D>> = solids::at(scene_solids, &flow.bodies, 0.0);
    let mut particles = Particles::new(&flow.materials);
    let mut filled: Vec<MovingShape> = Vec::new();
    for (k, tank) in liquid.tanks.iter().enumerate() {
        let place = moving::<D>(scene, &tank.shape, &Script::still(), &format!("tank {k}"))?;
        let Some((low, high)) = tank_bounds(liquid, &place) else {
            let what = "it has no end and the liquid no domain".to_owned();
            return Err(BuildError::Liquid { name: format!("tank {k}"), what });
        };
        let inside = |x: &Vector<D>| {
            let at = lift(x);
            let in_domain = flow.domain.is_none_or(|d| (0..D).all(|a| x[a] >= d.low[a] && x[a] <= d.high[a]));
            in_domain
                && place.own_distance(&at) < 0.0
                && filled.iter().all(|other| other.own_distance(&at) >= 0.0)
                && posed.iter().all(|solid| solid.distance(x) >= 0.0)
        };
        let material = index(&flow.names, &tank.material);
        let density = flow.materials[material as usize].density;
        let spin = tank.spin;
        for x in fill::fill(&lattice, per_axis, &lower::<D>(&low), &lower::<D>(&high), inside) {
            let mut particle = Particle::new(x, volume, material, density);
            let arm = lift(&x) - lift(&lower::<D>(&place.center));
            particle.velocity = lower::<D>(&(tank.velocity + spin.cross(&arm)));
            let turn = numerics::tensor::cross_matrix(&spin);
            particle.affine = Tensor::<D>::from_fn(|i, j| turn[(i, j)]);
            particles.push(particle);
        }
        filled.push(place);
    }
    Ok(particles)
}

/// Place of a liquid among the materials.
fn index(names: &[String], name: &str) -> u16 {
    names.iter().position(|n| n == name).unwrap_or(0) as u16
}
