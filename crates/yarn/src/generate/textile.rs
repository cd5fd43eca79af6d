//! Woven and knitted sheets.

use nalgebra::SVector;

use super::curve::resample;

/// Fine points per period of a textile curve.
const FINE: usize = 200;

/// A plain weave: warp yarns, then weft yarns, each a cosine that passes the others alternately above and below.
#[expect(clippy::too_many_arguments, reason = "one number per field of the scene's entry")]
pub(super) fn weave<const D: usize>(
    center: SVector<f64, D>,
    warp: SVector<f64, D>,
    weft: SVector<f64, D>,
    count: (usize, usize),
    spacing: f64,
    amplitude: f64,
    overhang: f64,
    segment: f64,
) -> Vec<Vec<SVector<f64, D>>> {
    let across = weft - warp * warp.dot(&weft);
    let across = across / across.norm().max(f64::MIN_POSITIVE);
    let mut up = SVector::<f64, D>::zeros();
    for i in 0..D {
        let (j, k) = ((i + 1) % D, (i + 2) % D);
        up[i] = warp[j] * across[k] - warp[k] * across[j];
    }
    let (warps, wefts) = count;
    let mut yarns = Vec::with_capacity(warps + wefts);
    let mut course =
        |along: &SVector<f64, D>, side: &SVector<f64, D>, own: usize, of: usize, others: usize, sign: f64| {
            let offset = (own as f64 - 0.5 * (of as f64 - 1.0)) * spacing;
            let reach = (others as f64 - 1.0) * spacing;
            let parity = if own.is_multiple_of(2) { sign } else { -sign };
            let n = FINE * (others + 1);
            let fine: Vec<_> = (0..=n)
                .map(|i| {
                    // `s` runs from the first crossing; crossings at multiples of the spacing.
                    let s = -overhang + (reach + 2.0 * overhang) * i as f64 / n as f64;
                    let height = parity * amplitude * (std::f64::consts::PI * s / spacing).cos();
                    center + along * (s - 0.5 * reach) + side * offset + up * height
                })
                .collect();
            yarns.push(resample(&fine, segment));
        };
    for i in 0..warps {
        course(&warp, &across, i, warps, wefts, 1.0);
    }
    for j in 0..wefts {
        course(&across, &warp, j, wefts, warps, -1.0);
    }
    yarns
}

/// Plain jersey in the x–y plane: rows of loops `x = t w/2π + a sin 2t`, `y = −h cos t`, `z = −d cos 2t`, one row height apart,
/// so that the head of each loop reaches through the foot of the next row's.
pub(super) fn knit<const D: usize>(
    center: SVector<f64, D>,
    rows: usize,
    loops: usize,
    width: f64,
    height: f64,
    depth: f64,
    segment: f64,
) -> Vec<Vec<SVector<f64, D>>> {
    let n = FINE * loops;
    // The overhang of a loop over its own foot: a quarter of its width keeps neighbours of a row apart.
    let lean = 0.25 * width;
    (0..rows)
        .map(|row| {
            let middle = (row as f64 - 0.5 * (rows as f64 - 1.0)) * height;
            let fine: Vec<_> = (0..=n)
                .map(|i| {
                    let t = std::f64::consts::TAU * loops as f64 * i as f64 / n as f64;
                    let mut p = center;
                    p[0] += width * (t / std::f64::consts::TAU - 0.5 * loops as f64) + lean * (2.0 * t).sin();
                    p[1] += middle - height * t.cos();
                    p[D - 1] -= depth * (2.0 * t).cos();
                    p
                })
                .collect();
            resample(&fine, segment)
        })
        .collect()
}
