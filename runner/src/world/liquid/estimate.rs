//! How much liquid a scene will have, without building it.

use std::path::Path;

use geometry::Shape;
use mpm::Vector;

use super::build::{dimensions, liquid_names};
use crate::scene::Scene;
use crate::scene::expand::BYTES_PER_PARTICLE;
use crate::scene::liquid::Liquid;
use crate::scene::solids::Volume;
use crate::world::solids::{describe, mesh_unit};

/// Samples along the longest side of a shape.
const SAMPLES: f64 = 40.0;

/// What the liquid of a scene will need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LiquidEstimate {
    /// Particles at the start.
    pub at_start: f64,
    /// Particles at most, if nothing drains away.
    pub particles: f64,
    /// Full cells at most.
    pub cells: f64,
    /// Memory while running [bytes].
    pub memory: f64,
    /// Particles in one frame as VTK, as PLY, and in a checkpoint [bytes].
    pub stored: [f64; 3],
}

/// What the liquid of a scene will need; `None` without any.
#[must_use]
pub fn estimate(scene: &Scene) -> Option<LiquidEstimate> {
    let liquid = scene.liquid.as_ref()?;
    let d = dimensions(liquid) as usize;
    let per_volume = liquid.particles_per_cell as f64 / liquid.cell.powi(d as i32);
    let solids: Vec<(Shape, bool)> =
        scene.solids.iter().filter_map(|solid| Some((built(scene, &solid.shape)?, solid.inverted))).collect();
    let free = |x: &Vector<3>| solids.iter().all(|(shape, inverted)| (shape.signed_distance(x) < 0.0) == *inverted);
    let mut at_start = 0.0;
    for tank in &liquid.tanks {
        at_start += per_volume * sampled(scene, liquid, &tank.shape, d, &free).map_or(0.0, |s| s.volume);
    }
    let mut particles = at_start;
    for source in &liquid.sources {
        let Some(seen) = sampled(scene, liquid, &source.shape, d, &|_| true) else { continue };
        let (start, end) = source.during.map_or((0.0, f64::INFINITY), |d| (d.start, d.end));
        let seconds = (end.min(scene.time.end) - start).max(0.0);
        // what flows through the cross-section, and what is in the shape at the start
        let speed = source.velocity.norm();
        let length = if speed > 0.0 { seen.extent(&(source.velocity / speed)) } else { f64::INFINITY };
        particles += per_volume * seen.volume * (1.0 + speed * seconds / length.max(liquid.cell));
    }
    let elastic = liquid_names(scene)
        .iter()
        .filter_map(|name| scene.liquid_material(name))
        .any(|properties| properties.shear_modulus > 0.0);
    let stored = if elastic { [144.0, 112.0, 300.0] } else { [112.0, 80.0, 160.0] };
    Some(LiquidEstimate {
        at_start: at_start.round(),
        particles: particles.round(),
        cells: (particles / liquid.particles_per_cell as f64).ceil(),
        memory: particles * BYTES_PER_PARTICLE,
        stored: stored.map(|bytes| bytes * particles),
    })
}

fn built(scene: &Scene, volume: &Volume) -> Option<Shape> {
    describe(volume, mesh_unit(scene)).build(Path::new("")).ok()
}

/// A shape seen through regular samples.
struct Sampled {
    /// Its volume (area) [m³].
    volume: f64,
    points: Vec<Vector<3>>,
    spacing: f64,
}

impl Sampled {
    /// Its length along a direction [m].
    fn extent(&self, direction: &Vector<3>) -> f64 {
        let along = self.points.iter().map(|x| x.dot(direction));
        let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), s| (l.min(s), h.max(s)));
        if high >= low { high - low + self.spacing } else { 0.0 }
    }
}

fn sampled(
    scene: &Scene,
    liquid: &Liquid,
    volume: &Volume,
    d: usize,
    free: &impl Fn(&Vector<3>) -> bool,
) -> Option<Sampled> {
    let shape = built(scene, volume)?;
    let domain = liquid.domain.as_ref().map(|domain| (domain.low, domain.high));
    let own = shape.bounds().map(|b| (Vector::<3>::from(b.min), Vector::<3>::from(b.max)));
    let (low, high) = match (own, domain) {
        (Some((low, high)), Some(domain)) => (low.sup(&domain.0), high.inf(&domain.1)),
        (Some(own), None) => own,
        (None, domain) => domain?,
    };
    let size = high - low;
    let longest = (0..d).map(|a| size[a]).fold(0.0, f64::max);
    if !(longest > 0.0 && longest.is_finite()) {
        return None;
    }
    let spacing = longest / SAMPLES;
    let counts: Vec<usize> =
        (0..3).map(|a| if a < d { (size[a] / spacing).round().clamp(1.0, SAMPLES) as usize } else { 1 }).collect();
    let step = Vector::<3>::from_fn(|a, _| if a < d { size[a].max(0.0) / counts[a] as f64 } else { 0.0 });
    let part: f64 = (0..d).map(|a| step[a]).product();
    let mut points = Vec::new();
    for k in 0..counts.iter().product() {
        let index = [k % counts[0], k / counts[0] % counts[1], k / (counts[0] * counts[1])];
        let x = Vector::<3>::from_fn(|a, _| if a < d { low[a] + (index[a] as f64 + 0.5) * step[a] } else { 0.0 });
        if shape.signed_distance(&x) < 0.0 && free(&x) {
            points.push(x);
        }
    }
    Some(Sampled { volume: points.len() as f64 * part, points, spacing })
}
