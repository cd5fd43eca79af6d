//! Stage 0 for the liquid: sources that emit it and terminators that take it away.
//!
//! A source is a shape that is kept full of liquid moving at a given velocity. Its samples lie on a lattice that drifts with that
//! velocity; at each step the samples that have entered the shape since the last one become particles. The stream is thus
//! sampled evenly whatever the step, and the emitted volume follows the swept volume to within one layer of samples.
//! When a sample enters depends on the time alone, so a restarted run emits the same particles. While it flows, the faces inside
//! the shape keep its velocity (see [`inlet`](crate::inlet)).

use crate::material::LiquidMaterial;
use crate::particles::{Particle, Particles};
use numerics::tensor::Vector;
use particle_grid::Lattice;
use serde::{Deserialize, Serialize};

/// The shape of a source over time.
pub trait SourceShape<const D: usize> {
    /// Signed distance at a position and time, negative inside [m].
    fn distance(&self, x: &Vector<D>, time: f64) -> f64;
    /// A box around the shape at a time [m].
    fn bounds(&self, time: f64) -> (Vector<D>, Vector<D>);
}

/// What a source emits and when.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SourceSettings<const D: usize> {
    /// Velocity of the emitted liquid [m/s].
    pub velocity: Vector<D>,
    /// Index of its material.
    pub material: u16,
    /// Time at which emission starts [s].
    pub start: f64,
    /// Time at which it ends [s].
    pub end: f64,
}

/// What a source has emitted so far: part of the state of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SourceState {
    /// Time of the last emission [s]; none before the first.
    pub last: Option<f64>,
    /// Particles emitted.
    pub particles: u64,
    /// Volume emitted [m³].
    pub volume: f64,
    /// Volume that the shape swept through the liquid, measured by finer samples [m³].
    pub analytic_volume: f64,
}

/// What one call emitted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Emission<const D: usize> {
    /// Number of particles.
    pub particles: usize,
    /// Mass [kg].
    pub mass: f64,
    /// Volume [m³].
    pub volume: f64,
    /// Momentum [kg m/s].
    pub momentum: Vector<D>,
}

/// Finer samples per direction that measure the swept volume.
const REFINEMENT: usize = 2;

/// Emits the liquid that has entered the shape since the last call, up to `time` (the start of the step).
#[expect(clippy::too_many_arguments, reason = "shape, settings, state, sampling and time are all separate things")]
pub fn emit<const D: usize>(
    shape: &impl SourceShape<D>,
    settings: &SourceSettings<D>,
    state: &mut SourceState,
    lattice: &Lattice<D>,
    per_axis: usize,
    materials: &[LiquidMaterial],
    time: f64,
    particles: &mut Particles<D>,
) -> Emission<D> {
    let mut out = Emission { particles: 0, mass: 0.0, volume: 0.0, momentum: Vector::zeros() };
    let Some(material) = materials.get(settings.material as usize) else { return out };
    if time < settings.start || state.last.is_some_and(|last| last >= settings.end.min(time)) {
        return out;
    }
    let until = time.min(settings.end);
    let spacing = lattice.dx / per_axis as f64;
    let from = state.last;
    // A fast stream may cross a thin shape within a step: look at it in strides of a fraction of a cell.
    let span = from.map_or(0.0, |f| until - f);
    let strides = ((settings.velocity.norm() * span / (0.5 * lattice.dx)).ceil() as usize).max(1);
    let mut previous = from;
    for k in 1..=strides {
        let now = from.map_or(until, |f| f + span * k as f64 / strides as f64);
        let entered = |x: &Vector<D>| {
            shape.distance(x, now) < 0.0
                && previous
                    .is_none_or(|before| shape.distance(&(x - settings.velocity * (now - before)), before) >= 0.0)
        };
        let volume = spacing.powi(D as i32);
        for x in drifting(shape, settings, lattice, per_axis, now, &entered) {
            // The particle has moved on since it entered.
            let mut p =
                Particle::new(x + settings.velocity * (time - now), volume, settings.material, material.density);
            lattice.wrap(&mut p.position);
            p.velocity = settings.velocity;
            out.particles += 1;
            out.mass += p.mass;
            out.volume += volume;
            out.momentum += p.velocity * p.mass;
            particles.push(p);
        }
        let finer = per_axis * REFINEMENT;
        let fine_volume = volume / REFINEMENT.pow(D as u32) as f64;
        state.analytic_volume += drifting(shape, settings, lattice, finer, now, &entered).len() as f64 * fine_volume;
        previous = Some(now);
    }
    state.last = Some(until);
    state.particles += out.particles as u64;
    state.volume += out.volume;
    out
}

