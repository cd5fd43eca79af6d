//! Films as a scene describes them.

use std::f64::consts::PI;

use nalgebra::Vector3;
use rods::RodSet;
use surface_flow::inertia::InertiaForm;
use surface_flow::{Advection, End, FilmLiquid, FilmReport, FilmSettings, FilmSolver, FilmState, WallLaw, film_area};

use super::{Exchanged, FilmLedger, FilmWorld, Films};
use crate::plan::Components;
use crate::scene::expand::StrandGeometry;
use crate::scene::film::{FilmAdvection, FilmEnds, FlowInertia, StrandFilm};
use crate::scene::materials::Material;
use crate::scene::presets::LiquidProperties;
use crate::scene::time::Component;
use crate::scene::{Scene, film};
use crate::world::BuildError;

/// Range of the solver's dry fraction of a strand's cross-section.
const DRY: (f64, f64) = (1e-12, 1e-2);

/// Name of the liquid of a film: its own, else the first that the bulk is filled with, else the only one there is.
pub(crate) fn liquid_name(scene: &Scene, film: Option<&StrandFilm>) -> Option<String> {
    let bulk = || {
        let liquid = scene.liquid.as_ref()?;
        let tank = liquid.tanks.first().map(|tank| tank.material.clone());
        tank.or_else(|| liquid.sources.first().map(|source| source.material.clone()))
    };
    film.and_then(|film| film.material.clone()).or_else(bulk).or_else(|| {
        let liquids = scene.materials.iter().filter(|(_, material)| matches!(material, Material::Liquid(_)));
        liquids.map(|(name, _)| name.clone()).next()
    })
}

fn settings(scene: &Scene) -> FilmSettings {
    let model = &scene.film;
    let on = |component: Component| !scene.is_disabled(&component);
    let x = model.dry_height;
    FilmSettings {
        advection: match model.advection {
            FilmAdvection::Conservative => Advection::Conservative,
            FilmAdvection::SemiLagrangian => Advection::SemiLagrangian,
        },
        wall: match model.wall {
            film::WallLaw::Lubrication => WallLaw::Lubrication,
            film::WallLaw::Paper => WallLaw::Paper,
        },
        // a film of x radii has (2 x + x²) of the strand's cross-section
        dry_fraction: (2.0 * x + x * x).clamp(DRY.0, DRY.1),
        steepness: (model.steepness < 1e9).then_some(model.steepness),
        elasticity: on(Component::FilmShear),
        plasticity: on(Component::FilmPlasticFlow),
        ..FilmSettings::default()
    }
}

/// Volume of the drop whose weight the surface tension around a strand's end just holds (Tate's law) [m³].
fn tate_volume(liquid: &LiquidProperties, radius: [f64; 2], gravity: &Vector3<f64>) -> f64 {
    let weight = liquid.density * gravity.norm();
    if weight > 0.0 { 2.0 * PI * (radius[0] * radius[1]).sqrt() * liquid.surface_tension / weight } else { 0.0 }
}

/// Films of a scene at the start; none where nothing can be wet.
///
/// # Errors
/// When a liquid or a setting cannot be used.
pub(crate) fn build(
    scene: &Scene,
    components: &Components,
    rods: &RodSet,
    geometry: &[StrandGeometry],
) -> Result<Option<(FilmWorld, Films)>, BuildError> {
    if !components.film {
        return Ok(None);
    }
    let refuse = |what: String| BuildError::Solver(format!("films: {what}"));
    let (mut names, mut liquids, mut media): (Vec<String>, Vec<LiquidProperties>, Vec<(FilmLiquid, f64)>) =
        Default::default();
    let (mut medium_of, mut liquid_of, mut density) = (Vec::new(), Vec::new(), Vec::new());
    let counts: Vec<usize> = geometry.iter().map(|strand| strand.positions.len()).collect();
    let mut films = FilmState::new(&counts);
    let mut drop_volume = Vec::new();
    for (strand, shape) in geometry.iter().enumerate() {
        let described = scene.strands[shape.group].film.as_ref();
        let name = liquid_name(scene, described).ok_or_else(|| refuse("the scene has no liquid".into()))?;
        let liquid = scene.liquid_material(&name).ok_or_else(|| refuse(format!("`{name}` is not a whole liquid")))?;
        let slip = described.map_or(2e-6, |film| film.slip_length);
        let prepared = FilmLiquid::new(&liquid).map_err(|error| refuse(error.to_string()))?;
        let place = names.iter().position(|known| *known == name).unwrap_or_else(|| {
            names.push(name.clone());
            liquids.push(liquid.clone());
            names.len() - 1
        });
        let medium = media.iter().position(|known| *known == (prepared, slip)).unwrap_or_else(|| {
            media.push((prepared, slip));
            media.len() - 1
        });
        liquid_of.push(place as u32);
        medium_of.push(medium as u32);
        density.push(liquid.density);

        let vertices = films.vertices(strand);
        let (first, last) = (vertices.start, vertices.end - 1);
        for (i, v) in vertices.enumerate() {
            let height = shape.film_height.get(i).copied().unwrap_or(0.0);
            films.area[v] = film_area(height, rods.radius[v][0] + rods.radius[v][1]);
        }
        let ends = described.map_or(FilmEnds::Drip, |film| film.ends.clone());
        let clamped = |vertex: usize| shape.clamps.iter().any(|clamp| clamp.vertices.contains(&vertex));
        let open = |clamped: bool| match ends {
            FilmEnds::Open => End::Open,
            FilmEnds::Drip if !clamped => End::Open,
            _ => End::Closed,
        };
        films.ends[strand] = [open(clamped(0)), open(clamped(shape.positions.len() - 1))];
        let volume = |v: usize| match (&ends, scene.film.drop_diameter) {
            (FilmEnds::Open, _) => 0.0,
            (_, Some(diameter)) => PI / 6.0 * diameter.powi(3),
            (_, None) => tate_volume(&liquid, rods.radius[v], &scene.gravity),
        };
        drop_volume.push([volume(first), volume(last)]);
    }
    let solver =
        FilmSolver::for_strands(&media, medium_of, settings(scene)).map_err(|error| refuse(error.to_string()))?;
    let (vertices, edges) = (rods.vertex_count(), rods.edge_count());
    let on = |component: Component| !scene.is_disabled(&component);
    let inertia = match scene.film.inertia {
        FlowInertia::Force => InertiaForm::Advective,
        FlowInertia::Transfer => InertiaForm::Flux,
        FlowInertia::BackTraced => InertiaForm::SemiLagrangian,
    };
    let advects = on(Component::FilmAdvection);
    let mut world = FilmWorld {
        solver,
        names,
        liquids,
        liquid_of,
        density,
        advects,
        inertia: (advects && on(Component::FlowInertia)).then_some(inertia),
        drips: on(Component::Dripping),
        drop_volume,
        edge_length: rods.rest_length.clone(),
        tangent: vec![Vector3::zeros(); edges],
        acceleration: vec![Vector3::zeros(); vertices],
        mass: vec![0.0; vertices],
        mass_before: vec![0.0; vertices],
        height: vec![0.0; vertices],
        impulse: vec![Vector3::zeros(); vertices],
        torque: vec![0.0; edges],
        report: FilmReport::default(),
        exchanged: Exchanged::default(),
        spin: Vec::new(),
    };
    world.weigh(&films, rods);
    let ledger = FilmLedger { initial: world.liquid_mass(&films), ..FilmLedger::default() };
    Ok(Some((world, Films { state: films, ledger })))
}
