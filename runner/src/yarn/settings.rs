//! From the scene to the settings of the library.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use yarn::settings::{
    AttractorSettings, Bending, ContactModuli, DomainSettings, Drive, ImplicitSettings, Integrator, Interpolation,
    ObstacleSettings, OversizedStep, PathSettings, Pin, PinPlace as Place, StepSettings, WallKind, WallSettings,
    YarnMaterial as MaterialSettings,
};
use yarn::{YarnError, YarnGroup as GroupSettings, YarnSettings, YarnShape as Shape, parse_polylines};

use crate::scene::Scene;
use crate::scene::error::ProblemKind;
use crate::scene::expand::{MEMORY_LIMIT, show_bytes};
use crate::scene::liquid::Dimensions;
use crate::scene::materials::Material;
use crate::scene::motion::Script;
use crate::scene::yarn::{
    AttractorPath, AttractorStrength, OversizedYarnStep, PinPlace, YarnAttractor, YarnBending, YarnDomain, YarnFile,
    YarnGroup, YarnIntegrator, YarnMaterial, YarnShape, YarnVertex, YarnWall, Yarns,
};
use crate::world::{BuildError, script, solids};

/// Why a scene of yarns is refused: where, and what is wrong.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{place}: {problem}")]
pub struct SettingsError {
    /// Field inside the section `yarn`, as in `groups[2].shape.radius`; empty for the whole section.
    pub place: String,
    /// What is wrong and what is allowed.
    pub problem: String,
    /// What kind of problem it is.
    pub kind: ProblemKind,
}

impl SettingsError {
    fn at(place: impl Into<String>, problem: impl Into<String>) -> SettingsError {
        SettingsError { place: place.into(), problem: problem.into(), kind: ProblemKind::Inconsistent }
    }
}

impl From<YarnError> for SettingsError {
    fn from(error: YarnError) -> SettingsError {
        match error {
            YarnError::Setting { setting, problem } => {
                // Fields that have other names, or stand elsewhere, in the scene.
                let place = setting
                    .replace("yarns[", "groups[")
                    .replace("quadrature_mass_share", "middle_mass")
                    .replace("step.integrator.", "integrator.")
                    .replace("step.", "");
                SettingsError::at(place, problem)
            }
            other => SettingsError::at("", other.to_string()),
        }
    }
}

impl From<BuildError> for SettingsError {
    fn from(error: BuildError) -> SettingsError {
        SettingsError::at("", error.to_string())
    }
}

/// Turns vectors of the scene into lists of two or three numbers.
#[derive(Clone, Copy)]
struct Space {
    flat: bool,
}

impl Space {
    fn list(self, v: &Vector3<f64>) -> Vec<f64> {
        if self.flat { vec![v.x, v.y] } else { vec![v.x, v.y, v.z] }
    }

    /// A point or direction, which in the plane must lie in it.
    fn point(self, place: impl Into<String>, v: &Vector3<f64>) -> Result<Vec<f64>, SettingsError> {
        if self.flat && v.z != 0.0 {
            return Err(SettingsError::at(place, format!("z must be 0 in two dimensions, is {}", v.z)));
        }
        Ok(self.list(v))
    }
}

