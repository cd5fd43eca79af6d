//! A solid over one step.

use crate::block::Vec3;
use geometry::{Aabb, MovingSolid, PosedSolid, Vector3};

/// A solid over one step: signed distance, normal, velocity. `fraction` runs from 0 (start of the step) to 1.
pub trait SolidField: Sync {
    /// Signed distance [m], negative inside, and outward unit normal.
    fn sample(&self, point: &Vec3, fraction: f64) -> (f64, Vec3);

    /// Velocity of the solid at a point near it [m/s].
    fn velocity(&self, point: &Vec3, fraction: f64) -> Vec3;

    /// Length of the step [s].
    fn dt(&self) -> f64;

    /// A box that holds the solid during the whole step, or `None` if it has no end.
    fn bounds(&self) -> Option<(Vec3, Vec3)> {
        None
    }
}

/// A solid of the geometry crate over the step from `time` to `time + dt`.
#[derive(Clone, Debug)]
pub struct StepSolid<'a> {
    solid: &'a MovingSolid,
    start: PosedSolid<'a>,
    end: PosedSolid<'a>,
    time: f64,
    dt: f64,
}

impl<'a> StepSolid<'a> {
    /// The solid over a step.
    #[must_use]
    pub fn new(solid: &'a MovingSolid, time: f64, dt: f64) -> Self {
        StepSolid { solid, start: solid.at(time), end: solid.at(time + dt), time, dt }
    }
}

impl SolidField for StepSolid<'_> {
    fn sample(&self, point: &Vec3, fraction: f64) -> (f64, Vec3) {
        let p = Vector3::new(point[0], point[1], point[2]);
        let s = if fraction == 0.0 {
            self.start.sample(&p)
        } else if fraction == 1.0 {
            self.end.sample(&p)
        } else {
            self.solid.at(self.time + fraction * self.dt).sample(&p)
        };
        (s.distance, [s.normal.x, s.normal.y, s.normal.z])
    }

    fn velocity(&self, point: &Vec3, fraction: f64) -> Vec3 {
        let p = Vector3::new(point[0], point[1], point[2]);
        // mean velocity over the rest of the step: what the position constraint needs, also where motion turns or stops
        let from = self.time + fraction * self.dt;
        let rest = (1.0 - fraction) * self.dt;
        let v = if rest > 1e-6 * self.dt {
            self.solid.displacement(&p, from, self.time + self.dt) / rest
        } else {
            self.solid.velocity_at(&p, self.time + self.dt)
        };
        [v.x, v.y, v.z]
    }

    fn dt(&self) -> f64 {
        self.dt
    }

    fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let merged: Aabb = self.start.bounds()?.merge(&self.end.bounds()?);
        // turning bodies leave the union of their end boxes by at most half its size
        let margin = 0.25 * merged.longest_side();
        let b = merged.inflated(margin);
        Some((b.min, b.max))
    }
}
