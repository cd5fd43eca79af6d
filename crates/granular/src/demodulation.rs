//! From a stress signal to moduli: in-phase and out-of-phase parts, drift, harmonics, cycle by cycle.

use crate::error::GranularError;
use serde::{Deserialize, Serialize};

/// How a linear drift of the stress is taken out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Drift {
    /// Subtracted, as intended.
    #[default]
    Subtract,
    /// Added, as the published program does: the drift is doubled and G′ is off by it.
    Double,
    /// Left in.
    Keep,
}

/// Where the oscillation lies in the record.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Window {
    /// Frequency [Hz].
    pub frequency: f64,
    /// Strain amplitude [-].
    pub amplitude: f64,
    /// Periods of rest before [-].
    pub pre: f64,
    /// Periods of oscillation [-].
    pub periods: f64,
    /// Periods of rest afterwards [-].
    pub post: f64,
}

/// Moduli of one tone.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Demodulation {
    /// Storage modulus G′ [Pa].
    pub g_prime: f64,
    /// Loss modulus G″ [Pa].
    pub g_double_prime: f64,
    /// Standard error of G′ from the scatter of whole periods [Pa]; zero with a single period.
    pub g_prime_error: f64,
    /// Standard error of G″ [Pa].
    pub g_double_prime_error: f64,
    /// `[G′, G″]` of each whole period of the shear window, the first included [Pa].
    pub per_period: Vec<[f64; 2]>,
    /// Drift rate that was found [Pa/s].
    pub drift: f64,
    /// `[order, in-phase, out-of-phase]` of the third and fifth harmonic of the stress [-, Pa, Pa].
    pub harmonics: Vec<[f64; 3]>,
    /// Peak-to-peak range of the stress at rest before and after, without its drift [Pa].
    pub baseline_range: f64,
    /// Root mean square of what harmonics 1, 3 and 5 do not describe [Pa].
    pub residual: f64,
}

impl Demodulation {
    /// Magnitude of the complex modulus [Pa].
    pub fn magnitude(&self) -> f64 {
        self.g_prime.hypot(self.g_double_prime)
    }
}

/// In-phase and out-of-phase amplitude of one harmonic over the samples of `range`.
fn project(t: &[f64], y: &[f64], w: &Window, order: f64, range: std::ops::Range<usize>) -> [f64; 2] {
    let mut sums = [0.0; 4];
    for i in range {
        let (s, c) = (std::f64::consts::TAU * order * (w.frequency * t[i] - w.pre)).sin_cos();
        sums[0] += y[i] * s;
        sums[1] += s * s;
        sums[2] += y[i] * c;
        sums[3] += c * c;
    }
    [sums[0] / sums[1], sums[2] / sums[3]]
}