/// The library's settings of a scene with a `yarn` section; checked as far as that needs no yarns.
///
/// # Errors
/// The first thing that is wrong, with its place inside the section.
pub fn settings(scene: &Scene, section: &Yarns) -> Result<YarnSettings, SettingsError> {
    let flat = section.dimensions == Dimensions::Two;
    let space = Space { flat };
    let mut groups = Vec::with_capacity(section.groups.len());
    for (g, group) in section.groups.iter().enumerate() {
        groups.push(self::group(scene, space, g, group)?);
    }
    let sizes: Vec<(f64, f64)> = groups.iter().map(|group: &GroupSettings| group.size(section.cell)).collect();
    let vertices: f64 = sizes.iter().map(|size| size.1).sum();
    let bytes = vertices * super::BYTES_PER_VERTEX;
    if !(bytes <= MEMORY_LIMIT) {
        let (needed, limit) = (show_bytes(bytes), show_bytes(MEMORY_LIMIT));
        let problem =
            format!("this needs about {needed} of memory: {vertices:.3e} vertices; at most {limit} are allowed");
        return Err(SettingsError { kind: ProblemKind::TooLarge, ..SettingsError::at("groups", problem) });
    }
    let counts: Vec<usize> = sizes.iter().map(|size| size.0 as usize).collect();
    let settings = YarnSettings {
        dimension: if flat { 2 } else { 3 },
        cell: section.cell,
        domain: section.domain.as_ref().map(|domain| self::domain(space, section.cell, domain)).transpose()?,
        materials: materials(scene),
        yarns: groups,
        gravity: space.list(&scene.gravity),
        attractor: section.attractor.as_ref().map(|attractor| self::attractor(space, attractor)).transpose()?,
        obstacles: obstacles(scene)?,
        pins: pins(scene, space, section)?,
        drives: drives(scene, section, &counts)?,
        step: step(section),
        plastic: section.plastic,
        quadrature_mass_share: section.middle_mass,
        momentum_hand_back: section.hand_back,
        affine_damping: section.affine_damping,
        min_section: section.min_section,
        push_out: section.push_out,
        compat: section.compat,
    };
    settings.check()?;
    Ok(settings)
}

/// Number of yarns and about how many vertices each group will have, without making them.
#[must_use]
pub fn group_sizes(settings: &YarnSettings) -> Vec<(f64, f64)> {
    settings.yarns.iter().map(|group| group.size(settings.cell)).collect()
}

fn materials(scene: &Scene) -> BTreeMap<String, MaterialSettings> {
    let of = |material: &YarnMaterial| MaterialSettings {
        density: material.density,
        width: material.width,
        stretch_modulus: material.stretch_modulus,
        shear_modulus: material.shear_modulus,
        contact: ContactModuli::Engineering {
            young_modulus: material.young_modulus,
            poisson_ratio: material.poisson_ratio,
        },
        friction: material.friction,
        section_friction: material.section_friction,
        bending: match material.bending {
            YarnBending::Flexible => Bending::None,
            YarnBending::Rod(share) => Bending::RodShare { share },
            YarnBending::Spring(share) => Bending::SpringShare { share },
        },
    };
    let yarns = scene.materials.iter().filter_map(|(name, material)| match material {
        Material::Yarn(material) => Some((name.clone(), of(material))),
        _ => None,
    });
    yarns.collect()
}

fn group(scene: &Scene, space: Space, g: usize, group: &YarnGroup) -> Result<GroupSettings, SettingsError> {
    let place = format!("groups[{g}]");
    Ok(GroupSettings {
        material: group.material.clone(),
        shape: shape(scene, space, &format!("{place}.shape"), g, &group.shape)?,
        segment_length: group.segment_length,
        velocity: space.point(format!("{place}.velocity"), &group.velocity)?,
        stretch: group.stretch,
    })
}

fn shape(scene: &Scene, space: Space, place: &str, g: usize, shape: &YarnShape) -> Result<Shape, SettingsError> {
    let point = |name: &str, v: &Vector3<f64>| space.point(format!("{place}.{name}"), v);
    // Groups draw from streams of their own.
    let seed = scene.seed.wrapping_add((g as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15));
    Ok(match shape {
        YarnShape::Line(line) => Shape::Line { from: point("from", &line.from)?, to: point("to", &line.to)? },
        YarnShape::Lines(lines) => Shape::Lines {
            from: point("from", &lines.from)?,
            to: point("to", &lines.to)?,
            count: lines.count,
            step: point("step", &lines.step)?,
        },
        YarnShape::Circle(circle) => Shape::Circle {
            center: point("center", &circle.center)?,
            radius: circle.radius,
            normal: if space.flat { Vec::new() } else { space.list(&circle.axis.0) },
            start: circle.start,
            sweep: circle.angle,
        },
        YarnShape::Helix(helix) => Shape::Helix {
            from: point("from", &helix.from)?,
            to: point("to", &helix.to)?,
            radius: helix.radius,
            turns: helix.turns,
        },
        YarnShape::Weave(sheet) => Shape::Weave {
            center: point("center", &sheet.center)?,
            warp: space.list(&sheet.warp.0),
            weft: space.list(&sheet.weft.0),
            count: (sheet.warp_count, sheet.weft_count),
            spacing: sheet.spacing,
            amplitude: sheet.amplitude,
            overhang: sheet.overhang,
        },
        YarnShape::Knit(knit) => Shape::Knit {
            center: point("center", &knit.center)?,
            rows: knit.rows,
            loops: knit.loops,
            width: knit.width,
            height: knit.height,
            depth: knit.depth,
        },
        YarnShape::HairBall(ball) => Shape::HairBall {
            center: point("center", &ball.center)?,
            radius: ball.radius,
            count: ball.count,
            length: ball.length,
            curl: ball.curl,
            seed,
        },
        YarnShape::CutPile(pile) => Shape::CutPile {
            low: point("low", &pile.low)?,
            high: point("high", &pile.high)?,
            count: pile.count,
            length: pile.length,
            seed,
        },
        YarnShape::Polyline(line) => Shape::Polyline {
            points: line.points.iter().map(|x| point("points", x)).collect::<Result<_, _>>()?,
            rest_lengths: line.rest_lengths.clone(),
            velocities: Vec::new(),
        },
        YarnShape::File(file) => Shape::Polylines { yarns: file_of_yarns(scene, space, place, file)? },
    })
}

