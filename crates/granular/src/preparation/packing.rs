//! Random discs of two sizes, overlapping as they fall.

use crate::grains::Grains;
use crate::model::{Mode, ModelSettings, Radii};
use crate::random::Random;

/// Scatters the grains of a model over its box at rest.
///
/// Compat mode draws whole-number positions and independent sizes as published; physical mode draws real positions, sizes as
/// the settings say, and numbers the grains row by row so that neighbours lie close in memory. Source: manual S1-14.
pub fn random_packing(settings: &ModelSettings, mode: Mode, random: &mut Random) -> Grains {
    let c = settings.constants();
    let n = settings.grains;
    let compat = mode == Mode::Compat;
    let mut sizes: Vec<f64> = (0..n)
        .map(|i| {
            let large = if compat || settings.radii == Radii::Random { random.uniform() < 0.5 } else { i < n / 2 };
            if large { c.large } else { c.small }
        })
        .collect();
    if !compat {
        random.shuffle(&mut sizes);
    }
    let mut coordinate = |length: f64| {
        let v = random.uniform() * length;
        if compat { v.floor() } else { v }
    };
    let mut discs: Vec<([f64; 2], f64)> =
        sizes.into_iter().map(|r| ([coordinate(settings.width), coordinate(settings.height)], r)).collect();
    if !compat {
        let row = |y: f64| (y / (2.0 * c.mean_radius)) as i64;
        discs.sort_by(|a, b| row(a.0[1]).cmp(&row(b.0[1])).then(a.0[0].total_cmp(&b.0[0])));
    }
    let mut grains = Grains::default();
    for (position, r) in discs {
        grains.push(position, r, c.mass * (r / c.mean_radius).powi(2));
    }
    grains
}