/// Demodulates a stress signal `stress` [Pa] sampled at ascending times `t` [s].
///
/// The first period of the shear window is left out if there are two or more. The drift is the line through the mean stress of
/// the last two thirds of the rest before and the first third of the rest afterwards.
///
/// # Errors
/// [`GranularError::Signal`] for signals that are too short, of unequal length or not finite;
/// [`GranularError::CoarseSampling`] below 20 samples per period.
pub fn demodulate(t: &[f64], stress: &[f64], w: &Window, drift: Drift) -> Result<Demodulation, GranularError> {
    let n = t.len();
    if n < 3 || stress.len() != n {
        return Err(GranularError::Signal("time and stress need equal length of at least three"));
    }
    if !(w.frequency > 0.0 && w.amplitude != 0.0 && w.periods > 0.0 && w.pre >= 0.0 && w.post >= 0.0) {
        return Err(GranularError::Signal("frequency, amplitude and periods must be positive"));
    }
    if t.iter().chain(stress).any(|v| !v.is_finite()) {
        return Err(GranularError::Signal("the signal is not finite"));
    }
    let f = w.frequency;
    let per_period = 1.0 / (f * (t[n - 1] - t[0]) / (n - 1) as f64);
    if per_period < 20.0 {
        return Err(GranularError::CoarseSampling { steps_per_period: per_period });
    }
    let (start, end) = (w.pre / f, (w.pre + w.periods) / f);
    let mean = |holds: &dyn Fn(f64) -> bool, fallback: usize| {
        let mut sum = [0.0; 3];
        for i in 0..n {
            if holds(t[i]) {
                sum[0] += 1.0;
                sum[1] += t[i];
                sum[2] += stress[i];
            }
        }
        if sum[0] > 0.0 { [sum[1] / sum[0], sum[2] / sum[0]] } else { [t[fallback], stress[fallback]] }
    };
    let [t1, m1] = mean(&|v| v >= 2.0 / 3.0 * w.pre / f && v < start, 0);
    let [t2, m2] = mean(&|v| v > end && v <= (w.pre + w.periods + w.post / 3.0) / f, n - 1);
    let slope = if t2 > t1 { (m2 - m1) / (t2 - t1) } else { 0.0 };
    let sign = match drift {
        Drift::Subtract => -1.0,
        Drift::Double => 1.0,
        Drift::Keep => 0.0,
    };
    let level: Vec<f64> = (0..n).map(|i| stress[i] + sign * (t[i] - start) * slope).collect();

    let skipped = if w.periods >= 2.0 { 1.0 } else { 0.0 };
    let from = t.partition_point(|v| *v < (w.pre + skipped) / f);
    let to = t.partition_point(|v| *v <= end);
    if to < from + 3 {
        return Err(GranularError::Signal("no samples in the evaluation window"));
    }
    let [a, b] = project(t, &level, w, 1.0, from..to);
    let mut result = Demodulation {
        g_prime: a / w.amplitude,
        g_double_prime: b / w.amplitude,
        drift: slope,
        ..Demodulation::default()
    };
    let offset = level[from..to].iter().sum::<f64>() / (to - from) as f64;
    let centred: Vec<f64> = level.iter().map(|v| v - offset).collect();
    for order in [3.0, 5.0] {
        let [p, q] = project(t, &centred, w, order, from..to);
        result.harmonics.push([order, p, q]);
    }
    let mut square = 0.0;
    for i in from..to {
        let phase = std::f64::consts::TAU * (f * t[i] - w.pre);
        let mut model = offset + a * phase.sin() + b * phase.cos();
        for h in &result.harmonics {
            model += h[1] * (h[0] * phase).sin() + h[2] * (h[0] * phase).cos();
        }
        square += (level[i] - model).powi(2);
    }
    result.residual = (square / (to - from) as f64).sqrt();

    for k in 0..(w.periods + 1e-9) as usize {
        let lo = t.partition_point(|v| *v < (w.pre + k as f64) / f);
        let hi = t.partition_point(|v| *v < (w.pre + (k + 1) as f64) / f);
        if hi >= lo + 3 {
            let [p, q] = project(t, &level, w, 1.0, lo..hi);
            result.per_period.push([p / w.amplitude, q / w.amplitude]);
        }
    }
    let used: Vec<[f64; 2]> = result.per_period.iter().skip(skipped as usize).copied().collect();
    if used.len() > 1 {
        let m = used.len() as f64;
        let error = |k: usize| {
            let mean = used.iter().map(|v| v[k]).sum::<f64>() / m;
            (used.iter().map(|v| (v[k] - mean).powi(2)).sum::<f64>() / (m - 1.0) / m).sqrt()
        };
        (result.g_prime_error, result.g_double_prime_error) = (error(0), error(1));
    }
    // Rest: the last two thirds before and all of the last two thirds after, where transients have died down.
    let corrected: Vec<f64> = (0..n).map(|i| stress[i] - (t[i] - start) * slope).collect();
    let range = |lo: f64, hi: f64| {
        let (i, j) = (t.partition_point(|v| *v < lo), t.partition_point(|v| *v < hi));
        let part = &corrected[i..j];
        if part.is_empty() {
            return 0.0;
        }
        part.iter().fold(f64::MIN, |m, v| m.max(*v)) - part.iter().fold(f64::MAX, |m, v| m.min(*v))
    };
    result.baseline_range = range(w.pre / f / 3.0, start).max(range(end + w.post / f / 3.0, f64::MAX));
    Ok(result)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn synthetic(slope: f64) -> (Vec<f64>, Vec<f64>, Window) {
        let w = Window { frequency: 1.0, amplitude: 0.2, pre: 2.0, periods: 3.0, post: 1.0 };
        let t: Vec<f64> = (0..12_000).map(|i| f64::from(i) * 5e-4).collect();
        let y = t
            .iter()
            .map(|&t| {
                let p = std::f64::consts::TAU * (t - 2.0);
                let wave = 200.0 * p.sin() + 30.0 * p.cos() + 7.0 * (3.0 * p).sin() - 2.0 * (5.0 * p).cos();
                slope * t + if (2.0..=5.0).contains(&t) { wave } else { 0.0 }
            })
            .collect();
        (t, y, w)
    }

    #[test]
    fn drift_is_removed_and_the_published_sign_doubles_it() {
        let (t, y, w) = synthetic(10.0);
        let right = demodulate(&t, &y, &w, Drift::Subtract).unwrap();
        assert!((right.g_prime - 1000.0).abs() < 0.2, "{}", right.g_prime);
        assert!((right.g_double_prime - 150.0).abs() < 0.2);
        assert!((right.drift - 10.0).abs() < 0.05);
        // Mean of the ramp against the sine: -10/(pi A) Pa per removal.
        let shift = 10.0 / std::f64::consts::PI / 0.2;
        let kept = demodulate(&t, &y, &w, Drift::Keep).unwrap();
        assert!((kept.g_prime - 1000.0 + shift).abs() < 0.5);
        let doubled = demodulate(&t, &y, &w, Drift::Double).unwrap();
        assert!((doubled.g_prime - 968.2).abs() < 0.2, "{}", doubled.g_prime);
        assert_eq!(right.per_period.len(), 3);
        assert!(right.g_prime_error < 1.0);
    }

    #[test]
    fn harmonics_and_residual_are_separated() {
        let (t, y, w) = synthetic(0.0);
        let d = demodulate(&t, &y, &w, Drift::Subtract).unwrap();
        assert!((d.harmonics[0][1] - 7.0).abs() < 0.05 && d.harmonics[0][2].abs() < 0.1);
        assert!((d.harmonics[1][2] + 2.0).abs() < 0.05);
        assert!(d.residual < 0.2 && d.baseline_range < 0.1);
    }

    #[test]
    fn nonsense_is_refused() {
        let (t, mut y, w) = synthetic(0.0);
        assert!(demodulate(&t[..2], &y[..2], &w, Drift::Keep).is_err());
        y[5] = f64::NAN;
        assert!(demodulate(&t, &y, &w, Drift::Keep).is_err());
        assert!(matches!(
            demodulate(&[0.0, 1.0, 2.0, 3.0], &[0.0; 4], &w, Drift::Keep),
            Err(GranularError::CoarseSampling { .. })
        ));
    }
}
