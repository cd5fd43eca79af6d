//! Columns of the series and figures of the summary.

use serde_json::{Map, Value, json};
use yarn::diagnostics;
use yarn::{YarnSettings, YarnSystem};

use super::settings::SettingsError;
use super::system::YarnScene;
use crate::scene::Scene;
use crate::scene::error::ProblemKind;
use crate::scene::output::Probe;
use crate::scene::yarn::{YarnVertex, Yarns};
use crate::system::Column;

/// A force that is summed over some of the library's bodies of one kind.
#[derive(Clone, Debug)]
struct Force {
    name: String,
    of: Of,
}

/// What a force acts on.
#[derive(Clone, Debug)]
enum Of {
    Solid(usize),
    Pin(usize),
    Drives(std::ops::Range<usize>),
    Walls,
}

/// What is recorded of a scene.
#[derive(Clone, Debug)]
pub(super) struct Record {
    forces: Vec<Force>,
    probes: Vec<(String, usize)>,
    /// Half width of endless solids in pictures [m].
    pub extent: f64,
}

impl Record {
    pub fn new<const D: usize>(
        scene: &Scene,
        section: &Yarns,
        system: &YarnSystem<D>,
        settings: &YarnSettings,
    ) -> Result<Record, SettingsError> {
        let mut forces = Vec::new();
        let mut add = |name: String, of| forces.push(Force { name, of });
        for (i, solid) in scene.solids.iter().enumerate() {
            add(solid.name.clone().unwrap_or_else(|| format!("solid{i}")), Of::Solid(i));
        }
        for i in 0..section.pins.len() {
            add(format!("pin{i}"), Of::Pin(i));
        }
        let mut first = 0;
        for (g, (group, size)) in section.groups.iter().zip(super::group_sizes(settings)).enumerate() {
            let name = group.name.clone().unwrap_or_else(|| format!("group{g}"));
            for (end, script) in [("first", &group.first), ("last", &group.last)] {
                if script.is_some() {
                    let count = size.0 as usize;
                    add(format!("{name}_{end}"), Of::Drives(first..first + count));
                    first += count;
                }
            }
        }
        for i in 0..section.drives.len() {
            add(format!("drive{i}"), Of::Drives(first + i..first + i + 1));
        }
        if section.domain.is_some() {
            add("walls".to_owned(), Of::Walls);
        }
        let mut probes = Vec::new();
        for (i, probe) in scene.output.probes.iter().enumerate() {
            let Probe::Yarn(probe) = probe else { continue };
            let vertex = match probe.vertex {
                YarnVertex::First => 0,
                YarnVertex::Last => -1,
                YarnVertex::At(vertex) => i64::try_from(vertex).unwrap_or(i64::MAX),
            };
            let refuse = |error: yarn::YarnError| {
                let yarn::YarnError::Setting { problem, .. } = error else { return SettingsError::from(error) };
                SettingsError { place: format!("output.probes[{i}]"), problem, kind: ProblemKind::UnknownReference }
            };
            let index = system.model().vertex("", probe.yarn, vertex).map_err(refuse)?;
            let (yarn, along) = system.model().locate(index);
            probes.push((probe.name.clone().unwrap_or_else(|| format!("yarn{yarn}_vertex{along}")), index));
        }
        let mut low = nalgebra::SVector::<f64, D>::repeat(f64::INFINITY);
        let mut high = -low;
        for x in &system.state().position {
            low = low.inf(x);
            high = high.sup(x);
        }
        let size = (high - low).norm();
        let extent = if size > 0.0 && size.is_finite() { 3.0 * size } else { 1.0 };
        Ok(Record { forces, probes, extent })
    }

