//! Sums whose order never depends on the thread count, and the vector updates that iterative solvers need.
//!
//! Every reduction is cut into chunks of fixed length; inside a chunk four interleaved partial sums are kept, and the chunks are
//! added in order. Threads only share out the chunks, so one and many threads give the same bits.

use rayon::prelude::*;

/// Length of a chunk; below it nothing is done in parallel.
pub const CHUNK: usize = 8192;

#[inline(always)]
fn dot_chunk(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0f64; 4];
    let (a4, a_rest) = a.as_chunks::<4>();
    let (b4, b_rest) = b.as_chunks::<4>();
    for (x, y) in a4.iter().zip(b4) {
        for k in 0..4 {
            lanes[k] += x[k] * y[k];
        }
    }
    for (x, y) in a_rest.iter().zip(b_rest) {
        lanes[0] += x * y;
    }
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3])
}

/// Sum over fixed chunks of `f(chunk of a, chunk of b)`, the chunks shared out over threads and added in order.
fn chunked(a: &[f64], b: &[f64], f: impl Fn(&[f64], &[f64]) -> f64 + Sync, join: impl Fn(f64, f64) -> f64) -> f64 {
    if a.len() <= CHUNK {
        return f(a, b);
    }
    let partial: Vec<f64> = a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK)).map(|(x, y)| f(x, y)).collect();
    partial.into_iter().fold(0.0, join)
}

/// `Σ a_i b_i` in a fixed order.
#[must_use]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    debug_assert_eq!(a.len(), b.len());
    chunked(a, b, dot_chunk, |x, y| x + y)
}

/// `sqrt(Σ a_i²)` in a fixed order.
#[must_use]
pub fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

/// Largest magnitude; NaN where an entry is NaN.
#[must_use]
pub fn norm_max(a: &[f64]) -> f64 {
    let join = |x: f64, y: f64| if x.is_nan() || y.is_nan() { f64::NAN } else { x.max(y) };
    chunked(a, a, |x, _| x.iter().fold(0.0, |m: f64, v| join(m, v.abs())), join)
}

/// Sum with the running error added back (Neumaier): for totals that ledgers compare to round-off.
#[must_use]
pub fn compensated_sum(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut sum = 0.0f64;
    let mut lost = 0.0f64;
    for v in values {
        let next = sum + v;
        lost += if sum.abs() >= v.abs() { (sum - next) + v } else { (v - next) + sum };
        sum = next;
    }
    sum + lost
}

/// `y += factor x`.
pub fn add_scaled(y: &mut [f64], factor: f64, x: &[f64]) {
    debug_assert_eq!(x.len(), y.len());
    let body = |(y, x): (&mut [f64], &[f64])| {
        for (y, x) in y.iter_mut().zip(x) {
            *y += factor * x;
        }
    };
    if y.len() <= CHUNK {
        body((y, x));
    } else {
        y.par_chunks_mut(CHUNK).zip(x.par_chunks(CHUNK)).for_each(body);
    }
}

/// `y = x + factor y`.
pub fn scale_add(y: &mut [f64], factor: f64, x: &[f64]) {
    debug_assert_eq!(x.len(), y.len());
    let body = |(y, x): (&mut [f64], &[f64])| {
        for (y, x) in y.iter_mut().zip(x) {
            *y = x + factor * *y;
        }
    };
    if y.len() <= CHUNK {
        body((y, x));
    } else {
        y.par_chunks_mut(CHUNK).zip(x.par_chunks(CHUNK)).for_each(body);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_bits_for_any_thread_count() {
        let a: Vec<f64> = (0..50_001).map(|i| (f64::from(i) * 0.37).sin() * 10f64.powi(i % 13 - 6)).collect();
        let b: Vec<f64> = (0..50_001).map(|i| (f64::from(i) * 0.11).cos()).collect();
        let run = |threads: usize| {
            rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
                let mut y = b.clone();
                add_scaled(&mut y, 0.3, &a);
                scale_add(&mut y, -0.7, &b);
                (dot(&a, &y).to_bits(), norm_max(&y).to_bits(), norm(&a).to_bits())
            })
        };
        assert_eq!(run(1), run(2));
        assert_eq!(run(1), run(4));
    }

    #[test]
    fn compensated_sum_keeps_what_a_plain_sum_loses() {
        assert_eq!(compensated_sum([1e16, 1.0, -1e16]), 1.0);
        assert!(norm_max(&[1.0, f64::NAN, 2.0]).is_nan());
        assert_eq!(norm_max(&[1.0, -3.0, 2.0]), 3.0);
        assert_eq!(dot(&[], &[]), 0.0);
    }
}