fn file_of_yarns(
    scene: &Scene,
    space: Space,
    place: &str,
    file: &YarnFile,
) -> Result<Vec<Vec<Vec<f64>>>, SettingsError> {
    let refuse = |problem: String| SettingsError {
        kind: ProblemKind::File,
        ..SettingsError::at(format!("{place}.file"), problem)
    };
    let path = &file.file.path;
    let text = std::fs::read_to_string(path)
        .map_err(|error| refuse(format!("cannot read the yarns {}: {error}", path.display())))?;
    let mut yarns = parse_polylines(&text, if space.flat { 2 } else { 3 })
        .map_err(|error| refuse(format!("{}: {error}", path.display())))?;
    let scale = file.scale * solids::mesh_unit(scene);
    yarns.iter_mut().flatten().flatten().for_each(|x| *x *= scale);
    Ok(yarns)
}

fn domain(space: Space, cell: f64, domain: &YarnDomain) -> Result<DomainSettings, SettingsError> {
    let mut cells = Vec::new();
    let axes = if space.flat { 2 } else { 3 };
    for a in 0..axes {
        let count = (domain.high[a] - domain.low[a]) / cell;
        let whole = count.round();
        if (count - whole).abs() > 1e-6 * count.abs().max(1.0) || !(4.0..=1048576.0).contains(&whole) {
            let axis = ["x", "y", "z"][a];
            return Err(SettingsError::at(
                "domain.high",
                format!("the box must be a whole number of cells wide, from 4 to 1048576; along {axis} it is {count}"),
            ));
        }
        cells.push(whole as usize);
    }
    let kind = |own: &Option<YarnWall>| match own.as_ref().unwrap_or(&domain.walls) {
        YarnWall::Open => WallKind::Open,
        YarnWall::Stick => WallKind::Stick,
        YarnWall::Slip => WallKind::Slip,
        YarnWall::Separate => WallKind::Separate,
        YarnWall::Friction(friction) => WallKind::Friction(*friction),
    };
    let sides = [(&domain.left, &domain.right), (&domain.bottom, &domain.top), (&domain.back, &domain.front)]
        .map(|(low, high)| (kind(low), kind(high)));
    if space.flat && (domain.back.is_some() || domain.front.is_some()) {
        return Err(SettingsError::at("domain", "`back` and `front` exist in three dimensions only"));
    }
    Ok(DomainSettings {
        origin: space.list(&domain.low),
        cells,
        walls: WallSettings::Sides(sides[..axes].to_vec()),
        layers: domain.layers,
    })
}

