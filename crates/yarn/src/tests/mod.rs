//! Properties of the whole method.

mod conservation;
mod forces;
mod hard;
mod implicit;
mod invariance;
mod limits;
mod reference;
mod resume;

use std::path::Path;

use nalgebra::SVector;

use crate::settings::*;
use crate::{YarnGroup, YarnSettings, YarnShape, YarnSystem};

/// A repeatable stream of numbers in `[-1, 1)`.
pub(crate) struct Noise(pub u64);

impl Noise {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub fn vector<const D: usize>(&mut self) -> SVector<f64, D> {
        SVector::from_fn(|_, _| self.next())
    }
}

pub(crate) fn polyline<const D: usize>(points: &[SVector<f64, D>], velocities: &[SVector<f64, D>]) -> YarnGroup {
    let list = |v: &[SVector<f64, D>]| v.iter().map(|p| p.iter().copied().collect()).collect();
    YarnGroup::new(YarnShape::Polyline { points: list(points), rest_lengths: vec![], velocities: list(velocities) })
}

/// Two crossing wavy yarns near the point (½, ½[, ½]), moving towards each other.
pub(crate) fn pair<const D: usize>(speed: f64) -> Vec<(Vec<SVector<f64, D>>, Vec<SVector<f64, D>>)> {
    let length = 1.0 / 128.0;
    let mut noise = Noise(11);
    (0..2)
        .map(|yarn| {
            let sign = if yarn == 0 { 1.0 } else { -1.0 };
            let points: Vec<_> = (0..20)
                .map(|i| {
                    let s = (f64::from(i) - 9.5) * length;
                    let mut x = SVector::<f64, D>::repeat(0.5);
                    x[0] += s;
                    x[1] += sign * (0.006 + 0.3 * s) + 0.002 * (s * 60.0).sin();
                    if D == 3 {
                        x[2] += sign * 0.2 * s + 0.002 * (s * 50.0).cos();
                    }
                    x
                })
                .collect();
            let velocities = points
                .iter()
                .map(|_| {
                    let mut v = noise.vector::<D>() * (0.2 * speed);
                    v[1] -= sign * speed;
                    v
                })
                .collect();
            (points, velocities)
        })
        .collect()
}

pub(crate) fn settings<const D: usize>(yarns: Vec<YarnGroup>) -> YarnSettings {
    YarnSettings { dimension: D, cell: 1.0 / 64.0, yarns, ..YarnSettings::default() }
}

pub(crate) fn pair_settings<const D: usize>(speed: f64) -> YarnSettings {
    let mut settings = settings::<D>(pair::<D>(speed).iter().map(|(x, v)| polyline(x, v)).collect());
    settings.materials.insert(
        "yarn".to_owned(),
        YarnMaterial { friction: 0.3, bending: Bending::Rod { stiffness: Some(1e-6) }, ..YarnMaterial::default() },
    );
    settings
}

pub(crate) fn build<const D: usize>(settings: &YarnSettings) -> YarnSystem<D> {
    YarnSystem::build(settings, Path::new(".")).unwrap()
}
