//! Time, memory, and what is recorded.

use super::Checker;
use crate::scene::Scene;
use crate::scene::edit::Path;
use crate::scene::error::ProblemKind;
use crate::scene::expand::{BYTES_PER_PARTICLE, BYTES_PER_VERTEX, MEMORY_LIMIT, show_bytes};
use crate::scene::generators::{centrelines, counts};
use crate::scene::liquid::Dimensions;
use crate::scene::output::{Clock, Probe};
use crate::scene::quantity::Quantity;
use crate::scene::solids::Volume;
use crate::scene::time::StepControl;

/// More frames than this are refused.
const MAX_FRAMES: f64 = 1e7;
/// More steps than this are refused.
const MAX_STEPS: f64 = 1e12;

impl Checker<'_> {
    pub(super) fn time(&mut self) {
        let time = &self.scene.time;
        let place = Path::default().field("time");
        if time.is_left_open() {
            let message = "the scene needs a field `time`";
            self.refuse(
                ProblemKind::MissingField,
                &Path::default(),
                message,
                "add `time: (end: …, step: Adaptive(max: …))`: when the run ends and how it steps",
            );
            return;
        }
        let (step, at) = match &time.step {
            StepControl::Fixed(step) => (*step, place.field("step")),
            StepControl::Adaptive(step) => {
                let at = place.field("step");
                if let Some(min) = step.min
                    && min > step.max
                {
                    let message = format!("the smallest step ({min} s) exceeds the largest ({} s)", step.max);
                    self.inconsistent(&at.field("min"), message, "make `min` smaller than `max`");
                }
                (step.max, at.field("max"))
            }
        };
        if step > time.end {
            let message = format!("the step of {step} s is longer than the run, which ends at {} s", time.end);
            self.inconsistent(&at, message, "make the step smaller or the run longer");
        } else if time.end / step > MAX_STEPS {
            let message = format!("the run would take {:.1e} steps", time.end / step);
            self.refuse(
                ProblemKind::TooLarge,
                &at,
                message,
                format!("at most {MAX_STEPS:e} are allowed: make the step larger or the run shorter"),
            );
        }
    }

    pub(super) fn memory(&mut self) {
        let limit = show_bytes(MEMORY_LIMIT);
        let mut total = 0.0;
        for (i, group) in self.scene.strands.iter().enumerate() {
            let Some((strands, vertices)) = counts(&group.shape) else { continue };
            #[allow(clippy::cast_precision_loss)]
            let vertices = strands as f64 * vertices as f64;
            total += vertices * BYTES_PER_VERTEX;
            if total > MEMORY_LIMIT {
                let message = format!("this needs about {} of memory: {vertices:.3e} vertices", show_bytes(total));
                let place = Path::default().field("strands").index(i).field("shape");
                self.refuse(
                    ProblemKind::TooLarge,
                    &place,
                    message,
                    format!("at most {limit} are allowed: use fewer strands or vertices"),
                );
                return;
            }
        }
        let Some(liquid) = &self.scene.liquid else { return };
        #[allow(clippy::cast_precision_loss)]
        let (per_cell, dimension) = match liquid.dimensions {
            Dimensions::Three => (liquid.particles_per_cell as f64, 3),
            Dimensions::Two => (liquid.particles_per_cell as f64, 2),
        };
        for (i, tank) in liquid.tanks.iter().enumerate() {
            let particles =
                extent(&tank.shape, dimension).map_or(0.0, |size| size / liquid.cell.powi(dimension)) * per_cell;
            total += particles * BYTES_PER_PARTICLE;
            if total > MEMORY_LIMIT {
                let message = format!("this needs about {} of memory: {particles:.3e} particles", show_bytes(total));
                let place = Path::default().field("liquid").field("tanks").index(i).field("shape");
                let cell = self.show(Quantity::Length, liquid.cell);
                self.refuse(
                    ProblemKind::TooLarge,
                    &place,
                    message,
                    format!("at most {limit} are allowed: make the tank smaller or the cell ({cell}) larger"),
                );
                return;
            }
        }
    }

    /// When the run ends [s].
    fn end(&self) -> f64 {
        crate::microgel::schedule_of(self.scene).map_or(self.scene.time.end, |schedule| schedule.end)
    }

    pub(super) fn output(&mut self) {
        let place = Path::default().field("output");
        let output = &self.scene.output;
        let clocks = [("frames", &output.frames), ("series", &output.series), ("checkpoint", &output.checkpoint)];
        for (name, clock) in clocks {
            let at = place.field(name);
            let end = self.end();
            #[allow(clippy::cast_precision_loss)]
            let count = match clock {
                Clock::Every(period) => end / period,
                Clock::Count(count) => *count as f64,
                Clock::At(times) => {
                    if let Some(late) = times.iter().find(|&&time| time > end && end > 0.0) {
                        let message = format!("`{name}` asks for {late} s, but the run ends at {end} s");
                        self.inconsistent(&at, message, "remove the time, or make the run longer");
                    }
                    if times.windows(2).any(|pair| pair[1] <= pair[0]) {
                        self.inconsistent(
                            &at,
                            format!("the times of `{name}` are not in order"),
                            "write them from early to late, each once",
                        );
                    }
                    times.len() as f64
                }
                Clock::Steps(_) | Clock::Never => 0.0,
            };
            if name != "series" && count > MAX_FRAMES {
                let message = format!("`{name}` would write {count:.1e} files");
                self.refuse(
                    ProblemKind::TooLarge,
                    &at,
                    message,
                    format!("at most {MAX_FRAMES:e} are allowed: write them less often"),
                );
            }
        }
        if output.formats.is_empty() && output.frames != Clock::Never {
            self.inconsistent(
                &place.field("formats"),
                "frames need a format",
                "write `formats: [Vtk]`, or `frames: Never`",
            );
        }
        for (i, slice) in output.slices.iter().enumerate() {
            let at = place.field("slices").index(i);
            if self.scene.liquid.is_none() {
                let message = "a slice shows liquid, but the scene has no `liquid`";
                self.inconsistent(&at, message, "remove the slice");
            }
            if slice.normal.0.amax() != 1.0 {
                let message = "a slice stands across `X`, `Y` or `Z`";
                self.inconsistent(&at.field("normal"), message, "write `normal: X`, `Y` or `Z`");
            }
        }
        let slices: Vec<_> = output.slices.iter().map(|slice| slice.name.clone()).collect();
        self.unique_names(&place.field("slices"), &slices);
        if self.problems.is_empty() {
            self.probes(&place.field("probes"));
        }
    }

    pub(super) fn probes(&mut self, place: &Path) {
        let mut names = Vec::new();
        for (i, probe) in self.scene.output.probes.iter().enumerate() {
            let at = place.index(i);
            match probe {
                Probe::Point(probe) => {
                    names.push(probe.name.clone());
                    if self.scene.liquid.is_none() {
                        let message = "a point is probed for liquid, but the scene has no `liquid`";
                        self.inconsistent(&at, message, "probe a vertex of a strand, or remove the probe");
                    }
                }
                Probe::Yarn(probe) => {
                    names.push(probe.name.clone());
                    if self.scene.yarn.is_none() {
                        let message = "a yarn is probed, but the scene has no `yarn`";
                        self.inconsistent(&at, message, "probe a vertex of a strand, or remove the probe");
                    }
                }
                Probe::Vertex(probe) => {
                    names.push(probe.name.clone());
                    match vertices_of(self.scene, probe.strand) {
                        Err(strands) => {
                            let message = format!("there is no strand {}; the scene has {strands}", probe.strand);
                            self.refuse(
                                ProblemKind::UnknownReference,
                                &at.field("strand"),
                                message,
                                "strands are counted from 0 over all groups",
                            );
                        }
                        Ok(vertices) if probe.vertex.is_some_and(|vertex| vertex >= vertices) => {
                            let message =
                                format!("strand {} has {vertices} vertices (0 to {})", probe.strand, vertices - 1);
                            self.refuse(
                                ProblemKind::UnknownReference,
                                &at.field("vertex"),
                                message,
                                "leave `vertex` out for the tip",
                            );
                        }
                        Ok(_) => {}
                    }
                }
            }
        }
        self.unique_names(place, &names);
    }
}

