//! What acts on grid nodes besides the yarns: obstacles, pins, walls, in this order.

mod obstacle;
mod wall;

pub(crate) use obstacle::{Obstacle, PosedObstacle, rub};
pub(crate) use wall::Walls;

use std::path::Path;

use geometry::{Motion, Vector3};
use nalgebra::SVector;

use crate::YarnError;
use crate::error::YarnWarning;
use crate::model::YarnModel;
use crate::settings::{PinPlace, YarnSettings, vector};
use crate::state::YarnState;

/// A vector with zeros in the missing directions.
#[inline]
pub(crate) fn embed<const D: usize>(x: &SVector<f64, D>) -> Vector3 {
    let mut v = Vector3::zeros();
    for a in 0..D {
        v[a] = x[a];
    }
    v
}

/// The first directions of a vector.
#[inline]
pub(crate) fn project<const D: usize>(v: &Vector3) -> SVector<f64, D> {
    SVector::from_fn(|a, _| v[a])
}

/// A point led by a script.
#[derive(Clone, Debug)]
pub(crate) struct Led<const D: usize> {
    /// Where it is described.
    pub place: SVector<f64, D>,
    /// Script.
    pub motion: Motion,
}

impl<const D: usize> Led<D> {
    /// Position and velocity at a time.
    pub fn at(&self, time: f64) -> (SVector<f64, D>, SVector<f64, D>) {
        let place = embed(&self.place);
        let (pose, field) = self.motion.evaluate(&place, time);
        let position = pose.apply(&place);
        (project(&position), project(&field.at(&position)))
    }
}

/// Everything that bounds the motion.
#[derive(Clone, Debug)]
pub(crate) struct Boundary<const D: usize> {
    pub obstacles: Vec<Obstacle>,
    /// Place and half sides [m] of each pin.
    pub pins: Vec<(Led<D>, SVector<f64, D>)>,
    pub drives: Vec<(usize, Led<D>)>,
    /// Which vertices are driven; empty where none is.
    pub driven: Vec<bool>,
    pub walls: Option<Walls<D>>,
}

/// The boundary at one instant.
pub(crate) struct BoundarySample<'a, const D: usize> {
    pub obstacles: Vec<PosedObstacle<'a>>,
    /// Centre, velocity and half sides [m] of each pin.
    pub pins: Vec<(SVector<f64, D>, SVector<f64, D>, SVector<f64, D>)>,
    pub walls: Option<&'a Walls<D>>,
}

/// Who changed the velocity of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Actor {
    Obstacle(u32),
    Pin(u32),
    Wall,
}

impl<const D: usize> Boundary<D> {
    pub fn build(
        settings: &YarnSettings,
        model: &YarnModel<D>,
        state: &YarnState<D>,
        base: &Path,
        warnings: &mut Vec<YarnWarning>,
    ) -> Result<Self, YarnError> {
        let mut obstacles = Vec::new();
        for (i, given) in settings.obstacles.iter().enumerate() {
            let obstacle = Obstacle::build(given, &format!("obstacles[{i}]"), base)?;
            if let Some(width) = obstacle.smallest_width(D)
                && width < 2.0 * settings.cell
            {
                warnings.push(YarnWarning::SmallObstacle { obstacle: i, cells: width / settings.cell });
            }
            let posed = obstacle.at(0.0);
            if let Some(inside) = (0..model.len()).find(|&k| posed.sample(&state.position[k]).0 < 0.0) {
                let (yarn, vertex) = model.locate(inside);
                warnings.push(YarnWarning::StartsInside { yarn, vertex, obstacle: i });
            }
            obstacles.push(obstacle);
        }
        let mut pins = Vec::new();
        for (i, pin) in settings.pins.iter().enumerate() {
            let path = format!("pins[{i}]");
            pin.check(&path)?;
            let place = match &pin.at {
                PinPlace::Point(point) => vector(&format!("{path}.at"), point)?,
                PinPlace::Vertex { yarn, vertex } => state.position[model.vertex(&path, *yarn, *vertex)?],
            };
            let half = if pin.half_size.is_empty() {
                SVector::repeat(pin.half_width * settings.cell)
            } else {
                let half: SVector<f64, D> = vector(&format!("{path}.half_size"), &pin.half_size)?;
                if half.iter().any(|side| *side < 0.0) {
                    return Err(YarnError::setting(format!("{path}.half_size"), "sides must not be negative"));
                }
                half
            };
            pins.push((Led { place, motion: pin.motion.clone() }, half));
        }
        let mut drives = Vec::new();
        for (i, drive) in settings.drives.iter().enumerate() {
            let path = format!("drives[{i}]");
            drive.motion.check().map_err(|e| YarnError::setting(format!("{path}.motion"), e.to_string()))?;
            let vertex = model.vertex(&path, drive.yarn, drive.vertex)?;
            drives.push((vertex, Led { place: state.position[vertex], motion: drive.motion.clone() }));
        }
        let mut driven = vec![false; if drives.is_empty() { 0 } else { model.len() }];
        for (vertex, _) in &drives {
            driven[*vertex] = true;
        }
        let walls = settings.domain.as_ref().map(|domain| Walls::build(domain, settings.cell)).transpose()?;
        Ok(Self { obstacles, pins, drives, driven, walls })
    }

    /// Poses everything at `time`.
    pub fn at(&self, time: f64) -> BoundarySample<'_, D> {
        BoundarySample {
            obstacles: self.obstacles.iter().map(|o| o.at(time)).collect(),
            pins: self
                .pins
                .iter()
                .map(|(led, half)| {
                    let (position, velocity) = led.at(time);
                    (position, velocity, *half)
                })
                .collect(),
            walls: self.walls.as_ref(),
        }
    }
}

impl<const D: usize> BoundarySample<'_, D> {
    /// Obstacles that a ball of `radius` about `center` can touch.
    pub fn near(&self, center: &SVector<f64, D>, radius: f64, out: &mut Vec<u32>) {
        out.clear();
        for (i, obstacle) in self.obstacles.iter().enumerate() {
            if obstacle.sample(center).0 < radius {
                out.push(i as u32);
            }
        }
    }

    /// Applies obstacles (those in `near`), pins and walls to the velocity of a node; `record(actor, change)` hears of every change.
    #[inline]
    pub fn constrain(
        &self,
        node: &[i32; D],
        x: &SVector<f64, D>,
        near: &[u32],
        mut velocity: SVector<f64, D>,
        mut record: impl FnMut(Actor, SVector<f64, D>),
    ) -> SVector<f64, D> {
        for &i in near {
            let after = self.obstacles[i as usize].contact(x, velocity);
            if after != velocity {
                record(Actor::Obstacle(i), after - velocity);
                velocity = after;
            }
        }
        for (i, (center, pinned, half)) in self.pins.iter().enumerate() {
            if inside_pin(x, center, half) {
                record(Actor::Pin(i as u32), pinned - velocity);
                velocity = *pinned;
            }
        }
        if let Some(walls) = self.walls {
            let after = walls.contact(node, velocity);
            if after != velocity {
                record(Actor::Wall, after - velocity);
                velocity = after;
            }
        }
        velocity
    }
}

/// Whether a node lies in the box of a pin, whose border belongs to it up to rounding.
#[inline]
pub(crate) fn inside_pin<const D: usize>(
    x: &SVector<f64, D>,
    center: &SVector<f64, D>,
    half: &SVector<f64, D>,
) -> bool {
    (0..D).all(|a| (x[a] - center[a]).abs() <= half[a] * (1.0 + 1e-12))
}