    pub fn columns(&self, dimension: usize) -> Vec<Column> {
        let flat = dimension == 2;
        let unit = |space: &'static str, plane: &'static str| if flat { plane } else { space };
        let (joule, newton) = (unit("J", "J/m"), unit("N", "N/m"));
        let mut columns = vec![Column::new("mass", unit("kg", "kg/m"), "of all yarns")];
        for (name, meaning) in [
            ("kinetic_energy", "with the affine parts"),
            ("stretch_energy", "of stretch along the yarns"),
            ("shear_energy", "of shear between fibres"),
            ("contact_energy", "of compressed and distorted cross-sections"),
            ("bending_energy", "of bending"),
            ("gravity_energy", "potential about the origin"),
            ("total_energy", "sum of all"),
        ] {
            columns.push(Column::new(name, joule, meaning));
        }
        for axis in &["x", "y", "z"][..dimension] {
            columns.push(Column::new(format!("momentum_{axis}"), unit("kg m/s", "kg/s"), "linear"));
        }
        for axis in if flat { &["z"][..] } else { &["x", "y", "z"][..] } {
            columns.push(Column::new(
                format!("angular_momentum_{axis}"),
                unit("kg m²/s", "kg m/s"),
                "about the origin",
            ));
        }
        columns.push(Column::new("momentum_defect", "1", "momentum that the books do not explain, relative"));
        columns.push(Column::new("lost_momentum", unit("kg m/s", "kg/s"), "given to nodes without mass, so far"));
        columns.push(Column::new("largest_tension", newton, "of a segment"));
        columns.push(Column::new("largest_pressure", "Pa", "of a cross-section"));
        columns.push(Column::new("largest_stretch", "1", "strain of a segment"));
        columns.push(Column::new("mean_slip", "m", "sliding between fibres since the start, mean of the segments"));
        columns.push(Column::new("largest_slip", "m", "sliding between fibres since the start"));
        columns.push(Column::new("substeps", "1", "steps of the library in this step"));
        columns.push(Column::new("newton_iterations", "1", "of implicit steps"));
        columns.push(Column::new("cg_iterations", "1", "of implicit steps"));
        columns.push(Column::new("solve_residual", "1", "of implicit steps, relative"));
        columns.push(Column::new("flattened", "1", "cross-sections lifted to the smallest stretch"));
        columns.push(Column::new("massless_nodes", "1", "nodes with momentum and no mass"));
        columns.push(Column::new("solid_depth", "m", "deepest vertex inside a solid"));
        for force in &self.forces {
            for axis in &["x", "y", "z"][..dimension] {
                columns.push(Column::new(
                    format!("{}_force_{axis}", force.name),
                    newton,
                    "of the yarns, mean of the step",
                ));
            }
        }
        for (name, _) in &self.probes {
            for part in ["x", "y", "z"] {
                columns.push(Column::new(format!("{name}_{part}"), "m", "probe position"));
            }
            for part in ["vx", "vy", "vz"] {
                columns.push(Column::new(format!("{name}_{part}"), "m/s", "probe velocity"));
            }
        }
        columns
    }

    pub fn row<const D: usize>(&self, scene: &YarnScene<D>, out: &mut Vec<f64>) {
        let system = &scene.system;
        let state = system.state();
        out.push(system.model().total_mass());
        let energy = system.energy();
        out.extend([energy.kinetic, energy.stretch, energy.shear, energy.contact(), energy.bending, energy.gravity]);
        out.push(energy.total());
        let momentum = system.momentum();
        out.extend(momentum.linear.iter());
        out.extend(if D == 2 { &momentum.angular[2..] } else { &momentum.angular[..] });
        out.extend([system.momentum_defect(), state.ledger.lost.norm()]);
        out.extend(extremes(system));
        let report = scene.report.as_ref();
        let count = |of: fn(&yarn::StepReport<D>) -> f64| report.map_or(0.0, of);
        out.extend([
            count(|r| r.substeps as f64),
            count(|r| r.newton_iterations as f64),
            count(|r| r.cg_iterations as f64),
            count(|r| r.residual),
            count(|r| r.clamped as f64),
            count(|r| r.massless_nodes as f64),
            count(|r| r.depth),
        ]);
        for force in &self.forces {
            let mut sum = nalgebra::SVector::<f64, D>::zeros();
            if let Some(report) = report {
                match &force.of {
                    Of::Solid(i) => sum = report.obstacle_force[*i],
                    Of::Pin(i) => sum = report.pin_force[*i],
                    Of::Drives(range) => report.drive_force[range.clone()].iter().for_each(|f| sum += f),
                    Of::Walls => sum = report.wall_force,
                }
            }
            out.extend(sum.iter());
        }
        for (_, vertex) in &self.probes {
            for v in [&state.position[*vertex], &state.velocity[*vertex]] {
                out.extend((0..3).map(|a| if a < D { v[a] } else { 0.0 }));
            }
        }
    }
}

