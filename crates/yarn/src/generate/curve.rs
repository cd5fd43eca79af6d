//! Single curves and their even division.

use nalgebra::SVector;

/// Number of segments of about `segment` that divide `length`, at least one.
pub(super) fn divisions(length: f64, segment: f64) -> usize {
    ((length / segment).round() as usize).max(1)
}

/// A straight line in equal segments.
pub(super) fn line<const D: usize>(from: SVector<f64, D>, to: SVector<f64, D>, segment: f64) -> Vec<SVector<f64, D>> {
    let n = divisions((to - from).norm(), segment);
    (0..=n).map(|i| from + (to - from) * (i as f64 / n as f64)).collect()
}

/// An arc in equal segments.
pub(super) fn circle<const D: usize>(
    center: SVector<f64, D>,
    radius: f64,
    normal: &SVector<f64, D>,
    start: f64,
    sweep: Option<f64>,
    segment: f64,
) -> Vec<SVector<f64, D>> {
    let full = std::f64::consts::TAU;
    let (n, sweep) = match sweep {
        Some(sweep) => (divisions(radius * sweep.abs(), segment), sweep),
        None => {
            let n = divisions(radius * full, segment).max(3);
            (n - 1, full * (n - 1) as f64 / n as f64)
        }
    };
    let (u, v) = plane(normal);
    (0..=n)
        .map(|i| {
            let angle = start + sweep * i as f64 / n as f64;
            center + u * (radius * angle.cos()) + v * (radius * angle.sin())
        })
        .collect()
}

/// A helix about the axis `from`–`to` in equal segments.
pub(super) fn helix<const D: usize>(
    from: SVector<f64, D>,
    to: SVector<f64, D>,
    radius: f64,
    turns: f64,
    segment: f64,
) -> Vec<SVector<f64, D>> {
    let axis = to - from;
    let length = axis.norm();
    let (u, v) = plane(&(if length > 0.0 { axis / length } else { SVector::zeros() }));
    let sweep = std::f64::consts::TAU * turns;
    let n = divisions((length * length + (radius * sweep).powi(2)).sqrt(), segment);
    (0..=n)
        .map(|i| {
            let t = i as f64 / n as f64;
            let angle = sweep * t;
            from + axis * t + u * (radius * angle.cos()) + v * (radius * angle.sin())
        })
        .collect()
}

/// Two unit vectors that complete `normal` to a right-handed frame; in 2-D the coordinate axes. For `normal = z` they are x and y.
pub(super) fn plane<const D: usize>(normal: &SVector<f64, D>) -> (SVector<f64, D>, SVector<f64, D>) {
    let mut u = SVector::<f64, D>::zeros();
    let mut v = SVector::<f64, D>::zeros();
    if D == 2 || normal.norm() == 0.0 {
        u[0] = 1.0;
        v[1] = 1.0;
        return (u, v);
    }
    let helper = if normal[0].abs() < 0.9 { 0 } else { 1 };
    u[helper] = 1.0;
    u -= normal * normal[helper];
    u /= u.norm();
    for i in 0..D {
        let (j, k) = ((i + 1) % D, (i + 2) % D);
        v[i] = normal[j] * u[k] - normal[k] * u[j];
    }
    (u, v)
}

/// Divides a finely sampled curve into segments of equal arc length of about `segment`.
pub(super) fn resample<const D: usize>(fine: &[SVector<f64, D>], segment: f64) -> Vec<SVector<f64, D>> {
    let mut arc = Vec::with_capacity(fine.len());
    let mut length = 0.0;
    arc.push(0.0);
    for w in fine.windows(2) {
        length += (w[1] - w[0]).norm();
        arc.push(length);
    }
    let n = divisions(length, segment);
    let mut out = Vec::with_capacity(n + 1);
    let mut k = 0;
    for i in 0..=n {
        let s = length * i as f64 / n as f64;
        while k + 2 < fine.len() && arc[k + 1] < s {
            k += 1;
        }
        let span = arc[k + 1] - arc[k];
        let t = if span > 0.0 { ((s - arc[k]) / span).min(1.0) } else { 0.0 };
        out.push(fine[k] + (fine[k + 1] - fine[k]) * t);
    }
    out
}