/// The number of vertices of a strand counted over all groups, or how many strands there are.
fn vertices_of(scene: &Scene, strand: usize) -> Result<usize, usize> {
    let mut before = 0;
    for (i, group) in scene.strands.iter().enumerate() {
        let (strands, vertices) = match counts(&group.shape) {
            Some((strands, vertices)) => (strands, vec![vertices; 1]),
            None => {
                let lines = centrelines(scene, i, group).unwrap_or_default();
                (lines.len(), lines.iter().map(|(line, _)| line.len()).collect())
            }
        };
        if strand - before < strands {
            let place = if vertices.len() == 1 { 0 } else { strand - before };
            return Ok(vertices[place]);
        }
        before += strands;
    }
    Err(before)
}

/// The volume (area in two dimensions) of a bounded shape without a file.
fn extent(volume: &Volume, dimension: i32) -> Option<f64> {
    use std::f64::consts::PI;
    Some(match (volume, dimension) {
        (Volume::Sphere(ball), 3) => 4.0 / 3.0 * PI * ball.radius.powi(3),
        (Volume::Sphere(ball), _) => PI * ball.radius.powi(2),
        (Volume::Box(cuboid), 3) => 8.0 * cuboid.half_size.product(),
        (Volume::Box(cuboid), _) => 4.0 * cuboid.half_size.x * cuboid.half_size.y,
        (Volume::Cylinder(cylinder), 3) => 2.0 * PI * cylinder.radius.powi(2) * cylinder.half_length,
        (Volume::Cylinder(cylinder), _) => 4.0 * cylinder.radius * cylinder.half_length,
        (Volume::Capsule(capsule), 3) => {
            PI * capsule.radius.powi(2) * (2.0 * capsule.half_length + 4.0 / 3.0 * capsule.radius)
        }
        (Volume::Capsule(capsule), _) => capsule.radius * (4.0 * capsule.half_length + PI * capsule.radius),
        (Volume::Torus(torus), _) => 2.0 * PI.powi(2) * torus.major_radius * torus.minor_radius.powi(2),
        (Volume::HalfSpace(_) | Volume::Mesh(_), _) => return None,
    })
}