/// Largest tension, pressure and strain; mean and largest slip.
fn extremes<const D: usize>(system: &YarnSystem<D>) -> [f64; 5] {
    use rayon::prelude::*;
    const CHUNK: usize = 4096;
    let (model, state) = (system.model(), system.state());
    // Chunks have fixed borders and are summed in their order: the same bits for any number of threads.
    let of_chunk = |chunk: usize| {
        let (mut most, mut slip, mut segments) = ([f64::NEG_INFINITY, 0.0, f64::NEG_INFINITY, 0.0f64], 0.0, 0.0);
        for i in chunk * CHUNK..((chunk + 1) * CHUNK).min(model.len()) {
            if !model.has_segment(i) {
                continue;
            }
            let strain = state.deformation[i].column(0).norm() - 1.0;
            let values =
                [diagnostics::tension(model, state, i), diagnostics::pressure(model, state, i), strain, state.slip[i]];
            for (most, value) in most.iter_mut().zip(values) {
                *most = most.max(value);
            }
            slip += state.slip[i];
            segments += 1.0;
        }
        (most, slip, segments)
    };
    let chunks = 0..model.len().div_ceil(CHUNK);
    let parts: Vec<([f64; 4], f64, f64)> =
        if chunks.len() < 4 { chunks.map(of_chunk).collect() } else { chunks.into_par_iter().map(of_chunk).collect() };
    let (mut most, mut slip, mut segments) = ([f64::NEG_INFINITY, 0.0, f64::NEG_INFINITY, 0.0f64], 0.0, 0.0);
    for part in &parts {
        for (most, value) in most.iter_mut().zip(part.0) {
            *most = most.max(value);
        }
        slip += part.1;
        segments += part.2;
    }
    [most[0], most[1], most[2], slip / segments, most[3]]
}

/// Figures for `summary.json`.
pub(super) fn summary<const D: usize>(scene: &YarnScene<D>) -> Map<String, Value> {
    let system = &scene.system;
    let (model, totals) = (system.model(), &scene.totals);
    let mut summary = Map::new();
    let mut put = |name: &str, value: Value| summary.insert(name.to_owned(), value);
    put("dimensions", json!(D));
    put("yarns", json!(model.yarn_count()));
    put("vertices", json!(model.len()));
    put("mass", json!(model.total_mass()));
    put("yarn_steps", json!(totals.substeps));
    put("divided_steps", json!(totals.divided));
    put("newton_iterations", json!(totals.newton));
    put("cg_iterations", json!(totals.cg));
    put("flattened", json!(totals.flattened));
    put("largest_solid_depth", json!(totals.depth));
    put("momentum_defect", json!(system.momentum_defect()));
    put("first_energy", json!(totals.first_energy));
    put("last_energy", json!(system.energy().total()));
    let [tension, pressure, stretch, mean_slip, slip] = extremes(system);
    put("largest_tension", json!(tension));
    put("largest_pressure", json!(pressure));
    put("largest_stretch", json!(stretch));
    put("mean_slip", json!(mean_slip));
    put("largest_slip", json!(slip));
    put("warnings", json!(warnings(system)));
    summary
}

/// Warnings in words: of each kind the first few, then how many more there are.
fn warnings<const D: usize>(system: &YarnSystem<D>) -> Vec<String> {
    const SHOWN: usize = 5;
    let mut kinds: Vec<(std::mem::Discriminant<yarn::YarnWarning>, usize)> = Vec::new();
    let mut lines = Vec::new();
    for warning in system.warnings() {
        let kind = std::mem::discriminant(warning);
        let count = match kinds.iter_mut().find(|(known, _)| *known == kind) {
            Some((_, count)) => {
                *count += 1;
                *count
            }
            None => {
                kinds.push((kind, 1));
                1
            }
        };
        if count <= SHOWN {
            lines.push(warning.to_string());
        }
    }
    let hidden: usize = kinds.iter().map(|(_, count)| count.saturating_sub(SHOWN)).sum();
    if hidden > 0 {
        lines.push(format!("and {hidden} more of the same kinds"));
    }
    lines
}