/// Points of the drifting lattice inside the bounds of the shape for which `entered` holds.
fn drifting<const D: usize>(
    shape: &impl SourceShape<D>,
    settings: &SourceSettings<D>,
    lattice: &Lattice<D>,
    per_axis: usize,
    now: f64,
    entered: &impl Fn(&Vector<D>) -> bool,
) -> Vec<Vector<D>> {
    let drift = settings.velocity * (now - settings.start);
    let (low, high) = shape.bounds(now);
    let mut points = crate::fill::fill(lattice, per_axis, &(low - drift), &(high - drift), |y| entered(&(y + drift)));
    for x in &mut points {
        *x += drift;
    }
    points
}

/// What a terminator took away.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Terminated<const D: usize> {
    /// Number of particles.
    pub particles: usize,
    /// Mass [kg].
    pub mass: f64,
    /// Volume [m³].
    pub volume: f64,
    /// Volume at rest [m³].
    pub rest_volume: f64,
    /// Momentum [kg m/s].
    pub momentum: Vector<D>,
}

/// Removes the particles inside a region and says what went with them.
pub fn terminate<const D: usize>(particles: &mut Particles<D>, inside: impl Fn(&Vector<D>) -> bool) -> Terminated<D> {
    let mut out = Terminated { particles: 0, mass: 0.0, volume: 0.0, rest_volume: 0.0, momentum: Vector::zeros() };
    let gone: Vec<bool> = particles.position.iter().map(&inside).collect();
    for p in 0..particles.len() {
        if gone[p] {
            out.particles += 1;
            out.mass += particles.mass[p];
            out.volume += particles.volume(p);
            out.rest_volume += particles.rest_volume[p];
            out.momentum += particles.velocity[p] * particles.mass[p];
        }
    }
    if out.particles > 0 {
        particles.retain(|p| !gone[p]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use constitutive::{LawSettings, Liquid};

    /// A cylinder along y of radius `r` whose axis passes through the origin, moving along x.
    struct Nozzle {
        radius: f64,
        half: f64,
        speed: f64,
    }

    impl SourceShape<3> for Nozzle {
        fn distance(&self, x: &Vector<3>, time: f64) -> f64 {
            let side = (x[0] - self.speed * time).hypot(x[2]) - self.radius;
            side.max(x[1].abs() - self.half)
        }
        fn bounds(&self, time: f64) -> (Vector<3>, Vector<3>) {
            let c = self.speed * time;
            (
                Vector::<3>::new(c - self.radius, -self.half, -self.radius),
                Vector::<3>::new(c + self.radius, self.half, self.radius),
            )
        }
    }

    #[test]
    fn the_emitted_volume_is_that_of_the_swept_cylinder_for_any_step() {
        let lattice = Lattice::<3>::new(5e-3);
        let materials =
            [LiquidMaterial::new(&Liquid::preset("shaving-cream").unwrap(), LawSettings::default()).unwrap()];
        let nozzle = Nozzle { radius: 8e-3, half: 5e-3, speed: 0.0 };
        let settings =
            SourceSettings { velocity: Vector::<3>::new(0.0, -0.8, 0.0), material: 0, start: 0.0, end: 0.05 };
        for dt in [1e-3, 3.7e-3, 2e-2] {
            let mut particles = Particles::new(&materials);
            let mut state = SourceState::default();
            let mut t = 0.0;
            while t < 0.1 {
                emit(&nozzle, &settings, &mut state, &lattice, 4, &materials, t, &mut particles);
                t += dt;
            }
            let area = std::f64::consts::PI * nozzle.radius * nozzle.radius;
            let exact = area * (2.0 * nozzle.half + 0.8 * 0.05);
            // A circle of six samples radius holds a few percent fewer samples than its area; finer samples come closer.
            assert!((state.volume / exact - 1.0).abs() < 0.05, "{} {exact} at {dt}", state.volume);
            assert!((state.analytic_volume / exact - 1.0).abs() < 0.03, "{} {exact}", state.analytic_volume);
            assert_eq!(particles.len() as u64, state.particles);
            // No two samples of the stream coincide.
            let mut keys: Vec<[i64; 3]> =
                particles.position.iter().map(|x| std::array::from_fn(|a| (x[a] * 1e7).round() as i64)).collect();
            keys.sort_unstable();
            keys.dedup();
            assert!(keys.len() as f64 > 0.5 * particles.len() as f64);
            let taken = terminate(&mut particles, |x| x[0] > 0.0);
            assert!((taken.volume / state.volume - 0.5).abs() < 0.02);
            assert_eq!(taken.particles + particles.len(), state.particles as usize);
        }
    }
}