fn attractor(space: Space, attractor: &YarnAttractor) -> Result<AttractorSettings, SettingsError> {
    let point = |v: &Vector3<f64>| space.point("attractor.path", v);
    let path = match &attractor.path {
        AttractorPath::Fixed(place) => PathSettings::Fixed(point(place)?),
        AttractorPath::Points(path) => PathSettings::Points {
            points: path
                .points
                .iter()
                .map(|key| Ok((key.time, point(&key.at)?)))
                .collect::<Result<_, SettingsError>>()?,
            interpolation: if path.smooth { Interpolation::CatmullRom } else { Interpolation::Linear },
        },
        AttractorPath::Orbit(orbit) => PathSettings::Orbit {
            center: point(&orbit.center)?,
            radii: (orbit.radius_x, orbit.radius_y),
            angular_velocity: orbit.rate,
            phase: orbit.phase,
        },
        AttractorPath::Line(line) => PathSettings::Line { from: point(&line.from)?, velocity: point(&line.velocity)? },
    };
    let strength = match &attractor.strength {
        AttractorStrength::Constant(strength) => vec![(0.0, *strength)],
        AttractorStrength::Keys(keys) => keys.iter().map(|key| (key.time, key.strength)).collect(),
    };
    Ok(AttractorSettings { path, strength, softening: attractor.softening })
}

fn obstacles(scene: &Scene) -> Result<Vec<ObstacleSettings>, SettingsError> {
    scene
        .solids
        .iter()
        .map(|solid| {
            let shape = solids::describe(&solid.shape, solids::mesh_unit(scene));
            let shape = if solid.inverted { geometry::ShapeDescription::Complement(Box::new(shape)) } else { shape };
            Ok(ObstacleSettings {
                shape,
                motion: script::motion(scene.script(&solid.motion), scene.time.end)?,
                friction: solid.friction,
                restitution: solid.restitution,
            })
        })
        .collect()
}

fn index(vertex: YarnVertex) -> i64 {
    match vertex {
        YarnVertex::First => 0,
        YarnVertex::Last => -1,
        YarnVertex::At(vertex) => i64::try_from(vertex).unwrap_or(i64::MAX),
    }
}

fn pins(scene: &Scene, space: Space, section: &Yarns) -> Result<Vec<Pin>, SettingsError> {
    let mut pins = Vec::new();
    for (i, pin) in section.pins.iter().enumerate() {
        let at = match &pin.at {
            PinPlace::Point(place) => Place::Point(space.point(format!("pins[{i}].at"), place)?),
            PinPlace::Vertex(place) => Place::Vertex { yarn: place.yarn, vertex: index(place.vertex) },
        };
        pins.push(Pin {
            at,
            half_width: 1.5,
            half_size: pin.half_size.as_ref().map_or_else(Vec::new, |half| space.list(half)),
            motion: script::motion(scene.script(&pin.motion), scene.time.end)?,
        });
    }
    Ok(pins)
}

/// Drives of groups (first ends, then last ends, group by group), then those of single vertices.
fn drives(scene: &Scene, section: &Yarns, counts: &[usize]) -> Result<Vec<Drive>, SettingsError> {
    let motion = |script: &Script| script::motion(scene.script(script), scene.time.end);
    let mut drives = Vec::new();
    let mut before = 0;
    for (group, count) in section.groups.iter().zip(counts) {
        for (script, vertex) in [(&group.first, 0), (&group.last, -1)] {
            let Some(script) = script else { continue };
            let motion = motion(script)?;
            drives.extend((before..before + count).map(|yarn| Drive { yarn, vertex, motion: motion.clone() }));
        }
        before += count;
    }
    for drive in &section.drives {
        drives.push(Drive { yarn: drive.yarn, vertex: index(drive.vertex), motion: motion(&drive.motion)? });
    }
    Ok(drives)
}

fn step(section: &Yarns) -> StepSettings {
    let (oversized, max_substeps) = match &section.oversized {
        OversizedYarnStep::Divide(parts) => (OversizedStep::Substep, *parts),
        OversizedYarnStep::Refuse => (OversizedStep::Refuse, 1),
    };
    StepSettings {
        integrator: match &section.integrator {
            YarnIntegrator::Explicit => Integrator::Explicit,
            YarnIntegrator::Implicit(newton) => Integrator::Implicit(ImplicitSettings {
                tolerance: newton.tolerance,
                max_newton: newton.max_newton,
                max_cg: newton.max_cg,
                require_convergence: true,
            }),
        },
        safety: section.safety,
        motion: section.motion,
        oversized,
        max_substeps,
    }
}
