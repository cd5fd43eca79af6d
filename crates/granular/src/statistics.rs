//! Means with error bars, Welch's test, Holm's correction, bootstrap bands.

use crate::random::Random;
use serde::{Deserialize, Serialize};

/// Mean of a sample with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Estimate {
    /// Number of values.
    pub count: usize,
    /// Mean.
    pub mean: f64,
    /// Standard deviation of the values (n - 1).
    pub sd: f64,
    /// Half width of the 95 % confidence interval of the mean (Student).
    pub half_width: f64,
}

/// Estimates the mean of values; the spread of fewer than two is zero.
pub fn estimate(values: &[f64]) -> Estimate {
    let n = values.len() as f64;
    if values.is_empty() {
        return Estimate::default();
    }
    let mean = values.iter().sum::<f64>() / n;
    let sd = if values.len() > 1 {
        (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt()
    } else {
        0.0
    };
    let half_width = if values.len() > 1 { student_quantile(0.975, n - 1.0) * sd / n.sqrt() } else { 0.0 };
    Estimate { count: values.len(), mean, sd, half_width }
}

/// Outcome of Welch's test for equal means.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Welch {
    /// Difference of the means, first minus second.
    pub difference: f64,
    /// Student's t [-].
    pub t: f64,
    /// Degrees of freedom [-].
    pub degrees: f64,
    /// Two-sided probability of a difference at least as large by chance [-].
    pub p: f64,
}

/// Welch's t-test of two estimates. Without spread, equal means have probability one and different ones zero.
pub fn welch(a: &Estimate, b: &Estimate) -> Welch {
    let difference = a.mean - b.mean;
    let (va, vb) = (a.sd * a.sd / a.count.max(1) as f64, b.sd * b.sd / b.count.max(1) as f64);
    if va + vb <= 0.0 {
        let p = if difference == 0.0 { 1.0 } else { 0.0 };
        return Welch { difference, t: if difference == 0.0 { 0.0 } else { f64::MAX }, degrees: 1.0, p };
    }
    let t = difference / (va + vb).sqrt();
    let part = |v: f64, n: usize| if n > 1 { v * v / (n - 1) as f64 } else { 0.0 };
    let degrees = (va + vb).powi(2) / (part(va, a.count) + part(vb, b.count)).max(f64::MIN_POSITIVE);
    Welch { difference, t, degrees, p: 2.0 * (1.0 - student_cdf(t.abs(), degrees)) }
}

/// Probabilities corrected for the number of comparisons (Holm 1979), in the order given.
pub fn holm(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|&a, &b| p[a].total_cmp(&p[b]));
    let mut corrected = vec![0.0; p.len()];
    let mut largest = 0.0f64;
    for (rank, &k) in order.iter().enumerate() {
        largest = largest.max((p[k] * (p.len() - rank) as f64).min(1.0));
        corrected[k] = largest;
    }
    corrected
}

/// Percentile bootstrap interval of the mean at a confidence level such as 0.95.
pub fn bootstrap(values: &[f64], level: f64, draws: usize, seed: u64) -> [f64; 2] {
    if values.is_empty() || draws == 0 {
        return [0.0; 2];
    }
    let mut random = Random::new(seed);
    let mut means: Vec<f64> = (0..draws)
        .map(|_| (0..values.len()).map(|_| values[random.below(values.len())]).sum::<f64>() / values.len() as f64)
        .collect();
    means.sort_by(f64::total_cmp);
    let at = |q: f64| means[((q * draws as f64) as usize).min(draws - 1)];
    [at(0.5 - level / 2.0), at(0.5 + level / 2.0)]
}

/// Distribution function of Student's t.
pub fn student_cdf(t: f64, degrees: f64) -> f64 {
    let tail = 0.5 * incomplete_beta(0.5 * degrees, 0.5, degrees / (degrees + t * t));
    if t >= 0.0 { 1.0 - tail } else { tail }
}

/// Quantile of Student's t for `0.5 ≤ p < 1`, by bisection.
pub fn student_quantile(p: f64, degrees: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while student_cdf(high, degrees) < p && high < 1e9 {
        high *= 2.0;
    }
    for _ in 0..100 {
        let mid = 0.5 * (low + high);
        if student_cdf(mid, degrees) < p { low = mid } else { high = mid }
    }
    0.5 * (low + high)
}

/// Logarithm of the gamma function for positive arguments (Lanczos 1964, g = 7).
fn ln_gamma(x: f64) -> f64 {
    const C: [f64; 9] = [
        0.999_999_999_999_809_9,
        676.520_368_121_885_1,
        -1_259.139_216_722_402_8,
        771.323_428_777_653_1,
        -176.615_029_162_140_6,
        12.507_343_278_686_905,
        -0.138_571_095_265_720_12,
        9.984_369_578_019_572e-6,
        1.505_632_735_149_311_6e-7,
    ];
    let x = x - 1.0;
    let t = x + 7.5;
    let sum = C.iter().enumerate().skip(1).fold(C[0], |s, (i, c)| s + c / (x + i as f64));
    0.5 * (2.0 * std::f64::consts::PI).ln() + (x + 0.5) * t.ln() - t + sum.ln()
}

/// Regularised incomplete beta function by its continued fraction (modified Lentz).
fn incomplete_beta(a: f64, b: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    if x >= 1.0 {
        return 1.0;
    }
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - incomplete_beta(b, a, 1.0 - x);
    }
    let front = (ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b) + a * x.ln() + b * (1.0 - x).ln()).exp() / a;
    let guard = |v: f64| if v.abs() < 1e-300 { 1e-300 } else { v };
    let (mut c, mut d) = (1.0, 1.0 / guard(1.0 - (a + b) * x / (a + 1.0)));
    let mut fraction = d;
    for m in 1..500 {
        let m = f64::from(m);
        for term in [
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m)),
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0)),
        ] {
            d = 1.0 / guard(1.0 + term * d);
            c = guard(1.0 + term / c);
            fraction *= c * d;
        }
        if (c * d - 1.0).abs() < 1e-15 {
            break;
        }
    }
    front * fraction
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn student_quantiles_match_the_tables() {
        for (p, n, t) in
            [(0.975, 9.0, 2.262157), (0.975, 1.0, 12.706205), (0.995, 15.0, 2.946713), (0.95, 100.0, 1.660234)]
        {
            assert!((student_quantile(p, n) - t).abs() < 1e-5, "{p} {n}");
        }
        assert!((student_cdf(1.0, 1.0) - 0.75).abs() < 1e-12);
    }

    #[test]
    fn welch_and_holm_on_known_numbers() {
        let a = Estimate { count: 10, mean: 5.0, sd: 1.0, half_width: 0.0 };
        let b = Estimate { count: 10, mean: 6.0, sd: 1.0, half_width: 0.0 };
        let w = welch(&a, &b);
        assert!((w.degrees - 18.0).abs() < 1e-9 && (w.t + 5f64.sqrt()).abs() < 1e-12);
        assert!((w.p - 0.038_250).abs() < 1e-5, "{}", w.p);
        assert_eq!(holm(&[0.01, 0.04, 0.03]), vec![0.03, 0.06, 0.06]);
        let e = estimate(&[1.0, 2.0, 3.0, 4.0]);
        assert!((e.sd - 1.290_994_448_735_805_6).abs() < 1e-12);
        let [low, high] = bootstrap(&[1.0, 2.0, 3.0, 4.0, 5.0], 0.9, 2000, 1);
        assert!(low > 1.5 && low < 2.6 && high > 3.4 && high < 4.5);
    }
}
