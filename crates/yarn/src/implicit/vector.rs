//! Node vectors: sums in a fixed order.

use nalgebra::SVector;
use rayon::prelude::*;

/// Nodes per partial sum; sums do not depend on threads.
const CHUNK: usize = 4096;

fn sum(n: usize, term: impl Fn(usize) -> f64 + Sync) -> f64 {
    let chunk = |c: usize| (c * CHUNK..((c + 1) * CHUNK).min(n)).map(&term).sum::<f64>();
    if n <= CHUNK {
        return chunk(0);
    }
    let parts: Vec<f64> = (0..n.div_ceil(CHUNK)).into_par_iter().map(chunk).collect();
    parts.into_iter().sum()
}

/// `Σ a·b`.
pub(super) fn dot<const D: usize>(a: &[SVector<f64, D>], b: &[SVector<f64, D>]) -> f64 {
    sum(a.len(), |i| a[i].dot(&b[i]))
}

/// `sqrt(Σ |r|²/m)` over nodes with mass, the size of an impulse.
pub(super) fn mass_norm<const D: usize>(r: &[SVector<f64, D>], mass: &[f64]) -> f64 {
    sum(r.len(), |i| if mass[i] > 0.0 { r[i].norm_squared() / mass[i] } else { 0.0 }).sqrt()
}

/// `sqrt(Σ m |v|²)`, the size of a velocity.
pub(super) fn momentum_norm<const D: usize>(v: &[SVector<f64, D>], mass: &[f64]) -> f64 {
    sum(v.len(), |i| mass[i] * v[i].norm_squared()).sqrt()
}

/// `out = r/m`, zero on massless nodes.
pub(super) fn over_mass<const D: usize>(out: &mut [SVector<f64, D>], r: &[SVector<f64, D>], mass: &[f64]) {
    out.par_chunks_mut(CHUNK).enumerate().for_each(|(c, out)| {
        for (k, out) in out.iter_mut().enumerate() {
            let i = c * CHUNK + k;
            *out = if mass[i] > 0.0 { r[i] / mass[i] } else { SVector::zeros() };
        }
    });
}

/// `a += s b`.
pub(super) fn add<const D: usize>(a: &mut [SVector<f64, D>], s: f64, b: &[SVector<f64, D>]) {
    a.par_chunks_mut(CHUNK).zip(b.par_chunks(CHUNK)).for_each(|(a, b)| {
        for (a, b) in a.iter_mut().zip(b) {
            *a += b * s;
        }
    });
}

/// `a = s a + b`.
pub(super) fn scale_add<const D: usize>(a: &mut [SVector<f64, D>], s: f64, b: &[SVector<f64, D>]) {
    a.par_chunks_mut(CHUNK).zip(b.par_chunks(CHUNK)).for_each(|(a, b)| {
        for (a, b) in a.iter_mut().zip(b) {
            *a = *a * s + b;
        }
    });
}

/// `out = a + s b`.
pub(super) fn combine<const D: usize>(
    out: &mut [SVector<f64, D>],
    a: &[SVector<f64, D>],
    s: f64,
    b: &[SVector<f64, D>],
) {
    out.par_chunks_mut(CHUNK).enumerate().for_each(|(c, out)| {
        for (k, out) in out.iter_mut().enumerate() {
            let i = c * CHUNK + k;
            *out = a[i] + b[i] * s;
        }
    });
}

/// `Σ term(i)` for `i < n`.
pub(super) fn total(n: usize, term: impl Fn(usize) -> f64 + Sync) -> f64 {
    sum(n, term)
}
